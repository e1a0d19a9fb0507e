//! Curves over a logarithmic axis of what is small when all is well.

use super::svg::{Anchor, Lettering, Pen, Svg, path, ring};
use glam::DVec2;
use std::ops::RangeInclusive;

/// A curve through points, in the order given.
#[derive(Clone, Debug)]
pub struct Curve {
    /// What it shows.
    pub name: String,
    /// Points; those that are not positive and finite are left out.
    pub points: Vec<DVec2>,
}

/// Curves in groups.
pub(super) struct Chart<'a> {
    /// What the axes are.
    pub(super) names: [&'a str; 2],
    /// Whether the horizontal axis is logarithmic too.
    pub(super) log_x: bool,
    /// Ranges along the horizontal axis that are tinted.
    pub(super) strips: &'a [(f64, f64)],
    /// Names of the groups: each has a mark and, on a page, a colour of its own.
    pub(super) groups: &'a [String],
    /// Groups and their curves.
    pub(super) curves: &'a [(usize, Curve)],
}

/// Width of the rectangle within the axes, and what is around it for words, pixels.
const WIDTH: f64 = 790.0;
const LEFT: f64 = 90.0;
const RIGHT: f64 = 20.0;
const ABOVE: f64 = 30.0;
const BELOW: f64 = 70.0;
/// Columns of the legend, and height of its rows, pixels.
const COLUMNS: usize = 3;
const ROW: f64 = 22.0;
const TEXT: Lettering = Lettering { height: 10.0, grey: 30, halo: 2.0 };
const GRID: Pen = Pen { width: 0.6, grey: 215 };
const STRIP: u8 = 244;
/// More decades than these are not divided, and not more than so many labels written.
const DIVIDED: f64 = 4.0;
const MOST_LABELS: f64 = 8.0;
/// Points that are so many are small.
const MANY: usize = 60;

/// Draws curves over logarithmic axes, each with a mark of its own, named in a legend.
pub fn curves(x_name: &str, y_name: &str, curves: &[Curve]) -> Svg {
    let groups: Vec<String> = curves.iter().map(|curve| curve.name.clone()).collect();
    let curves: Vec<(usize, Curve)> = curves.iter().cloned().enumerate().collect();
    Chart { names: [x_name, y_name], log_x: true, strips: &[], groups: &groups, curves: &curves }.draw(500.0)
}

impl Chart<'_> {
    /// Draws them within a rectangle of this height, pixels.
    pub(super) fn draw(&self, height: f64) -> Svg {
        let lower = DVec2::new(LEFT, ABOVE + ROW * self.groups.len().div_ceil(COLUMNS) as f64);
        let upper = lower + DVec2::new(WIDTH, height);
        let mut sheet = Svg::new((upper.x + RIGHT) as u32, (upper.y + BELOW) as u32);
        let along = |x: f64| if self.log_x { x.log10() } else { x };
        let log = |p: DVec2| DVec2::new(along(p.x), p.y.log10());
        let shown = |p: &DVec2| p.is_finite() && p.min_element() > 0.0;
        let drawn: Vec<Vec<DVec2>> = self
            .curves
            .iter()
            .map(|(_, curve)| curve.points.iter().copied().filter(shown).map(log).collect())
            .collect();
        let (mut lo, mut hi) =
            drawn.iter().flatten().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        if !lo.is_finite() {
            (lo, hi) = (DVec2::ZERO, DVec2::ONE);
        }
        let room = (0.06 * (hi - lo)).max(DVec2::splat(0.05));
        (lo, hi) = (lo - room, hi + room);
        let place = |p: DVec2| {
            let t = (p - lo) / (hi - lo);
            DVec2::new(lower.x + t.x * WIDTH, upper.y - t.y * height)
        };
        for &(from, to) in self.strips {
            let [a, b] = [from, to].map(|x| place(DVec2::new(along(x).clamp(lo.x, hi.x), hi.y)));
            sheet.area(a, DVec2::new(b.x - a.x, height), STRIP);
        }
        let x_ticks = if self.log_x { ticks(lo.x..=hi.x) } else { even_ticks(lo.x..=hi.x, 1.0) };
        for x in x_ticks {
            let at = place(DVec2::new(along(x), lo.y));
            sheet.line(at, DVec2::new(at.x, lower.y), GRID);
            sheet.text(at + DVec2::new(0.0, 18.0), Anchor::Middle, &label(x), TEXT);
        }
        for y in ticks(lo.y..=hi.y) {
            let at = place(DVec2::new(lo.x, y.log10()));
            sheet.line(at, DVec2::new(upper.x, at.y), GRID);
            sheet.text(at - DVec2::new(12.0, 0.0), Anchor::End, &label(y), TEXT);
        }
        sheet.stroke(&path([lower, DVec2::new(lower.x, upper.y), upper]), Pen { width: 1.2, grey: 60 });
        sheet.text(DVec2::new(lower.x + 0.5 * WIDTH, upper.y + 50.0), Anchor::Middle, self.names[0], TEXT);
        sheet.text(DVec2::new(10.0, 12.0), Anchor::Start, self.names[1], TEXT);
        let reach = if drawn.iter().map(Vec::len).sum::<usize>() > MANY { 2.5 } else { 5.0 };
        for (points, (group, curve)) in drawn.iter().zip(self.curves) {
            let points: Vec<DVec2> = points.iter().map(|&p| place(p)).collect();
            sheet.group(&format!("g{group}"), &curve.name, |sheet| {
                if !points.is_empty() {
                    sheet.stroke(&path(points.iter().copied()), Pen { width: 1.6, grey: grey(*group) });
                }
                points.iter().for_each(|&p| mark(sheet, p, *group, reach));
            });
        }
        for (k, name) in self.groups.iter().enumerate() {
            let (column, row) = (k % COLUMNS, k / COLUMNS);
            let at = DVec2::new(LEFT + 10.0 + WIDTH / COLUMNS as f64 * column as f64, ABOVE + ROW * row as f64);
            sheet.group(&format!("g{k}"), name, |sheet| mark(sheet, at, k, 5.0));
            sheet.fitted_text(at + DVec2::new(16.0, 0.0), Anchor::Start, name, TEXT, WIDTH / COLUMNS as f64 - 36.0);
        }
        sheet
    }
}

/// The greys of the groups.
fn grey(group: usize) -> u8 {
    [0, 80, 130, 0, 80][group % 5]
}

/// 1, 2 and 5 times powers of ten within a range of decimal logarithms; of many powers, some alone,
/// and where there are too few of them, equal steps.
fn ticks(range: RangeInclusive<f64>) -> Vec<f64> {
    let (first, last) = (range.start().floor() as i32, range.end().ceil() as i32);
    let decades = range.end() - range.start();
    let every = (decades / MOST_LABELS).ceil().max(1.0) as i32;
    let parts: &[f64] = if decades > DIVIDED { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let powers = (first..=last).filter(|power| power.rem_euclid(every) == 0);
    let all = powers.flat_map(|power| parts.iter().map(move |m| m * 10f64.powi(power)));
    let ticks: Vec<f64> = all.filter(|tick| range.contains(&tick.log10())).collect();
    if ticks.len() < 3 { even_ticks(10f64.powf(*range.start())..=10f64.powf(*range.end()), 0.0) } else { ticks }
}

/// Multiples of a round number within a range.
fn even_ticks(range: RangeInclusive<f64>, least: f64) -> Vec<f64> {
    let least = least.max((range.end() - range.start()) / MOST_LABELS);
    let decade = 10f64.powf((least.log10() + 1e-9).floor());
    let step = [1.0, 2.0, 5.0].map(|m| m * decade).into_iter().find(|step| *step >= 0.999 * least);
    let step = step.unwrap_or(10.0 * decade);
    let (first, last) = ((range.start() / step).ceil() as i64, (range.end() / step).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

fn label(tick: f64) -> String {
    if tick > 0.0 && tick < 0.999e-4 {
        return format!("{tick:.0e}").replace('-', "−");
    }
    format!("{}", (tick * 1e9).round() / 1e9)
}

/// A dot, a square, a cross, a saltire or a diamond.
fn mark(sheet: &mut Svg, at: DVec2, kind: usize, reach: f64) {
    let grey = grey(kind);
    let (x, y) = (DVec2::new(reach, 0.0), DVec2::new(0.0, reach));
    let strokes = match kind % 5 {
        0 => return sheet.line(at, at, Pen { width: 1.6 * reach, grey }),
        1 => ring([at - x - y, at + x - y, at + x + y, at - x + y]),
        2 => path([at - x, at + x]) + &path([at - y, at + y]),
        3 => path([at - x - y, at + x + y]) + &path([at - x + y, at + x - y]),
        _ => ring([at - x, at - y, at + x, at + y]),
    };
    sheet.stroke(&strokes, Pen { width: 1.8, grey });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_labelled_to_their_last_figure() {
        assert_eq!(ticks(-1.1..=0.4), [0.1, 0.2, 0.5, 1.0, 2.0]);
        assert_eq!([0.05, 0.1, 1.0, 200.0, 1e-4, 1e-9].map(label), ["0.05", "0.1", "1", "200", "0.0001", "1e−9"]);
        assert_eq!(ticks(-12.5..=0.1), [1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0]);
        assert_eq!(even_ticks(0.5..=33.4, 1.0), [5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
        assert_eq!(even_ticks(0.9..=2.1, 1.0), [1.0, 2.0]);
        let near: Vec<String> = ticks(0.139_f64.log10()..=0.261_f64.log10()).into_iter().map(label).collect();
        assert_eq!(near, ["0.14", "0.16", "0.18", "0.2", "0.22", "0.24", "0.26"]);
    }

    #[test]
    fn a_power_law_is_a_straight_line_and_nonsense_is_left_out() {
        let law = |k: i32| DVec2::new(10f64.powi(k), 10f64.powi(-2 * k));
        let one = Curve { name: "law".into(), points: (0..3).map(law).collect() };
        let with_nonsense = [law(0), DVec2::new(0.0, 1.0), law(1), DVec2::new(3.0, f64::NAN), law(2)];
        let other = Curve { name: "law".into(), points: with_nonsense.to_vec() };
        let [a, b] = [one, other].map(|curve| curves("x", "y", &[curve]).raster());
        assert!(a == b && a.pixels().any(|p| p.0[0] == 0));
        assert_eq!(curves("x", "y", &[]).size(), (900, 600));
    }
}
