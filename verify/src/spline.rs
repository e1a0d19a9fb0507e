//! The not-a-knot bicubic spline through heights on a regular grid.

use rayon::prelude::*;

/// The interpolating bicubic spline through nodes on a regular grid, with not-a-knot ends: what
/// FITPACK (and so SciPy's `RectBivariateSpline` without smoothing) gives on the same nodes.
///
/// On equidistant nodes the not-a-knot spline is a uniform B-spline whose third derivative is
/// continuous also at the first and last inner node, so one coefficient per node and one ghost row
/// around them describe it whole.
#[derive(Clone, Debug)]
pub(crate) struct Bicubic {
    lower: [f64; 2],
    per_mm: [f64; 2],
    cells: [usize; 2],
    /// `(nx + 2) x (ny + 2)` B-spline coefficients, row-major; node `(i, j)` is at
    /// `(i + 1, j + 1)`.
    coefficients: Vec<f64>,
}

/// Height and slopes at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet {
    pub(crate) z: f64,
    pub(crate) zx: f64,
    pub(crate) zy: f64,
}

impl Bicubic {
    /// Least number of nodes along a side: a cubic needs four.
    pub(crate) const LEAST_NODES: usize = 4;

    /// Interpolates `nx * ny` heights (row-major, rows along `+y`) whose first node is at `lower`
    /// and last at `upper`, mm.
    pub(crate) fn through(heights: &[f64], nx: usize, ny: usize, lower: [f64; 2], upper: [f64; 2]) -> Self {
        debug_assert!(nx >= Self::LEAST_NODES && ny >= Self::LEAST_NODES && heights.len() == nx * ny);
        let width = nx + 2;
        let mut coefficients = vec![0.0; width * (ny + 2)];
        let pivots_x = pivots(nx);
        coefficients[width..width * (ny + 1)].par_chunks_mut(width).zip(heights.par_chunks(nx)).for_each(|(row, h)| {
            row[1..=nx].copy_from_slice(h);
            interpolate(row, &pivots_x);
        });
        // Along y, a band of columns at a time: contiguous work for every thread, whatever their
        // number.
        let pivots_y = pivots(ny);
        let bands: Vec<Vec<f64>> = (0..width)
            .step_by(BAND)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|begin| {
                let columns = BAND.min(width - begin);
                let mut band = vec![0.0; columns * (ny + 2)];
                for (c, column) in band.chunks_mut(ny + 2).enumerate() {
                    for j in 1..=ny {
                        column[j] = coefficients[j * width + begin + c];
                    }
                    interpolate(column, &pivots_y);
                }
                band
            })
            .collect();
        coefficients.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
            for (b, band) in bands.iter().enumerate() {
                for (c, column) in band.chunks(ny + 2).enumerate() {
                    row[b * BAND + c] = column[j];
                }
            }
        });
        let per_mm = [(nx - 1) as f64 / (upper[0] - lower[0]), (ny - 1) as f64 / (upper[1] - lower[1])];
        Self { lower, per_mm, cells: [nx - 1, ny - 1], coefficients }
    }

    /// Height and slopes at `(x, y)`, mm. Outside of the grid the outermost polynomials go on.
    #[inline]
    pub(crate) fn jet(&self, x: f64, y: f64) -> Jet {
        let (i, wx, dx) = weights((x - self.lower[0]) * self.per_mm[0], self.cells[0]);
        let (j, wy, dy) = weights((y - self.lower[1]) * self.per_mm[1], self.cells[1]);
        let width = self.cells[0] + 3;
        let (mut z, mut zx, mut zy) = (0.0, 0.0, 0.0);
        for k in 0..4 {
            let begin = (j + k) * width + i;
            let c = &self.coefficients[begin..begin + 4];
            let value = wx[0] * c[0] + wx[1] * c[1] + wx[2] * c[2] + wx[3] * c[3];
            let slope = dx[0] * c[0] + dx[1] * c[1] + dx[2] * c[2] + dx[3] * c[3];
            z += wy[k] * value;
            zx += wy[k] * slope;
            zy += dy[k] * value;
        }
        Jet { z, zx: zx * self.per_mm[0], zy: zy * self.per_mm[1] }
    }
}

/// Where the columns of a lattice cross a spline, and with which weights.
#[derive(Clone, Debug)]
pub(crate) struct Columns(Vec<Column>);

#[derive(Clone, Copy, Debug)]
struct Column {
    cell: usize,
    value: [f64; 4],
    slope: [f64; 4],
}

impl Bicubic {
    /// What all rows of a lattice have in common whose columns are at these places, mm.
    pub(crate) fn columns(&self, xs: &[f64]) -> Columns {
        let column = |&x: &f64| {
            let (cell, value, slope) = weights((x - self.lower[0]) * self.per_mm[0], self.cells[0]);
            Column { cell, value, slope }
        };
        Columns(xs.iter().map(column).collect())
    }

    /// Calls `f` with every column of a row, by its number: the values of [`jet`](Self::jet), but
    /// for rounding. `scratch` is kept from row to row for its memory.
    pub(crate) fn row(&self, columns: &Columns, y: f64, scratch: &mut Vec<[f64; 2]>, mut f: impl FnMut(usize, Jet)) {
        let (j, wy, dy) = weights((y - self.lower[1]) * self.per_mm[1], self.cells[1]);
        let width = self.cells[0] + 3;
        let line = |k: usize| &self.coefficients[(j + k) * width..(j + k + 1) * width];
        let (a, b, c, d) = (line(0), line(1), line(2), line(3));
        // Along y once for all columns: coefficients of the height and of its slope along y.
        scratch.clear();
        scratch.extend((0..width).map(|i| {
            let along = |w: [f64; 4]| w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i];
            [along(wy), along(dy)]
        }));
        for (k, Column { cell, value, slope }) in columns.0.iter().enumerate() {
            let Some(&[p, q, r, s]) = scratch.get(*cell..cell + 4).and_then(|c| c.first_chunk()) else { continue };
            let along = |w: &[f64; 4], k: usize| w[0] * p[k] + w[1] * q[k] + w[2] * r[k] + w[3] * s[k];
            let zx = along(slope, 0) * self.per_mm[0];
            f(k, Jet { z: along(value, 0), zx, zy: along(value, 1) * self.per_mm[1] });
        }
    }
}

const BAND: usize = 16;

/// Cell index, B-spline weights and their derivatives (per cell) at `at` cells from the first node.
#[inline]
fn weights(at: f64, cells: usize) -> (usize, [f64; 4], [f64; 4]) {
    let cell = (at.max(0.0) as usize).min(cells - 1);
    let t = at - cell as f64;
    let s = 1.0 - t;
    let (t2, s2) = (t * t, s * s);
    let value = [s2 * s / 6.0, 2.0 / 3.0 - t2 + 0.5 * t2 * t, 2.0 / 3.0 - s2 + 0.5 * s2 * s, t2 * t / 6.0];
    let slope = [-0.5 * s2, 1.5 * t2 - 2.0 * t, 2.0 * s - 1.5 * s2, 0.5 * t2];
    (cell, value, slope)
}

/// Reciprocal pivots of the elimination of (1, 4, 1) for the inner unknowns.
fn pivots(n: usize) -> Vec<f64> {
    let mut previous = 0.0;
    (2..n.max(4) - 2)
        .map(|_| {
            previous = 1.0 / (4.0 - previous);
            previous
        })
        .collect()
}

/// Turns values at `line[1..=n]` into coefficients at `line[0..=n + 1]`, in place.
///
/// With `d_i = c_(i-1) - 2 c_i + c_(i+1)` the interpolation reads `f_i = c_i + d_i / 6`, and
/// not-a-knot at node 1 reads `d_0 - 2 d_1 + d_2 = 0`. The second difference of the former gives
/// `d_1 = f_0 - 2 f_1 + f_2`: the first inner coefficient is known outright (likewise the last),
/// the others follow from the system (1, 4, 1) between them.
fn interpolate(line: &mut [f64], pivots: &[f64]) {
    let n = line.len() - 2;
    let f = |line: &[f64], i: usize| line[i + 1];
    let ends = [f(line, 0), f(line, 1), f(line, n - 2), f(line, n - 1)];
    let first = ends[1] - (ends[0] - 2.0 * ends[1] + f(line, 2)) / 6.0;
    let last = ends[2] - (f(line, n - 3) - 2.0 * ends[2] + ends[3]) / 6.0;
    line[2] = first;
    line[n - 1] = last;
    // Unknowns c_2 .. c_(n-3), stored one further on.
    for k in 3..n - 1 {
        let rhs = 6.0 * line[k] - if k == n - 2 { last } else { 0.0 };
        line[k] = (rhs - line[k - 1]) * pivots[k - 3];
    }
    for k in (3..n - 2).rev() {
        line[k] -= pivots[k - 3] * line[k + 1];
    }
    line[1] = 6.0 * ends[1] - 4.0 * line[2] - line[3];
    line[0] = 6.0 * ends[0] - 4.0 * line[1] - line[2];
    line[n] = 6.0 * ends[2] - 4.0 * line[n - 1] - line[n - 2];
    line[n + 1] = 6.0 * ends[3] - 4.0 * line[n] - line[n - 1];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(nx: usize, ny: usize, f: impl Fn(f64, f64) -> f64) -> Bicubic {
        let (lower, upper) = ([-3.0, -2.0], [3.0, 2.5]);
        let at = |k: usize, n: usize, a: usize| lower[a] + (upper[a] - lower[a]) * k as f64 / (n - 1) as f64;
        let heights: Vec<f64> = (0..nx * ny).map(|k| f(at(k % nx, nx, 0), at(k / nx, ny, 1))).collect();
        Bicubic::through(&heights, nx, ny, lower, upper)
    }

    #[test]
    fn bicubic_polynomials_are_reproduced_with_their_slopes_up_to_the_border() {
        let f = |x: f64, y: f64| 0.3 + x - 0.2 * y + 0.1 * x * x * x - 0.05 * x * x * y * y + 0.02 * x * y * y * y;
        for (nx, ny) in [(4, 4), (5, 4), (6, 5), (23, 40)] {
            let spline = grid(nx, ny, f);
            for k in 0..400 {
                let (x, y) = (-3.0 + 6.0 * f64::from(k % 20) / 19.0, -2.0 + 4.5 * f64::from(k / 20) / 19.0);
                let jet = spline.jet(x, y);
                let zx = 1.0 + 0.3 * x * x - 0.1 * x * y * y + 0.02 * y * y * y;
                let zy = -0.2 - 0.1 * x * x * y + 0.06 * x * y * y;
                assert!((jet.z - f(x, y)).abs() < 1e-12, "{nx} x {ny} at {x}, {y}: {} for {}", jet.z, f(x, y));
                assert!((jet.zx - zx).abs() < 1e-11 && (jet.zy - zy).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn values_equal_those_of_scipy() {
        // h[j, i] = sin(1.3 i + 0.4 j) + 0.1 i j on xs = linspace(-3, 3, 7), ys = linspace(-2, 2.5,
        // 6); s = RectBivariateSpline(ys, xs, h); s(y, x), s(y, x, dy=1), s(y, x, dx=1), SciPy 1.x.
        let (nx, ny) = (7, 6);
        let heights: Vec<f64> = (0..nx * ny)
            .map(|k| ((k % nx) as f64, (k / nx) as f64))
            .map(|(i, j)| (1.3 * i + 0.4 * j).sin() + 0.1 * i * j)
            .collect();
        let spline = Bicubic::through(&heights, nx, ny, [-3.0, -2.0], [3.0, 2.5]);
        for [x, y, z, zx, zy] in SCIPY {
            let jet = spline.jet(x, y);
            assert!((jet.z - z).abs() < 1e-12 && (jet.zx - zx).abs() < 1e-12 && (jet.zy - zy).abs() < 1e-12, "{jet:?}");
        }
    }

    const SCIPY: [[f64; 5]; 5] = [
        [-2.9, -1.95, 0.1909991676548113, 1.6002995550292212, 0.45680859050184586],
        [0.37, 1.21, 0.7502025396302231, 1.5352993388463614, 0.7658159938033169],
        [2.999, 2.4, 2.6097092776795408, -1.137416037390124, 0.24572659548547424],
        [-1.5, 0.0, 0.6109891582690323, -1.0057656236809858, -0.24721740239096537],
        [1.25, -0.6, 0.5145860320134833, 1.4045777379930988, 0.9060711880480203],
    ];

    #[test]
    fn rows_give_what_points_give() {
        let spline = grid(23, 40, |x, y| (1.1 * x).sin() * (0.9 * y + 0.3).cos());
        let xs: Vec<f64> = (0..=90).map(|k| -3.0 + 6.0 * f64::from(k) / 90.0).collect();
        let (columns, mut scratch) = (spline.columns(&xs), Vec::new());
        for y in [-2.0, -1.3, 0.0, 0.77, 2.5] {
            let mut met = 0;
            spline.row(&columns, y, &mut scratch, |k, jet| {
                let one = spline.jet(xs[k], y);
                assert!(k == met && (jet.z - one.z).abs() < 1e-14);
                assert!((jet.zx - one.zx).abs() < 1e-13 && (jet.zy - one.zy).abs() < 1e-13);
                met += 1;
            });
            assert_eq!(met, xs.len());
        }
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_spacing() {
        let f = |x: f64, y: f64| (1.1 * x).sin() * (0.9 * y + 0.3).cos();
        let error = |n: usize| {
            let spline = grid(n, n, f);
            (0..2500)
                .map(|k| (-3.0 + 6.0 * f64::from(k % 50) / 49.0, -2.0 + 4.5 * f64::from(k / 50) / 49.0))
                .map(|(x, y)| (spline.jet(x, y).z - f(x, y)).abs())
                .fold(0.0, f64::max)
        };
        // Fine enough that the ends, where the constant is larger, have reached the asymptote too.
        let order = (error(121) / error(241)).log2();
        assert!((3.8..4.3).contains(&order), "order {order}");
    }
}
