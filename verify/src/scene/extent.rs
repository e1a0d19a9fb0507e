//! Light that is not ideal: a sun with a size, a lamp with an area, a face with a finish. Sampled
//! ray by ray, not convolved.

use super::{
    error::{SceneError, in_range},
    light::Light,
};
use crate::random::{PhotonRandom, Purpose};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The extent of the light, in angle or in place.
///
/// [`photons`](crate::photons) draw a direction or a place of the source for every photon.
/// [`beams`](crate::beams) see ideal light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SourceExtent {
    /// None: ideal light.
    #[default]
    None,
    /// Of parallel light, an even disc of directions around its own, such as the sun: 4.65e-3
    /// radians.
    AngularDisc {
        /// Angle from the centre of the disc to its edge, radians.
        radius: f64,
    },
    /// Of parallel light, directions that are normally distributed around its own.
    AngularGaussian {
        /// Root of the mean square of the tangent along each of two axes.
        rms: f64,
    },
    /// Of a point source, an even disc across its axis.
    SourceDisc {
        /// Radius, mm.
        radius_mm: f64,
    },
    /// Of a point source, an even rectangle across its axis: the first side along the bench's x as
    /// seen along that axis.
    SourceRectangle {
        /// Length of its sides, mm.
        size_mm: DVec2,
    },
}

impl SourceExtent {
    pub(crate) fn validate(&self, light: &Light) -> Result<(), SceneError> {
        match *self {
            Self::None => return Ok(()),
            Self::AngularDisc { radius } => in_range("the angular radius of the light (radians)", radius, 0.0, 0.5)?,
            Self::AngularGaussian { rms } => in_range("the rms angle of the light (radians)", rms, 0.0, 0.2)?,
            Self::SourceDisc { radius_mm } => in_range("the radius of the light source (mm)", radius_mm, 0.0, 1e6)?,
            Self::SourceRectangle { size_mm } => {
                in_range("the width of the light source (mm)", size_mm.x, 0.0, 1e6)?;
                in_range("the height of the light source (mm)", size_mm.y, 0.0, 1e6)?;
            }
        }
        match (self, light) {
            (Self::AngularDisc { .. } | Self::AngularGaussian { .. }, Light::Point { .. }) => Err(SceneError::Needs(
                "a spread of angles is one of parallel light: give a point source a size in millimetres",
            )),
            (Self::SourceDisc { .. } | Self::SourceRectangle { .. }, Light::Parallel { .. }) => Err(SceneError::Needs(
                "a source with a size in millimetres is a point source: give parallel light a spread of angles",
            )),
            _ => Ok(()),
        }
    }

    /// A direction around this unit vector.
    pub(crate) fn direction(&self, axis: DVec3, random: &PhotonRandom) -> DVec3 {
        let (x, y) = across(axis);
        match *self {
            Self::AngularDisc { radius } => {
                let [u, v] = random.pair(Purpose::Light);
                // Even in solid angle. 1 - cos of a small angle, without losing digits.
                let fall = u * 2.0 * (0.5 * radius).sin().powi(2);
                let sin = (fall * (2.0 - fall)).sqrt();
                let aside = sin * DVec2::from_angle(TAU * v);
                (1.0 - fall) * axis + aside.x * x + aside.y * y
            }
            Self::AngularGaussian { rms } => {
                let aside = rms * random.normal_pair(Purpose::Light);
                (axis + aside.x * x + aside.y * y).normalize()
            }
            Self::None | Self::SourceDisc { .. } | Self::SourceRectangle { .. } => axis,
        }
    }

    /// A place of the source around this point, mm.
    pub(crate) fn place(&self, centre: DVec3, axis: DVec3, random: &PhotonRandom) -> DVec3 {
        let aside = match *self {
            Self::SourceDisc { radius_mm } => {
                let [u, v] = random.pair(Purpose::Light);
                radius_mm * u.sqrt() * DVec2::from_angle(TAU * v)
            }
            Self::SourceRectangle { size_mm } => (DVec2::from_array(random.pair(Purpose::Light)) - 0.5) * size_mm,
            Self::None | Self::AngularDisc { .. } | Self::AngularGaussian { .. } => return centre,
        };
        let (x, y) = across(axis);
        centre + aside.x * x + aside.y * y
    }
}

/// Two unit vectors across an axis: the first as near to x as can be.
fn across(axis: DVec3) -> (DVec3, DVec3) {
    let near = if axis.x.abs() < 0.999 { DVec3::X } else { DVec3::Y };
    let x = (near - near.dot(axis) * axis).normalize();
    (x, axis.cross(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over many photons of a function of what is drawn.
    fn mean(of: impl Fn(&PhotonRandom) -> DVec3) -> DVec3 {
        let n = 40_000;
        (0..n).map(|photon| of(&PhotonRandom { key: 7, photon })).sum::<DVec3>() / n as f64
    }

    #[test]
    fn moments_are_those_of_discs_rectangles_and_gaussians() {
        let axis = DVec3::new(0.3, -0.2, 0.9).normalize();
        let (x, y) = across(axis);
        assert!(x.dot(y).abs() < 1e-15 && x.dot(axis).abs() < 1e-15 && x.cross(y).dot(axis) > 0.999);
        let squares = |v: DVec3| DVec3::new(v.dot(x).powi(2), v.dot(y).powi(2), v.dot(x) * v.dot(y));
        let on = |extent: SourceExtent| mean(|random| squares(extent.direction(axis, random)));
        let at = |extent: SourceExtent| mean(|random| squares(extent.place(DVec3::ZERO, axis, random)));
        let near = |found: DVec3, wanted: DVec2| {
            // Fourth moments are at most thrice the square of the second.
            let tolerance = 5.0 * (2.0 / 40_000f64).sqrt() * wanted.max_element();
            assert!(
                (found.truncate() - wanted).abs().max_element() < tolerance && found.z.abs() < tolerance,
                "{found} {wanted}"
            );
        };
        near(on(SourceExtent::AngularDisc { radius: 0.01 }), DVec2::splat(1e-4 / 4.0));
        near(on(SourceExtent::AngularGaussian { rms: 0.01 }), DVec2::splat(1e-4));
        near(at(SourceExtent::SourceDisc { radius_mm: 3.0 }), DVec2::splat(9.0 / 4.0));
        near(at(SourceExtent::SourceRectangle { size_mm: DVec2::new(3.0, 1.0) }), DVec2::new(9.0, 1.0) / 12.0);
    }

    #[test]
    fn draws_are_uniform_and_independent() {
        let all = mean(|random| {
            let ([a, b], [c, d]) = (random.pair(Purpose::Light), random.pair(Purpose::Finish(0)));
            DVec3::new((a - 0.5) * (b - 0.5), (a - 0.5) * (c - 0.5), (b - 0.5) * (d - 0.5))
        });
        // Products of two uniform deviates have the variance 1/144.
        assert!(all.abs().max_element() < 4.0 / 12.0 / 200.0, "{all}");
    }

    #[test]
    fn spreads_go_with_their_light() {
        let (parallel, point) = (
            Light::parallel(DVec3::Z),
            Light::Point { position_mm: DVec3::NEG_Z, emission: Default::default(), axis: None },
        );
        let (sun, lamp) = (SourceExtent::AngularDisc { radius: 0.005 }, SourceExtent::SourceDisc { radius_mm: 2.0 });
        assert!(sun.validate(&parallel).is_ok() && lamp.validate(&point).is_ok());
        assert!(matches!(sun.validate(&point), Err(SceneError::Needs(_))));
        assert!(matches!(lamp.validate(&parallel), Err(SceneError::Needs(_))));
        let wide = SourceExtent::AngularDisc { radius: f64::NAN };
        assert!(matches!(wide.validate(&parallel), Err(SceneError::Value { .. })));
    }
}
