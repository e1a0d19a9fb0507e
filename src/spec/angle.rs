//! Angles as people write them.

use super::quantity::{finite, number_and_unit, number_or_text};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::{fmt, str::FromStr};

/// An angle as a person writes it: `30deg`, `0.5rad`, `8mrad`, `16arcmin`; a bare number is
/// degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle {
    /// Degrees.
    pub deg: f64,
}

impl Angle {
    /// The same in radians.
    pub fn radians(self) -> f64 {
        self.deg.to_radians()
    }
}

impl FromStr for Angle {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit) = number_and_unit(text, '\u{b0}');
        let scale = match unit {
            "" | "deg" | "\u{b0}" => 1.0,
            "arcmin" => 1.0 / 60.0,
            "rad" => 1f64.to_degrees(),
            "mrad" => 1e-3_f64.to_degrees(),
            other => {
                return Err(format!("unknown unit '{other}'; use deg, arcmin, mrad or rad (a bare number is degrees)"));
            }
        };
        Ok(Self { deg: finite(number)? * scale })
    }
}

impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}deg", self.deg)
    }
}

/// An inclination and the side to which it points: `30deg` or `30deg,90deg`. The side is counted
/// from the picture's top, clockwise as one sees the picture on the wall from the block: 0 top, 90
/// right, 180 bottom, 270 left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inclination {
    /// How far it leans.
    pub by: Angle,
    /// To which side.
    pub side: Angle,
}

impl Inclination {
    /// The side as a unit vector across the axis: top is +y, right is -x.
    pub fn towards(self) -> glam::DVec2 {
        // Whole quarters to the last digit.
        let quarters = self.side.deg / 90.0;
        let (sin, cos) = if quarters.fract() == 0.0 {
            [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.rem_euclid(4.0) as usize]
        } else {
            self.side.radians().sin_cos()
        };
        glam::DVec2::new(-sin, cos)
    }
}

impl FromStr for Inclination {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (by, side) = text.split_once(',').unwrap_or((text, "0"));
        Ok(Self { by: by.parse()?, side: side.parse()? })
    }
}

impl fmt::Display for Inclination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.by, self.side)
    }
}

impl Serialize for Inclination {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Inclination {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(
            deserializer,
            "an angle such as \"30deg\", with a side \"30deg,90deg\", or a number of degrees",
            |deg| Ok(Self { by: Angle { deg }, side: Angle { deg: 0.0 } }),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_take_their_units() {
        for (text, deg) in
            [("30", 30.0), ("30deg", 30.0), ("0.5rad", 28.6479), ("8mrad", 0.458366), ("32arcmin", 0.53333)]
        {
            let angle: Angle = text.parse().unwrap();
            assert!((angle.deg - deg).abs() < 1e-4, "{text}: {angle}");
        }
        for text in ["", "deg", "30mm", "nan", "inf deg"] {
            assert!(text.parse::<Angle>().is_err(), "{text}");
        }
    }

    #[test]
    fn sides_go_round_with_the_clock_as_seen_on_the_wall() {
        let towards = |text: &str| text.parse::<Inclination>().unwrap().towards();
        assert!((towards("10") - glam::DVec2::Y).length() < 1e-15, "top");
        assert!((towards("10deg,90deg") + glam::DVec2::X).length() < 1e-15, "right is -x");
        assert_eq!(towards("10deg,-90deg"), glam::DVec2::X, "and left +x, to the last digit");
        assert!((towards("10,180") + glam::DVec2::Y).length() < 1e-15, "bottom");
        let text = "12.5deg,270deg".parse::<Inclination>().unwrap().to_string();
        assert_eq!(text.parse::<Inclination>(), "12.5,270".parse());
    }
}
