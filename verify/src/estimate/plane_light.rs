//! The light as it passes planes on its way: where it is brightest is where it may burn.

use super::{beams::beams, flux::Flux};
use crate::{
    image::Image,
    scene::{SceneError, Window},
    trace::{End, Tracer},
};
use glam::DVec2;
use rayon::prelude::*;

/// Rays along each side that tell where the light is.
const RAYS: usize = 128;
/// Pixels around it that are dark, for what passes between those rays.
const MARGIN: f64 = 2.0;
/// Least size of what is taken for the light, mm.
const LEAST_MM: f64 = 1e-3;

/// The light as it passes a plane across the axis.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlaneLight {
    /// The plane, mm, on the bench.
    pub z_mm: f64,
    /// The part of the plane that holds all of the light.
    pub window: Window,
    /// Irradiance there, in units of the mean irradiance over the [aperture](Tracer::aperture_mm).
    pub image: Image,
    /// The greatest irradiance of a pixel, in the same units: a finer image may show more.
    pub peak: f64,
    /// The centre of that pixel, mm from the axis.
    pub peak_at_mm: DVec2,
    /// Where the light of the aperture went that does not pass the window.
    pub flux: Flux,
}

/// Looks at the light on the plane across the axis at `z_mm`, which [`Tracer::on_plane`] explains,
/// by as many [`beams`] as that, in a picture of `pixels` along the longer side of a window around
/// all of the light.
///
/// # Errors
/// Those of [`Tracer::on_plane`]; [`SceneError::Dark`] where no light passes.
pub fn light_on_plane(
    tracer: &Tracer,
    z_mm: f64,
    (nx, ny): (usize, usize),
    pixels: usize,
) -> Result<PlaneLight, SceneError> {
    let anywhere = Window { size_mm: DVec2::ONE, centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
    let on_plane = tracer.on_plane(z_mm, anywhere)?;
    on_plane.prepare();
    let (lower, upper) = tracer.aperture_mm();
    let landing = |k: usize| {
        let place = DVec2::new((k % (RAYS + 1)) as f64, (k / (RAYS + 1)) as f64) / RAYS as f64;
        let path = on_plane.path_at(lower * (1.0 - place) + upper * place);
        match path.end {
            End::Receiver(at) if path.power > 0.0 && at.is_finite() => (at, at),
            _ => (DVec2::INFINITY, DVec2::NEG_INFINITY),
        }
    };
    let nowhere = || (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let around = |(a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)| (a.min(c), b.max(d));
    let (least, greatest) = (0..(RAYS + 1).pow(2)).into_par_iter().map(landing).reduce(nowhere, around);
    if !(greatest - least).is_finite() {
        return Err(SceneError::Dark);
    }
    // A focus has a size too.
    let extent = (greatest - least).max(DVec2::splat(LEAST_MM));
    let pixel_mm = extent.max_element() / (pixels as f64 - 2.0 * MARGIN).max(1.0);
    let across = |extent: f64| (extent / pixel_mm + 2.0 * MARGIN).ceil();
    let counts = DVec2::new(across(extent.x), across(extent.y));
    let window = Window {
        size_mm: pixel_mm * counts,
        centre_mm: 0.5 * (least + greatest),
        nx: counts.x as usize,
        ny: counts.y as usize,
    };
    let seen = beams(&tracer.on_plane(z_mm, window)?, nx, ny);
    let aperture = upper - lower;
    // From parts of the light over the window to parts over the aperture.
    let scale = aperture.x * aperture.y / (window.size_mm.x * window.size_mm.y);
    let mut image = seen.image;
    image.values.iter_mut().for_each(|value| *value *= scale);
    let brightest = (0..image.values.len()).max_by(|&a, &b| image.values[a].total_cmp(&image.values[b])).unwrap_or(0);
    let pixel = DVec2::new((brightest % window.nx) as f64, (brightest / window.nx) as f64) + 0.5;
    Ok(PlaneLight {
        z_mm,
        window,
        peak: image.values[brightest],
        peak_at_mm: window.corners_mm()[1] - pixel * pixel_mm,
        image,
        flux: seen.flux,
    })
}
