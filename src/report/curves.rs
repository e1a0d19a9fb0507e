//! Curves over two logarithmic axes.

use super::ink::{Lettering, line, write, write_from};
use glam::DVec2;
use image::{GrayImage, Luma};
use std::ops::RangeInclusive;

/// A curve through points, in the order given.
#[derive(Clone, Debug)]
pub struct Curve {
    /// What it shows.
    pub name: String,
    /// Points; those that are not positive and finite are left out.
    pub points: Vec<DVec2>,
}

const SIZE: (u32, u32) = (900, 600);
/// The rectangle within the axes, pixels.
const LOWER: DVec2 = DVec2::new(90.0, 30.0);
const UPPER: DVec2 = DVec2::new(880.0, 530.0);
const TEXT: Lettering = Lettering { height: 10.0, grey: 30, halo: 2.0 };

/// Draws curves over logarithmic axes, each with a mark of its own, named in a legend.
pub fn curves(x_name: &str, y_name: &str, curves: &[Curve]) -> GrayImage {
    let mut sheet = GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([255]));
    let drawn: Vec<Vec<DVec2>> =
        curves.iter().map(|curve| curve.points.iter().copied().filter(|p| shown(*p)).map(log).collect()).collect();
    let (mut lo, mut hi) =
        drawn.iter().flatten().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)));
    if !lo.is_finite() {
        (lo, hi) = (DVec2::ZERO, DVec2::ONE);
    }
    let room = (0.06 * (hi - lo)).max(DVec2::splat(0.05));
    (lo, hi) = (lo - room, hi + room);
    let place = |p: DVec2| {
        let t = (p - lo) / (hi - lo);
        DVec2::new(LOWER.x + t.x * (UPPER.x - LOWER.x), UPPER.y - t.y * (UPPER.y - LOWER.y))
    };
    for x in ticks(lo.x..=hi.x) {
        let at = place(DVec2::new(x.log10(), lo.y));
        line(&mut sheet, at, DVec2::new(at.x, LOWER.y), 0.3, 215);
        write(&mut sheet, at + DVec2::new(0.0, 18.0), 0.0, &label(x), TEXT);
    }
    for y in ticks(lo.y..=hi.y) {
        let at = place(DVec2::new(lo.x, y.log10()));
        line(&mut sheet, at, DVec2::new(UPPER.x, at.y), 0.3, 215);
        write(&mut sheet, at - DVec2::new(36.0, 0.0), 0.0, &label(y), TEXT);
    }
    for (a, b) in [(LOWER, DVec2::new(LOWER.x, UPPER.y)), (DVec2::new(LOWER.x, UPPER.y), UPPER)] {
        line(&mut sheet, a, b, 0.6, 60);
    }
    write(&mut sheet, DVec2::new(0.5 * (LOWER.x + UPPER.x), UPPER.y + 50.0), 0.0, x_name, TEXT);
    write_from(&mut sheet, DVec2::new(10.0, 12.0), y_name, TEXT);
    for (k, (points, curve)) in drawn.iter().zip(curves).enumerate() {
        let grey = [0, 80, 130, 0, 80][k % 5];
        points.windows(2).for_each(|pair| line(&mut sheet, place(pair[0]), place(pair[1]), 0.8, grey));
        points.iter().for_each(|&p| mark(&mut sheet, place(p), k, grey));
        let legend = DVec2::new(UPPER.x - 300.0, LOWER.y + 16.0 + 22.0 * k as f64);
        mark(&mut sheet, legend, k, grey);
        write_from(&mut sheet, legend + DVec2::new(16.0, 0.0), &curve.name, TEXT);
    }
    sheet
}

fn shown(p: DVec2) -> bool {
    p.is_finite() && p.min_element() > 0.0
}

fn log(p: DVec2) -> DVec2 {
    DVec2::new(p.x.log10(), p.y.log10())
}

/// 1, 2 and 5 times powers of ten within a range of decimal logarithms.
fn ticks(range: RangeInclusive<f64>) -> Vec<f64> {
    let (first, last) = (range.start().floor() as i32, range.end().ceil() as i32);
    let all = (first..=last).flat_map(|power| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(power)));
    all.filter(|tick| range.contains(&tick.log10())).collect()
}

fn label(tick: f64) -> String {
    let decimals = (-(tick.log10() + 1e-9).floor()).max(0.0) as usize;
    format!("{tick:.decimals$}")
}

/// A dot, a square, a cross, a saltire or a diamond.
fn mark(sheet: &mut GrayImage, at: DVec2, kind: usize, grey: u8) {
    let corners = |a: DVec2, b: DVec2, c: DVec2, d: DVec2| vec![(a, b), (b, c), (c, d), (d, a)];
    let (x, y) = (DVec2::new(4.5, 0.0), DVec2::new(0.0, 4.5));
    let strokes = match kind % 5 {
        0 => return line(sheet, at, at, 4.0, grey),
        1 => corners(at - x - y, at + x - y, at + x + y, at - x + y),
        2 => vec![(at - x, at + x), (at - y, at + y)],
        3 => vec![(at - x - y, at + x + y), (at - x + y, at + x - y)],
        _ => corners(at - x, at - y, at + x, at + y),
    };
    strokes.into_iter().for_each(|(a, b)| line(sheet, a, b, 0.9, grey));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_labelled_to_their_last_figure() {
        assert_eq!(ticks(-1.1..=0.4), [0.1, 0.2, 0.5, 1.0, 2.0]);
        assert_eq!([0.05, 0.1, 1.0, 200.0].map(label), ["0.05", "0.1", "1", "200"]);
    }

    #[test]
    fn a_power_law_is_a_straight_line_and_nonsense_is_left_out() {
        let law = |k: i32| DVec2::new(10f64.powi(k), 10f64.powi(-2 * k));
        let one = Curve { name: "law".into(), points: (0..3).map(law).collect() };
        let with_nonsense = [law(0), DVec2::new(0.0, 1.0), law(1), DVec2::new(3.0, f64::NAN), law(2)];
        let other = Curve { name: "law".into(), points: with_nonsense.to_vec() };
        let [a, b] = [one, other].map(|curve| curves("x", "y", &[curve]));
        assert!(a == b && a.pixels().any(|p| p.0[0] == 0));
        assert_eq!(curves("x", "y", &[]).dimensions(), SIZE);
    }
}
