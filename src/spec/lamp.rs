//! Where light comes from, as a person says it.

use super::{
    angle::Angle,
    quantity::{names, read_as_text},
};
use clap::ValueEnum;
use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

/// What light there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LightName {
    /// Light from far away: the sun, a collimated lamp
    #[default]
    Parallel,
    /// Light from one place: a torch, an LED, a candle
    Point,
}

read_as_text!(Emission);
names!(LightName, "kind of light");

impl LightName {
    /// A kind of light, as a flag.
    pub(super) fn of_flag(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("sun") {
            return Err("the sun is parallel light of a size: write --source-size sun".into());
        }
        text.parse().map_err(|error: String| format!("{error}; it is parallel or point"))
    }
}

/// How a lamp shines: its flux per solid angle by the angle to its axis, which points at the middle
/// of the block.
#[derive(Clone, Debug, PartialEq)]
pub enum Emission {
    /// The same in every direction.
    Isotropic,
    /// As the cosine: a small flat emitter.
    Lambertian,
    /// A Gaussian, half as bright at this angle.
    Gaussian(Angle),
    /// As its maker measured it.
    Ies(PathBuf),
}

impl FromStr for Emission {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_ies = Path::new(text).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ies"));
        match text.split_once(':') {
            Some(("gaussian", half)) => Ok(Self::Gaussian(half.parse()?)),
            _ if text == "isotropic" => Ok(Self::Isotropic),
            _ if text == "lambertian" => Ok(Self::Lambertian),
            _ if is_ies => Ok(Self::Ies(text.into())),
            _ => Err(format!(
                "'{text}' is no emission; write isotropic, lambertian, gaussian:12deg, or a file's name with .ies"
            )),
        }
    }
}

impl fmt::Display for Emission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Isotropic => f.write_str("isotropic"),
            Self::Lambertian => f.write_str("lambertian"),
            Self::Gaussian(half) => write!(f, "gaussian:{half}"),
            Self::Ies(path) => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emissions_are_read_as_they_are_written() {
        for text in ["isotropic", "lambertian", "gaussian:12deg", "lamps/torch.ies"] {
            assert_eq!(text.parse::<Emission>().unwrap().to_string(), text);
        }
        for text in ["", "gauss", "gaussian", "gaussian:", "torch.txt"] {
            assert!(text.parse::<Emission>().is_err(), "{text}");
        }
    }
}
