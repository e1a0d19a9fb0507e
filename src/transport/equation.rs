//! The collocated equation: light is conserved at every node of the receiver, and the window maps
//! onto the lens.
//!
//! With `A` the jacobian of the footprint, scaled to the unit squares of window and lens,
//! conservation is `det A = f e^mu`, `f` the target of mean 1. It is solved in its convex form
//!
//! ```text
//! R = tr A - S,   S = sqrt(d^2 + 4 A01 A10 + 4 f e^mu),   d = A00 - A11
//! ```
//!
//! which has no logarithm to break down in a black area, and picks the root with a positive trace.
//! `mu` absorbs the mismatch of total flux that the discretisation leaves.

use super::{
    map::Map,
    path::OpticalPath,
    spline::{BorderSlopes, PathSpline, ReceiverGrid},
};
use crate::{
    bench::Bench,
    grid::{Contour, Field},
};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// What is solved for.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) spline: PathSpline,
    pub(super) slopes: BorderSlopes,
    pub(super) mu: f64,
}

impl State {
    pub(super) fn zero(grid: ReceiverGrid) -> Self {
        Self { spline: PathSpline::zero(grid), slopes: BorderSlopes::zero(grid.cells), mu: 0.0 }
    }

    /// Adds a constant to the unknown: the whole face moves along the axis.
    pub(super) fn shift(&mut self, by: f64) {
        self.spline.coefficients.as_mut_slice().par_chunks_mut(CHUNK).for_each(|c| c.iter_mut().for_each(|v| *v += by));
    }
}

const CHUNK: usize = 8192;

/// Derivatives of the residual at a node with respect to `u, u_x, u_y, u_xx, u_xy, u_yy, mu`. In
/// single precision: they only steer an iteration that is exact to a tenth, the residual itself is
/// computed in double precision.
pub(super) type Row = [f32; 7];

/// The equation on one grid.
#[derive(Clone, Debug)]
pub(super) struct Equation<'a, M> {
    pub(super) map: M,
    pub(super) grid: ReceiverGrid,
    /// Target at the nodes, of trapezoidal mean 1.
    pub(super) light: &'a Field<f64>,
    /// `W_j / L_i` for the window `W` and the lens `L`.
    unit: DMat2,
    /// What the border of the window maps to.
    pub(super) contour: Contour,
}

/// Sums over the nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Root mean square of the residual.
    pub(super) rms: f64,
    /// Mean height of the face, mm, and its derivative with respect to a shift of `u`.
    pub(super) height_mm: f64,
    pub(super) height_by_u: f64,
    /// Means of the derivatives with respect to `u_xx`, `u_yy` and `mu`.
    pub(super) principal: [f64; 3],
}

impl<'a> Equation<'a, OpticalPath<'a>> {
    /// That of one free face.
    pub(super) fn new(bench: &'a Bench, grid: ReceiverGrid, light: &'a Field<f64>) -> Self {
        Self::of(OpticalPath::new(bench), grid, light, bench.contour())
    }
}

impl<'a, M: Map> Equation<'a, M> {
    /// That of a map of the grid's rectangle onto the `contour`.
    pub(super) fn of(map: M, grid: ReceiverGrid, light: &'a Field<f64>, contour: Contour) -> Self {
        let (window, lens) = (grid.size_mm, contour.extent().as_vec());
        let unit = DMat2::from_cols(window.x / lens, window.y / lens);
        Self { map, grid, light, unit, contour }
    }

    /// The residual at every node, and its sums; none if somewhere no ray exists.
    pub(super) fn residual(&self, state: &State, out: &mut [f32]) -> Option<Sums> {
        self.sweep(state, out.par_chunks_mut(self.grid.nodes().0).map(|row| (row, None)))
    }

    /// The residual and its derivatives at every node.
    pub(super) fn linearise(&self, state: &State, out: &mut [f32], rows: &mut [Row]) -> Option<Sums> {
        let nx = self.grid.nodes().0;
        self.sweep(state, out.par_chunks_mut(nx).zip(rows.par_chunks_mut(nx).map(Some)))
    }

    fn sweep<'b>(
        &self,
        state: &State,
        rows: impl IndexedParallelIterator<Item = (&'b mut [f32], Option<&'b mut [Row]>)>,
    ) -> Option<Sums> {
        let (nx, ny) = self.grid.nodes();
        let growth = state.mu.exp();
        let parts: Vec<Option<[f64; 7]>> = rows
            .enumerate()
            .map(|(j, (out, mut rows))| {
                let mut sums = [0.0; 7];
                let mut real = true;
                let light = self.light.row(j);
                let mut nearby = None;
                state.spline.row_jets(j, |i, jet| {
                    let y = self.grid.node(i, j);
                    let Some(ray) = self.map.ray(y, jet.value, jet.slope, nearby.as_ref()) else {
                        real = false;
                        return;
                    };
                    nearby = Some(ray);
                    let label = self.map.label(&ray);
                    let a = self.scaled(self.map.jacobian(&ray, &jet, &label));
                    let (residual, slope, of_mu) = convex(a, light[i] * growth * self.map.gain(&ray, &label));
                    out[i] = residual as f32;
                    let weight = trapezoid(i, nx) * trapezoid(j, ny);
                    let (height, by_u) = self.map.height(y, &ray);
                    sums[0] += residual * residual;
                    let area = self.map.area(&ray, &jet, light[i]);
                    sums[1] += weight * area * height;
                    sums[2] += weight * area * by_u;
                    sums[3] += weight * area;
                    if let Some(rows) = rows.as_deref_mut() {
                        let d = self.map.variation(&ray, &jet, &label, self.scaled(slope), of_mu);
                        rows[i] = [d[0], d[1], d[2], d[3], d[4], d[5], of_mu].map(|v| v as f32);
                        sums[4] += d[3];
                        sums[5] += d[5];
                        sums[6] += weight * of_mu;
                    }
                });
                real.then_some(sums)
            })
            .collect();
        let mut sums = [0.0; 7];
        for part in parts {
            sums.iter_mut().zip(part?).for_each(|(sum, v)| *sum += v);
        }
        let nodes = (nx * ny) as f64;
        let cells = (self.grid.cells.0 * self.grid.cells.1) as f64;
        Some(Sums {
            rms: (sums[0] / nodes).sqrt(),
            height_mm: sums[1] / sums[3],
            height_by_u: sums[2] / sums[3],
            principal: [sums[4] / nodes, sums[5] / nodes, sums[6] / cells],
        })
    }

    #[inline(always)]
    fn scaled(&self, a: DMat2) -> DMat2 {
        DMat2::from_cols(a.x_axis * self.unit.x_axis, a.y_axis * self.unit.y_axis)
    }
}

#[inline(always)]
pub(super) fn trapezoid(k: usize, n: usize) -> f64 {
    if k == 0 || k + 1 == n { 0.5 } else { 1.0 }
}

/// The convex residual of a jacobian, its gradient with respect to that, and its derivative with
/// respect to `mu`.
#[inline(always)]
fn convex(a: DMat2, light: f64) -> (f64, DMat2, f64) {
    let (a00, a10, a01, a11) = (a.x_axis.x, a.x_axis.y, a.y_axis.x, a.y_axis.y);
    let d = a00 - a11;
    // Negative only where the jacobian turns by more than it stretches, far from any solution.
    let s = (d * d + 4.0 * a01 * a10 + 4.0 * light).max(0.04 * light).sqrt();
    let slope = DMat2::from_cols(DVec2::new(1.0 - d / s, -2.0 * a01 / s), DVec2::new(-2.0 * a10 / s, 1.0 + d / s));
    (a00 + a11 - s, slope, -2.0 * light / s)
}
