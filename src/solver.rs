//! What every solver of the inverse problem takes and gives.

use crate::{bench::Bench, grid::Field, irradiance::TargetIrradiance, optim::Summary, surface::HeightField};
use glam::{DVec2, DVec3};
use std::time::Duration;

/// Watches a long computation, and may end it. Calls come from the thread that started it.
pub trait Progress {
    /// A new stage begins, of `steps` steps.
    fn begin(&self, stage: &str, steps: usize);
    /// `done` of the stage's steps are done.
    fn advance(&self, done: usize);

    /// Whether nobody waits for the result any more. Solvers ask at every iteration, also of their linear systems, and end
    /// with [`SolveError::Cancelled`].
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Time since any fixed moment, by the caller's clock: solvers have none, and time the levels of their [`Summary`] by
    /// this one. Where it stands still, as by default, their times are 0.
    fn clock(&self) -> Duration {
        Duration::ZERO
    }
}

impl dyn Progress + '_ {
    /// Ends a computation that was cancelled.
    ///
    /// # Errors
    /// [`SolveError::Cancelled`].
    pub(crate) fn check(&self) -> Result<(), SolveError> {
        if self.is_cancelled() { Err(SolveError::Cancelled) } else { Ok(()) }
    }
}

/// Watches nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &str, _steps: usize) {}
    fn advance(&self, _done: usize) {}
}

/// Why no surface could be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Light would have to be bent by more than refraction can.
    #[error(
        "the light would be totally reflected inside the block at x = {:.2} mm, y = {:.2} mm: it would have to be bent by {deflection_deg:.1} degrees, and this material bends by less than {limit_deg:.1} degrees; move the receiver further away, take a smaller window or a higher index",
        at_mm.x, at_mm.y
    )]
    TotalInternalReflection {
        /// Point of the exit face, mm.
        at_mm: DVec2,
        /// Deflection asked for, degrees.
        deflection_deg: f64,
        /// Limit of the material, degrees.
        limit_deg: f64,
    },
    /// A target cell gets no light at all, and this solver divides by it.
    #[error(
        "the darkest part of the picture is {least:.2e} of the mean; this solver needs at least {limit:.0e}: add an offset (--offset 0.1)"
    )]
    TooDark {
        /// Least target irradiance, relative to the mean.
        least: f64,
        /// Least that the solver takes.
        limit: f64,
    },
    /// The surface would touch or pass the receiver.
    #[error(
        "the exit face would rise {height_mm:.1} mm above its mean plane, to the receiver at {distance_mm:.1} mm: move the receiver further away"
    )]
    ReachesReceiver {
        /// Highest point of the face, mm.
        height_mm: f64,
        /// Distance of the receiver, mm.
        distance_mm: f64,
    },
    /// The surface would cut through the entry face of its block, or rise past the source of its light.
    #[error(
        "the exit face would extend to z = {height_mm:.1} mm, past the {what} at z = {limit_mm:.1} mm: take a thicker block, or move receiver and light further away"
    )]
    ReachesLight {
        /// Lowest point of a face of glass, highest one of a mirror, mm.
        height_mm: f64,
        /// Where the light comes from, mm.
        limit_mm: f64,
        /// What is there.
        what: &'static str,
    },
    /// The light would have to be turned by more than a face between its source and the receiver can.
    #[error(
        "no face was found that draws this picture with the light source at ({}, {}, {}) mm: move the source further away, take a thicker block, or move the receiver further away",
        position_mm.x, position_mm.y, position_mm.z
    )]
    SourceTooNear {
        /// The source, mm.
        position_mm: DVec3,
    },
    /// The bench asks for something this solver does not do.
    #[error("the {solver} solver does not do {what}")]
    Unsupported {
        /// Name of the solver.
        solver: &'static str,
        /// What was asked for.
        what: String,
    },
    /// The caller wants no result any more, see [`Progress::is_cancelled`].
    #[error("the design was cancelled")]
    Cancelled,
    /// The numerics broke down; the result would be wrong.
    #[error("the {solver} solver failed on the level of {nx} x {ny} nodes: {why}")]
    Failed {
        /// Name of the solver.
        solver: &'static str,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
        /// What happened.
        why: String,
    },
}

/// A solved surface and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The exit face.
    pub surface: HeightField,
    /// Where it is weak: the light of this face as the solver sees it, on the cells of the target as far as the nodes can draw it,
    /// mean 1 if none is lost; from solvers that look at the light of their result.
    pub light: Option<Field<f64>>,
    /// What the solver did.
    pub summary: Summary,
}

/// Finds an exit face whose light draws the target.
///
/// Results are bit-identical for any number of threads.
pub trait Solver {
    /// Solves for a surface of `nx` by `ny` height nodes.
    ///
    /// # Errors
    /// Where physics forbids the picture on this bench, or the numerics break down. Reaching an iteration limit is no
    /// error: the [`Summary`] reports it.
    fn solve(
        &self,
        target: &TargetIrradiance,
        bench: &Bench,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError>;
}

/// Nodes along a side that solvers take.
const NODES: std::ops::RangeInclusive<usize> = 5..=16_385;

/// Refuses grids that hold no picture, or whose indices nobody has tried.
pub(crate) fn check_nodes(solver: &'static str, (nx, ny): (usize, usize)) -> Result<(), SolveError> {
    if NODES.contains(&nx) && NODES.contains(&ny) {
        return Ok(());
    }
    let what =
        format!("height fields of {nx} x {ny} nodes (both must lie between {} and {})", NODES.start(), NODES.end());
    Err(SolveError::Unsupported { solver, what })
}
