//! The cheapest of many cutters and step-overs that still draws the picture.

use super::{
    console::say,
    error::Failure,
    length::Length,
    mill::{mill, polished},
    progress::TerminalProgress,
    toml_file,
    workpiece::{Workpiece, look_at_scallops},
};
use glasswarp::{
    fabricate::{Cutter, Direction, Pass},
    surface::Polish,
};
use serde::{Deserialize, Deserializer, de};
use std::path::Path;

/// What the shop has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct List {
    cutter: Vec<Entry>,
}

/// A cutter, and how fast it may be moved.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Entry {
    name: Option<String>,
    #[serde(deserialize_with = "cutter")]
    cutter: Cutter,
    /// Per minute.
    feed: Length,
    #[serde(default)]
    step_overs: Vec<Length>,
}

fn cutter<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Cutter, D::Error> {
    String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
}

/// What is wanted of a cutter.
pub(crate) struct Wish {
    /// Relative RMS error in the end.
    pub(crate) error: f64,
    pub(crate) direction: Direction,
    pub(crate) allowance_mm: f64,
    pub(crate) polish: Option<Polish>,
}

/// Step-overs that are tried where the list names none, mm.
const STEP_OVERS_MM: [f64; 9] = [0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.035, 0.025];

impl List {
    fn read(path: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(path).map_err(|source| Failure::reading(path, source))?;
        Self::parse(&text, path)
    }

    /// The same from memory; `path` is its name.
    pub(crate) fn parse(text: &str, path: &Path) -> Result<Self, Failure> {
        let list: Self = toml_file::parse(text, path, "list of cutters")?;
        if list.cutter.is_empty() {
            return Err(Failure::Usage(format!("{} names no cutter", path.display())));
        }
        if let Some(entry) = list.cutter.iter().find(|entry| entry.feed.mm.is_nan() || entry.feed.mm <= 0.0) {
            return Err(Failure::Usage(format!(
                "the feed of {} is {}; it must be above 0 mm",
                entry.cutter, entry.feed
            )));
        }
        Ok(list)
    }
}

/// Looks for the pass of least time whose picture keeps to the wish. The error grows with the step-over: for every cutter the
/// greatest that keeps to it is found by bisection among those listed.
pub(crate) fn cheapest(path: &Path, piece: &Workpiece, wish: &Wish) -> Result<Pass, Failure> {
    let list = List::read(path)?;
    let progress = TerminalProgress::new();
    progress.begin("trying cutters", list.cutter.len());
    say!("Cutters of {} for a relative RMS error of {}:", path.display(), wish.error);
    say!("  {:<28} {:>10} {:>10} {:>10} {:>9}", "cutter", "step-over", "error", "way m", "minutes");
    let mut chosen: Option<(f64, Pass)> = None;
    let mut least = f64::INFINITY;
    for (k, entry) in list.cutter.iter().enumerate() {
        let mut step_overs: Vec<f64> = match entry.step_overs.as_slice() {
            [] => STEP_OVERS_MM.into_iter().filter(|s| *s <= 2.0 * entry.cutter.radius_mm()).collect(),
            named => named.iter().map(|length| length.mm).collect(),
        };
        step_overs.sort_by(|a, b| b.total_cmp(a));
        let name = entry.name.clone().unwrap_or_else(|| entry.cutter.to_string());
        let pass = |step_over_mm: f64| Pass {
            cutter: entry.cutter,
            step_over_mm,
            direction: wish.direction,
            allowance_mm: wish.allowance_mm,
        };
        for step_over_mm in &step_overs {
            pass(*step_over_mm).check(piece.surface.extent()).map_err(Failure::refused)?;
        }
        // The first that is good enough, as all after it are.
        let (mut low, mut high, mut found) = (0, step_overs.len(), None);
        while low < high {
            let middle = low.midpoint(high);
            let error = error_of(piece, &pass(step_overs[middle]), wish.polish)?;
            least = least.min(error);
            if error <= wish.error {
                (high, found) = (middle, Some((step_overs[middle], error)));
            } else {
                low = middle + 1;
            }
        }
        match found {
            Some((step_over, error)) => {
                let cost = pass(step_over).cost(&piece.surface.contour());
                let minutes = cost.minutes(entry.feed.mm);
                say!("  {name:<28} {step_over:>10} {error:>10.4} {:>10.1} {minutes:>9.0}", 1e-3 * cost.length_mm);
                if chosen.is_none_or(|(least, _)| minutes < least) {
                    chosen = Some((minutes, pass(step_over)));
                }
            }
            None => say!("  {name:<28} {:>10}", "none"),
        }
        progress.advance(k + 1);
    }
    progress.finish();
    match chosen {
        Some((_, pass)) => {
            say!("Cheapest: {}, {} mm from row to row.\n", pass.cutter, pass.step_over_mm);
            Ok(pass)
        }
        None => Err(Failure::FellShort(format!(
            "no cutter of {} keeps to a relative RMS error of {}: the least met was {least:.4}; polish more or less, take smaller step-overs, or ask for less",
            path.display(),
            wish.error
        ))),
    }
}

fn error_of(piece: &Workpiece, pass: &Pass, polish: Option<Polish>) -> Result<f64, Failure> {
    let milled = mill(&piece.surface, pass)?;
    let view = match polish {
        Some(polish) => piece.look(&polished(&milled.surface, &piece.surface, polish))?,
        None => look_at_scallops(&piece.examiner, &piece.block, &piece.surface, milled)?.0,
    };
    Ok(view.metrics.rel_rms)
}
