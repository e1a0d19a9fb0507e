//! Lengths as people write them.

use super::quantity::{finite, number_and_unit, number_or_text};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::{fmt, str::FromStr};

/// A length as a person writes it: `250mm`, `25cm`, `0.25m`, `9.8in`; a bare number is millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Length {
    /// Millimetres.
    pub mm: f64,
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit) = number_and_unit(text, '"');
        let scale = match unit {
            "" | "mm" => 1.0,
            "cm" => 10.0,
            "m" => 1000.0,
            "in" | "\"" => 25.4,
            other => return Err(format!("unknown unit '{other}'; use mm, cm, m or in (a bare number is mm)")),
        };
        Ok(Self { mm: finite(number)? * scale })
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} mm", self.mm)
    }
}

impl Serialize for Length {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{}mm", self.mm))
    }
}

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(
            deserializer,
            "a length such as \"100mm\", \"10cm\", \"4in\", or a number of millimetres",
            |mm| Ok(Self { mm }),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_with_their_units() {
        for (text, mm) in [
            ("100", 100.0),
            ("100mm", 100.0),
            ("10 cm", 100.0),
            ("0.1m", 100.0),
            ("4in", 101.6),
            ("1e2", 100.0),
            ("-5mm", -5.0),
        ] {
            let length: Length = text.parse().unwrap();
            assert!((length.mm - mm).abs() < 1e-9, "{text} is {length}");
        }
        for text in ["", "mm", "ten", "5 furlongs", "nan", "inf", "1e999", "5mmm"] {
            assert!(text.parse::<Length>().is_err(), "{text} was taken");
        }
    }
}
