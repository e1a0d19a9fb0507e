//! What each step between the solver and the file does to the light: a bar for every step, and small
//! pictures beside it where there are any.

use super::svg::{Anchor, Lettering, Pen, Svg};
use glam::DVec2;
use image::GrayImage;

/// A step of the error budget.
#[derive(Clone, Debug)]
pub struct Cost {
    /// What is looked at.
    pub name: String,
    /// `None` if it is known to be that of another step, as the name says.
    pub errors: Option<CostErrors>,
}

/// What is wrong with the light of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostErrors {
    /// Relative RMS error against the target.
    pub rel_rms: f64,
    /// Structural similarity to the target.
    pub ssim: f64,
    /// By how much the step alone moves the light, as relative RMS.
    pub moved: f64,
}

pub(super) const MARGIN: u32 = 16;
/// Heights of a step without errors, without pictures, and at least with pictures.
const RISES: [u32; 3] = [34, 48, 78];
pub(super) const BARS: f64 = 560.0;
/// Room for figures beyond the longest bar.
const BEYOND: f64 = 150.0;
pub(super) const HEAD: u32 = 58;
const TEXT: Lettering = Lettering { height: 11.0, grey: 30, halo: 2.0 };
const FINE: Lettering = Lettering { height: 8.5, grey: 90, halo: 2.0 };
const GRID: Pen = Pen { width: 0.6, grey: 205 };
pub(super) const BAR: u8 = 90;
/// Of a bar.
pub(super) const THICK: f64 = 12.0;
/// Figures along the axis of errors.
const TICKS: [f64; 8] = [0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0];
/// How far along the axis an error lies, from 0 to 1.
///
/// The axis is that of the error's square root. Along a logarithm, .08 and .30 look alike, though
/// one is a fine picture and the other a bad one; along the error itself, all steps of a good design
/// are one thin line.
fn along(error: f64) -> f64 {
    if error.is_nan() { 0.0 } else { error.clamp(0.0, 1.0).sqrt() }
}

/// An error with the digits that tell steps apart.
pub(super) fn rounded(error: f64) -> String {
    if error < 1e-3 { format!("{error:.5}") } else { format!("{error:.4}") }
}

/// Draws the steps from top to bottom, the error as a bar along an axis of its square root.
pub fn budget_chart(costs: &[Cost]) -> Svg {
    chart(&costs.iter().map(|cost| (cost, Vec::new())).collect::<Vec<_>>(), &[], (0, 0))
}

pub(super) fn chart(rows: &[(&Cost, Vec<GrayImage>)], titles: &[&str], (width, height): (u32, u32)) -> Svg {
    let rise = |(cost, pictures): &(&Cost, Vec<GrayImage>)| match cost.errors {
        None => RISES[0],
        Some(_) if pictures.is_empty() => RISES[1],
        Some(_) => RISES[2].max(height + 14),
    };
    let columns = titles.len() as u32;
    let begin = f64::from(columns * (MARGIN + width) + MARGIN + if columns > 0 { 8 } else { 0 });
    let end = begin + BARS + BEYOND;
    let total = HEAD + rows.iter().map(rise).sum::<u32>() + MARGIN;
    let mut sheet = Svg::new(end as u32 + MARGIN, total);
    let place = |error: f64| begin + BARS * along(error);
    let (upper, lower) = (f64::from(HEAD) - 6.0, f64::from(total - MARGIN));
    for tick in TICKS {
        let x = place(tick);
        sheet.line(DVec2::new(x, upper), DVec2::new(x, lower), GRID);
        sheet.text(DVec2::new(x, 44.0), Anchor::Middle, &format!("{tick}"), FINE);
    }
    sheet.text(DVec2::new(begin, 9.0), Anchor::Start, "relative RMS error, along an axis of its square root", FINE);
    for (k, title) in (0u32..).zip(titles) {
        let at = DVec2::new(f64::from(MARGIN + k * (width + MARGIN)), 44.0);
        sheet.fitted_text(at, Anchor::Start, title, FINE, f64::from(width));
    }
    let mut top = HEAD;
    for row in rows {
        let (cost, pictures) = row;
        let middle = f64::from(top) + 0.5 * f64::from(rise(row));
        let left = begin + 4.0;
        for (k, picture) in (0u32..).zip(pictures) {
            sheet.picture(MARGIN + k * (width + MARGIN), top, picture.clone());
        }
        if let Some(CostErrors { rel_rms: error, ssim, moved }) = cost.errors {
            const MOVED: f64 = 190.0;
            sheet.fitted_text(DVec2::new(left, middle - 12.0), Anchor::Start, &cost.name, TEXT, end - left - MOVED);
            let moved = format!("moves the light by {}", rounded(moved));
            sheet.text(DVec2::new(end, middle - 12.0), Anchor::End, &moved, FINE);
            // Whole pixels, whose middles have whole numbers.
            let low = DVec2::new(begin, (middle + 2.0).round()) - 0.5;
            sheet.area(low, DVec2::new(place(error) - begin, THICK), BAR);
            let figures = format!("{}, SSIM {ssim:.4}", rounded(error));
            sheet.text(DVec2::new(place(error) + 8.0, low.y + 0.5 * THICK), Anchor::Start, &figures, TEXT);
        } else {
            sheet.fitted_text(DVec2::new(left, middle), Anchor::Start, &cost.name, TEXT, end - left);
        }
        top += rise(row);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_takes_words_as_words_and_errors_beyond_its_axis() {
        assert_eq!([0.0, 0.25, 1.0, 5.0].map(along), [0.0, 0.5, 1.0, 1.0]);
        assert_eq!([along(-1.0), along(f64::NAN)], [0.0; 2]);
        // A fine picture and a bad one are apart on the chart, and what nobody sees is still a bar.
        let [fine, bad, least] = [0.08, 0.3, 1e-3].map(|error| BARS * along(error));
        assert!(bad - fine > 140.0 && least > 15.0, "{fine} {bad} {least}");
        let errors = |rel_rms| Some(CostErrors { rel_rms, ssim: 0.0, moved: 0.0 });
        let cost = |error| Cost { name: "a <step>".into(), errors: errors(error) };
        let chart = budget_chart(&[cost(0.0), cost(f64::NAN), cost(f64::INFINITY)]);
        assert!(chart.raster().pixels().any(|p| p.0[0] == BAR));
    }
}
