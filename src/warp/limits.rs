//! What brightness warping can do.

use crate::{
    bench::Bench,
    grid::{Field, Outline},
    light::Light,
    solver::SolveError,
};

/// Least irradiance of a quad, relative to the mean.
pub const LEAST_TARGET: f64 = 1e-3;

pub(super) const NAME: &str = "warping";
pub(super) const NAME_PAPER: &str = "warping-paper";

pub(super) fn check_light(cells: &Field<f64>, limit: f64) -> Result<(), SolveError> {
    let least = cells.min_max().0 / cells.mean();
    if least < limit { Err(SolveError::TooDark { least, limit }) } else { Ok(()) }
}

pub(super) fn check_bench(solver: &'static str, bench: &Bench) -> Result<(), SolveError> {
    let what = match bench.light() {
        _ if bench.outline() != Outline::Rectangle => "blocks that are not rectangular",
        _ if !bench.known_faces().is_empty() => "light that comes through other faces first",
        Light::Point { .. } => "light from a point source",
        Light::Parallel { .. } if bench.profile().is_some() => "light that is spread unevenly over the block",
        Light::Parallel { .. } if bench.receiver().is_turned() => "a receiver that leans",
        Light::Parallel { .. } => return Ok(()),
    };
    Err(SolveError::Unsupported { solver, what, able: "transport" })
}
