//! The transport solver: the optical path on the receiver, of which warp and true displaced height
//! follow in closed form.

mod border;
mod carry;
mod correction;
mod equation;
mod height;
mod krylov;
mod level;
mod light;
mod map;
mod newton;
mod options;
mod path;
mod pyramid;
mod report;
mod rounds;
mod soften;
mod spline;
mod start;
mod two_faces;
mod uneven;
mod unfold;

pub use options::{BlackFloor, Quality, TransportOptions, TransportOptionsError};
pub use two_faces::TwoFaces;

use crate::{
    optim::Summary,
    solver::{Problem, Progress, Solution, SolveError, Solver, check_nodes},
};
use level::NAME;

/// The transport solver; see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transport {
    options: TransportOptions,
}

impl Transport {
    /// A solver with these options.
    ///
    /// # Errors
    /// An option outside of its limits.
    pub fn new(options: TransportOptions) -> Result<Self, TransportOptionsError> {
        options.validate()?;
        Ok(Self { options })
    }

    /// A solver for looking, see [`Quality::Draft`].
    pub fn draft() -> Self {
        Self { options: TransportOptions::new(Quality::Draft) }
    }

    /// What it works with.
    pub fn options(&self) -> &TransportOptions {
        &self.options
    }
}

impl Solver for Transport {
    fn solve(
        &self,
        problem: &Problem<'_>,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        let (bench, target) = problem.single(NAME)?;
        check_nodes(NAME, nodes)?;
        let mut summary = Summary::default();
        start::check(bench)?;
        let mut solved = pyramid::solve(&self.options, target, bench, nodes, progress, &mut summary)
            .map_err(|error| start::explain(error, bench))?;
        height::recentre(&mut solved, bench, nodes, progress, &mut summary)?;
        let (surface, light) = rounds::close(&self.options, solved, bench, nodes, progress, &mut summary)?;
        start::check_light_reaches(&surface, bench)?;
        Ok(Solution::new(surface, summary).with_light(vec![light]))
    }
}

#[cfg(test)]
mod tests;
