//! Where light comes from, as a person says it.

use super::{angle::Angle, console, error::Failure, quantity::read_as_text};
use clap::ValueEnum;
use glasswarp::light::Photometry;
use serde::Deserialize;
use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LightName {
    /// Light from far away: the sun, a collimated lamp
    #[default]
    Parallel,
    /// Light from one place: a torch, an LED, a candle
    Point,
}

read_as_text!(Emission);

/// How a lamp shines: its flux per solid angle by the angle to its axis, which points at the middle of the block.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Emission {
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

/// The same with its file read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Lamp {
    Isotropic,
    Lambertian,
    /// Half angle, radians.
    Gaussian(f64),
    Measured(Photometry),
}

impl Lamp {
    /// # Errors
    /// A half angle out of range, an IES file that cannot be read.
    pub(crate) fn open(emission: &Emission) -> Result<Self, Failure> {
        let lamp = Self::read(emission)?;
        if let (Self::Measured(lamp), Emission::Ies(path)) = (&lamp, emission)
            && lamp.asymmetry() > 0.05
        {
            console::warn(format_args!(
                "the planes of {} differ by up to {:.0} % of the peak; their mean is used, as for a lamp without a top",
                path.display(),
                100.0 * lamp.asymmetry()
            ));
        }
        Ok(lamp)
    }

    /// The same without a word on a lamp that is not round.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub(crate) fn read(emission: &Emission) -> Result<Self, Failure> {
        match emission {
            Emission::Isotropic => Ok(Self::Isotropic),
            Emission::Lambertian => Ok(Self::Lambertian),
            Emission::Gaussian(half) if (0.1..=89.0).contains(&half.deg) => Ok(Self::Gaussian(half.radians())),
            Emission::Gaussian(half) => Err(Failure::Usage(format!(
                "the half angle of the lamp's beam (--emission) is {half}; it must lie between 0.1deg and 89deg"
            ))),
            Emission::Ies(path) => {
                let bytes = std::fs::read(path).map_err(|source| Failure::reading(path, source))?;
                let read = Photometry::parse_ies(&String::from_utf8_lossy(&bytes));
                read.map(Self::Measured).map_err(|error| Failure::Io {
                    what: format!("{} is no photometry that can be used", path.display()),
                    source: error.into(),
                })
            }
        }
    }

    /// Intensity at an angle to the axis, radians, up to a constant.
    pub(crate) fn intensity(&self, angle: f64) -> f64 {
        match self {
            Self::Isotropic => 1.0,
            Self::Lambertian => angle.cos().max(0.0),
            Self::Gaussian(half) => (-(angle / half).powi(2) * std::f64::consts::LN_2).exp(),
            Self::Measured(lamp) => lamp.candela_at(angle),
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
        assert!(Lamp::open(&Emission::Gaussian(Angle { deg: 0.0 })).is_err());
        let half = Lamp::open(&Emission::Gaussian(Angle { deg: 10.0 })).unwrap();
        assert!((half.intensity(10f64.to_radians()) - 0.5).abs() < 1e-12);
    }
}
