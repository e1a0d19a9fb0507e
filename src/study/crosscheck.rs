//! What other renderers say of a block: for programs, and against limits.

use crate::{failure::Failure, record::document};
use glam::DVec2;
use glasswarp_verify::crosscheck::{Distances, ImageAgreement, ImageLevel, MapAgreement};

/// Pixels along x and y over an area of this size, so many across: multiples of 8, because images
/// are compared at means of 8 x 8 too.
pub fn pixels_over(size: DVec2, across: u32) -> (usize, usize) {
    let eight = |pixels: f64| (pixels / 8.0).ceil().max(8.0) as usize * 8;
    let nx = eight(f64::from(across));
    (nx, eight(nx as f64 * size.y / size.x))
}

/// How landing points agree, for programs.
pub fn map_document(agreement: &MapAgreement) -> document::MapAgreement {
    let distances = |d: &Distances| document::Distances {
        rms_mm: document::finite(d.rms_mm),
        worst_mm: document::finite(d.worst_mm),
    };
    document::MapAgreement {
        rays: agreement.rays,
        contested: agreement.contested,
        smooth: distances(&agreement.smooth),
        spline: distances(&agreement.spline),
    }
}

/// How caustics agree at every number of pixels, for programs.
pub fn levels_document(agreement: &ImageAgreement) -> Vec<document::ImageLevel> {
    let level = |level: &ImageLevel| document::ImageLevel {
        pixels: level.pixels,
        rel_rms: document::finite(level.rel_rms),
        noise: document::finite(level.noise),
        without_noise: document::finite(level.without_noise),
    };
    agreement.levels.iter().map(level).collect()
}

/// Rays that may land by one of both only, as a part of all.
const CONTESTED: f64 = 1e-3;

/// Fails if landing points differ by more than a limit, mm rms, or more than one ray in a thousand
/// lands by one of both only.
///
/// # Errors
/// See above.
pub fn demand_map(agreement: &MapAgreement, limit: Option<f64>) -> Result<(), Failure> {
    let Some(limit) = limit else { return Ok(()) };
    let rms = agreement.smooth.rms_mm;
    if rms.is_nan() || rms > limit {
        let what =
            format!("the landing points differ by {rms:.5} mm rms, above the limit of {limit} (`max-difference`)");
        return Err(Failure::BelowThreshold(what));
    }
    let (contested, rays) = (agreement.contested, agreement.rays);
    if contested as f64 > CONTESTED * rays as f64 {
        return Err(Failure::BelowThreshold(format!("{contested} rays land by one of both only, {rays} by both")));
    }
    Ok(())
}

/// Fails if caustics differ by more than a limit, as relative RMS at a quarter of the pixels.
///
/// # Errors
/// See above; too few pixels to compare.
pub fn demand_image(agreement: &ImageAgreement, limit: Option<f64>) -> Result<(), Failure> {
    let Some(limit) = limit else { return Ok(()) };
    let level = agreement.levels.get(1).ok_or_else(|| {
        Failure::Usage("there are too few pixels to compare (`max-difference`): take more `pixels`".into())
    })?;
    if level.rel_rms.is_nan() || level.rel_rms > limit {
        return Err(Failure::BelowThreshold(format!(
            "the caustics differ by {:.4} (relative RMS at {} pixels), above the limit of {limit} (`max-difference`)",
            level.rel_rms, level.pixels
        )));
    }
    Ok(())
}
