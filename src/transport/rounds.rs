//! The closed loop: look at the light of the true surface, and ask for less where there is too much
//! (Richardson and Lucy).

use super::{
    TransportOptions,
    carry::Carrier,
    correction::{Correction, GENTLE, STAGES},
    equation::State,
    level::{FORCING, NAME, RMS, Solved, record},
    light::relative_rms,
    newton::{Criterion, Halt},
    path::OpticalPath,
    report,
    soften::{self, soften},
    uneven,
    unfold::unfold,
};
use crate::{
    bench::Bench,
    forward::{self, Caustic, Geometry},
    grid::Field,
    optim::{Summary, Termination},
    solver::{Event, Progress, SolveError},
    surface::{HeightField, SurfaceSpline},
};

/// Greatest correction of the mean height that can be meant, as a share of the distance.
const MOST_SHIFT: f64 = 0.01;
/// A round is solved when its residual is no more than this share of the error that was seen: the
/// next round is told what was solved, if there is one.
const RESIDUAL_SHARE: f64 = 0.2;
const LAST_RESIDUAL_SHARE: f64 = 0.12;
/// Newton steps of a round; the start is close.
const STEPS: usize = 12;

/// A first error beyond which the loop starts with the gentle stage.
const HARD: f64 = 0.1;
/// Light in folds, as a share of all, that a picture does not need: more is that of creases, which
/// a picture with black has.
const NEEDLESS: f64 = 1e-3;
const NEEDLESS_WITH_BLACK: f64 = 5e-5;
/// Black: less than this share of the mean light.
const BLACK: f64 = 0.05;
/// Most times that folds are taken out of a face.
const UNFOLDINGS: usize = 3;
/// A round that takes away less than this share of the error is the last of its stage.
const LEAST_GAIN: f64 = 0.03;

/// The best that was found so far.
struct Best {
    surface: HeightField,
    seen: Caustic,
    error: f64,
    /// What could not be had, and what softening cost.
    flaws: report::Flaws,
    state: State,
    /// The iteration that led here did not converge.
    unconverged: bool,
}

impl Best {
    /// Takes out folds that the picture does not need.
    ///
    /// # Errors
    /// A solve that was cancelled.
    fn unfold(
        &mut self,
        bench: &Bench,
        beams: Beams,
        wanted: &Field<f64>,
        progress: &dyn Progress,
    ) -> Result<(), SolveError> {
        let cells = (wanted.nx(), wanted.ny());
        let needless = if wanted.min_max().0 < BLACK * wanted.mean() { NEEDLESS_WITH_BLACK } else { NEEDLESS };
        for _ in 0..UNFOLDINGS {
            if self.seen.folds.is_empty() || self.seen.folded > needless {
                break;
            }
            let lattice = beams.lattice(&self.surface, cells);
            let surface = unfold(&self.surface, bench, lattice, &self.seen.folds, progress)?;
            let seen = light_of(&surface, bench, beams, cells);
            let error = relative_rms(&seen.irradiance, wanted);
            tracing::debug!(error, folded = seen.folded, "without its folds");
            if seen.folded >= self.seen.folded {
                break;
            }
            if let Some(softened) = &mut self.flaws.softened {
                let violations = soften::count(&surface, bench, softened.radius_mm);
                if violations > softened.violations {
                    break;
                }
                softened.violations = violations;
            }
            (self.surface, self.seen, self.error) = (surface, seen, error);
        }
        Ok(())
    }
}

/// Carries the solution to the lens and improves it in a closed loop; the best surface met is
/// returned, with its light.
///
/// # Errors
/// Where the face would reach the receiver, and a solve that was cancelled.
pub(super) fn close(
    options: &TransportOptions,
    solved: Solved,
    bench: &Bench,
    nodes: (usize, usize),
    progress: &dyn Progress,
    summary: &mut Summary,
) -> Result<(HeightField, Field<f64>), SolveError> {
    let Solved { cells, per_cell, grid, mut light, mut state, mut newton } = solved;
    let mut rounds = options.rounds(&bench.contour());
    let mut carrier = Carrier::new(bench.contour(), nodes);
    let path = OpticalPath::new(bench);
    let mut best: Option<Best> = None;
    let mut correction: Option<Correction> = None;
    let mut stage = 0;
    let mut unconverged = false;
    let mut unsoftened = f64::INFINITY;
    progress.tell(Event::Stage { name: "closed loop", steps: rounds })?;
    for round in 0.. {
        progress.tell(Event::Iteration)?;
        let began = progress.clock();
        let carried = carrier.heights(&path, &state.spline);
        // Nodes that were missed may lie anywhere, and would spoil the mean.
        let mean = carried.mean_mm(bench);
        if carried.missed == 0 && mean.abs() < MOST_SHIFT * bench.distance_mm() {
            newton.height_mm -= mean;
        }
        let surface = HeightField::outlined(bench.block(), bench.outline(), carried.heights_mm);
        let highest = surface.range_mm().1;
        // Also where a height is not a number.
        if highest.is_nan() || bench.receiver().clearance_mm(bench.block(), highest) <= 0.0 {
            if best.is_some() {
                break;
            }
            return Err(SolveError::ReachesReceiver { height_mm: highest, distance_mm: bench.distance_mm() });
        }
        // What is cut is sharper than what shines; the loop corrects for the waves that are given
        // up.
        let surface = match options.finish {
            Some(finish) => finish.prepared(&surface),
            None => surface,
        };
        let light_after_finish = |surface: &HeightField| {
            let finished = options.finish.map(|finish| finish.finished(surface));
            // What a first rough look gets wrong the others see, if it is the same everywhere.
            let beams = if round == 0 && rounds > 0 && bench.is_evenly_lit() {
                Beams::Rough
            } else {
                Beams::PerNode(options.beams())
            };
            light_of(finished.as_ref().unwrap_or(surface), bench, beams, (cells.nx(), cells.ny()))
        };
        let mut flaws = report::Flaws { missed: carried.missed, softened: None, unconverged: false };
        let (surface, seen) = match options.min_radius_mm {
            None => {
                let seen = light_after_finish(&surface);
                (surface, seen)
            }
            Some(radius_mm) => {
                unsoftened = unsoftened.min(relative_rms(&light_after_finish(&surface).irradiance, &cells));
                let softened = soften(surface, bench, radius_mm);
                flaws.softened = Some(report::Softening { radius_mm, violations: softened.violations });
                let seen = light_after_finish(&softened.surface);
                (softened.surface, seen)
            }
        };
        let error = relative_rms(&seen.irradiance, &cells);
        tracing::debug!(round, stage, error, folded = seen.folded, "the light of the surface");
        let correction = match &mut correction {
            None => correction.insert(Correction::new(
                light.clone(),
                seen.irradiance.clone(),
                &cells,
                per_cell,
                &bench.contour(),
            )),
            Some(correction) => {
                correction.learn(&light, &seen.irradiance, &cells);
                correction
            }
        };
        if round == 0 && error > HARD {
            // White on black: creases are what the lens cannot hold, and firm corrections only fold
            // them.
            stage = GENTLE;
            rounds = options.hard_rounds();
        }
        let gain = best.as_ref().map_or(1.0, |best| 1.0 - error / best.error);
        if gain > 0.0 {
            best = Some(Best { surface, seen, error, flaws, state: state.clone(), unconverged });
        }
        stage += usize::from(gain.is_nan() || gain < LEAST_GAIN);
        let Some(best) = best.as_ref() else { break };
        if round >= rounds || stage >= STAGES.len() {
            break;
        }
        if gain.is_nan() || gain <= 0.0 {
            state.clone_from(&best.state);
        }
        correction.next(&cells, options.floor(), stage, &mut light);
        let share = if round + 1 < rounds { RESIDUAL_SHARE } else { LAST_RESIDUAL_SHARE };
        let criterion = Criterion { rms: RMS.max(share * best.error), steps: STEPS, forcing: FORCING };
        let outcome = match uneven::run(&mut newton, bench, grid, &light, &mut state, criterion, progress) {
            Ok(outcome) => outcome,
            Err(Halt::Cancelled) => return Err(SolveError::Cancelled),
            // What was found before stands.
            Err(Halt::NoRays) => break,
        };
        newton.account(&mut light);
        unconverged = outcome.termination != Termination::Converged;
        let elapsed = progress.clock().saturating_sub(began);
        summary.levels.push(record(format!("closed loop {}", round + 1), grid, outcome, elapsed));
        if let Some(level) = summary.levels.last() {
            tracing::debug!(?level, "level done");
        }
        progress.tell(Event::Step { done: round + 1 })?;
    }
    let Some(mut best) = best else {
        return Err(SolveError::Failed {
            solver: NAME,
            nx: nodes.0,
            ny: nodes.1,
            why: "the light of the surface is not a number".into(),
        });
    };
    if options.finish.is_none() && rounds > 0 {
        best.unfold(bench, Beams::PerNode(options.beams()), &cells, progress)?;
    }
    let flaws = report::Flaws { unconverged: best.unconverged, ..best.flaws };
    report::describe(&best.seen, &cells, best.error, &flaws, unsoftened, bench, summary);
    Ok((best.surface, best.seen.irradiance))
}

/// How closely the light is looked at.
#[derive(Clone, Copy)]
enum Beams {
    /// Three beams per cell of the picture along each axis.
    Rough,
    /// So many per lens cell, and at least three per cell of the picture, however few nodes there
    /// are.
    PerNode(usize),
}

impl Beams {
    /// Beams along x and y.
    fn lattice(self, surface: &HeightField, cells: (usize, usize)) -> (usize, usize) {
        let along = |nodes: usize, cells: usize| match self {
            Self::Rough => (3 * cells).min(8 * (nodes - 1)).max(nodes - 1),
            Self::PerNode(beams) => (nodes - 1) * beams.max((3 * cells).div_ceil(nodes - 1).min(8)),
        };
        (along(surface.heights_mm().nx(), cells.0), along(surface.heights_mm().ny(), cells.1))
    }
}

/// The light of a surface on the window's cells.
fn light_of(surface: &HeightField, bench: &Bench, beams: Beams, cells: (usize, usize)) -> Caustic {
    let lattice = beams.lattice(surface, cells);
    forward::irradiance(&SurfaceSpline::through(surface), bench, Geometry::Displaced, lattice, cells)
}
