//! The closed loop: look at the light of the true surface, and ask for less where there is too much (Richardson and Lucy).

use super::{
    NAME, Options,
    carry::Carrier,
    equation::Equation,
    light,
    newton::Criterion,
    pyramid::{FORCING, RMS, Solved, record},
};
use crate::{
    bench::Bench,
    forward::{self, Geometry},
    grid::Field,
    optim::Summary,
    solver::{Progress, SolveError},
    surface::{HeightField, SurfaceSpline},
};
use rayon::prelude::*;
use std::time::Instant;

/// Beams per lens cell along each axis.
const BEAMS: usize = 2;
/// Most that a round changes the logarithm of the light.
const MOST_CHANGE: f64 = 0.5;

/// Carries the solution to the lens and improves it in a closed loop; the best surface met is returned.
///
/// # Errors
/// Where the face would reach the receiver.
pub(super) fn close(
    options: &Options,
    solved: Solved,
    bench: &Bench,
    nodes: (usize, usize),
    progress: &dyn Progress,
    summary: &mut Summary,
) -> Result<HeightField, SolveError> {
    let Solved { cells, per_cell, grid, mut light, mut state, mut newton } = solved;
    let rounds = options.rounds();
    let mut carrier = Carrier::new(bench.block(), nodes);
    let mut best: Option<(f64, HeightField)> = None;
    progress.begin("closed loop", rounds);
    for round in 0..=rounds {
        let began = Instant::now();
        let carried = carrier.heights(&Equation::new(bench, grid, &light).path, &state.spline);
        newton.height_mm -= carried.heights_mm.mean();
        let surface = HeightField::new(bench.block(), carried.heights_mm);
        let highest = surface.heights_mm().min_max().1;
        if !(highest < bench.distance_mm()) {
            return Err(SolveError::ReachesReceiver { height_mm: highest, distance_mm: bench.distance_mm() });
        }
        if rounds == 0 {
            return Ok(surface);
        }
        let beams = ((nodes.0 - 1) * BEAMS, (nodes.1 - 1) * BEAMS);
        let spline = SurfaceSpline::through(&surface);
        let seen = forward::irradiance(&spline, bench, Geometry::Displaced, beams, (cells.nx(), cells.ny())).irradiance;
        let error = relative_rms(&seen, &cells);
        if std::env::var("TRY").is_ok() {
            eprintln!("round {round}: error {error:.5} missed {} carry+splat {:?}", carried.missed, began.elapsed());
        }
        let improved = best.as_ref().is_none_or(|(least, _)| error < *least);
        if improved {
            best = Some((error, surface));
        }
        if round == rounds {
            break;
        }
        correct(&mut light, &seen, &cells, per_cell, options.floor());
        let equation = Equation::new(bench, grid, &light);
        let criterion = Criterion { rms: RMS, steps: 3, forcing: FORCING };
        let outcome = newton.run(&equation, &mut state, criterion).ok_or_else(|| SolveError::Failed {
            solver: NAME,
            nx: grid.nodes().0,
            ny: grid.nodes().1,
            why: "the closed loop left the rays that exist".into(),
        })?;
        summary.levels.push(record(format!("closed loop {}", round + 1), grid, outcome, began));
        progress.advance(round + 1);
    }
    Ok(best.expect("the first round always gives a surface").1)
}

/// Root mean square of the difference, both with mean 1.
fn relative_rms(seen: &Field<f64>, wanted: &Field<f64>) -> f64 {
    let (a, b) = (seen.mean(), wanted.mean());
    let sum: f64 = seen.as_slice().iter().zip(wanted.as_slice()).map(|(s, w)| (s / a - w / b) * (s / a - w / b)).sum();
    (sum / seen.as_slice().len() as f64).sqrt()
}

/// Multiplies the light at the nodes by what the cells lack.
fn correct(light: &mut Field<f64>, seen: &Field<f64>, wanted: &Field<f64>, per_cell: (usize, usize), floor: f64) {
    let data = seen
        .as_slice()
        .iter()
        .zip(wanted.as_slice())
        .map(|(s, w)| ((s + floor) / (w + floor)).ln().clamp(-MOST_CHANGE, MOST_CHANGE))
        .collect();
    let excess = Field::from_vec(seen.nx(), seen.ny(), data);
    let factor = light::interpolate(&excess, per_cell, |d| (-d).exp());
    let nx = light.nx();
    light.as_mut_slice().par_chunks_mut(nx).zip(factor.as_slice().par_chunks(nx)).for_each(|(light, factor)| {
        light.iter_mut().zip(factor).for_each(|(light, factor)| *light *= factor);
    });
    light::normalise(light);
}
