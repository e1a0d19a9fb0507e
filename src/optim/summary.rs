use std::{fmt, time::Duration};

/// Why an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// The stated criterion was met.
    Converged,
    /// The iteration limit came first. A reported outcome, not a success.
    IterationLimit,
    /// No step along the search direction improved the objective any more.
    Stalled,
    /// Whoever watched wanted no more.
    Cancelled,
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::IterationLimit => "iteration limit",
            Self::Stalled => "no further progress",
            Self::Cancelled => "cancelled",
        })
    }
}

/// One iteration of a solver on one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// The objective after the iteration, or the norm of the residual for a solver of equations.
    pub objective: f64,
    /// Norm of the gradient; 0 where the solver has none.
    pub gradient_norm: f64,
    /// Accepted step length along the search direction.
    pub step: f64,
    /// Evaluations of the objective or residual that it took.
    pub evaluations: usize,
}

/// Everything that happened on one grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// What was done: "pyramid", "height-aware pass 1", "closed loop 2".
    pub stage: String,
    /// Nodes along x.
    pub nx: usize,
    /// Nodes along y.
    pub ny: usize,
    /// Why it ended.
    pub termination: Termination,
    /// Every iteration, in order.
    pub iterations: Vec<Iteration>,
    /// Wall time by the caller's clock ([`Progress::clock`](crate::solver::Progress::clock)).
    pub elapsed: Duration,
}

/// Everything that a solver did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Every level, in order.
    pub levels: Vec<Level>,
    /// What was chosen automatically.
    pub notes: Vec<String>,
    /// What the user should know: an unconverged level, a fold, where the solution is weakest.
    pub warnings: Vec<String>,
}

impl Summary {
    /// Iterations over all levels.
    pub fn iterations(&self) -> usize {
        self.levels.iter().map(|level| level.iterations.len()).sum()
    }

    /// Levels that stopped at their iteration limit.
    pub fn levels_at_limit(&self) -> usize {
        self.levels.iter().filter(|level| level.termination == Termination::IterationLimit).count()
    }
}
