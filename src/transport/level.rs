//! What is solved on a grid of the receiver, and the criteria that all levels share.

use super::{
    equation::State,
    newton::{Newton, Outcome},
    spline::ReceiverGrid,
};
use crate::{grid::Field, optim::Level};
use std::time::Duration;

/// The solver's name in messages.
pub(super) const NAME: &str = "transport";
/// Name of the levels' stage.
pub(super) const STAGE: &str = "pyramid";
/// Root mean square of the residual at which a level is solved. The residual is twice the error of
/// the irradiance, more where it is dark.
pub(super) const RMS: f64 = 3e-4;
/// Reduction asked of a linear solve.
pub(super) const FORCING: f64 = 0.1;

/// The solution on the finest receiver grid, and what its closed loop needs.
#[derive(Debug)]
pub(super) struct Solved {
    /// The target as far as the lens can draw it.
    pub(super) cells: Field<f64>,
    /// Receiver cells per target cell along x and y.
    pub(super) per_cell: (usize, usize),
    pub(super) grid: ReceiverGrid,
    /// The light at the receiver's nodes that was solved for.
    pub(super) light: Field<f64>,
    pub(super) state: State,
    pub(super) newton: Newton,
}

/// What was done on a grid, for the summary.
pub(super) fn record(stage: String, grid: ReceiverGrid, outcome: Outcome, elapsed: Duration) -> Level {
    let (nx, ny) = grid.nodes();
    Level { stage, nx, ny, termination: outcome.termination, iterations: outcome.iterations, elapsed }
}
