//! Light and faces as they are: sources have a size, and polished glass is a little rough.
//!
//! Every cause turns the rays of one point of the face a little, by `w` in the plane of the cause
//! (the source, the slopes of the face). To first order their landing points move by `J w`, where
//! `J` is taken at the ray from the middle of the face to the middle of the window. For
//! perpendicular parallel light, a face of index `n` and a receiver at the distance `D`, with a
//! point source `d` in front of a block of the thickness `t`:
//!
//! ```text
//! direction of parallel light    J = D                 the sun: a disc of diameter D * 0.0093
//! place of a point source        J = -D / (d + t/n)    its image, turned round
//! slope of glass, of a mirror    J = D (n - 1), 2 D
//! ```

use super::{
    Psf, PsfError, PsfPicture,
    psf::{Spot, SpotShape, within},
};
use crate::{
    bench::{Bench, ExitFace},
    light::Light,
    optics::Interface,
};
use glam::{DMat2, DVec2, DVec3};

/// The size of a source of light, evenly bright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceSize {
    /// A disc infinitely far away, by its angular diameter, radians: for parallel light.
    Angle {
        /// Its diameter, radians.
        diameter: f64,
    },
    /// A disc that faces the middle of the block: for a point source, which is its middle.
    Disc {
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// A rectangle that faces the middle of the block: for a point source, which is its middle.
    Rectangle {
        /// Along the bench's x, as near as can be, mm.
        width_mm: f64,
        /// Across that, mm.
        height_mm: f64,
    },
}

impl SourceSize {
    /// The sun as seen from the earth: 0.53 degrees.
    pub const SUN: Self = Self::Angle { diameter: 0.53 * std::f64::consts::PI / 180.0 };

    /// How wide and how high the light of one point of the face becomes in the middle of a bench's
    /// window, mm: nothing smaller is left of a picture.
    ///
    /// # Errors
    /// A size out of range, a source that does not fit the light.
    pub fn spot_mm(self, bench: &Bench) -> Result<DVec2, PsfError> {
        Ok(match CentralRay::of(bench)?.source_spot(self)? {
            // Images of a square of side 1, and of a disc of radius 1.
            Spot::Shape(SpotShape::Square, map) => {
                DVec2::new(map.row(0).abs().element_sum(), map.row(1).abs().element_sum())
            }
            Spot::Shape(_, map) => 2.0 * DVec2::new(map.row(0).length(), map.row(1).length()),
            Spot::Picture(_) => DVec2::ZERO,
        })
    }
}

/// What makes the light of a bench less than perfect. The default is perfect light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImperfectLight {
    /// The size of the source.
    pub source: Option<SourceSize>,
    /// Roughness of the structured face: the standard deviation of its slope along any one
    /// direction (Rdq of ISO 4287), normally distributed.
    pub roughness: Option<f64>,
    /// What else spreads the light, as measured on the receiver.
    pub psf: Option<PsfPicture>,
}

/// Greatest angular diameter of a source, radians.
const GREATEST_ANGLE: f64 = 0.35;
/// Greatest size of a source, mm.
const GREATEST_SOURCE_MM: f64 = 1e4;
/// Greatest roughness.
const GREATEST_ROUGHNESS: f64 = 0.2;

impl ImperfectLight {
    /// Whether it is perfect after all.
    pub fn is_perfect(&self) -> bool {
        self.source.is_none() && self.roughness.is_none() && self.psf.is_none()
    }

    /// The point spread function on `cells` of the window of a bench.
    ///
    /// # Errors
    /// Numbers out of range, a source that does not fit the light, or more spread than the window
    /// is large.
    pub fn psf(&self, bench: &Bench, cells: (usize, usize)) -> Result<Psf, PsfError> {
        let ray = CentralRay::of(bench)?;
        let source = self.source.map(|source| ray.source_spot(source)).transpose()?;
        let roughness = self.roughness.map(|roughness| ray.roughness_spot(roughness)).transpose()?;
        let spots: Vec<Spot> = [source, roughness, self.psf.clone().map(Spot::Picture)].into_iter().flatten().collect();
        Psf::of_spots(&spots, bench.window(), cells)
    }
}

/// The ray from the middle of the face to the middle of the window.
struct CentralRay<'a> {
    bench: &'a Bench,
    slopes: DVec2,
}

impl<'a> CentralRay<'a> {
    fn of(bench: &'a Bench) -> Result<Self, PsfError> {
        let (face, to) = (Interface::of(bench), bench.receiver().point(bench.window_centre_mm()));
        face.check(to, DVec2::ZERO).map_err(|_| PsfError::Unlit)?;
        Ok(Self { bench, slopes: face.slopes(to) })
    }

    /// Where light that arrives at the middle of the face along `light` lands if the face has these
    /// slopes there, mm.
    fn landing(&self, light: DVec3, slopes: DVec2) -> Result<DVec2, PsfError> {
        let out = Interface::new(self.bench.exit_face(), light).exitant(slopes);
        let at = out.map_or(DVec2::NAN, |out| self.bench.receiver().landing(DVec3::ZERO, out));
        if at.is_finite() { Ok(at) } else { Err(PsfError::Unlit) }
    }

    /// `J`, by central differences of this step.
    fn derivative(&self, step: f64, landing: impl Fn(DVec2) -> Result<DVec2, PsfError>) -> Result<DMat2, PsfError> {
        let column = |d: DVec2| Ok::<_, PsfError>((landing(step * d)? - landing(-step * d)?) / (2.0 * step));
        Ok(DMat2::from_cols(column(DVec2::X)?, column(DVec2::Y)?))
    }

    fn roughness_spot(&self, roughness: f64) -> Result<Spot, PsfError> {
        within("the roughness (standard deviation of the slope)", roughness, "rad", 0.0, GREATEST_ROUGHNESS)?;
        let light = self.bench.light_direction();
        let map = self.derivative(1e-5, |d| self.landing(light, self.slopes + d))?;
        Ok(Spot::Shape(SpotShape::Gaussian, map * roughness))
    }

    fn source_spot(&self, source: SourceSize) -> Result<Spot, PsfError> {
        let size = |what, mm: f64| within(what, mm, "mm", 0.0, GREATEST_SOURCE_MM);
        match (source, self.bench.light()) {
            (SourceSize::Angle { diameter }, Light::Parallel { direction }) => {
                within("the angular diameter of the source", diameter, "rad", 0.0, GREATEST_ANGLE)?;
                let map = self
                    .derivative(1e-5, |d| self.landing(turned(self.bench.exit_face(), direction, d)?, self.slopes))?;
                Ok(Spot::Shape(SpotShape::Disc, map * (0.5 * diameter).tan()))
            }
            (SourceSize::Disc { diameter_mm }, Light::Point { .. }) => {
                size("the diameter of the source", diameter_mm)?;
                Ok(Spot::Shape(SpotShape::Disc, self.image_of_source()? * (0.5 * diameter_mm)))
            }
            (SourceSize::Rectangle { width_mm, height_mm }, Light::Point { .. }) => {
                size("the width of the source", width_mm)?;
                size("the height of the source", height_mm)?;
                let sides = DMat2::from_diagonal(DVec2::new(width_mm, height_mm));
                Ok(Spot::Shape(SpotShape::Square, self.image_of_source()? * sides))
            }
            (SourceSize::Angle { .. }, Light::Point { .. }) => Err(PsfError::SourceKind {
                given: "an angle",
                light: "the light comes from a point nearby: give a diameter or WIDTHxHEIGHT in millimetres",
            }),
            (_, Light::Parallel { .. }) => Err(PsfError::SourceKind {
                given: "a length",
                light: "the light is parallel: give the angle under which its source is seen, 0.53deg for the sun",
            }),
        }
    }

    /// How landing points answer to the place of a point source.
    fn image_of_source(&self) -> Result<DMat2, PsfError> {
        let Light::Point { position_mm, thickness_mm, intensity } = self.bench.light() else {
            return Err(PsfError::Unlit);
        };
        let middle_z = if self.bench.exit_face() == ExitFace::Reflects { 0.0 } else { -thickness_mm };
        let axis = (DVec3::Z * middle_z - position_mm).normalize();
        let across = (DVec3::X - DVec3::X.dot(axis) * axis).normalize_or(DVec3::Y);
        let also_across = axis.cross(across);
        self.derivative(1e-4 * position_mm.length(), |d| {
            let moved = position_mm + d.x * across + d.y * also_across;
            let moved = self.bench.clone().with_point_source(moved, thickness_mm, intensity);
            self.landing(moved.map_err(|_| PsfError::Unlit)?.light_direction(), self.slopes)
        })
    }
}

/// The direction of parallel light inside of the block if its source moves by the angles `by`
/// across it.
fn turned(face: ExitFace, direction: DVec3, by: DVec2) -> Result<DVec3, PsfError> {
    let n = face.ior();
    let tangential = n * direction.truncate();
    let axial = (1.0 - tangential.length_squared()).sqrt().copysign(direction.z);
    let outside = tangential.extend(axial);
    let (across, also_across) = outside.any_orthonormal_pair();
    let moved = (outside + by.x * across + by.y * also_across).normalize().truncate() / n;
    let inside = moved.extend((1.0 - moved.length_squared()).sqrt().copysign(direction.z));
    // No light from outside travels this way inside of the block.
    if inside.is_finite() { Ok(inside) } else { Err(PsfError::Unlit) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{grid::Extent, light::Intensity};

    const CELLS: (usize, usize) = (400, 400);

    fn bench(face: ExitFace) -> Bench {
        Bench::new(Extent::new(100.0, 100.0), 250.0, face).unwrap()
    }

    fn glass() -> Bench {
        bench(ExitFace::Refracts { ior: 1.5 })
    }

    fn deviation(light: &ImperfectLight, bench: &Bench) -> DVec2 {
        light.psf(bench, CELLS).unwrap().deviation_mm()
    }

    fn near(found: DVec2, expected: DVec2) {
        // Less what the pixels themselves spread: a sixth of one, squared.
        let found = DVec2::new(found.x.powi(2), found.y.powi(2)) - DVec2::splat(0.25 * 0.25 / 6.0);
        let found = DVec2::new(found.x.sqrt(), found.y.sqrt());
        at_worst(
            2.3e-4,
            ((found - expected) / expected).abs().max_element(),
            format_args!("{found} instead of {expected}"),
        );
    }

    #[test]
    fn spreads_are_those_of_the_formulas() {
        let sun = ImperfectLight { source: Some(SourceSize::SUN), ..ImperfectLight::default() };
        for face in [ExitFace::Refracts { ior: 1.5 }, ExitFace::Reflects] {
            near(deviation(&sun, &bench(face)), DVec2::splat(0.25 * 250.0 * 0.53_f64.to_radians()));
        }
        let rough = ImperfectLight { roughness: Some(0.005), ..ImperfectLight::default() };
        near(deviation(&rough, &glass()), DVec2::splat(0.5 * 0.005 * 250.0));
        near(deviation(&rough, &bench(ExitFace::Reflects)), DVec2::splat(2.0 * 0.005 * 250.0));
        let source = DVec3::new(0.0, 0.0, -315.0);
        let lit = glass().with_point_source(source, 15.0, Intensity::Isotropic).unwrap();
        let led = SourceSize::Rectangle { width_mm: 5.0, height_mm: 3.0 };
        let led = ImperfectLight { source: Some(led), ..ImperfectLight::default() };
        near(deviation(&led, &lit), DVec2::new(5.0, 3.0) * (250.0 / 310.0) / 12.0_f64.sqrt());
        let both = ImperfectLight { roughness: Some(0.005), ..sun };
        near(deviation(&both, &glass()), DVec2::splat(0.625_f64.hypot(0.25 * 250.0 * 0.53_f64.to_radians())));
    }

    #[test]
    fn a_lamp_is_seen_turned_round() {
        let position_mm = DVec3::new(0.0, 0.0, -315.0);
        let lit = glass().with_point_source(position_mm, 15.0, Intensity::Isotropic).unwrap();
        let map = CentralRay::of(&lit).unwrap().image_of_source().unwrap();
        assert!((map.x_axis.x + 250.0 / 310.0).abs() < 1e-9 && map.x_axis.y.abs() < 1e-9, "{map}");
    }

    #[test]
    fn tilted_light_spreads_more_along_its_tilt() {
        // In air at 30 degrees, straight on to the receiver: along the tilt a turn moves the spot
        // by D / cos^2, across by D / cos.
        let angle = 30.0_f64.to_radians();
        let inside = DVec3::new(angle.sin() / 1.5, 0.0, (1.0 - (angle.sin() / 1.5).powi(2)).sqrt());
        let shift = DVec2::new(250.0 * angle.tan(), 0.0);
        let window = Extent::new(100.0, 100.0);
        let bench = glass().with_light_direction(inside).unwrap().with_window(window, shift).unwrap();
        let sun = ImperfectLight { source: Some(SourceSize::SUN), ..ImperfectLight::default() };
        let across = 0.25 * 250.0 * 0.53_f64.to_radians() / angle.cos();
        near(deviation(&sun, &bench), DVec2::new(across / angle.cos(), across));
        // Four standard deviations of a disc are its diameter.
        let spot = SourceSize::SUN.spot_mm(&bench).unwrap();
        assert!((spot - 4.0 * DVec2::new(across / angle.cos(), across)).abs().max_element() < 1e-4, "{spot}");
    }

    #[test]
    fn sizes_in_the_wrong_unit_or_out_of_range_are_refused() {
        let of = |source| ImperfectLight { source: Some(source), ..ImperfectLight::default() };
        let refused = |light: ImperfectLight, bench: &Bench| light.psf(bench, CELLS).unwrap_err();
        let disc = of(SourceSize::Disc { diameter_mm: 5.0 });
        assert!(matches!(refused(disc, &glass()), PsfError::SourceKind { given: "a length", .. }));
        let lit = glass().with_point_source(DVec3::new(0.0, 0.0, -300.0), 10.0, Intensity::Isotropic).unwrap();
        assert!(matches!(refused(of(SourceSize::SUN), &lit), PsfError::SourceKind { given: "an angle", .. }));
        for bad in [-0.01, 0.5, f64::NAN] {
            assert!(matches!(refused(of(SourceSize::Angle { diameter: bad }), &glass()), PsfError::Range { .. }));
            let rough = ImperfectLight { roughness: Some(bad), ..ImperfectLight::default() };
            assert!(matches!(refused(rough, &glass()), PsfError::Range { .. }));
        }
        let wide = of(SourceSize::Disc { diameter_mm: 200.0 });
        assert!(matches!(refused(wide, &lit), PsfError::WiderThanWindow { .. }));
    }
}
