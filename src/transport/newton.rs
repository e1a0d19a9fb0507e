//! Inexact Newton iteration on one grid: GMRES to a tenth, preconditioned by the operator's mean,
//! which is diagonal in cosines.

use super::{
    border::BorderRows,
    equation::{Equation, Row, State, Sums},
    krylov::Gmres,
    map::Map,
    spline::{BorderSlopes, PathSpline},
};
use crate::{
    grid::{
        Field,
        dct::{CosineFilter, Symmetry},
    },
    optim::{Iteration, Termination},
    solver::{Event, Progress},
};
use rayon::prelude::*;
use std::{f64::consts::PI, ops::ControlFlow};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Criterion {
    /// Converged when the root mean square of the residual is no more than this.
    pub(super) rms: f64,
    /// Most Newton steps.
    pub(super) steps: usize,
    /// Reduction of the residual asked of a linear solve.
    pub(super) forcing: f64,
}

/// What an iteration did.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) termination: Termination,
    pub(super) iterations: Vec<Iteration>,
}

/// Why an iteration gave nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Halt {
    /// The state asks for rays that do not exist.
    NoRays,
    /// The caller wants no result.
    Cancelled,
}

/// Most directions of a linear solve.
const DIRECTIONS: usize = 24;
/// Most halvings of a step.
const HALVINGS: usize = 8;

/// Most change of the logarithm of the light that a residual stands for to first order.
const MOST_ACCOUNTED: f64 = 0.5;

/// An error of the mean height, as a share of the distance, that does not matter even near a
/// source, where it changes the size of the picture.
const LEAST_SHIFT: f64 = 3e-6;

/// An iteration with its memory, for one grid.
#[derive(Debug)]
pub(super) struct Newton {
    residual: Vec<f32>,
    rows: Vec<Row>,
    preconditioner: Preconditioner,
    gmres: Gmres,
    variation: PathSpline,
    variation_slopes: BorderSlopes,
    trial: State,
    /// Mean height of the face over the receiver's nodes that puts the mean over the lens's nodes
    /// at 0, mm.
    pub(super) height_mm: f64,
}

impl Newton {
    pub(super) fn new(state: &State) -> Self {
        let grid = state.spline.grid;
        let (nx, ny) = grid.nodes();
        Self {
            residual: vec![0.0; nx * ny],
            rows: vec![[0.0; 7]; nx * ny],
            preconditioner: Preconditioner::new(grid),
            gmres: Gmres::default(),
            variation: PathSpline::zero(grid),
            variation_slopes: BorderSlopes::zero(grid.cells),
            trial: state.clone(),
            height_mm: 0.0,
        }
    }

    /// Improves `state`, whose border need not be fitted.
    ///
    /// # Errors
    /// See [`Halt`].
    pub(super) fn run(
        &mut self,
        equation: &Equation<'_, impl Map>,
        state: &mut State,
        criterion: Criterion,
        progress: &dyn Progress,
    ) -> Result<Outcome, Halt> {
        let mut iterations = Vec::new();
        let mut termination = Termination::IterationLimit;
        let mut sums = fit_and_recentre(equation, state, &mut self.residual, self.height_mm).ok_or(Halt::NoRays)?;
        while sums.rms > criterion.rms && iterations.len() < criterion.steps {
            let at = equation.linearise(state, &mut self.residual, &mut self.rows).ok_or(Halt::NoRays)?;
            let border = equation.linearise_border(state);
            let (change_of_mu, products) = self.solve(&at, &border, criterion.forcing, progress);
            if progress.report(Event::Iteration).is_break() {
                return Err(Halt::Cancelled);
            }
            let mut step = 1.0;
            let mut evaluations = 1;
            let accepted = loop {
                self.advance(state, step, change_of_mu);
                let after = fit_and_recentre(equation, &mut self.trial, &mut self.residual, self.height_mm);
                evaluations += 1;
                match after {
                    Some(after) if after.rms < (1.0 - 1e-3 * step) * at.rms => break Some(after),
                    _ if evaluations > HALVINGS => break None,
                    _ => step *= 0.5,
                }
            };
            let Some(after) = accepted else {
                termination = Termination::Stalled;
                break;
            };
            std::mem::swap(state, &mut self.trial);
            iterations.push(Iteration { objective: after.rms, gradient_norm: products as f64, step, evaluations });
            sums = after;
        }
        if sums.rms <= criterion.rms {
            termination = Termination::Converged;
        }
        Ok(Outcome { termination, iterations })
    }

    /// Changes the light that was asked for to what the last iteration solved for, to first order
    /// in the residual that it left.
    pub(super) fn account(&self, light: &mut Field<f64>) {
        let nx = light.nx();
        let known = self.residual.par_chunks(nx).zip(self.rows.par_chunks(nx));
        light.as_mut_slice().par_chunks_mut(nx).zip(known).for_each(|(light, (residual, rows))| {
            for ((light, residual), row) in light.iter_mut().zip(residual).zip(rows) {
                let of_mu = row[6];
                // Not where nothing was linearised since nothing was left.
                if of_mu < 0.0 {
                    *light *= f64::from(-residual / of_mu).clamp(-MOST_ACCOUNTED, MOST_ACCOUNTED).exp();
                }
            }
        });
    }

    /// Solves the linearised equation for the variation; returns the change of mu and the number of
    /// products it took.
    fn solve(&mut self, sums: &Sums, border: &BorderRows, forcing: f64, progress: &dyn Progress) -> (f64, usize) {
        let Self { residual, rows, preconditioner, gmres, variation, variation_slopes, .. } = self;
        preconditioner.tune(sums.principal);
        let mut mus = Vec::new();
        let solved = gmres.solve(residual, forcing, DIRECTIONS, |v, z, w| {
            progress.report(Event::Iteration)?;
            let mu = preconditioner.apply(v, rows, z);
            set_inner(variation, |j, inner| inner.copy_from_slice(preconditioner.row(j)));
            border.set_ghosts(variation, variation_slopes);
            product(rows, variation, mu, w);
            mus.push(mu);
            ControlFlow::Continue(())
        });
        let (weights, nx) = (&solved.weights, variation.grid.nodes().0);
        set_inner(variation, |j, inner| {
            inner.fill(0.0);
            for (weight, z) in weights.iter().zip(gmres.directions()) {
                inner.iter_mut().zip(&z[j * nx..(j + 1) * nx]).for_each(|(c, &z)| *c += weight * f64::from(z));
            }
        });
        border.set_ghosts(variation, variation_slopes);
        (weights.iter().zip(&mus).map(|(weight, mu)| weight * mu).sum(), weights.len())
    }

    /// Sets the trial state to `step` times the variation away from `state`.
    fn advance(&mut self, state: &State, step: f64, change_of_mu: f64) {
        let Self { trial, variation, variation_slopes, .. } = self;
        let nx = variation.coefficients.nx();
        trial.spline.coefficients.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
            let (from, change) = (state.spline.coefficients.row(j), variation.coefficients.row(j));
            out.iter_mut().zip(from).zip(change).for_each(|((out, a), b)| *out = a - step * b);
        });
        for ((out, from), change) in
            trial.slopes.sides_mut().into_iter().zip(state.slopes.sides()).zip(variation_slopes.sides())
        {
            out.iter_mut().zip(from).zip(change).for_each(|((out, a), b)| *out = a - step * b);
        }
        trial.mu = state.mu - step * change_of_mu;
    }
}

/// Fits the border, moves the face to the mean height `height_mm`, and computes the residual.
fn fit_and_recentre(
    equation: &Equation<'_, impl Map>,
    state: &mut State,
    residual: &mut [f32],
    height_mm: f64,
) -> Option<Sums> {
    // The last shifts are too small to see in the residual.
    let tolerance = LEAST_SHIFT * equation.map.distance_mm();
    for _ in 0..3 {
        equation.fit_border(state);
        let sums = equation.residual(state, residual)?;
        let miss = height_mm - sums.height_mm;
        if miss == 0.0 {
            return Some(sums);
        }
        state.shift(miss / sums.height_by_u);
        if miss.abs() <= tolerance {
            return Some(sums);
        }
    }
    equation.fit_border(state);
    equation.residual(state, residual)
}

/// Writes the inner coefficients row by row.
fn set_inner(spline: &mut PathSpline, write: impl Fn(usize, &mut [f64]) + Sync) {
    let (nx, ny) = spline.grid.nodes();
    spline.coefficients.as_mut_slice().par_chunks_mut(nx + 2).skip(1).take(ny).enumerate().for_each(|(j, row)| {
        write(j, &mut row[1..=nx]);
    });
}

/// The linearised residual of a variation.
pub(super) fn product(rows: &[Row], variation: &PathSpline, mu: f64, out: &mut [f32]) {
    let nx = variation.grid.nodes().0;
    out.par_chunks_mut(nx).zip(rows.par_chunks(nx)).enumerate().for_each(|(j, (out, rows))| {
        variation.row_jets(j, |i, jet| {
            let d = rows[i].map(f64::from);
            let [xx, xy, yy] = jet.curvature;
            out[i] = (d[0] * jet.value
                + d[1] * jet.slope.x
                + d[2] * jet.slope.y
                + d[3] * xx
                + d[4] * xy
                + d[5] * yy
                + d[6] * mu) as f32;
        });
    });
}

/// The inverse of the operator with its derivatives by `u_xx` and `u_yy` replaced by their means,
/// for B-spline collocation.
#[derive(Debug)]
struct Preconditioner {
    filter: CosineFilter,
    buffer: Field<f64>,
    /// Symbols of value and second derivative along x and y.
    along_x: Vec<[f64; 2]>,
    along_y: Vec<[f64; 2]>,
    principal: [f64; 3],
}

impl Preconditioner {
    fn new(grid: super::spline::ReceiverGrid) -> Self {
        let (nx, ny) = grid.nodes();
        let symbols = |cells: usize, h: f64| {
            (0..=cells)
                .map(|k| {
                    let cos = (PI * k as f64 / cells as f64).cos();
                    [(2.0 + cos) / 3.0, 2.0 * (cos - 1.0) / (h * h)]
                })
                .collect()
        };
        Self {
            filter: CosineFilter::new(Symmetry::Nodes, nx, ny),
            buffer: Field::filled(nx, ny, 0.0),
            along_x: symbols(grid.cells.0, grid.spacing.x),
            along_y: symbols(grid.cells.1, grid.spacing.y),
            principal: [1.0; 3],
        }
    }

    fn tune(&mut self, principal: [f64; 3]) {
        self.principal = principal;
    }

    /// The constant of `v` goes to mu, whose value is returned, the rest through the cosines.
    fn apply(&mut self, v: &[f32], rows: &[Row], z: &mut [f32]) -> f64 {
        let (nx, ny) = (self.buffer.nx(), self.buffer.ny());
        let [of_xx, of_yy, of_mu] = self.principal;
        let weight = super::equation::trapezoid;
        let sums: Vec<f64> = v
            .par_chunks(nx)
            .enumerate()
            .map(|(j, v)| weight(j, ny) * v.iter().enumerate().map(|(i, &v)| weight(i, nx) * f64::from(v)).sum::<f64>())
            .collect();
        let mu = sums.iter().sum::<f64>() / (((nx - 1) * (ny - 1)) as f64 * of_mu);
        self.buffer.as_mut_slice().par_chunks_mut(nx).zip(v.par_chunks(nx)).zip(rows.par_chunks(nx)).for_each(
            |((out, v), rows)| {
                for ((out, &v), row) in out.iter_mut().zip(v).zip(rows) {
                    *out = f64::from(v) - mu * f64::from(row[6]);
                }
            },
        );
        let (along_x, along_y) = (&self.along_x, &self.along_y);
        self.filter.apply(&mut self.buffer, |kx, ky| {
            if kx + ky == 0 {
                return 0.0;
            }
            let ([bx, cx], [by, cy]) = (along_x[kx], along_y[ky]);
            1.0 / (of_xx * cx * by + of_yy * bx * cy)
        });
        z.par_chunks_mut(nx).zip(self.buffer.as_slice().par_chunks(nx)).for_each(|(z, b)| {
            z.iter_mut().zip(b).for_each(|(z, &b)| *z = b as f32);
        });
        mu
    }

    /// A row of the last direction.
    fn row(&self, j: usize) -> &[f64] {
        self.buffer.row(j)
    }
}
