//! Light that is not ideal: a sun with a size, a lamp with an area, a face with a finish. Sampled ray by ray, not convolved.

use crate::{
    light::Light,
    scene::{SceneError, within},
};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The extent of the light, in angle or in place.
///
/// [`photons`](crate::photons) draw a direction or a place of the source for every photon. [`beams`](crate::beams) see ideal light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spread {
    /// None: ideal light.
    #[default]
    None,
    /// Of parallel light, an even disc of directions around its own, such as the sun: 4.65e-3 radians.
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
    /// Of a point source, an even rectangle across its axis: the first side along the bench's x as seen along that axis.
    SourceRectangle {
        /// Length of its sides, mm.
        size_mm: DVec2,
    },
}

/// Random numbers of one photon, besides the two that the net gives it: any number of them, always the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dice {
    /// Of the replicate.
    pub(crate) key: u64,
    /// Number of the photon.
    pub(crate) photon: u64,
}

/// What a pair of random numbers is for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Draw {
    Light = 1,
    Finish = 2,
}

impl Dice {
    /// Two independent numbers between 0 and 1, never 0.
    pub(crate) fn pair(&self, draw: Draw) -> [f64; 2] {
        let photon = mix(self.key ^ mix(self.photon));
        [0, 1].map(|k| {
            let bits = mix(photon ^ mix(2 * draw as u64 + k));
            ((bits >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        })
    }

    /// Two independent normal deviates (Box and Muller).
    pub(crate) fn normal_pair(&self, draw: Draw) -> DVec2 {
        let [u, v] = self.pair(draw);
        (-2.0 * u.ln()).sqrt() * DVec2::from_angle(TAU * v)
    }
}

/// The finaliser of SplitMix64: a bijection whose output bits all depend on all input bits.
pub(crate) fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Spread {
    pub(crate) fn validate(&self, light: &Light) -> Result<(), SceneError> {
        match *self {
            Self::None => return Ok(()),
            Self::AngularDisc { radius } => within("the angular radius of the light (radians)", radius, 0.0, 0.5)?,
            Self::AngularGaussian { rms } => within("the rms angle of the light (radians)", rms, 0.0, 0.2)?,
            Self::SourceDisc { radius_mm } => within("the radius of the light source (mm)", radius_mm, 0.0, 1e6)?,
            Self::SourceRectangle { size_mm } => {
                within("the width of the light source (mm)", size_mm.x, 0.0, 1e6)?;
                within("the height of the light source (mm)", size_mm.y, 0.0, 1e6)?;
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
    pub(crate) fn direction(&self, axis: DVec3, dice: &Dice) -> DVec3 {
        let (x, y) = across(axis);
        match *self {
            Self::AngularDisc { radius } => {
                let [u, v] = dice.pair(Draw::Light);
                // Even in solid angle. 1 - cos of a small angle, without losing digits.
                let fall = u * 2.0 * (0.5 * radius).sin().powi(2);
                let sin = (fall * (2.0 - fall)).sqrt();
                let aside = sin * DVec2::from_angle(TAU * v);
                (1.0 - fall) * axis + aside.x * x + aside.y * y
            }
            Self::AngularGaussian { rms } => {
                let aside = rms * dice.normal_pair(Draw::Light);
                (axis + aside.x * x + aside.y * y).normalize()
            }
            Self::None | Self::SourceDisc { .. } | Self::SourceRectangle { .. } => axis,
        }
    }

    /// A place of the source around this point, mm.
    pub(crate) fn place(&self, centre: DVec3, axis: DVec3, dice: &Dice) -> DVec3 {
        let aside = match *self {
            Self::SourceDisc { radius_mm } => {
                let [u, v] = dice.pair(Draw::Light);
                radius_mm * u.sqrt() * DVec2::from_angle(TAU * v)
            }
            Self::SourceRectangle { size_mm } => (DVec2::from_array(dice.pair(Draw::Light)) - 0.5) * size_mm,
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
    fn mean(of: impl Fn(&Dice) -> DVec3) -> DVec3 {
        let n = 40_000;
        (0..n).map(|photon| of(&Dice { key: 7, photon })).sum::<DVec3>() / n as f64
    }

    #[test]
    fn moments_are_those_of_discs_rectangles_and_gaussians() {
        let axis = DVec3::new(0.3, -0.2, 0.9).normalize();
        let (x, y) = across(axis);
        assert!(x.dot(y).abs() < 1e-15 && x.dot(axis).abs() < 1e-15 && x.cross(y).dot(axis) > 0.999);
        let squares = |v: DVec3| DVec3::new(v.dot(x).powi(2), v.dot(y).powi(2), v.dot(x) * v.dot(y));
        let on = |spread: Spread| mean(|dice| squares(spread.direction(axis, dice)));
        let at = |spread: Spread| mean(|dice| squares(spread.place(DVec3::ZERO, axis, dice)));
        let near = |found: DVec3, wanted: DVec2| {
            // Fourth moments are at most thrice the square of the second.
            let tolerance = 5.0 * (2.0 / 40_000f64).sqrt() * wanted.max_element();
            assert!(
                (found.truncate() - wanted).abs().max_element() < tolerance && found.z.abs() < tolerance,
                "{found} {wanted}"
            );
        };
        near(on(Spread::AngularDisc { radius: 0.01 }), DVec2::splat(1e-4 / 4.0));
        near(on(Spread::AngularGaussian { rms: 0.01 }), DVec2::splat(1e-4));
        near(at(Spread::SourceDisc { radius_mm: 3.0 }), DVec2::splat(9.0 / 4.0));
        near(at(Spread::SourceRectangle { size_mm: DVec2::new(3.0, 1.0) }), DVec2::new(9.0, 1.0) / 12.0);
    }

    #[test]
    fn draws_are_uniform_and_independent() {
        let all = mean(|dice| {
            let ([a, b], [c, d]) = (dice.pair(Draw::Light), dice.pair(Draw::Finish));
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
        let (sun, lamp) = (Spread::AngularDisc { radius: 0.005 }, Spread::SourceDisc { radius_mm: 2.0 });
        assert!(sun.validate(&parallel).is_ok() && lamp.validate(&point).is_ok());
        assert!(matches!(sun.validate(&point), Err(SceneError::Needs(_))));
        assert!(matches!(lamp.validate(&parallel), Err(SceneError::Needs(_))));
        let wide = Spread::AngularDisc { radius: f64::NAN };
        assert!(matches!(wide.validate(&parallel), Err(SceneError::Value { .. })));
    }
}
