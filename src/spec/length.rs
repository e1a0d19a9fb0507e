//! Lengths as people write them.

use super::quantity::{finite, number_and_unit, number_or_text};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::{fmt, str::FromStr};

/// A length as a person writes it: `250mm`, `25cm`, `0.25m`, `9.8in`, `50um`; a bare number is
/// millimetres, and a decimal comma does as well.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Length {
    /// Millimetres.
    pub mm: f64,
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit) = number_and_unit(text, '"');
        let value = finite(number)
            .map_err(|_| format!("'{text}' is no length: a number and um, mm, cm, m or in (a bare number is mm)"))?;
        let scale = match unit {
            "" | "mm" => 1.0,
            "um" | "\u{b5}m" | "\u{3bc}m" => 1e-3,
            "cm" => 10.0,
            "m" => 1000.0,
            "in" | "\"" => 25.4,
            other => return Err(format!("unknown unit '{other}'; use um, mm, cm, m or in (a bare number is mm)")),
        };
        Ok(Self { mm: value * scale })
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

/// A small length as a person writes it: `0.05um`, `50nm`, or with any unit of a [`Length`]; a bare
/// number is micrometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallLength {
    /// Micrometres.
    pub um: f64,
}

impl FromStr for SmallLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let um = match number_and_unit(text, '"') {
            (number, "") => finite(number)?,
            (number, "nm") => 1e-3 * finite(number)?,
            _ => 1e3 * text.parse::<Length>()?.mm,
        };
        Ok(Self { um })
    }
}

impl fmt::Display for SmallLength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}um", self.um)
    }
}

impl Serialize for SmallLength {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for SmallLength {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(deserializer, "a small length such as \"0.05um\", or a number of micrometres", |um| {
            Ok(Self { um })
        })
    }
}

/// The feed of a cutter as a person writes it: `2000mm/min`, `2m/min`, `80in/min`; without a time
/// it is that of a minute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feed {
    /// Millimetres per minute.
    pub mm_per_minute: f64,
}

impl FromStr for Feed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (length, per_minute) = match text.split_once('/') {
            None => (text, 1.0),
            Some((length, "min")) => (length, 1.0),
            Some((length, "s")) => (length, 60.0),
            Some((_, time)) => return Err(format!("unknown time '{time}'; use mm/min or mm/s")),
        };
        let mm_per_minute = length.trim().parse::<Length>()?.mm * per_minute;
        if mm_per_minute <= 0.0 {
            return Err(format!("a feed of {mm_per_minute} mm/min gets nowhere"));
        }
        Ok(Self { mm_per_minute })
    }
}

impl<'de> Deserialize<'de> for Feed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(deserializer, "a feed such as \"2000mm/min\"", |number| number.to_string().parse())
    }
}

impl fmt::Display for Feed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} mm/min", self.mm_per_minute)
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
            ("8,5cm", 85.0),
            ("50um", 0.05),
        ] {
            let length: Length = text.parse().unwrap();
            assert!((length.mm - mm).abs() < 1e-9, "{text} is {length}");
        }
        for text in ["", "mm", "ten", "5 furlongs", "nan", "inf", "1e999", "5mmm"] {
            assert!(text.parse::<Length>().is_err(), "{text} was taken");
        }
    }

    #[test]
    fn feeds_are_those_of_a_minute() {
        for (text, mm_per_minute) in
            [("2000mm/min", 2000.0), ("2000", 2000.0), ("2m/min", 2000.0), ("20mm/s", 1200.0), ("10in/min", 254.0)]
        {
            assert!((text.parse::<Feed>().unwrap().mm_per_minute - mm_per_minute).abs() < 1e-9, "{text}");
        }
        for text in ["0", "-5mm/min", "2m/h", "fast"] {
            assert!(text.parse::<Feed>().is_err(), "{text}");
        }
    }

    #[test]
    fn small_lengths_are_micrometres() {
        for (text, um) in [("0.05", 0.05), ("0.05um", 0.05), ("50nm", 0.05), ("0.001mm", 1.0), ("0,5um", 0.5)] {
            assert!((text.parse::<SmallLength>().unwrap().um - um).abs() < 1e-12, "{text}");
        }
        assert!("a little".parse::<SmallLength>().is_err());
    }
}
