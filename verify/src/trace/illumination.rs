//! The light at a point of a block's face: where it comes from, and how much of it there is.
//!
//! Flux is told as flux per unit of area of the plane z = const through the point. A ray in air
//! carries `e` per unit of area across it. Entering glass at `cos` to the entry face's normal, it
//! brings `e cos` to a unit of that face; on its way through the glass parallel light keeps that,
//! and the light of a point spreads. With `g` the tangent of its angle in air, `d` the way through
//! air along the axis and `a` that through glass, it is
//!
//! ```text
//! rho(g) = g (d + a / s),   s = sqrt(n^2 + (n^2 - 1) g^2),   drho/dg = d + a n^2 / s^3
//! ```
//!
//! to the side of its source (Snell's law), and an area d g x d dg of the entry face has become
//! (rho / g) g x drho.

use super::{
    refraction::{RefractionOutcome, refract},
    stand::Stand,
};
use crate::scene::{BeamProfile, Emission, Fresnel, Light, Optics, Scene};
use glam::DVec3;

/// The rays of ideal light: parallel along a unit vector, or from a point, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rays {
    Parallel(DVec3),
    From(DVec3),
}

impl Rays {
    pub(super) fn of(light: &Light) -> Self {
        match light {
            Light::Parallel { direction } => Self::Parallel(direction.normalize()),
            Light::Point { position_mm, .. } => Self::From(*position_mm),
        }
    }

    /// Unit vector of the ray through a point.
    #[inline]
    pub(super) fn direction_at(&self, at: DVec3) -> DVec3 {
        match *self {
            Self::Parallel(direction) => direction,
            Self::From(source) => (at - source).normalize(),
        }
    }

    /// The same light in the frame in which its own stands so.
    fn seen(self, stand: &Stand) -> Self {
        match self {
            Self::Parallel(direction) => Self::Parallel(stand.direction(direction)),
            Self::From(source) => Self::From(stand.point(source)),
        }
    }
}

/// The axis of a bench's light: the bench's own unless a source has another. Unit vector.
pub(super) fn axis_of(scene: &Scene) -> DVec3 {
    let of_source = if let Light::Point { axis, .. } = &scene.light { *axis } else { None };
    of_source.map_or(DVec3::new(0.0, 0.0, scene.sense()), DVec3::normalize)
}

/// How much light the rays carry, in the bench's frame.
#[derive(Clone, Debug)]
pub(super) struct SourceFlux {
    emission: Emission,
    axis: DVec3,
    profile: Option<BeamProfile>,
    /// The plane in which the profile was measured, mm.
    plane_mm: f64,
}

impl SourceFlux {
    pub(super) fn of(scene: &Scene, plane_mm: f64) -> Self {
        let emission = match &scene.light {
            Light::Parallel { .. } => Emission::Isotropic,
            Light::Point { emission, .. } => emission.clone(),
        };
        Self { emission, axis: axis_of(scene), profile: scene.profile.clone(), plane_mm }
    }

    /// Flux per unit of area across the ray that passes a point in air.
    #[inline]
    pub(super) fn across(&self, rays: Rays, at: DVec3) -> f64 {
        let direction = rays.direction_at(at);
        match (&self.profile, rays) {
            (None, Rays::Parallel(_)) => 1.0,
            (None, Rays::From(source)) => {
                self.emission.intensity(direction.dot(self.axis)) / at.distance_squared(source)
            }
            (Some(profile), _) => {
                let to_plane = (self.plane_mm - at.z) / direction.z;
                let measured = at + direction * to_plane;
                let spreads = match rays {
                    Rays::Parallel(_) => 1.0,
                    Rays::From(source) => measured.distance_squared(source) / at.distance_squared(source),
                };
                spreads * profile.irradiance(measured.truncate()) / direction.z.abs()
            }
        }
    }
}

/// The light at a point of the face, in the block's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Unit vector along which it travels there.
    pub(super) direction: DVec3,
    /// Where it enters the glass, mm; of a mirror the point itself.
    pub(super) entered: DVec3,
    /// Flux per unit of area of the plane z = const.
    pub(super) flux: f64,
    /// The part that the entry face lets through.
    pub(super) transmittance: f64,
}

/// What lights a block.
#[derive(Clone, Debug)]
pub(super) struct Illumination {
    strength: SourceFlux,
    /// How the block stands on the bench, where their frames differ.
    stand: Option<Stand>,
    optics: Optics,
    entry_z: f64,
    fresnel: Fresnel,
}

/// Newton's steps; it takes four or five.
const STEPS: usize = 60;

impl Illumination {
    /// The light for a block that stands so; `belongs_mm` is where its mean exit plane belongs on
    /// the bench.
    pub(super) fn of(scene: &Scene, optics: Optics, entry_z: f64, stand: Option<Stand>, belongs_mm: f64) -> Self {
        let plane_mm = match optics {
            Optics::Refracts { .. } => belongs_mm + entry_z,
            Optics::Reflects => 0.0,
        };
        Self { strength: SourceFlux::of(scene, plane_mm), stand, optics, entry_z, fresnel: scene.fresnel }
    }

    /// Rays of the bench in the block's frame.
    pub(super) fn in_block(&self, rays: Rays) -> Rays {
        self.stand.map_or(rays, |stand| rays.seen(&stand.inverse()))
    }

    /// The light of these rays (in the block's frame) at a point of the face; none where it comes
    /// from the wrong side.
    #[inline]
    pub(super) fn at(&self, rays: Rays, point: DVec3) -> Option<Arrival> {
        let Optics::Refracts { ior } = self.optics else { return self.in_air(rays, point) };
        match rays {
            Rays::Parallel(_) => {
                let (inside, transmittance) = self.enter(rays, point)?;
                let entered = point - inside * ((point.z - self.entry_z) / inside.z);
                let flux = self.across(rays, entered) * rays.direction_at(entered).z;
                Some(Arrival { direction: inside, entered, flux, transmittance })
            }
            Rays::From(source) => {
                let aside = point.truncate() - source.truncate();
                let (air, glass) = (self.entry_z - source.z, point.z - self.entry_z);
                if air.is_nan() || air <= 0.0 || glass < 0.0 {
                    return None;
                }
                let (over_tangent, by_tangent, tangent) = fan(ior, air, glass, aside.length());
                let entered = (source.truncate() + aside * (air / over_tangent)).extend(self.entry_z);
                let (inside, transmittance) = self.enter(rays, entered)?;
                let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
                let flux = self.across(rays, entered) * cos * air * air / (over_tangent * by_tangent);
                Some(Arrival { direction: inside, entered, flux, transmittance })
            }
        }
    }

    /// The light of these rays at a point to which they come through air: of a mirror, or of an
    /// entry face that is not planar.
    #[inline]
    pub(super) fn in_air(&self, rays: Rays, point: DVec3) -> Option<Arrival> {
        let direction = rays.direction_at(point);
        let along = match self.optics {
            Optics::Refracts { .. } => direction.z,
            Optics::Reflects => -direction.z,
        };
        let flux = self.across(rays, point) * along;
        (along > 0.0).then_some(Arrival { direction, entered: point, flux, transmittance: 1.0 })
    }

    /// Direction inside of the glass of the ray that enters at a point, and what the entry face
    /// lets through.
    #[inline]
    pub(super) fn enter(&self, rays: Rays, entered: DVec3) -> Option<(DVec3, f64)> {
        let Optics::Refracts { ior } = self.optics else { return None };
        let direction = rays.direction_at(entered);
        match refract(direction, DVec3::Z, 1.0 / ior) {
            RefractionOutcome::Refracted(refraction) if direction.z > 0.0 => {
                let transmittance = match self.fresnel {
                    Fresnel::Off => 1.0,
                    Fresnel::On => refraction.transmittance(),
                };
                Some((refraction.direction, transmittance))
            }
            _ => None,
        }
    }

    fn across(&self, rays: Rays, at: DVec3) -> f64 {
        match self.stand {
            None => self.strength.across(rays, at),
            Some(stand) => self.strength.across(rays.seen(&stand), stand.point(at)),
        }
    }
}

/// `rho / g`, `drho/dg` and `g` of the ray that comes `rho` to the side of its source, through so
/// much air and glass.
#[inline]
fn fan(ior: f64, air: f64, glass: f64, rho: f64) -> (f64, f64, f64) {
    let n2 = ior * ior;
    // rho(g) is concave, so Newton's steps from a ray that falls short never overshoot. This one
    // does, as all angles are small to it.
    let mut g = rho / (air + glass / ior);
    for _ in 0..STEPS {
        let s2 = n2 + (n2 - 1.0) * g * g;
        let s = s2.sqrt();
        let (over, by) = (air + glass / s, air + glass * n2 / (s2 * s));
        let step = (rho - g * over) / by;
        if step.abs() <= 1e-15 * g {
            return (over, by, g);
        }
        g += step;
    }
    let s = (n2 + (n2 - 1.0) * g * g).sqrt();
    (air + glass / s, air + glass * n2 / (s * s * s), g)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Window;
    use glam::DVec2;

    #[test]
    fn a_ray_is_aimed_to_rounding_and_spreads_as_its_neighbours_say() {
        let (n, air, glass) = (1.49f64, 80.0, 17.0);
        let rho = |g: f64| air * g + glass * (g / (1.0 + g * g).sqrt() / n).asin().tan();
        for wanted in [0.0, 1e-6, 3.0, 70.0, 900.0] {
            let (over, by, g) = fan(n, air, glass, wanted);
            assert!((rho(g) - wanted).abs() < 1e-12 * (1.0 + wanted), "{wanted}");
            let step = 1e-5;
            assert!((by - (rho(g + step) - rho(g - step)) / (2.0 * step)).abs() < 1e-5 * by, "{wanted}");
            assert!(g == 0.0 || (over - wanted / g).abs() < 1e-9 * over, "{wanted}");
        }
    }

    /// All flux that leaves the source within a cone arrives within its edge, whatever the glass
    /// does to the rays.
    #[test]
    fn flux_is_kept_between_source_and_face() {
        let window = Window { size_mm: DVec2::ONE, centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
        for (emission, flux_to) in [
            (Emission::Isotropic, &(|cos: f64| 1.0 - cos) as &dyn Fn(f64) -> f64),
            (Emission::Lambertian, &|cos: f64| 0.5 * (1.0 - cos * cos)),
        ] {
            let source = DVec3::new(0.0, 0.0, -60.0);
            let light = Light::Point { position_mm: source, emission, axis: None };
            let scene = Scene { light, ..Scene::new(1.5, 100.0, window) };
            let illumination = Illumination::of(&scene, scene.optics, -12.0, None, 0.0);
            let edge = 40.0;
            let (_, _, g) = fan(1.5, 48.0, 12.0, edge);
            let wanted = flux_to(1.0 / (1.0 + g * g).sqrt());
            let n = 20_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    let rho = edge * (f64::from(k) + 0.5) / f64::from(n);
                    illumination.at(Rays::From(source), DVec3::new(rho, 0.0, 0.0)).unwrap().flux * rho * edge
                        / f64::from(n)
                })
                .sum();
            assert!((sum / wanted - 1.0).abs() < 1e-8, "{sum} {wanted}");
        }
    }
}
