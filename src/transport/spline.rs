//! The unknown as a bicubic B-spline on the receiver: coefficients on its nodes and one ring of
//! ghosts around them.

use super::map::Jet;
use crate::{
    bench::Bench,
    grid::{Extent, Field},
};
use glam::DVec2;
use rayon::prelude::*;

/// Nodes that span the receiver window edge to edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReceiverGrid {
    /// Cells along x and y.
    pub(super) cells: (usize, usize),
    origin: DVec2,
    pub(super) spacing: DVec2,
    /// Size of the rectangle, mm.
    pub(super) size_mm: DVec2,
}

impl ReceiverGrid {
    pub(super) fn new(bench: &Bench, cells: (usize, usize)) -> Self {
        let window = bench.window();
        Self {
            cells,
            origin: bench.window_centre_mm() + window.lower(),
            spacing: window.as_vec() / DVec2::new(cells.0 as f64, cells.1 as f64),
            size_mm: window.as_vec(),
        }
    }

    /// Nodes that span another rectangle around the axis.
    pub(super) fn across(extent: Extent, cells: (usize, usize)) -> Self {
        let spacing = extent.as_vec() / DVec2::new(cells.0 as f64, cells.1 as f64);
        Self { cells, origin: extent.lower(), spacing, size_mm: extent.as_vec() }
    }

    /// Nodes along x and y.
    pub(super) fn nodes(&self) -> (usize, usize) {
        (self.cells.0 + 1, self.cells.1 + 1)
    }

    /// A position in units of nodes, as a point on the receiver, mm.
    #[inline(always)]
    pub(super) fn point(&self, position: DVec2) -> DVec2 {
        self.origin + position * self.spacing
    }

    /// A point on the receiver, mm, as a position in units of nodes.
    #[inline(always)]
    pub(super) fn position(&self, point: DVec2) -> DVec2 {
        (point - self.origin) / self.spacing
    }

    #[inline(always)]
    pub(super) fn node(&self, i: usize, j: usize) -> DVec2 {
        self.point(DVec2::new(i as f64, j as f64))
    }
}

/// Derivatives of the unknown along the outward axis on the four borders of the window, at the
/// border's nodes: `u_x` on the left and right, `u_y` on the lower and upper one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BorderSlopes {
    pub(super) left: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl BorderSlopes {
    pub(super) fn zero(cells: (usize, usize)) -> Self {
        let (x, y) = (vec![0.0; cells.0 + 1], vec![0.0; cells.1 + 1]);
        Self { left: y.clone(), right: y, lower: x.clone(), upper: x }
    }

    /// Of an unknown with these slopes at the nodes of a grid.
    pub(super) fn of((nx, ny): (usize, usize), slope: impl Fn(usize, usize) -> DVec2) -> Self {
        Self {
            left: (0..ny).map(|j| slope(0, j).x).collect(),
            right: (0..ny).map(|j| slope(nx - 1, j).x).collect(),
            lower: (0..nx).map(|i| slope(i, 0).y).collect(),
            upper: (0..nx).map(|i| slope(i, ny - 1).y).collect(),
        }
    }

    /// The sides in the order left, right, lower, upper.
    pub(super) fn sides_mut(&mut self) -> [&mut Vec<f64>; 4] {
        [&mut self.left, &mut self.right, &mut self.lower, &mut self.upper]
    }

    /// The same, to read.
    pub(super) fn sides(&self) -> [&Vec<f64>; 4] {
        [&self.left, &self.right, &self.lower, &self.upper]
    }

    fn are_zero(&self) -> bool {
        self.sides().iter().all(|side| side.iter().all(|&v| v == 0.0))
    }

    /// `u_xy` in the corners (left lower, right lower, left upper, right upper), where two borders
    /// meet: the mean of what their slopes say.
    fn twists(&self, spacing: DVec2) -> [f64; 4] {
        let begin = |v: &[f64], h: f64| (4.0 * v[1] - 3.0 * v[0] - v[2]) / (2.0 * h);
        let end = |v: &[f64], h: f64| {
            let n = v.len();
            (3.0 * v[n - 1] + v[n - 3] - 4.0 * v[n - 2]) / (2.0 * h)
        };
        [
            0.5 * (begin(&self.left, spacing.y) + begin(&self.lower, spacing.x)),
            0.5 * (begin(&self.right, spacing.y) + end(&self.lower, spacing.x)),
            0.5 * (end(&self.left, spacing.y) + begin(&self.upper, spacing.x)),
            0.5 * (end(&self.right, spacing.y) + end(&self.upper, spacing.x)),
        ]
    }
}

/// The unknown `u(y)`. Coefficient `(i + 1, j + 1)` belongs to node `(i, j)`; the outermost ring
/// are ghosts, which carry the border slopes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PathSpline {
    pub(super) grid: ReceiverGrid,
    pub(super) coefficients: Field<f64>,
}

impl PathSpline {
    pub(super) fn zero(grid: ReceiverGrid) -> Self {
        let (nx, ny) = grid.nodes();
        Self { grid, coefficients: Field::filled(nx + 2, ny + 2, 0.0) }
    }

    /// The spline through values at the nodes with the given slopes on the border.
    pub(super) fn through(grid: ReceiverGrid, values: &Field<f64>, slopes: &BorderSlopes) -> Self {
        let (nx, ny) = grid.nodes();
        let h = grid.spacing;
        let mut along_x = vec![0.0; (nx + 2) * ny];
        along_x.par_chunks_mut(nx + 2).enumerate().for_each(|(j, row)| {
            row[1..=nx].copy_from_slice(values.row(j));
            clamped(row, h.x, slopes.left[j], slopes.right[j]);
        });
        let twists = slopes.twists(h);
        let ends =
            [(&slopes.lower, twists[0], twists[1]), (&slopes.upper, twists[2], twists[3])].map(|(side, a, b)| {
                let mut ends = vec![0.0; nx + 2];
                ends[1..=nx].copy_from_slice(side);
                clamped(&mut ends, h.x, a, b);
                ends
            });
        // Columns are solved in place after a transposition; each is contiguous then.
        let mut columns = vec![0.0; (nx + 2) * (ny + 2)];
        columns.par_chunks_mut(ny + 2).enumerate().for_each(|(i, column)| {
            for j in 0..ny {
                column[j + 1] = along_x[j * (nx + 2) + i];
            }
            clamped(column, h.y, ends[0][i], ends[1][i]);
        });
        let mut data = vec![0.0; (nx + 2) * (ny + 2)];
        data.par_chunks_mut(nx + 2).enumerate().for_each(|(j, row)| {
            for (i, c) in row.iter_mut().enumerate() {
                *c = columns[i * (ny + 2) + j];
            }
        });
        Self { grid, coefficients: Field::from_vec(nx + 2, ny + 2, data) }
    }

    /// The same function on another grid of the same window (exactly, if that one divides this
    /// one's cells).
    pub(super) fn on(&self, grid: ReceiverGrid) -> (Self, BorderSlopes) {
        let (nx, ny) = grid.nodes();
        let scale =
            DVec2::new(self.grid.cells.0 as f64 / grid.cells.0 as f64, self.grid.cells.1 as f64 / grid.cells.1 as f64);
        let at = |i: usize, j: usize| self.jet(DVec2::new(i as f64, j as f64) * scale);
        let mut values = vec![0.0; nx * ny];
        values.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            row.iter_mut().enumerate().for_each(|(i, v)| *v = at(i, j).value);
        });
        let slopes = BorderSlopes::of((nx, ny), |i, j| at(i, j).slope);
        (Self::through(grid, &Field::from_vec(nx, ny, values), &slopes), slopes)
    }

    /// Sets the ghosts so that the border has the given slopes.
    pub(super) fn set_ghosts(&mut self, slopes: &BorderSlopes) {
        let (nx, ny) = self.grid.nodes();
        let h = self.grid.spacing;
        let c = &mut self.coefficients;
        if slopes.are_zero() {
            reflect(c);
            return;
        }
        let twists = slopes.twists(h);
        let spline = |side: &[f64], h: f64, a: f64, b: f64| {
            let mut g = vec![0.0; side.len() + 2];
            g[1..=side.len()].copy_from_slice(side);
            clamped(&mut g, h, a, b);
            g
        };
        let left = spline(&slopes.left, h.y, twists[0], twists[2]);
        let right = spline(&slopes.right, h.y, twists[1], twists[3]);
        let lower = spline(&slopes.lower, h.x, twists[0], twists[1]);
        let upper = spline(&slopes.upper, h.x, twists[2], twists[3]);
        for j in 1..=ny {
            c[(0, j)] = c[(2, j)] - 2.0 * h.x * left[j];
            c[(nx + 1, j)] = c[(nx - 1, j)] + 2.0 * h.x * right[j];
        }
        for i in 0..nx + 2 {
            c[(i, 0)] = c[(i, 2)] - 2.0 * h.y * lower[i];
            c[(i, ny + 1)] = c[(i, ny - 1)] + 2.0 * h.y * upper[i];
        }
    }

    /// Value and derivatives at node `(i, j)`.
    pub(super) fn node_jet(&self, i: usize, j: usize) -> Jet {
        let rows = [0, 1, 2].map(|l| &self.coefficients.row(j + l)[i..i + 3]);
        let column = |k: usize| along_y(rows[0][k], rows[1][k], rows[2][k], self.grid.spacing.y);
        along_x([column(0), column(1), column(2)], self.grid.spacing.x)
    }

    /// Calls `f(i, jet)` for every node of row `j`.
    #[inline(always)]
    pub(super) fn row_jets(&self, j: usize, mut f: impl FnMut(usize, Jet)) {
        let rows = [0, 1, 2].map(|l| self.coefficients.row(j + l));
        let h = self.grid.spacing;
        let column = |k: usize| along_y(rows[0][k], rows[1][k], rows[2][k], h.y);
        let mut three = [[0.0; 3], column(0), column(1)];
        for i in 0..self.grid.cells.0 + 1 {
            three = [three[1], three[2], column(i + 2)];
            f(i, along_x(three, h.x));
        }
    }

    /// Value and derivatives at a position in units of nodes that may lie beyond the window: there
    /// parabolas go on from the places of the window that are nearest to it and to its
    /// surroundings, which are as wide as it is far (Whitney's extension), so that detail of the
    /// border fades.
    pub(super) fn jet_beyond(&self, position: DVec2) -> Jet {
        let most = DVec2::new(self.grid.cells.0 as f64, self.grid.cells.1 as f64);
        let within = |position: DVec2| position.clamp(DVec2::ZERO, most);
        let far = (position - within(position)).length();
        if far == 0.0 {
            return self.jet(position);
        }
        let mut sum = Jet::default();
        for (j, of_row) in (-2..=2).zip(AROUND) {
            for (i, of_column) in (-2..=2).zip(AROUND) {
                let from = within(position + DVec2::new(f64::from(i), f64::from(j)) * (0.25 * far));
                let jet = self.jet(from);
                let step = (position - from) * self.grid.spacing;
                let rise = jet.hessian() * step;
                let weight = of_row * of_column;
                sum.value += weight * (jet.value + jet.slope.dot(step) + 0.5 * rise.dot(step));
                sum.slope += weight * (jet.slope + rise);
                sum.curvature.iter_mut().zip(jet.curvature).for_each(|(sum, v)| *sum += weight * v);
            }
        }
        sum
    }

    /// Value and derivatives at a position in units of nodes, which is clamped to the window.
    #[inline(always)]
    pub(super) fn jet(&self, position: DVec2) -> Jet {
        let (mx, my) = self.grid.cells;
        let (i, wx) = weights(position.x, mx);
        let (j, wy) = weights(position.y, my);
        let mut sums = [[0.0; 3]; 3];
        for l in 0..4 {
            let row = &self.coefficients.row(j + l)[i..i + 4];
            for (k, w) in wx.iter().enumerate() {
                let along = w[0] * row[0] + w[1] * row[1] + w[2] * row[2] + w[3] * row[3];
                for (m, v) in wy.iter().enumerate() {
                    sums[k][m] += v[l] * along;
                }
            }
        }
        let h = self.grid.spacing;
        Jet {
            value: sums[0][0],
            slope: DVec2::new(sums[1][0], sums[0][1]) / h,
            curvature: [sums[2][0] / (h.x * h.x), sums[1][1] / (h.x * h.y), sums[0][2] / (h.y * h.y)],
        }
    }
}

/// Weights of five places in a row.
const AROUND: [f64; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

/// Even reflection: the ghosts of a function without slope on the border.
pub(super) fn reflect(c: &mut Field<f64>) {
    let (nx, ny) = (c.nx(), c.ny());
    for j in 1..ny - 1 {
        c[(0, j)] = c[(2, j)];
        c[(nx - 1, j)] = c[(nx - 3, j)];
    }
    for i in 0..nx {
        c[(i, 0)] = c[(i, 2)];
        c[(i, ny - 1)] = c[(i, ny - 3)];
    }
}

/// Value, slope and curvature along y of a column of three coefficients.
#[inline(always)]
fn along_y(below: f64, at: f64, above: f64, h: f64) -> [f64; 3] {
    [
        (below + 4.0 * at + above) * (1.0 / 6.0),
        (above - below) * (0.5 / h),
        (below - 2.0 * at + above) * (1.0 / (h * h)),
    ]
}

#[inline(always)]
fn along_x([a, b, c]: [[f64; 3]; 3], h: f64) -> Jet {
    let value = |k: usize| (a[k] + 4.0 * b[k] + c[k]) * (1.0 / 6.0);
    let rise = 0.5 / h;
    Jet {
        value: value(0),
        slope: DVec2::new((c[0] - a[0]) * rise, value(1)),
        curvature: [(a[0] - 2.0 * b[0] + c[0]) * (1.0 / (h * h)), (c[1] - a[1]) * rise, value(2)],
    }
}

/// The first of four coefficients that matter at a position, and their weights for value, slope and
/// curvature.
#[inline(always)]
fn weights(position: f64, cells: usize) -> (usize, [[f64; 4]; 3]) {
    let position = position.clamp(0.0, cells as f64);
    let cell = (position as usize).min(cells - 1);
    let t = position - cell as f64;
    let s = 1.0 - t;
    let value = [
        s * s * s / 6.0,
        (4.0 - (6.0 - 3.0 * t) * t * t) / 6.0,
        (4.0 - (6.0 - 3.0 * s) * s * s) / 6.0,
        t * t * t / 6.0,
    ];
    let slope = [-0.5 * s * s, (1.5 * t - 2.0) * t, (2.0 - 1.5 * s) * s, 0.5 * t * t];
    (cell, [value, slope, [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t]])
}

/// Replaces values in `c[1..=n]` by the coefficients `c[0..n + 2]` of the cubic spline through them
/// with these end slopes.
pub(super) fn clamped(c: &mut [f64], h: f64, begin: f64, end: f64) {
    let n = c.len() - 2;
    // (c[i-1] + 4 c[i] + c[i+1]) / 6 = v[i], c[-1] = c[1] - 2 h begin, c[n] = c[n-2] + 2 h end; the
    // pivots converge to 2 - sqrt 3 so quickly that storing them does not pay.
    let mut pivots = [0.0; PIVOTS];
    c[1] = 1.5 * c[1] + 0.5 * h * begin;
    let mut pivot = 0.5;
    for i in 2..=n {
        pivots[(i - 2).min(PIVOTS - 1)] = pivot;
        if i < n {
            let next = 1.0 / (4.0 - pivot);
            c[i] = (6.0 * c[i] - c[i - 1]) * next;
            pivot = next;
        } else {
            c[i] = (6.0 * c[i] - 2.0 * h * end - 2.0 * c[i - 1]) / (4.0 - 2.0 * pivot);
        }
    }
    for i in (1..n).rev() {
        c[i] -= pivots[(i - 1).min(PIVOTS - 1)] * c[i + 1];
    }
    c[0] = c[2] - 2.0 * h * begin;
    c[n + 1] = c[n - 1] + 2.0 * h * end;
}

/// After so many steps of elimination the pivot has converged to rounding.
const PIVOTS: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bench::ExitFace, grid::Extent};

    fn grid(cells: (usize, usize)) -> ReceiverGrid {
        let bench = Bench::new(Extent::new(10.0, 6.0), 50.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        ReceiverGrid::new(&bench, cells)
    }

    fn cubic(p: DVec2) -> Jet {
        Jet {
            value: 0.1 * p.x.powi(3) - 0.2 * p.x * p.y + 0.05 * p.y.powi(3) + 2.0,
            slope: DVec2::new(0.3 * p.x * p.x - 0.2 * p.y, -0.2 * p.x + 0.15 * p.y * p.y),
            curvature: [0.6 * p.x, -0.2, 0.3 * p.y],
        }
    }

    fn spline(grid: ReceiverGrid) -> (PathSpline, BorderSlopes) {
        let (nx, ny) = grid.nodes();
        let values = Field::from_fn(nx, ny, |i, j| cubic(grid.node(i, j)).value);
        let slopes = BorderSlopes::of((nx, ny), |i, j| cubic(grid.node(i, j)).slope);
        (PathSpline::through(grid, &values, &slopes), slopes)
    }

    fn close(a: &Jet, b: &Jet) -> bool {
        (a.value - b.value).abs() < 1e-10
            && (a.slope - b.slope).length() < 1e-9
            && a.curvature.iter().zip(b.curvature).all(|(p, q)| (p - q).abs() < 1e-8)
    }

    #[test]
    fn cubics_are_reproduced_everywhere_with_all_derivatives() {
        for cells in [(2, 2), (3, 5), (40, 33), (64, 4)] {
            let grid = grid(cells);
            let (spline, _) = spline(grid);
            for k in 0..100 {
                let at = DVec2::new(f64::from(k) / 99.0, f64::from(k * 37 % 100) / 99.0)
                    * DVec2::new(cells.0 as f64, cells.1 as f64);
                assert!(close(&spline.jet(at), &cubic(grid.point(at))), "{cells:?} at {at}");
            }
            for j in 0..=cells.1 {
                spline.row_jets(j, |i, jet| {
                    assert!(close(&jet, &cubic(grid.node(i, j))) && close(&jet, &spline.node_jet(i, j)));
                });
            }
        }
    }

    #[test]
    fn ghosts_carry_the_slopes_of_the_border() {
        let (mut spline, slopes) = spline(grid((9, 7)));
        let before = spline.coefficients.clone();
        spline.set_ghosts(&slopes);
        for (a, b) in spline.coefficients.as_slice().iter().zip(before.as_slice()) {
            assert!((a - b).abs() < 1e-10);
        }
    }

    #[test]
    fn another_grid_holds_the_same_function() {
        let (coarse, _) = spline(grid((5, 4)));
        for cells in [(10, 8), (10, 4), (23, 17)] {
            let (fine, _) = coarse.on(grid(cells));
            for (i, j) in [(0, 0), (1, 3), (4, 2), (cells.0, cells.1)] {
                assert!(close(&fine.node_jet(i, j), &cubic(fine.grid.node(i, j))));
            }
        }
    }
}
