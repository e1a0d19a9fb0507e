//! Numbers for other programs: glasswarp itself finds them in the settings and in the block's file.

use super::hash_of;
use crate::cli::{
    error::Failure,
    lamp::{self, Lamp, LightName},
    settings::Settings,
};
use glasswarp::solid::Solid;
use std::fmt::Arguments;

/// The grid of the exit face, and its corners.
pub(super) fn face(line: &mut impl FnMut(Arguments<'_>) -> Result<(), Failure>, solid: &Solid) -> Result<(), Failure> {
    let (heights, corner) = (solid.surface().heights_mm(), solid.surface().contour().radius_mm());
    line(format_args!("nodes = {:?} # of the exit face with its skirt, along x and y", [heights.nx(), heights.ny()]))?;
    line(format_args!(
        "corner-radius-mm = {:?} # semi-axes of the elliptic corners of the exit face with its skirt",
        corner.to_array()
    ))
}

/// How a point source shines, where no picture of its beam says so.
pub(super) fn emission(
    line: &mut impl FnMut(Arguments<'_>) -> Result<(), Failure>,
    settings: &Settings,
) -> Result<(), Failure> {
    if settings.light() != LightName::Point || settings.beam.is_some() {
        return Ok(());
    }
    let (name, numbers) = match Lamp::read(settings.emission.as_ref().unwrap_or(&lamp::Emission::Isotropic))? {
        Lamp::Isotropic => ("isotropic", None),
        Lamp::Lambertian => ("lambertian", None),
        Lamp::Gaussian(half) => {
            ("gaussian", Some(format!("emission-half-angle = {half:?} # radians, where half of the intensity is left")))
        }
        Lamp::Measured(lamp) => {
            let table: Vec<[f64; 2]> = lamp.table().map(Into::into).collect();
            ("table", Some(format!("emission-table = {table:?} # radians, and the intensity there")))
        }
    };
    line(format_args!("emission = \"{name}\" # intensity by the angle to light-direction"))?;
    numbers.map_or(Ok(()), |numbers| line(format_args!("{numbers}")))
}

/// The hash of the beam's picture, if there is one.
pub(super) fn beam(
    line: &mut impl FnMut(Arguments<'_>) -> Result<(), Failure>,
    settings: &Settings,
) -> Result<(), Failure> {
    match &settings.beam {
        Some(path) => line(format_args!("beam-sha256 = \"{}\" # of the picture of the beam", hash_of(path)?)),
        None => Ok(()),
    }
}
