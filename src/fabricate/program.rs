//! The rows of a pass as a program for a machine: RS-274, as LinuxCNC and most controls read it.

use super::{Rows, Scallop};
use glam::{DVec2, DVec3};
use std::io::{self, Write};

/// How a machine is to go along the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machining {
    /// Feed along the rows, mm per minute.
    pub feed_mm_per_min: f64,
    /// Speed of the spindle, per minute.
    pub spindle_per_min: f64,
    /// How far above the highest place of the stock the tip goes between cuts, mm.
    pub safe_mm: f64,
}

/// Why there is no program.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} is {value}; it must lie between {least} and {greatest}")]
pub struct MachiningError {
    what: &'static str,
    value: f64,
    least: f64,
    greatest: f64,
}

impl Machining {
    /// Refuses what no machine does.
    ///
    /// # Errors
    /// A number that is none, or out of limits.
    pub fn check(&self) -> Result<(), MachiningError> {
        for (what, value, least, greatest) in [
            ("the feed (`feed`), mm per minute,", self.feed_mm_per_min, 1.0, 100_000.0),
            ("the speed of the spindle (`spindle`), per minute,", self.spindle_per_min, 1.0, 1_000_000.0),
            ("the safe height (`safe-height`), mm,", self.safe_mm, 0.5, 500.0),
        ] {
            if !(least..=greatest).contains(&value) {
                return Err(MachiningError { what, value, least, greatest });
            }
        }
        Ok(())
    }
}

/// How far the straight lines of a program may lie off the way of the tip, mm: as much as its last
/// decimal.
const CHORD_MM: f64 = 1e-5;
/// Part of the feed at which the tip goes down into the stock.
const PLUNGE: f64 = 0.3;
/// Beside the block the tip goes down no further than this below the lowest place of the face, mm:
/// the edge of the face is cut, and the walls are not.
const BELOW_MM: f64 = 0.5;

impl Rows<'_> {
    /// Writes the way of the tip along all rows, to and fro. `top_mm` is the highest place of the
    /// stock, `floor_mm` that of the entry face, which the tip stays above; coordinates are counted
    /// from `origin`, all in the frame of the surface.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_program(
        &self,
        out: &mut impl Write,
        machining: &Machining,
        (top_mm, floor_mm): (f64, f64),
        (origin, about): (DVec3, &str),
    ) -> io::Result<()> {
        let cutter = self.pass().cutter;
        let lowest = self.surface.range_mm().0;
        let least = (lowest - BELOW_MM).max(floor_mm);
        let safe = top_mm + machining.safe_mm - origin.z;
        writeln!(out, "%")?;
        for line in about.lines() {
            comment(out, line)?;
        }
        comment(out, &format!("tool: {}; Z is that of its tip", cutter.in_words()))?;
        let scallop = Scallop::of(cutter, self.pass.step_over_mm).map(|s| format!(", scallops {:.5} mm", s.height_mm));
        let rows = format!("rows {} mm apart along {}", self.pass.step_over_mm, self.pass.direction);
        comment(out, &format!("{rows}{}", scallop.unwrap_or_default()))?;
        comment(out, &format!("finishing pass: leave no more than {} mm for it", 0.25 * cutter.radius_mm()))?;
        writeln!(out, "G21 G90 G94 G17 G40 G49 G80")?;
        writeln!(out, "G0 Z{safe:.5}")?;
        writeln!(out, "S{:.0} M3", machining.spindle_per_min)?;
        let mut last: Option<(usize, DVec3)> = None;
        for row in 0..self.count {
            let way = self.way(row, least);
            if way.len() < 2 {
                continue;
            }
            let mut way: Vec<DVec3> = straightened(&way).into_iter().map(|p| self.in_file(row, p, origin)).collect();
            if row % 2 == 1 {
                way.reverse();
            }
            let begin = way[0];
            // The next row begins beside the end of this one, unless they run out differently.
            let near = last.is_some_and(|(before, end)| {
                before + 1 == row && end.truncate().distance(begin.truncate()) < 1.001 * self.pass.step_over_mm
            });
            let mut feed = machining.feed_mm_per_min;
            if near {
                writeln!(out, "G1 {} F{feed:.0}", words(begin))?;
            } else {
                writeln!(out, "G0 Z{safe:.5}")?;
                writeln!(out, "G0 X{:.5} Y{:.5}", begin.x + 0.0, begin.y + 0.0)?;
                feed *= PLUNGE;
                writeln!(out, "G1 Z{:.5} F{feed:.0}", begin.z + 0.0)?;
                writeln!(out, "F{:.0}", machining.feed_mm_per_min)?;
            }
            for point in &way[1..] {
                writeln!(out, "G1 {}", words(*point))?;
            }
            last = Some((row, way[way.len() - 1]));
        }
        writeln!(out, "G0 Z{safe:.5}")?;
        writeln!(out, "M5")?;
        writeln!(out, "M2")?;
        writeln!(out, "%")
    }

    /// Places along a row and heights of the tip there.
    fn way(&self, row: usize, least: f64) -> Vec<DVec2> {
        let tips = &self.tips[row * self.positions..(row + 1) * self.positions];
        let kinks = self.kinks[row].iter().map(|kink| (kink.position as f64 + kink.at, kink.tip[0]));
        let positions = tips.iter().enumerate().map(|(i, tip)| (i as f64, tip[0]));
        let mut way: Vec<(f64, f64)> = positions.chain(kinks).filter(|(_, height)| height.is_finite()).collect();
        way.sort_by(|a, b| a.0.total_cmp(&b.0));
        way.into_iter().map(|(i, z)| DVec2::new(self.first.x + i * self.spacing_mm, z.max(least))).collect()
    }

    fn in_file(&self, row: usize, at: DVec2, origin: DVec3) -> DVec3 {
        let aside = self.first.y + row as f64 * self.pass.step_over_mm;
        (at.x * self.along + aside * self.across).extend(at.y) - origin
    }
}

fn words(point: DVec3) -> String {
    // `+ 0.0` turns a negative zero into a positive one.
    format!("X{:.5} Y{:.5} Z{:.5}", point.x + 0.0, point.y + 0.0, point.z + 0.0)
}

/// A comment: 7-bit, and without what would end it.
fn comment(out: &mut impl Write, text: &str) -> io::Result<()> {
    let plain = text.chars().map(|c| match c {
        '(' => '[',
        ')' => ']',
        c if c == ' ' || c.is_ascii_graphic() => c,
        _ => '?',
    });
    writeln!(out, "({})", plain.collect::<String>())
}

/// Those of a line's points from which it can be drawn with straight strokes.
fn straightened(way: &[DVec2]) -> Vec<DVec2> {
    let mut kept = vec![way[0]];
    let mut from = 0;
    // Slopes between which a stroke from the last kept point passes all points since.
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 1..way.len() {
        let run = way[k].x - way[from].x;
        let slope = (way[k].y - way[from].y) / run;
        if !(low..=high).contains(&slope) {
            from = k - 1;
            kept.push(way[from]);
            (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        let (run, rise) = (way[k].x - way[from].x, way[k].y - way[from].y);
        low = low.max((rise - CHORD_MM) / run);
        high = high.min((rise + CHORD_MM) / run);
    }
    kept.push(way[way.len() - 1]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_pass_all_points_within_their_tolerance() {
        let way: Vec<DVec2> = (0..2000).map(|k| f64::from(k) * 0.01).map(|x| DVec2::new(x, 1e-3 * x.sin())).collect();
        let kept = straightened(&way);
        assert!(kept.len() > 20 && kept.len() < 300, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (way[0], way[1999]));
        for p in &way {
            let k = kept.partition_point(|q| q.x < p.x).clamp(1, kept.len() - 1);
            let (a, b) = (kept[k - 1], kept[k]);
            let height = a.y + (b.y - a.y) * (p.x - a.x) / (b.x - a.x);
            assert!((height - p.y).abs() <= 1.000_001 * CHORD_MM, "{p}");
        }
    }

    #[test]
    fn no_comment_ends_early_or_holds_what_no_control_reads() {
        let mut out = Vec::new();
        comment(&mut out, "a (b) \u{b5}m").unwrap();
        assert_eq!(out, b"(a [b] ?m)\n");
    }

    #[test]
    fn what_no_machine_does_is_refused() {
        let fine = Machining { feed_mm_per_min: 1000.0, spindle_per_min: 18_000.0, safe_mm: 5.0 };
        assert!(fine.check().is_ok());
        for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert!(Machining { feed_mm_per_min: bad, ..fine }.check().is_err());
            assert!(Machining { spindle_per_min: bad, ..fine }.check().is_err());
            assert!(Machining { safe_mm: bad, ..fine }.check().is_err());
        }
    }
}
