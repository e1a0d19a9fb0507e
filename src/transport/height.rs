//! The mean height of the face in the light of a point source.
//!
//! Newton's iteration holds the mean height over the receiver's nodes, which is that over the
//! lens's nodes up to an error of the discretisation. Near a source that error changes the size of
//! the picture. The closed loop would take it for an error of the light, while moving the face as
//! well; so it is removed before.

use super::{
    carry::Carrier,
    level::{FORCING, RMS, STAGE, Solved, record},
    newton::{Criterion, Halt},
    path::OpticalPath,
    uneven,
};
use crate::{
    bench::Bench,
    light::Light,
    optim::{Summary, Termination},
    solver::{Progress, SolveError},
};

/// Most corrections; each leaves a few percent.
const CORRECTIONS: usize = 3;
/// Newton steps of a correction; the start is close.
const STEPS: usize = 12;
/// A mean height that does no harm, as a share of the nearer of source and receiver.
const ENOUGH: f64 = 2e-5;

/// Moves the face so that the mean of the lens's nodes is 0.
///
/// # Errors
/// A solve that was cancelled.
pub(super) fn recentre(
    solved: &mut Solved,
    bench: &Bench,
    nodes: (usize, usize),
    progress: &dyn Progress,
    summary: &mut Summary,
) -> Result<(), SolveError> {
    let Light::Point { position_mm, .. } = bench.light() else { return Ok(()) };
    let near_mm = bench.distance_mm().min(position_mm.z.abs());
    let path = OpticalPath::new(bench);
    let mut carrier = Carrier::new(bench.contour(), nodes);
    for _ in 0..CORRECTIONS {
        let began = progress.clock();
        let carried = carrier.heights(&path, &solved.state.spline);
        let mean = carried.mean_mm(bench);
        // Nodes that were missed may lie anywhere, and would spoil the mean.
        if carried.missed > 0 || mean.is_nan() || mean.abs() < ENOUGH * near_mm {
            return Ok(());
        }
        solved.newton.height_mm -= mean;
        let mut state = solved.state.clone();
        let criterion = Criterion { rms: RMS, steps: STEPS, forcing: FORCING };
        match uneven::run(&mut solved.newton, bench, solved.grid, &solved.light, &mut state, criterion, progress) {
            Ok(outcome) if outcome.termination == Termination::Converged => {
                solved.state = state;
                let elapsed = progress.clock().saturating_sub(began);
                summary.levels.push(record(STAGE.into(), solved.grid, outcome, elapsed));
            }
            Err(Halt::Cancelled) => return Err(SolveError::Cancelled),
            // What was found before stands; the closed loop may do better.
            _ => {
                solved.newton.height_mm += mean;
                return Ok(());
            }
        }
    }
    Ok(())
}
