//! The optical bench: how light arrives, what the exit face does to it, and where the receiver
//! stands.

mod error;
mod face;
mod limits;
mod receiver;

pub use error::BenchError;
pub use face::ExitFace;
pub use receiver::Receiver;

use crate::{
    grid::{Contour, Extent, Outline},
    light::{Beginning, Congruence, Incidence, Intensity, KnownFace, Light, PointWave, Profile, Wavefront, passed},
};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A validated bench. See the [frame](crate#frame-units-signs).
///
/// What [`new`](Self::new) does not ask for is chosen by `with_*`, in any order; each checks its
/// part and leaves the others as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Bench {
    block: Extent,
    outline: Outline,
    receiver: Receiver,
    exit_face: ExitFace,
    light: Light,
    profile: Option<Arc<Profile>>,
    passed: Option<Arc<Passed>>,
}

/// Known faces, and the light behind them.
#[derive(Clone, Debug)]
struct Passed {
    faces: Vec<KnownFace>,
    wavefront: Wavefront,
}

impl PartialEq for Passed {
    fn eq(&self, other: &Self) -> bool {
        self.faces == other.faces
    }
}

impl Bench {
    /// Accepted sizes of block and window, mm.
    pub const SIZE_LIMITS_MM: (f64, f64) = (1.0, 10_000.0);
    /// Accepted distances from the mean exit plane to the receiver, mm.
    pub const DISTANCE_LIMITS_MM: (f64, f64) = (1.0, 1_000_000.0);
    /// Accepted refractive indices. Below the lower one the relief would be deeper than any block.
    pub const IOR_LIMITS: (f64, f64) = limits::IOR_LIMITS;
    /// Accepted thicknesses of a block in the light of a point source, from its entry face to the
    /// mean exit plane, mm.
    pub const THICKNESS_LIMITS_MM: (f64, f64) = (0.1, 10_000.0);
    /// Least radius of rounded corners, as a share of half the shorter side: below, use a rectangle
    /// and a file.
    pub const LEAST_CORNER: f64 = 0.02;
    /// Least distance of a point source from the entry face, or from the mean plane of a mirror,
    /// mm.
    pub const LEAST_SOURCE_MM: f64 = 1.0;
    /// Greatest angle to the axis at which light from a point source may meet the block, degrees.
    pub const GREATEST_INCIDENCE_DEG: f64 = limits::GREATEST_INCIDENCE_DEG;
    /// Greatest angle by which the receiver may lean, degrees.
    pub const GREATEST_LEAN_DEG: f64 = limits::GREATEST_LEAN_DEG;

    /// A bench with parallel light along the axis and a receiver window as large as the block.
    ///
    /// # Errors
    /// A length or index outside of its limits.
    pub fn new(block: Extent, distance_mm: f64, exit_face: ExitFace) -> Result<Self, BenchError> {
        length("the width of the block", block.width_mm, Self::SIZE_LIMITS_MM)?;
        length("the height of the block", block.height_mm, Self::SIZE_LIMITS_MM)?;
        length("the distance to the receiver", distance_mm, Self::DISTANCE_LIMITS_MM)?;
        let direction = match exit_face {
            ExitFace::Refracts { ior } => {
                if !(Self::IOR_LIMITS.0..=Self::IOR_LIMITS.1).contains(&ior) {
                    return Err(BenchError::Index { ior });
                }
                DVec3::Z
            }
            ExitFace::Reflects => DVec3::NEG_Z,
        };
        let light = Light::Parallel { direction };
        let receiver = Receiver::new(distance_mm, block);
        Ok(Self { block, outline: Outline::Rectangle, receiver, exit_face, light, profile: None, passed: None })
    }

    /// The same bench with a block of another outline within its extent.
    ///
    /// # Errors
    /// A radius that does not fit the block.
    pub fn with_outline(mut self, outline: Outline) -> Result<Self, BenchError> {
        if let Outline::Rounded { radius_mm } = outline {
            let Extent { width_mm, height_mm } = self.block;
            let greatest_mm = 0.5 * width_mm.min(height_mm);
            let least_mm = Self::LEAST_CORNER * greatest_mm;
            if !(least_mm..=greatest_mm).contains(&radius_mm) {
                return Err(BenchError::Corners { radius_mm, width_mm, height_mm, least_mm, greatest_mm });
            }
        }
        self.outline = outline;
        Ok(self)
    }

    /// The same bench with the picture drawn on another part of the receiver.
    ///
    /// # Errors
    /// A size outside of its limits.
    pub fn with_window(self, window: Extent, centre_mm: DVec2) -> Result<Self, BenchError> {
        let receiver = self.receiver.with_window(window, centre_mm);
        self.with_receiver(receiver)
    }

    /// The same bench with the receiver turned about its point on the axis by a rotation vector,
    /// radians. Places on it are then given in its own coordinates, see [`Receiver`].
    ///
    /// # Errors
    /// A receiver that leans too far, or passes through the block.
    pub fn with_receiver_turned(self, rotation: DVec3) -> Result<Self, BenchError> {
        let receiver = self.receiver.turned(rotation);
        self.with_receiver(receiver)
    }

    /// The same bench with another receiver.
    ///
    /// # Errors
    /// Those of [`check_receiver`](Self::check_receiver).
    pub fn with_receiver(self, receiver: Receiver) -> Result<Self, BenchError> {
        self.check_receiver(&receiver)?;
        Ok(Self { receiver, ..self })
    }

    /// Refuses a receiver that cannot stand behind this block.
    ///
    /// # Errors
    /// A distance or a size out of its limits, a receiver that leans too far or passes through the
    /// block.
    pub fn check_receiver(&self, receiver: &Receiver) -> Result<(), BenchError> {
        length("the distance to the receiver", receiver.distance_mm(), Self::DISTANCE_LIMITS_MM)?;
        let (window, centre_mm) = (receiver.window(), receiver.window_centre_mm());
        length("the width of the window", window.width_mm, Self::SIZE_LIMITS_MM)?;
        length("the height of the window", window.height_mm, Self::SIZE_LIMITS_MM)?;
        let reach = Self::DISTANCE_LIMITS_MM.1;
        length("the shift of the window along x", centre_mm.x, (-reach, reach))?;
        length("the shift of the window along y", centre_mm.y, (-reach, reach))?;
        let angle = receiver.rotation().length();
        length("the angle by which the receiver is turned (radians)", angle, (0.0, std::f64::consts::PI))?;
        let angle_deg = receiver.axes().z_axis.z.clamp(-1.0, 1.0).acos().to_degrees();
        if angle_deg > Self::GREATEST_LEAN_DEG {
            return Err(BenchError::Lean { angle_deg });
        }
        for k in 0..4 {
            let at_mm = self.block.node(k % 2, k / 2, 2, 2);
            let gap_mm = receiver.gap_mm(at_mm.extend(0.0));
            if gap_mm <= 0.0 {
                return Err(BenchError::ReceiverCuts { at_mm, gap_mm });
            }
        }
        Ok(())
    }

    /// The same bench with light whose flux is spread unevenly over the block, besides what its
    /// geometry gives.
    pub fn with_profile(mut self, profile: Profile) -> Self {
        self.profile = Some(Arc::new(profile));
        self
    }

    /// Where the light that a flat face behind nothing else sends out at its middle lands on the
    /// receiver, mm in its coordinates: the natural place of the picture.
    ///
    /// # Errors
    /// Light that is kept inside by a flat face, or goes past the receiver.
    pub fn undisturbed_landing_mm(&self) -> Result<DVec2, BenchError> {
        let tangential = self.light_in_air().truncate();
        let direction = tangential.extend((1.0 - tangential.length_squared()).sqrt());
        let at = self.receiver.landing(DVec3::ZERO, direction);
        if at.is_finite() { Ok(at) } else { Err(BenchError::PastReceiver { direction }) }
    }

    /// The same bench with the light travelling along `direction` as it arrives at the structured
    /// face (for a block of glass: inside of it). Need not be normalised.
    ///
    /// # Errors
    /// A direction that is not finite or does not reach the face from its own side.
    pub fn with_light_direction(self, direction: DVec3) -> Result<Self, BenchError> {
        let unit = unit_or_zero(direction);
        let towards = match self.exit_face {
            ExitFace::Refracts { .. } => unit.z,
            ExitFace::Reflects => -unit.z,
        };
        if !unit.is_finite() || towards.is_nan() || towards < 1e-3 {
            return Err(BenchError::Direction { direction });
        }
        self.lit(Light::Parallel { direction: unit })
    }

    /// The same with the light travelling along `direction` before it meets the block: for glass,
    /// which refracts it at the entry face, in air. Need not be normalised.
    ///
    /// # Errors
    /// Those of [`with_light_direction`](Self::with_light_direction).
    pub fn with_light_in_air(self, direction: DVec3) -> Result<Self, BenchError> {
        let unit = unit_or_zero(direction);
        let tangential = unit.truncate() / self.exit_face.ior();
        let inside = tangential.extend((1.0 - tangential.length_squared()).sqrt().copysign(unit.z));
        self.with_light_direction(if unit == DVec3::ZERO { direction } else { inside })
    }

    /// The same bench in the light of a point source at `position_mm`: for glass, in front of the
    /// entry face, which lies at `z = -thickness_mm`; for a mirror, in front of the mirror, where
    /// the thickness has no meaning and is not looked at.
    ///
    /// # Errors
    /// A length out of its limits, a source in or next to the block, or light that would graze the
    /// block.
    pub fn with_point_source(
        self,
        position_mm: DVec3,
        thickness_mm: f64,
        intensity: Intensity,
    ) -> Result<Self, BenchError> {
        let reach = Self::DISTANCE_LIMITS_MM.1;
        length("the place of the light source along x", position_mm.x, (-reach, reach))?;
        length("the place of the light source along y", position_mm.y, (-reach, reach))?;
        length("the place of the light source along z", position_mm.z, (-reach, reach))?;
        let z_mm = position_mm.z;
        match self.exit_face {
            ExitFace::Refracts { .. } => {
                length("the thickness of the block", thickness_mm, Self::THICKNESS_LIMITS_MM)?;
                let limit_mm = -thickness_mm - Self::LEAST_SOURCE_MM;
                if z_mm > limit_mm {
                    let face = "in front of the entry face";
                    return Err(BenchError::SourcePlace { z_mm, side: "below", limit_mm, face });
                }
            }
            ExitFace::Reflects => {
                let limit_mm = Self::LEAST_SOURCE_MM;
                if z_mm < limit_mm {
                    return Err(BenchError::SourcePlace {
                        z_mm,
                        side: "above",
                        limit_mm,
                        face: "in front of the mirror",
                    });
                }
            }
        }
        let light = Light::Point { position_mm, thickness_mm, intensity };
        let passed = self.passed.clone();
        let bare = Self { light, passed: None, ..self };
        // The angle is greatest at a corner.
        let incidence = bare.incidence();
        let corners = (0..4).map(|k| {
            let at_mm = bare.block.node(k % 2, k / 2, 2, 2);
            let inside = incidence.at(at_mm.extend(0.0)).direction.truncate().length();
            // Where no light arrives this is not a number, and rounding may leave it above 1: both
            // are no more than grazing.
            (at_mm, (inside * bare.exit_face.ior()).min(1.0).asin().to_degrees())
        });
        let worst = corners.fold((DVec2::ZERO, 0.0), |worst, corner| if corner.1 > worst.1 { corner } else { worst });
        if worst.1 > Self::GREATEST_INCIDENCE_DEG {
            return Err(BenchError::Grazing { at_mm: worst.0, angle_deg: worst.1 });
        }
        Self { passed, ..bare }.lit(light)
    }

    /// The same bench with known faces on the way of the light, in its order: an entry face that is not
    /// planar, or plates before the block. The last of them is the entry face of the block, with the
    /// index of its glass behind it.
    ///
    /// # Errors
    /// Faces for a mirror, a last face before some other glass, and light that does not come through to
    /// every part of the block.
    pub fn behind(self, faces: Vec<KnownFace>) -> Result<Self, BenchError> {
        let ior = match self.exit_face {
            ExitFace::Refracts { ior } => ior,
            ExitFace::Reflects => return Err(BenchError::FacesBeforeMirror),
        };
        let index = faces.last().map_or(f64::NAN, |face| face.index_behind);
        let same = (index - ior).abs() < 1e-12;
        if !same {
            return Err(BenchError::IndexBehind { index, wanted: ior });
        }
        let wavefront = passed(self.beginning(), &faces, self.block)?;
        Ok(Self { passed: Some(Arc::new(Passed { faces, wavefront })), ..self })
    }

    /// The faces that light passes before the structured face; none if there is but a planar entry
    /// face.
    pub fn known_faces(&self) -> &[KnownFace] {
        self.passed.as_ref().map_or(&[], |passed| &passed.faces)
    }

    /// The same bench in another light.
    fn lit(self, light: Light) -> Result<Self, BenchError> {
        let faces = self.passed.as_ref().map(|passed| passed.faces.clone());
        let lit = Self { light, passed: None, ..self };
        match faces {
            Some(faces) => lit.behind(faces),
            None => Ok(lit),
        }
    }

    /// How the light begins, in air.
    fn beginning(&self) -> Beginning {
        match self.light {
            Light::Parallel { .. } => Beginning::Parallel(self.light_in_air()),
            Light::Point { position_mm, intensity, .. } => Beginning::Point(position_mm, intensity),
        }
    }

    /// The light as it arrives at every point of the structured face.
    pub(crate) fn incidence(&self) -> Incidence<'_> {
        self.even_incidence().spread(self.profile())
    }

    /// The same without the profile.
    pub(crate) fn even_incidence(&self) -> Incidence<'_> {
        match (self.congruence(), self.light) {
            (Some(congruence), _) => Incidence::curved(congruence),
            (None, Light::Parallel { direction }) => Incidence::parallel(direction),
            (None, Light::Point { .. }) => unreachable!("light of a point is a congruence"),
        }
    }

    /// The light as a congruence of rays, if it is not the same everywhere before the structured face.
    pub(crate) fn congruence(&self) -> Option<Congruence<'_>> {
        match &self.passed {
            Some(passed) => Some(Congruence::Passed(&passed.wavefront)),
            None => self.wave().map(Congruence::Point),
        }
    }

    /// The wave of its source behind a planar entry face, if the light comes from a point.
    pub(crate) fn wave(&self) -> Option<PointWave> {
        match self.light {
            Light::Parallel { .. } => None,
            Light::Point { position_mm, thickness_mm, intensity } => {
                Some(PointWave::new((position_mm, thickness_mm), intensity, self.exit_face, self.block))
            }
        }
    }

    /// Whether the light meets the structured face with the same direction and flux everywhere.
    pub(crate) fn is_evenly_lit(&self) -> bool {
        self.congruence().is_none() && self.profile.is_none()
    }

    /// Size of the exit face.
    pub fn block(&self) -> Extent {
        self.block
    }

    /// The outline of the block within that size.
    pub fn outline(&self) -> Outline {
        self.outline
    }

    /// The curve around the exit face.
    pub fn contour(&self) -> Contour {
        self.outline.within(self.block)
    }

    /// Size of the picture on the receiver.
    pub fn window(&self) -> Extent {
        self.receiver.window()
    }

    /// Centre of the picture on the receiver, mm from the axis of the block.
    pub fn window_centre_mm(&self) -> DVec2 {
        self.receiver.window_centre_mm()
    }

    /// From the mean exit plane to the receiver along the axis, mm.
    pub fn distance_mm(&self) -> f64 {
        self.receiver.distance_mm()
    }

    /// The receiver.
    pub fn receiver(&self) -> &Receiver {
        &self.receiver
    }

    /// How the light's flux is spread over the block besides what its geometry gives.
    pub fn profile(&self) -> Option<&Profile> {
        self.profile.as_deref()
    }

    /// What the structured face does.
    pub fn exit_face(&self) -> ExitFace {
        self.exit_face
    }

    /// The light that arrives.
    pub fn light(&self) -> Light {
        self.light
    }

    /// Unit vector along which the light travels before it meets anything; if it comes from a point,
    /// that which would arrive at the middle of the face through a planar entry face.
    pub fn light_in_air(&self) -> DVec3 {
        let inside = match (self.light, self.wave()) {
            (Light::Parallel { direction }, _) => direction,
            (_, wave) => {
                wave.map_or(DVec3::NAN, |wave| Incidence::curved(Congruence::Point(wave)).at(DVec3::ZERO).direction)
            }
        };
        let tangential = inside.truncate() * self.exit_face.ior();
        tangential.extend((1.0 - tangential.length_squared()).max(0.0).sqrt().copysign(inside.z))
    }

    /// Unit vector along which the light travels as it arrives at the structured face; if it is not
    /// the same everywhere, at the middle of the face.
    pub fn light_direction(&self) -> DVec3 {
        self.even_incidence().at(DVec3::ZERO).direction
    }
}

fn length(what: &'static str, value_mm: f64, (least_mm, greatest_mm): (f64, f64)) -> Result<(), BenchError> {
    if (least_mm..=greatest_mm).contains(&value_mm) {
        Ok(())
    } else {
        Err(BenchError::Length { what, value_mm, least_mm, greatest_mm })
    }
}

/// The unit vector along `vector`, of length 1 to the last bits however short or long it is (the
/// square of its own length could underflow); zero for none, and for one that is not finite.
fn unit_or_zero(vector: DVec3) -> DVec3 {
    (vector / vector.abs().max_element()).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: Extent = Extent::new(100.0, 80.0);

    #[test]
    fn absurd_benches_are_refused_with_the_value_and_its_limit() {
        for distance in [0.0, -5.0, f64::NAN, f64::INFINITY] {
            let error = Bench::new(BLOCK, distance, ExitFace::Reflects).unwrap_err().to_string();
            assert!(error.contains("distance") && error.contains("between 1 mm"), "{error}");
        }
        for ior in [1.0, 0.5, f64::NAN, 9.0] {
            let error = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior }).unwrap_err();
            assert!(matches!(error, BenchError::Index { .. }));
        }
        let bench = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        assert!(bench.clone().with_light_direction(DVec3::NEG_Z).is_err());
        assert!(bench.clone().with_light_direction(DVec3::NAN).is_err());
        assert!(bench.clone().with_light_in_air(DVec3::NEG_Z).is_err());
        assert!(bench.clone().with_light_in_air(DVec3::NAN).is_err());
        let air = DVec3::new(0.3, -0.4, 0.75f64.sqrt());
        let bench = bench.with_light_in_air(2.0 * air).unwrap();
        assert!((bench.light_direction().truncate() - air.truncate() / 1.5).length() < 1e-15);
        assert!((bench.light_in_air() - air).length() < 1e-15);
    }

    #[test]
    fn parts_of_a_bench_are_chosen_in_any_order() {
        let start = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let source = DVec3::new(5.0, -3.0, -200.0);
        let lit = |bench: Bench| bench.with_point_source(source, 20.0, Intensity::Isotropic).unwrap();
        let profile = Profile::of(&lit(start.clone()), 20.0, |ray| 1.0 + ray.direction.x).unwrap();
        let parts: [&dyn Fn(Bench) -> Bench; 5] = [
            &|bench| bench.with_outline(Outline::Circle).unwrap(),
            &|bench| bench.with_window(Extent::new(60.0, 50.0), DVec2::new(4.0, -7.0)).unwrap(),
            &|bench| bench.with_receiver_turned(DVec3::new(0.1, 0.2, 0.0)).unwrap(),
            &lit,
            &|bench| bench.with_profile(profile.clone()),
        ];
        let in_order = parts.iter().fold(start.clone(), |bench, part| part(bench));
        for first in 0..parts.len() {
            for step in 1..parts.len() {
                let order = (0..parts.len()).map(|k| (first + step * k) % parts.len());
                assert_eq!(order.fold(start.clone(), |bench, k| parts[k](bench)), in_order, "{first}, {step}");
            }
        }
    }

    #[test]
    fn corners_must_fit_the_block() {
        let bench = Bench::new(BLOCK, 250.0, ExitFace::Reflects).unwrap();
        for radius_mm in [1.0, 10.0, 40.0] {
            let rounded = bench.clone().with_outline(Outline::Rounded { radius_mm }).unwrap();
            assert_eq!(rounded.contour().radius_mm(), DVec2::splat(radius_mm));
        }
        for radius_mm in [-1.0, 0.0, 0.5, 40.1, f64::NAN, f64::INFINITY] {
            let error = bench.clone().with_outline(Outline::Rounded { radius_mm }).unwrap_err().to_string();
            assert!(error.contains("at most 40.00 mm"), "{error}");
        }
        assert!(
            (bench.clone().with_outline(Outline::Circle).unwrap().contour().share_of_extent()
                - std::f64::consts::FRAC_PI_4)
                .abs()
                < 1e-12
        );
    }

    #[test]
    fn a_source_must_stand_off_the_block_and_not_graze_it() {
        let glass = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let mirror = Bench::new(BLOCK, 250.0, ExitFace::Reflects).unwrap();
        let lit = |bench: Bench, at: DVec3, thickness| bench.with_point_source(at, thickness, Intensity::Isotropic);
        let axis = |z: f64| DVec3::new(0.0, 0.0, z);
        assert!(lit(glass.clone(), axis(-60.0), 20.0).is_ok() && lit(mirror.clone(), axis(60.0), f64::NAN).is_ok());
        for (bench, z) in [
            (glass.clone(), 60.0),
            (glass.clone(), -20.5),
            (glass.clone(), -1.0),
            (mirror.clone(), -60.0),
            (mirror.clone(), 0.5),
        ] {
            let error = lit(bench, axis(z), 20.0).unwrap_err();
            assert!(matches!(error, BenchError::SourcePlace { z_mm, .. } if z_mm == z), "{error}");
        }
        // 64 mm to the corner, over 5 mm of air.
        let error = lit(glass.clone(), axis(-25.0), 20.0).unwrap_err();
        assert!(matches!(error, BenchError::Grazing { angle_deg, .. } if angle_deg > 80.0), "{error}");
        let error = lit(mirror.clone(), DVec3::new(500.0, 0.0, 100.0), 20.0).unwrap_err().to_string();
        assert!(error.contains("79.7 degrees") && error.contains("at most 75 degrees"), "{error}");
        for (at, thickness) in [(DVec3::NAN, 20.0), (axis(-2e6), 20.0), (axis(-60.0), f64::NAN), (axis(-60.0), 0.0)] {
            assert!(matches!(lit(glass.clone(), at, thickness), Err(BenchError::Length { .. })));
        }
        // At the middle of the face, an oblique source shines along the refracted ray.
        let bench = lit(mirror, DVec3::new(30.0, 0.0, 40.0), 0.0).unwrap();
        assert!((bench.light_direction() - DVec3::new(-0.6, 0.0, -0.8)).length() < 1e-15);
    }
}
