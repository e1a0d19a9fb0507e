//! What each step between the solver and the file does to the light, as one sheet: a bar and small
//! pictures for every step.

use super::{
    Exposure, difference_picture,
    ink::{Lettering, line, write_from},
    irradiance_picture,
};
use crate::grid::Field;
use glam::DVec2;
use image::{GrayImage, Luma, imageops};

/// One step of the budget.
#[derive(Clone, Debug)]
pub struct BudgetRow {
    /// What is looked at.
    pub name: String,
    /// The light that it draws, in picture order, mean 1, and its relative RMS error. `None` if it
    /// is known to be that of another step, as the name says.
    pub seen: Option<(Field<f64>, f64)>,
}

const MARGIN: u32 = 16;
/// Longer side of a small picture.
const SMALL: u32 = 150;
/// Height of a step without pictures.
const NOTE: u32 = 34;
const BARS: u32 = 560;
const TEXT: Lettering = Lettering { height: 11.0, grey: 30, halo: 0.0 };
const FINE: Lettering = Lettering { height: 8.5, grey: 110, halo: 0.0 };
/// Ends of the logarithmic axis of errors, as powers of ten.
const DECADES: (i32, i32) = (-4, 0);

/// Draws the steps from top to bottom: the light, its difference from the target (four times
/// enlarged, as in [`difference_picture`]), and the error as a bar on a logarithmic scale.
///
/// # Panics
/// If the pictures have another size than the target.
pub fn budget_sheet(target: &Field<f64>, steps: &[BudgetRow], exposure: Exposure) -> GrayImage {
    let scale = f64::from(SMALL) / target.nx().max(target.ny()) as f64;
    let small = |n: usize| ((n as f64 * scale).round() as u32).max(1);
    let (width, height) = (small(target.nx()), small(target.ny()));
    let rise = |step: &BudgetRow| if step.seen.is_some() { height.max(64) + 14 } else { NOTE };
    let left = 2 * (MARGIN + width) + 8;
    let head = 40;
    let total = head + steps.iter().map(rise).sum::<u32>() + MARGIN;
    let mut sheet = GrayImage::from_pixel(left + MARGIN + BARS + 90, total, Luma([255]));
    let decades = f64::from(DECADES.1 - DECADES.0);
    let along = |error: f64| {
        let power = (error.log10() - f64::from(DECADES.0)).clamp(0.0, decades);
        f64::from(left + MARGIN) + f64::from(BARS) * power / decades
    };
    for power in DECADES.0..=DECADES.1 {
        let x = along(10f64.powi(power));
        line(&mut sheet, DVec2::new(x, 34.0), DVec2::new(x, f64::from(total - MARGIN)), 0.3, 205);
        let label = format!("{:.*}", (-power).max(0) as usize, 10f64.powi(power));
        write_from(&mut sheet, DVec2::new(x - 12.0, 26.0), &label, FINE);
    }
    write_from(&mut sheet, DVec2::new(f64::from(left + MARGIN), 10.0), "relative RMS error", FINE);
    write_from(&mut sheet, DVec2::new(f64::from(MARGIN), 26.0), "the light", FINE);
    write_from(&mut sheet, DVec2::new(f64::from(2 * MARGIN + width), 26.0), "difference × 4", FINE);
    let mut top = head;
    for step in steps {
        let middle = f64::from(top) + 0.5 * f64::from(rise(step));
        let text_left = f64::from(left + MARGIN) + 4.0;
        if let Some((light, error)) = &step.seen {
            let pictures = [irradiance_picture(light, exposure), difference_picture(target, light, exposure)];
            for (k, picture) in (0u32..).zip(&pictures) {
                let shrunk = imageops::resize(picture, width, height, imageops::FilterType::Triangle);
                imageops::replace(&mut sheet, &shrunk, i64::from(MARGIN + k * (width + MARGIN)), i64::from(top));
            }
            write_from(&mut sheet, DVec2::new(text_left, middle - 18.0), &step.name, Lettering { halo: 2.0, ..TEXT });
            let (begin, end) = (DVec2::new(along(0.0), middle + 6.0), DVec2::new(along(*error), middle + 6.0));
            line(&mut sheet, begin, end, 6.0, 90);
            let value = if *error < 1e-3 { format!("{error:.5}") } else { format!("{error:.4}") };
            write_from(&mut sheet, end + DVec2::new(14.0, 0.0), &value, Lettering { halo: 2.0, ..TEXT });
        } else {
            write_from(&mut sheet, DVec2::new(text_left, middle), &step.name, Lettering { halo: 2.0, ..TEXT });
        }
        top += rise(step);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irradiance::{TargetIrradiance, Transfer};

    #[test]
    fn greater_errors_have_longer_bars() {
        let target = TargetIrradiance::new(Field::from_fn(60, 40, |i, _| 1.0 + i as f64)).unwrap();
        let step = |error: f64| BudgetRow { name: "step".into(), seen: Some((target.cells().clone(), error)) };
        let note = BudgetRow { name: "the same".into(), seen: None };
        let exposure = Exposure::of(&target, Transfer::Linear);
        let sheet = budget_sheet(target.cells(), &[step(1e-3), step(1e-1), note], exposure);
        let ink = |rows: std::ops::Range<u32>| {
            let bars = 2 * (MARGIN + SMALL) + 30..sheet.width();
            rows.flat_map(|j| bars.clone().map(move |i| (i, j)))
                .filter(|&(i, j)| sheet.get_pixel(i, j).0[0] == 90)
                .count()
        };
        let (short, long) = (ink(40..154), ink(154..268));
        // One decade against three; six pixels at the beginning are not counted, and edges are
        // grey.
        let ratio = long as f64 / short as f64;
        assert!(short > 1000 && (2.95..3.15).contains(&ratio), "{short} {long}");
        // Letters may have a pixel of a bar's grey.
        assert!(ink(268..sheet.height()) < 20);
    }
}
