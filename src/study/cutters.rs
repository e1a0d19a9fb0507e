//! The cheapest of many cutters and step-overs that still draws the picture.

use super::{
    mill::{mill, polished},
    progress::{advance, begin},
    workpiece::{Workpiece, view_milled, walls_of},
};
use crate::{
    fabricate::{Direction, Pass},
    failure::Failure,
    solver::Progress,
    spec::CutterList,
    surface::Polish,
};

/// What is required of a cutter.
pub struct CutterRequirements {
    /// Relative RMS error in the end, at most.
    pub error: f64,
    /// Of the rows.
    pub direction: Direction,
    /// What the pass leaves on the face.
    pub allowance_mm: f64,
    /// The polish after it.
    pub polish: Option<Polish>,
}

/// A cutter that was tried.
pub struct CutterTrial {
    /// What the shop calls it.
    pub name: String,
    /// The coarsest pass that keeps to the error; none if none does.
    pub best: Option<TrialPass>,
}

/// The coarsest pass of a cutter that keeps to the error.
pub struct TrialPass {
    /// The pass.
    pub pass: Pass,
    /// Relative RMS error after it.
    pub error: f64,
    /// Way of the cutter.
    pub length_mm: f64,
    /// At the feed of the list.
    pub minutes: f64,
}

/// Step-overs that are tried where the list names none, mm.
const STEP_OVERS_MM: [f64; 9] = [0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.035, 0.025];

/// Tries the cutters of a list. The error grows with the step-over: for every cutter the greatest
/// that keeps to it is found by bisection among those listed. Gives every trial to `tried`, and
/// returns the pass of least time, or the least error that was met.
///
/// # Errors
/// A cutter that does not fit the block.
pub fn cheapest(
    list: &CutterList,
    piece: &Workpiece,
    requirements: &CutterRequirements,
    progress: &dyn Progress,
    mut tried: impl FnMut(&CutterTrial),
) -> Result<Result<Pass, f64>, Failure> {
    begin(progress, "trying cutters", list.cutter.len())?;
    let mut chosen: Option<(f64, Pass)> = None;
    let mut least = f64::INFINITY;
    for (k, entry) in list.cutter.iter().enumerate() {
        let mut step_overs: Vec<f64> = match entry.step_overs.as_slice() {
            [] => STEP_OVERS_MM.into_iter().filter(|s| *s <= 2.0 * entry.cutter.radius_mm()).collect(),
            named => named.iter().map(|length| length.mm).collect(),
        };
        step_overs.sort_by(|a, b| b.total_cmp(a));
        let pass = |step_over_mm: f64| Pass {
            cutter: entry.cutter,
            step_over_mm,
            direction: requirements.direction,
            allowance_mm: requirements.allowance_mm,
        };
        for step_over_mm in &step_overs {
            pass(*step_over_mm).check(piece.surface.extent()).map_err(Failure::refused)?;
        }
        // The first that is good enough, as all after it are.
        let (mut low, mut high, mut found) = (0, step_overs.len(), None);
        while low < high {
            let middle = low.midpoint(high);
            let error = error_of(piece, &pass(step_overs[middle]), requirements.polish)?;
            least = least.min(error);
            if error <= requirements.error {
                (high, found) = (middle, Some((step_overs[middle], error)));
            } else {
                low = middle + 1;
            }
        }
        let best = found.map(|(step_over_mm, error)| {
            let pass = pass(step_over_mm);
            let cost = pass.cost(&piece.surface.contour());
            TrialPass { pass, error, length_mm: cost.length_mm, minutes: cost.minutes(entry.feed.mm_per_minute) }
        });
        if let Some(best) = best.as_ref().filter(|best| chosen.is_none_or(|(least, _)| best.minutes < least)) {
            chosen = Some((best.minutes, best.pass));
        }
        let name = entry.name.clone().unwrap_or_else(|| entry.cutter.in_words());
        tried(&CutterTrial { name, best });
        advance(progress, k + 1)?;
    }
    Ok(chosen.map(|(_, pass)| pass).ok_or(least))
}

fn error_of(piece: &Workpiece, pass: &Pass, polish: Option<Polish>) -> Result<f64, Failure> {
    let walls = walls_of(&piece.block, &piece.surface, pass.cutter);
    let milled = mill(&piece.surface, pass, walls.as_ref())?;
    let view = match polish {
        Some(polish) => piece.view(&polished(&milled.surface, &piece.surface, polish))?,
        None => view_milled(&piece.examiner, &piece.block, &piece.surface, milled)?.0,
    };
    Ok(view.metrics.rel_rms)
}
