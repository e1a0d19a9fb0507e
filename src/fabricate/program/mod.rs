//! Programs for machines: a finishing pass over a face, and, if it is asked for, roughing before
//! it.
//!
//! [`path`] lays the way of the tip, [`fit`] makes strokes of it, [`post`] the words of a control.
//! Rapids go along the clearance above the stock, or straight up and down to it, and the tip never
//! goes below the entry face, nor into a rim.

mod fit;
mod path;
mod post;

pub use path::{Pattern, Roughing, Sense};
pub use post::Post;

use super::{Cutter, Pass, PassError, Scallop};
use crate::surface::HeightField;
use fit::Stroke;
use glam::DVec3;
use path::{Guard, Way};
use post::Writer;
use rayon::prelude::*;
use std::io::{self, Write};

/// How a machine is to go along its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machining {
    /// Feed along the way, mm per minute.
    pub feed_mm_per_min: f64,
    /// Speed of the spindle, per minute.
    pub spindle_per_min: f64,
    /// How far above the highest place of the stock the tip goes between cuts, mm.
    pub safe_mm: f64,
    /// How far strokes may lie off the way of the tip, mm. What that does to light is told by
    /// reading the program back.
    pub chord_mm: f64,
    /// Whether rows along an axis may be written as arcs, which takes fewer words.
    pub arcs: bool,
    /// The control.
    pub post: Post,
}

/// Where the face lies on the machine, on the zero of the face, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The highest place of the stock.
    pub top_mm: f64,
    /// The entry face, which the tip stays above.
    pub floor_mm: f64,
    /// The plane around the face, if there is a rim.
    pub rim_mm: Option<f64>,
    /// The program's zero.
    pub origin_mm: DVec3,
}

/// A program to be written.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// The face.
    pub surface: &'a HeightField,
    /// The finishing pass.
    pub pass: Pass,
    /// How its way lies on the face.
    pub pattern: Pattern,
    /// In which sense rows are cut.
    pub sense: Sense,
    /// What goes before it.
    pub roughing: Option<Roughing>,
    /// How the machine goes.
    pub machining: Machining,
    /// Where the face lies.
    pub place: Place,
}

/// Why there is no program.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MachiningError {
    /// A number that no machine has.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Number {
        /// Which.
        what: &'static str,
        /// The refused number.
        value: f64,
        /// The least accepted.
        least: f64,
        /// The greatest accepted.
        greatest: f64,
    },
    /// A pass that cannot be made.
    #[error(transparent)]
    Pass(#[from] PassError),
    /// Two tools for a control that changes none.
    #[error(
        "GRBL changes no tools: write roughing and finishing as two programs, the former by `allowance` and a flat cutter"
    )]
    ToolChange,
    /// A writer that fails.
    #[error("the program cannot be written")]
    Write(#[from] io::Error),
}

/// The chord error of programs that nobody has said another one for, mm: as much as their last
/// decimal. Of the camera sample in rows 0.1 mm apart, polished with 0.1 mm, ten times as much
/// costs more than the rows do (docs/cam.md).
pub const CHORD_MM: f64 = 1e-6;
/// Part of the feed at which the tip goes down towards a cut.
const PLUNGE: f64 = 0.3;
/// Beside the block the tip goes down no further than this below the lowest place of the face, mm:
/// the edge of the face is cut, and the walls are not.
const BELOW_MM: f64 = 0.5;
/// Ways that are fitted at once.
const TOGETHER: usize = 64;

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
            ("the chord error (`chord-error`), mm,", self.chord_mm, 1e-6, 1.0),
        ] {
            within(what, value, (least, greatest))?;
        }
        Ok(())
    }

    /// Decimals that keep to the chord error, of which rounding may take as much as that again.
    fn decimals(&self) -> usize {
        (-self.chord_mm.log10() - 1e-9).ceil().clamp(3.0, 6.0) as usize
    }
}

fn check_roughing(roughing: &Roughing) -> Result<(), MachiningError> {
    within("the step from level to level (`step-down`), mm,", roughing.step_down_mm, (0.01, 100.0))?;
    within("the allowance of roughing (`rough-allowance`), mm,", roughing.allowance_mm, (0.0, Pass::MOST_ALLOWANCE_MM))
}

fn within(what: &'static str, value: f64, (least, greatest): (f64, f64)) -> Result<(), MachiningError> {
    // Not a number lies nowhere.
    if (least..=greatest).contains(&value) {
        Ok(())
    } else {
        Err(MachiningError::Number { what, value, least, greatest })
    }
}

impl Program<'_> {
    /// Writes the program; `title` names it, `header` is what a person reads first.
    ///
    /// # Errors
    /// What no machine does, a pass that does not fit the face, a writer that fails.
    pub fn write(&self, out: &mut impl Write, title: &str, header: &[String]) -> Result<(), MachiningError> {
        self.machining.check()?;
        let Machining { post, .. } = self.machining;
        if self.roughing.is_some() && !post.changes_tools() {
            return Err(MachiningError::ToolChange);
        }
        let finishing = path::finishing(
            self.surface,
            self.pass,
            self.pattern,
            self.sense,
            (&self.guard(self.pass.cutter), self.machining.chord_mm),
        )?;
        let rough = match self.roughing {
            Some(roughing) => {
                check_roughing(&roughing)?;
                Some((roughing, path::roughing(self.surface, &roughing, &self.guard(roughing.cutter))?))
            }
            None => None,
        };
        let mut writer = Writer { out, post, decimals: self.machining.decimals(), several: rough.is_some() };
        let mut lines = header.to_vec();
        lines.extend(self.about(&finishing));
        writer.begin(title, &lines, self.machining.chord_mm.max(1e-5))?;
        let finisher = if rough.is_some() { 2 } else { 1 };
        let safe = self.place.top_mm + self.machining.safe_mm - self.place.origin_mm.z;
        if let Some((roughing, ways)) = &rough {
            let words = format!("tool 1: {}; roughing, Z is that of its tip", roughing.cutter);
            writer.tool(1, &words, self.machining.spindle_per_min, safe)?;
            self.ways(&mut writer, ways, 0.1 * roughing.allowance_mm.max(0.01))?;
        }
        // A tool that the program does not call has no number.
        let called = if post.calls_tools() || rough.is_some() { format!(" {finisher}") } else { String::new() };
        let words = format!("tool{called}: {}; finishing, Z is that of its tip", self.pass.cutter);
        writer.tool(finisher, &words, self.machining.spindle_per_min, safe)?;
        self.ways(&mut writer, &finishing, self.machining.chord_mm)?;
        Ok(writer.end()?)
    }

    /// What the header says of the passes.
    fn about(&self, finishing: &[Way]) -> Vec<String> {
        let Pass { cutter, step_over_mm, allowance_mm, .. } = self.pass;
        let (low, high) = finishing
            .iter()
            .flat_map(|way| &way.places)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let (low, high) = (low - self.place.origin_mm, high - self.place.origin_mm);
        let scallop = Scallop::of(cutter, step_over_mm).map(|s| format!(", scallops {:.5} mm", s.height_mm));
        let length: f64 = finishing.iter().map(Way::length_mm).sum();
        let mut lines = vec![
            "units: mm; zero and axes as in the side file".to_owned(),
            format!("finishing: {} {step_over_mm} mm apart{}", self.pattern, scallop.unwrap_or_default()),
            format!(
                "x {:.3} to {:.3}, y {:.3} to {:.3}, z {:.4} to {:.4}",
                low.x, high.x, low.y, high.y, low.z, high.z
            ),
            format!(
                "finishing way {:.1} m, {:.0} min at {} mm/min without acceleration",
                1e-3 * length,
                length / self.machining.feed_mm_per_min,
                self.machining.feed_mm_per_min
            ),
        ];
        if allowance_mm > 0.0 {
            lines.push(format!("leaves {allowance_mm} mm"));
        }
        if self.roughing.is_none() {
            lines.push(format!("no roughing: leave no more than {} mm for this pass", 0.25 * cutter.radius_mm()));
        }
        lines
    }

    fn guard(&self, cutter: Cutter) -> Guard {
        let lowest = self.surface.range_mm().0;
        let least = (lowest - BELOW_MM).max(self.place.floor_mm);
        Guard {
            contour: self.surface.contour(),
            rim_mm: self.place.rim_mm,
            least_mm: least,
            top_mm: self.place.top_mm,
            cutter,
        }
    }

    /// Writes ways: down to each, along it, up again, but for those that go on from the last.
    fn ways<W: Write>(&self, writer: &mut Writer<'_, W>, ways: &[Way], off_mm: f64) -> io::Result<()> {
        let Machining { feed_mm_per_min: feed, safe_mm, arcs, .. } = self.machining;
        let origin = self.place.origin_mm;
        let safe = writer.number(self.place.top_mm + safe_mm - origin.z);
        // Beyond the face the tip only rolls around its edge.
        let contour = self.surface.contour();
        let off = |p: DVec3| if contour.contains(p.truncate()) { off_mm } else { off_mm.max(path::EDGE_MM) };
        let mut plane = None;
        for ways in ways.chunks(TOGETHER) {
            let fitted: Vec<Vec<Stroke>> = ways
                .par_iter()
                .map(|way| match way.upright.filter(|_| arcs) {
                    Some(upright) => fit::arcs(&way.places, &off, upright),
                    None => fit::straight(&way.places, &off),
                })
                .collect();
            for (way, strokes) in ways.iter().zip(fitted) {
                let place = |p: DVec3| {
                    let p = p - origin;
                    format!("X{} Y{} Z{}", writer.number(p.x), writer.number(p.y), writer.number(p.z))
                };
                let Some(&begin) = way.places.first() else { continue };
                let mut text = String::new();
                if way.goes_on {
                    text += &format!("G1 {}\n", place(begin));
                } else {
                    let p = begin - origin;
                    text += &format!("G0 Z{safe}\nG0 X{} Y{}\n", writer.number(p.x), writer.number(p.y));
                    text += &format!("G1 Z{} F{:.0}\nF{feed:.0}\n", writer.number(p.z), PLUNGE * feed);
                }
                let mut from = begin;
                for stroke in strokes {
                    from = match stroke {
                        Stroke::Line(to) => {
                            text += &format!("G1 {}\n", place(to));
                            to
                        }
                        Stroke::Arc { to, centre, clockwise } => {
                            let upright = way.upright;
                            if plane != upright {
                                text += if upright == Some(fit::Upright::X) { "G18\n" } else { "G19\n" };
                                plane = upright;
                            }
                            let of = centre - from;
                            // In zx, z comes first, and so turns the other way.
                            let (code, letter, along) = if upright == Some(fit::Upright::X) {
                                (if clockwise { "G3" } else { "G2" }, 'I', of.x)
                            } else {
                                (if clockwise { "G2" } else { "G3" }, 'J', of.y)
                            };
                            let (along, up) = (writer.number(along), writer.number(of.z));
                            text += &format!("{code} {} {letter}{along} K{up}\n", place(to));
                            to
                        }
                    };
                }
                writer.out.write_all(text.as_bytes())?;
            }
        }
        if plane.is_some() {
            writeln!(writer.out, "G17")?;
        }
        writeln!(writer.out, "G0 Z{safe}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_does_is_refused() {
        let fine = Machining {
            feed_mm_per_min: 1000.0,
            spindle_per_min: 18_000.0,
            safe_mm: 5.0,
            chord_mm: CHORD_MM,
            arcs: false,
            post: Post::LinuxCnc,
        };
        assert!(fine.check().is_ok() && fine.decimals() == 6);
        assert_eq!(Machining { chord_mm: 0.01, ..fine }.decimals(), 3);
        for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert!(Machining { feed_mm_per_min: bad, ..fine }.check().is_err());
            assert!(Machining { spindle_per_min: bad, ..fine }.check().is_err());
            assert!(Machining { safe_mm: bad, ..fine }.check().is_err());
            assert!(Machining { chord_mm: bad, ..fine }.check().is_err());
        }
    }
}
