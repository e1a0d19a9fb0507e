//! An error budget with small pictures of the light after every step.

use super::{
    budget::{Cost, chart},
    pictures::{Exposure, difference_picture, irradiance_picture},
};
use crate::grid::Field;
use image::{GrayImage, imageops};

/// Longer side of a small picture.
const SMALL: u32 = 150;

/// The [chart](super::budget::budget_chart) of steps with the light of those that have one, in picture order and of mean 1, and its
/// difference from the target (four times enlarged, as in [`difference_picture`]).
///
/// # Panics
/// If the pictures have another size than the target.
pub fn budget_sheet(target: &Field<f64>, steps: &[(Cost, Option<Field<f64>>)], exposure: Exposure) -> GrayImage {
    let scale = f64::from(SMALL) / target.nx().max(target.ny()) as f64;
    let small = |n: usize| ((n as f64 * scale).round() as u32).max(1);
    let (width, height) = (small(target.nx()), small(target.ny()));
    let shrunk = |picture| imageops::resize(&picture, width, height, imageops::FilterType::Triangle);
    let pictures = |light: &Field<f64>| {
        vec![shrunk(irradiance_picture(light, exposure)), shrunk(difference_picture(target, light, exposure))]
    };
    let rows: Vec<_> =
        steps.iter().map(|(cost, light)| (cost, light.as_ref().map(pictures).unwrap_or_default())).collect();
    chart(&rows, &["the light, as on the wall", "difference × 4"], (width, height)).raster()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::budget::{BAR, BARS, CostErrors, HEAD, MARGIN, THICK};
    use crate::{
        irradiance::{TargetIrradiance, Transfer},
        measured::within_tenth_of,
    };

    #[test]
    fn greater_errors_have_longer_bars() {
        let target = TargetIrradiance::new(Field::from_fn(60, 40, |i, _| 1.0 + i as f64)).unwrap();
        let step = |error: f64| {
            let errors = CostErrors { rel_rms: error, ssim: 0.5, moved: error };
            (Cost { name: "step".into(), errors: Some(errors) }, Some(target.cells().clone()))
        };
        let note = (Cost { name: "the same".into(), errors: None }, None);
        let exposure = Exposure::of(&target, Transfer::Linear);
        let sheet = budget_sheet(target.cells(), &[step(1e-3), step(1e-1), note], exposure);
        let ink = |rows: std::ops::Range<u32>| {
            let bars = 2 * (MARGIN + SMALL)..sheet.width();
            rows.flat_map(|j| bars.clone().map(move |i| (i, j)))
                .filter(|&(i, j)| sheet.get_pixel(i, j).0[0] == BAR)
                .count()
        };
        let rows = [HEAD, HEAD + 114, HEAD + 228];
        let (short, long) = (ink(rows[0]..rows[1]), ink(rows[1]..rows[2]));
        // A digit differs, and letters have pixels of a bar's grey.
        let longer = (0.1_f64.sqrt() - 0.001_f64.sqrt()) * BARS * THICK;
        assert!(short > 150, "{short}");
        within_tenth_of(3.4545, (long as f64 - short as f64 - longer).abs(), format_args!("{short} {long}"));
        assert!(ink(rows[2]..sheet.height()) < 20);
    }
}
