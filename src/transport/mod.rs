//! The transport solver: the optical path on the receiver, of which warp and true displaced height follow in closed form.

mod border;
mod carry;
mod correction;
mod equation;
mod height;
mod krylov;
mod light;
mod newton;
mod options;
mod path;
mod pyramid;
mod report;
mod rounds;
mod soften;
mod spline;
mod start;
mod uneven;
mod unfold;

pub use options::{BlackFloor, Options, OptionsError, Quality};

use crate::{
    bench::Bench,
    irradiance::TargetIrradiance,
    optim::Summary,
    solver::{Progress, Solution, SolveError, Solver, check_nodes},
};

/// The transport solver; see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transport {
    /// What the caller chose.
    pub options: Options,
}

impl Transport {
    /// Cells of the finest receiver grid on which this solver works, along x and y: what its memory and its time are made of.
    pub fn receiver_cells(&self, pixels: (usize, usize), nodes: (usize, usize)) -> (usize, usize) {
        pyramid::receiver_cells(&self.options, pixels, nodes)
    }
}

/// Its name in messages.
const NAME: &str = "transport";

impl Solver for Transport {
    fn solve(
        &self,
        target: &TargetIrradiance,
        bench: &Bench,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        self.options.validate().map_err(|error| SolveError::Unsupported { solver: NAME, what: error.to_string() })?;
        check_nodes(NAME, nodes)?;
        let mut summary = Summary::default();
        start::check(bench)?;
        let mut solved = pyramid::solve(&self.options, target, bench, nodes, progress, &mut summary)
            .map_err(|error| start::explain(error, bench))?;
        height::settle(&mut solved, bench, nodes, progress, &mut summary)?;
        let (surface, light) = rounds::close(&self.options, solved, bench, nodes, progress, &mut summary)?;
        start::check_light_reaches(&surface, bench)?;
        Ok(Solution { surface, light: Some(light), summary })
    }
}

#[cfg(test)]
mod tests;
