//! Coarse to fine: every level solves for as much of the picture as its grid can hold.

use super::{
    TransportOptions,
    equation::State,
    level::{FORCING, NAME, RMS, STAGE, Solved, record},
    light,
    newton::{Criterion, Halt, Newton},
    spline::ReceiverGrid,
    start, uneven,
};
use crate::{
    bench::Bench,
    grid::area_resample,
    irradiance::TargetIrradiance,
    light::Light,
    optim::Summary,
    solver::{Event, Progress, SolveError},
};

/// Coarsest receiver grid, cells along its shorter side.
const COARSEST: usize = 12;
/// Residual, root mean square, at which the finest level is solved if the closed loop goes on from
/// there: that is told what was solved.
const GOES_ON_RMS: f64 = 5e-3;
/// Most Newton steps on a level.
const STEPS: usize = 30;
/// Solves for the light of the target's cells.
///
/// # Errors
/// Where the numerics break down, and a solve that was cancelled.
pub(super) fn solve(
    options: &TransportOptions,
    target: &TargetIrradiance,
    bench: &Bench,
    nodes: (usize, usize),
    progress: &dyn Progress,
    summary: &mut Summary,
) -> Result<Solved, SolveError> {
    let (finest, per_cell) = options.divide((target.cells().nx(), target.cells().ny()), nodes);
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
    progress.tell(Event::Stage { name: "transport", steps: sizes.len() })?;
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
        progress.tell(Event::Step { done: done + 1 })?;
        if done + 1 == sizes.len() {
            return Ok(Solved { cells, per_cell, grid, light, state: current, newton });
        }
        state = Some(current);
    }
    unreachable!("the finest level is always there")
}
