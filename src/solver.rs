//! What every solver of the inverse problem takes and gives.
//!
//! A [`Problem`] says what is asked for, [`Progress`] watches and may end the work, a [`Solution`]
//! holds the faces that were found. Solvers use no clock, no files and no threads of their own:
//! their loops run on the current pool of `rayon`, which is the calling thread where there are
//! none.

mod error;
mod problem;
mod progress;

pub use error::{SolveError, TwoFacesError};
pub use problem::{FreeFaces, Problem, Target};
pub use progress::{Event, Progress, Silent};

use crate::{grid::Field, optim::Summary, surface::HeightField};

/// The faces that were solved for, and how they were found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Solution {
    /// The exit face.
    pub exit: HeightField,
    /// The entry face, if it was free.
    pub entry: Option<EntryFace>,
    /// Where it is weak: the light of these faces as the solver sees it, one field for every target
    /// in its order, on the cells of the target as far as the nodes can draw it, mean 1 if none is
    /// lost. Empty from solvers that do not look at the light of their result.
    pub light: Vec<Field<f64>>,
    /// What the solver did.
    pub summary: Summary,
}

/// An entry face that is not planar.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryFace {
    /// Heights along +z over its mean plane.
    pub surface: HeightField,
    /// From its mean plane to that of the exit face, mm.
    pub thickness_mm: f64,
}

impl Solution {
    /// An exit face, found as the summary says.
    pub fn new(exit: HeightField, summary: Summary) -> Self {
        Self { exit, entry: None, light: Vec::new(), summary }
    }

    /// The same with the entry face that goes with it.
    #[must_use]
    pub fn with_entry(self, entry: EntryFace) -> Self {
        Self { entry: Some(entry), ..self }
    }

    /// The same with the light of every target.
    #[must_use]
    pub fn with_light(self, light: Vec<Field<f64>>) -> Self {
        Self { light, ..self }
    }
}

/// Finds faces whose light draws the targets of a problem.
///
/// Results are bit-identical for any number of threads.
pub trait Solver {
    /// Solves for faces of `nx` by `ny` height nodes.
    ///
    /// # Errors
    /// A problem that this solver does not do, a picture that physics forbids on this bench,
    /// numerics that break down, and [`SolveError::Cancelled`]. Reaching an iteration limit is no
    /// error: the [`Summary`] reports it.
    fn solve(
        &self,
        problem: &Problem<'_>,
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
    Err(SolveError::Nodes { solver, nx, ny, least: *NODES.start(), greatest: *NODES.end() })
}
