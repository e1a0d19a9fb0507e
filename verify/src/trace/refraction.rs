//! Refraction and reflection at a smooth interface.

use glam::{DVec2, DVec3};

/// What an interface does to a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RefractionOutcome {
    /// The ray goes on.
    Refracted(Refraction),
    /// Beyond the critical angle: everything is reflected.
    TotallyReflected,
}

/// A ray behind an interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Refraction {
    /// Unit vector.
    pub(crate) direction: DVec3,
    eta: f64,
    cos_i: f64,
    cos_t: f64,
}

impl Refraction {
    /// The part of unpolarised light that goes on, by Fresnel's equations.
    #[inline]
    pub(crate) fn transmittance(&self) -> f64 {
        let Self { eta, cos_i, cos_t, .. } = *self;
        let s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        let p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        1.0 - 0.5 * (s * s + p * p)
    }
}

/// Snell's law.
///
/// `direction` and `normal` are unit vectors with a positive product: the normal points to where
/// the light goes. `eta` is the index before the interface divided by the one behind it. In vector
/// form `t = eta d + (cos_t - eta cos_i) n`.
#[inline]
pub(crate) fn refract(direction: DVec3, normal: DVec3, eta: f64) -> RefractionOutcome {
    let cos_i = direction.dot(normal);
    let cos2_t = 1.0 - eta * eta * (1.0 - cos_i * cos_i);
    if cos2_t <= 0.0 {
        return RefractionOutcome::TotallyReflected;
    }
    let cos_t = cos2_t.sqrt();
    let direction = eta * direction + (cos_t - eta * cos_i) * normal;
    RefractionOutcome::Refracted(Refraction { direction, eta, cos_i, cos_t })
}

/// Snell's law for light along z that meets a face of these slopes in a medium of this index
/// relative to the one behind it: what the light goes aside for every unit along z. NaN beyond the
/// critical angle.
///
/// With the normal `(-slope, 1)`, whose square is `g`, [`refract`] reads
/// `t = (0, 0, ior) + ((w - ior) / g) normal` where `w^2 = g - ior^2 (g - 1)`.
#[inline(always)]
pub(crate) fn tangent_behind(slope: DVec2, ior: f64) -> DVec2 {
    let g = 1.0 + slope.length_squared();
    let turn = (g - ior * ior * (g - 1.0)).sqrt() - ior;
    slope * (-turn / (ior * g + turn))
}

/// The mirror image of `direction` in the plane with this unit normal.
#[inline]
pub(crate) fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snells_law_holds_and_directions_stay_unit_vectors() {
        for degrees in [0.0, 5.0, 20.0, 40.0] {
            let a = f64::to_radians(degrees);
            let direction = DVec3::new(a.sin(), 0.0, a.cos());
            let RefractionOutcome::Refracted(Refraction { direction: out, .. }) = refract(direction, DVec3::Z, 1.5)
            else {
                panic!()
            };
            assert!((out.x - 1.5 * a.sin()).abs() < 1e-15 && (out.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_limit_of_total_reflection_is_where_it_should_be() {
        let limit = f64::asin(1.0 / 1.5);
        let at = |a: f64| refract(DVec3::new(a.sin(), 0.0, a.cos()), DVec3::Z, 1.5);
        assert!(matches!(at(limit - 1e-9), RefractionOutcome::Refracted(_)));
        assert_eq!(at(limit + 1e-9), RefractionOutcome::TotallyReflected);
    }

    #[test]
    fn light_along_the_axis_obeys_the_same_law() {
        for slope in [DVec2::ZERO, DVec2::new(0.3, -0.2), DVec2::new(-0.8, 0.1), DVec2::new(0.0, 1e-9)] {
            for ior in [1.5, 1.0 / 1.5] {
                let RefractionOutcome::Refracted(left) = refract(DVec3::Z, (-slope).extend(1.0).normalize(), ior)
                else {
                    panic!("{slope} is within the critical angle")
                };
                let wanted = left.direction.truncate() / left.direction.z;
                assert!((tangent_behind(slope, ior) - wanted).length() < 1e-15, "{slope} {ior}");
            }
        }
        assert!(tangent_behind(DVec2::new(1.0, 0.0), 1.5).is_nan(), "41.8 degrees is the limit");
    }

    #[test]
    fn fresnel_has_its_textbook_values() {
        let transmittance = |a: f64, eta: f64| match refract(DVec3::new(a.sin(), 0.0, a.cos()), DVec3::Z, eta) {
            RefractionOutcome::Refracted(refraction) => refraction.transmittance(),
            RefractionOutcome::TotallyReflected => 0.0,
        };
        assert!((transmittance(0.0, 1.0 / 1.5) - 0.96).abs() < 1e-15, "4 % at normal incidence on n = 1.5");
        assert!((transmittance(0.0, 1.5) - 0.96).abs() < 1e-15, "the same from inside");
        // At Brewster's angle only s is reflected: half of ((n^2 - 1) / (n^2 + 1))^2.
        let brewster = 1.0 - 0.5 * (1.25f64 / 3.25).powi(2);
        assert!((transmittance(1.5f64.atan(), 1.0 / 1.5) - brewster).abs() < 1e-15);
        assert!(transmittance(f64::asin(1.0 / 1.5) - 1e-12, 1.5) < 1e-5, "nothing at the critical angle");
    }

    #[test]
    fn reflection_turns_the_normal_component_round() {
        assert_eq!(reflect(DVec3::new(0.6, 0.0, 0.8), DVec3::Z), DVec3::new(0.6, 0.0, -0.8));
    }
}
