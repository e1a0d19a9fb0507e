//! How the lamp of a bench shines.

use crate::{
    failure::Failure,
    light::Photometry,
    record::EmissionRecord,
    spec::{Emission, Host},
};

/// How a lamp shines, its file read.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Lamp {
    Isotropic,
    Lambertian,
    /// Half angle, radians.
    Gaussian(f64),
    Measured(Photometry),
}

impl Lamp {
    /// # Errors
    /// A half angle out of range, an IES file that cannot be read.
    pub(super) fn open(emission: &Emission, host: &dyn Host) -> Result<Self, Failure> {
        let lamp = Self::read(emission, host)?;
        if let (Self::Measured(lamp), Emission::Ies(path)) = (&lamp, emission)
            && lamp.asymmetry() > 0.05
        {
            host.warn(&format!(
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
    pub(super) fn read(emission: &Emission, host: &dyn Host) -> Result<Self, Failure> {
        match emission {
            Emission::Isotropic => Ok(Self::Isotropic),
            Emission::Lambertian => Ok(Self::Lambertian),
            Emission::Gaussian(half) if (0.1..=89.0).contains(&half.deg) => Ok(Self::Gaussian(half.radians())),
            Emission::Gaussian(half) => Err(Failure::Usage(format!(
                "the half angle of the lamp's beam (`emission`) is {half}; it must lie between 0.1deg and 89deg"
            ))),
            Emission::Ies(path) => {
                let read = Photometry::parse_ies(&String::from_utf8_lossy(&host.bytes(path)?));
                read.map(Self::Measured).map_err(|error| Failure::Io {
                    what: format!("{} is no photometry that can be used", path.display()),
                    source: error.into(),
                })
            }
        }
    }

    /// The same for programs.
    pub(super) fn record(&self) -> EmissionRecord {
        match self {
            Self::Isotropic => EmissionRecord::Isotropic,
            Self::Lambertian => EmissionRecord::Lambertian,
            Self::Gaussian(half_angle) => EmissionRecord::Gaussian { half_angle: *half_angle },
            Self::Measured(lamp) => EmissionRecord::Table { table: lamp.table().map(Into::into).collect() },
        }
    }

    /// Intensity at an angle to the axis, radians, up to a constant.
    pub(super) fn intensity(&self, angle: f64) -> f64 {
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
    use crate::spec::Angle;
    use std::{io, path::Path};

    struct NoFiles;

    impl Host for NoFiles {
        fn read(&self, _: &Path) -> io::Result<Vec<u8>> {
            Err(io::ErrorKind::NotFound.into())
        }
    }

    #[test]
    fn a_gaussian_lamp_is_half_as_bright_at_its_half_angle() {
        assert!(Lamp::open(&Emission::Gaussian(Angle { deg: 0.0 }), &NoFiles).is_err());
        let half = Lamp::open(&Emission::Gaussian(Angle { deg: 10.0 }), &NoFiles).unwrap();
        assert!((half.intensity(10f64.to_radians()) - 0.5).abs() < 1e-12);
    }
}
