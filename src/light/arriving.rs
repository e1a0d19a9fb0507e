//! How rays arrive at a block, and the profile of a light that is known by them.

use super::{
    profile::{Profile, ProfileError},
    source::Intensity,
    wave::PointWave,
};
use crate::{
    bench::{Bench, ExitFace},
    grid::{Field, bilinear},
};
use glam::{DVec2, DVec3};

/// Nodes of a profile along each side of the block.
const NODES: usize = 513;

/// A ray before it meets the block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// Unit vector along which it travels in air.
    pub direction: DVec3,
    /// Where it meets the plane of the entry face; of a mirror, its mean plane, mm.
    pub entry_mm: DVec2,
    /// Flux per area of that plane, up to a constant, without a profile.
    pub irradiance: f64,
}

impl Profile {
    /// The profile of a bench's light whose flux differs from the light's own by a factor `of`
    /// every ray. `thickness_mm` is that from the entry face to the mean exit plane: light from the
    /// side enters elsewhere than it leaves.
    ///
    /// # Errors
    /// Factors that are no light, or leave a part of the block dark; a bench behind known faces.
    pub fn of(bench: &Bench, thickness_mm: f64, of: impl Fn(&Arriving) -> f64) -> Result<Self, ProfileError> {
        if !bench.known_faces().is_empty() {
            return Err(ProfileError::Passed);
        }
        let (extent, n) = (bench.block(), NODES);
        let light = bench.even_incidence();
        let wave = bench.wave();
        let mut mean = 0.0;
        let mut lowest = (f64::INFINITY, DVec2::ZERO);
        let mut data = Vec::with_capacity(n * n);
        for k in 0..n * n {
            let at_mm = extent.node(k % n, k / n, n, n);
            let incoming = light.at(at_mm.extend(0.0));
            let arriving = arriving(bench, wave.as_ref(), thickness_mm, at_mm, incoming.direction);
            let value = of(&arriving);
            if !(value.is_finite() && value >= 0.0) {
                return Err(ProfileError::Value { at_mm, value });
            }
            let flux = value * incoming.flux(DVec2::ZERO);
            mean += flux / (n * n) as f64;
            if flux < lowest.0 {
                lowest = (flux, at_mm);
            }
            data.push(value);
        }
        let share = if mean > 0.0 { lowest.0 / mean } else { 0.0 };
        if share < Self::LEAST {
            return Err(ProfileError::Dark { at_mm: lowest.1, share });
        }
        let whole: f64 = data.iter().sum::<f64>() / (n * n) as f64;
        Ok(Self::new(extent, Field::from_vec(n, n, data).map(|v| v / whole)))
    }

    /// The profile of a light whose irradiance on the entry face has been measured: `picture`, row
    /// along `+y`, spans the block.
    ///
    /// # Errors
    /// Those of [`Profile::of`], or too few pixels.
    pub fn measured(bench: &Bench, thickness_mm: f64, picture: &Field<f64>) -> Result<Self, ProfileError> {
        let (nx, ny) = (picture.nx(), picture.ny());
        if nx.min(ny) < 2 {
            return Err(ProfileError::TooSmall { nx, ny });
        }
        let block = bench.block();
        let pixels = DVec2::new(nx as f64, ny as f64);
        Self::of(bench, thickness_mm, |ray| {
            let at = (ray.entry_mm - block.lower()) / block.as_vec() * pixels - 0.5;
            bilinear(picture, at) / ray.irradiance
        })
    }
}

/// The ray in air that crosses the mean plane at `at_mm`, there along `inside`.
fn arriving(bench: &Bench, wave: Option<&PointWave>, thickness_mm: f64, at_mm: DVec2, inside: DVec3) -> Arriving {
    let thickness_mm = if bench.exit_face() == ExitFace::Reflects { 0.0 } else { thickness_mm };
    let tangential = inside.truncate() * bench.exit_face().ior();
    let axial = (1.0 - tangential.length_squared()).max(0.0).sqrt();
    let direction = tangential.extend(axial.copysign(inside.z));
    let entry_mm = at_mm - inside.truncate() * (thickness_mm / inside.z.abs());
    let irradiance = wave.map_or(1.0, |wave| {
        let air_mm = if bench.exit_face() == ExitFace::Reflects { wave.origin_mm } else { wave.air_mm };
        let ray = (entry_mm - wave.source).extend(air_mm);
        let even = air_mm / (ray.length_squared() * ray.length());
        match wave.intensity {
            Intensity::Isotropic => even,
            Intensity::Lambertian => even * air_mm / ray.length(),
        }
    });
    Arriving { direction, entry_mm, irradiance }
}
