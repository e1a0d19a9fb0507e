//! Wavelengths as a person writes them.

use super::quantity::number_or_text;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::{fmt, str::FromStr};

/// A wavelength as a person writes it: `532nm`; a bare number is nanometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelength {
    /// Nanometres.
    pub nm: f64,
}

/// Wavelengths for which dispersion is known of most materials, nm.
pub const VISIBLE_NM: (f64, f64) = (400.0, 700.0);

impl FromStr for Wavelength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.trim().strip_suffix("nm").unwrap_or(text).trim();
        match number.parse::<f64>() {
            Ok(nm) if (VISIBLE_NM.0..=VISIBLE_NM.1).contains(&nm) => Ok(Self { nm }),
            Ok(nm) => Err(format!(
                "{nm} nm is no visible light; it must lie between {} and {} nm",
                VISIBLE_NM.0, VISIBLE_NM.1
            )),
            Err(_) => Err(format!("'{text}' is no wavelength; write 532nm (a bare number is nanometres)")),
        }
    }
}

impl fmt::Display for Wavelength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}nm", self.nm)
    }
}

impl Serialize for Wavelength {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Wavelength {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(deserializer, "a wavelength such as \"532nm\", or a number of nanometres", |nm| {
            nm.to_string().parse()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavelengths_are_read_with_their_unit_and_their_limits() {
        assert_eq!("532nm".parse(), Ok(Wavelength { nm: 532.0 }));
        assert_eq!(" 632.8 nm ".parse(), Ok(Wavelength { nm: 632.8 }));
        for text in ["", "nm", "532um", "1064nm", "nan"] {
            assert!(text.parse::<Wavelength>().is_err(), "{text}");
        }
    }
}
