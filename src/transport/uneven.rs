//! Light that is spread unevenly over the block. Where a ray gets `w` times the flux, the face must
//! spread it over `w` times the area: the equation is that of even light which shall draw `f / w`,
//! `w` taken where the ray of every node leaves the block. The rays follow from the solution, so
//! that the two are found in turns.

use super::{
    equation::{Equation, State},
    light,
    newton::{Criterion, Halt, Newton, Outcome},
    path::OpticalPath,
    spline::ReceiverGrid,
};
use crate::{bench::Bench, grid::Field, light::Profile, solver::Progress};
use rayon::prelude::*;

/// Most turns; on benches with a torch each leaves about a tenth of the change before.
const TURNS: usize = 8;
/// A change of the light, root mean square, that is not worth another turn.
const ENOUGH: f64 = 2e-4;

/// Runs Newton's iteration for the wanted light on a bench, however its own light is spread.
///
/// # Errors
/// See [`Halt`].
pub(super) fn run(
    newton: &mut Newton,
    bench: &Bench,
    grid: ReceiverGrid,
    wanted: &Field<f64>,
    state: &mut State,
    criterion: Criterion,
    progress: &dyn Progress,
) -> Result<Outcome, Halt> {
    let Some(profile) = bench.profile() else {
        return newton.run(&Equation::new(bench, grid, wanted), state, criterion, progress);
    };
    let path = OpticalPath::new(bench);
    let mut even = evened(profile, &path, state, wanted);
    let mut outcome = newton.run(&Equation::new(bench, grid, &even), state, criterion, progress)?;
    for _ in 1..TURNS {
        let next = evened(profile, &path, state, wanted);
        let change = rms_change(&even, &next);
        if change < ENOUGH {
            break;
        }
        even = next;
        let more = newton.run(&Equation::new(bench, grid, &even), state, criterion, progress)?;
        outcome.termination = more.termination;
        outcome.iterations.extend(more.iterations);
    }
    Ok(outcome)
}

/// `f / w` at the receiver's nodes, of mean 1.
fn evened(profile: &Profile, path: &OpticalPath<'_>, state: &State, wanted: &Field<f64>) -> Field<f64> {
    let (mut even, grid) = (wanted.clone(), state.spline.grid);
    let nx = even.nx();
    even.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        state.spline.row_jets(j, |i, jet| {
            let y = grid.node(i, j);
            if let Some(ray) = path.ray(y, jet.value, jet.slope) {
                row[i] /= profile.at(path.crossing_point(y, &ray)).max(Profile::LEAST);
            }
        });
    });
    light::normalise(&mut even);
    even
}

/// Root mean square of the relative change.
fn rms_change(before: &Field<f64>, after: &Field<f64>) -> f64 {
    let sum: f64 = before.as_slice().iter().zip(after.as_slice()).map(|(a, b)| (b / a - 1.0) * (b / a - 1.0)).sum();
    (sum / before.as_slice().len() as f64).sqrt()
}
