//! Coarse to fine: every level solves for as much of the picture as its grid can hold.

use super::{
    NAME, Options,
    equation::State,
    light,
    newton::{Criterion, Halt, Newton, Outcome},
    spline::ReceiverGrid,
    start, uneven,
};
use crate::{
    bench::Bench,
    grid::{Field, area_resample},
    irradiance::TargetIrradiance,
    light::Light,
    optim::{Level, Summary},
    solver::{Progress, SolveError},
};
use std::time::Duration;

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

/// Name of the levels' stage.
pub(super) const STAGE: &str = "pyramid";
/// Coarsest receiver grid, cells along its shorter side.
const COARSEST: usize = 12;
/// Least receiver cells along the shorter side of the finest grid, so that tiny pictures have edges too.
const LEAST: usize = 64;
/// Most receiver cells along a side: 16 million nodes take about 3 GB.
const MOST: usize = 4096;
/// Root mean square of the residual at which a level is solved. The residual is twice the error of the irradiance, more where
/// it is dark.
pub(super) const RMS: f64 = 3e-4;
/// The same for the finest level if the closed loop goes on from there: that is told what was solved.
const GOES_ON_RMS: f64 = 5e-3;
/// Most Newton steps on a level.
const STEPS: usize = 30;
/// Reduction asked of a linear solve.
pub(super) const FORCING: f64 = 0.1;

/// How the picture is divided on the finest grid: its cells, and receiver cells per cell.
fn divide(options: &Options, pixels: (usize, usize), nodes: (usize, usize)) -> ((usize, usize), (usize, usize)) {
    let axis = |pixels: usize, nodes: usize| pixels.min(nodes.saturating_sub(1).max(TargetIrradiance::LEAST_CELLS));
    let cells = (axis(pixels.0, nodes.0).max(1), axis(pixels.1, nodes.1).max(1));
    let wanted = options.per_cell();
    let least = LEAST.div_ceil(cells.0.min(cells.1)).max(wanted);
    let per_cell = |n: usize| least.min((MOST / n).max(1));
    (cells, (per_cell(cells.0), per_cell(cells.1)))
}

/// Cells of the finest receiver grid on which a picture is solved for.
pub(super) fn receiver_cells(options: &Options, pixels: (usize, usize), nodes: (usize, usize)) -> (usize, usize) {
    let (cells, per_cell) = divide(options, pixels, nodes);
    (cells.0 * per_cell.0, cells.1 * per_cell.1)
}

/// Solves for the light of the target's cells.
///
/// # Errors
/// Where the numerics break down, and a solve that was cancelled.
pub(super) fn solve(
    options: &Options,
    target: &TargetIrradiance,
    bench: &Bench,
    nodes: (usize, usize),
    progress: &dyn Progress,
    summary: &mut Summary,
) -> Result<Solved, SolveError> {
    let (finest, per_cell) = divide(options, (target.cells().nx(), target.cells().ny()), nodes);
    let mut sizes = vec![finest];
    loop {
        let (nx, ny) = sizes[sizes.len() - 1];
        if (nx * per_cell.0).min(ny * per_cell.1) < 2 * COARSEST || nx.min(ny) < 2 * TargetIrradiance::LEAST_CELLS {
            break;
        }
        sizes.push((nx.div_ceil(2), ny.div_ceil(2)));
    }
    let floor = options.floor();
    if target.cells().min_max().0 < floor {
        summary.notes.push(format!("black parts of the picture get {floor} of the mean light"));
    }
    progress.begin("transport", sizes.len());
    let mut state: Option<State> = None;
    let mut height_mm = 0.0;
    for (done, &size) in sizes.iter().rev().enumerate() {
        let began = progress.clock();
        let cells = area_resample(target.cells(), size.0, size.1);
        let mut light = light::nodal(&cells, per_cell, floor);
        light::normalise(&mut light);
        let grid = ReceiverGrid::new(bench, (size.0 * per_cell.0, size.1 * per_cell.1));
        let mut current = match state.take() {
            Some(coarse) => {
                let (spline, slopes) = coarse.spline.on(grid);
                State { spline, slopes, mu: bench.contour().share_of_extent().ln() }
            }
            None => start::plain(bench, grid),
        };
        let mut newton = Newton::new(&current);
        newton.height_mm = height_mm;
        // Near a source the mean height comes first, and needs the solution itself.
        let goes_on = done + 1 == sizes.len()
            && options.rounds(&bench.contour()) > 0
            && matches!(bench.light(), Light::Parallel { .. });
        let criterion = Criterion { rms: if goes_on { GOES_ON_RMS } else { RMS }, steps: STEPS, forcing: FORCING };
        if done == 0 {
            start::round_corners(bench, grid, &light, &mut newton, &mut current, criterion, progress)?;
        }
        let outcome = uneven::run(&mut newton, bench, grid, &light, &mut current, criterion, progress).map_err(
            |halt| match halt {
                Halt::Cancelled => SolveError::Cancelled,
                Halt::NoRays => SolveError::Failed {
                    solver: NAME,
                    nx: grid.nodes().0,
                    ny: grid.nodes().1,
                    why: "the start asks for rays beyond the limit of refraction".into(),
                },
            },
        )?;
        newton.account(&mut light);
        height_mm = newton.height_mm;
        summary.levels.push(record(STAGE.into(), grid, outcome, progress.clock().saturating_sub(began)));
        if let Some(level) = summary.levels.last() {
            tracing::debug!(?level, "level done");
        }
        progress.advance(done + 1);
        if done + 1 == sizes.len() {
            return Ok(Solved { cells, per_cell, grid, light, state: current, newton });
        }
        state = Some(current);
    }
    unreachable!("the finest level is always there")
}

pub(super) fn record(stage: String, grid: ReceiverGrid, outcome: Outcome, elapsed: Duration) -> Level {
    let (nx, ny) = grid.nodes();
    Level { stage, nx, ny, termination: outcome.termination, iterations: outcome.iterations, elapsed }
}
