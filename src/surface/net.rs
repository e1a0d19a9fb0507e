//! A clamped bicubic B-spline surface near a height field: what CAD files hold.
//!
//! Along each side the net has its own cubic B-splines over knots of multiplicity 4 at both ends, so that the border of the
//! surface is the curve of the outermost control points. With as many control points as nodes the knots are those of the
//! not-a-knot spline, and the surface is that of [`SurfaceSpline`] itself; with fewer they are equidistant, and the heights
//! are the weighted least-squares fit to the nodes. Both are one direct solution: two sweeps of banded Cholesky, `O(nodes)`.

use super::{HeightField, SurfaceSpline};
use crate::grid::{Extent, Field};
use glam::DVec2;
use rayon::prelude::*;

/// Degree of the surface.
pub const DEGREE: usize = 3;
/// B-splines that do not vanish at a point.
const ORDER: usize = DEGREE + 1;

/// A control net of heights over a rectangle. Parameters are counted in intervals from the lower corner; the control points
/// stand above the Greville abscissae, so that `x` and `y` are linear in them.
#[derive(Clone, Debug)]
pub struct ControlNet {
    extent: Extent,
    along_x: Axis,
    along_y: Axis,
    heights_mm: Field<f64>,
}

/// How far a net is from the height field, over a lattice twice as dense as the nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitError {
    /// Greatest difference of height, mm.
    pub greatest_mm: f64,
    /// Root mean square difference of height, mm.
    pub rms_mm: f64,
    /// Root mean square difference of slope, mm per mm: what displaces the light.
    pub slope_rms: f64,
    /// Root mean square difference of the Laplacian, per mm: what changes how bright it is.
    pub laplacian_rms: f64,
}

impl ControlNet {
    /// Fewest control points along a side.
    pub const LEAST: usize = ORDER;

    /// The net of `points` control points nearest to the nodes, in the sense of least squares with the weights of the
    /// trapezoidal rule: it keeps the volume under the nodes.
    ///
    /// # Panics
    /// With fewer than [`LEAST`](Self::LEAST) control points along a side, or more than nodes.
    pub fn fitted(surface: &HeightField, points: (usize, usize)) -> Self {
        let nodes = surface.heights_mm();
        let (along_x, along_y) = (Axis::new(nodes.nx(), points.0), Axis::new(nodes.ny(), points.1));
        let rows = along_x.fit_rows(nodes);
        let heights_mm = along_y.fit_columns(&rows);
        Self { extent: surface.extent(), along_x, along_y, heights_mm }
    }

    /// The net that is the not-a-knot spline through the nodes itself.
    pub fn interpolating(surface: &HeightField) -> Self {
        Self::fitted(surface, (surface.heights_mm().nx(), surface.heights_mm().ny()))
    }

    /// Size of the face.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Control points along x and y.
    pub fn points(&self) -> (usize, usize) {
        (self.heights_mm.nx(), self.heights_mm.ny())
    }

    /// Heights of the control points, mm: row `j` along `+y`, column `i` along `+x`.
    pub fn heights_mm(&self) -> &Field<f64> {
        &self.heights_mm
    }

    /// Distinct knots along x and y, in intervals: whole numbers from 0. The first and the last are fourfold.
    pub fn knots(&self) -> [&[f64]; 2] {
        [self.along_x.distinct(), self.along_y.distinct()]
    }

    /// Places of the control points along x and y, mm. The ends are exactly half the size.
    pub fn places_mm(&self) -> [Vec<f64>; 2] {
        [self.along_x.greville(self.extent.width_mm), self.along_y.greville(self.extent.height_mm)]
    }

    /// Heights at `nx` by `ny` places that span the face edge to edge, mm.
    pub fn sampled(&self, nx: usize, ny: usize) -> Field<f64> {
        let (tables_x, tables_y) = (self.along_x.lattice(nx), self.along_y.lattice(ny));
        let mut data = vec![0.0; nx * ny];
        data.par_chunks_mut(nx).zip(&tables_y).for_each_init(
            || vec![0.0; self.heights_mm.nx()],
            |mixed, (out, (first, [y, ..]))| {
                for (i, mixed) in mixed.iter_mut().enumerate() {
                    *mixed = (0..ORDER).map(|l| y[l] * self.heights_mm[(i, first + l)]).sum();
                }
                for (out, (first, [x, ..])) in out.iter_mut().zip(&tables_x) {
                    *out = (0..ORDER).map(|l| x[l] * mixed[first + l]).sum();
                }
            },
        );
        Field::from_vec(nx, ny, data)
    }

    /// Measures the distance to the spline through the nodes of `surface`.
    pub fn error(&self, surface: &HeightField) -> FitError {
        let spline = SurfaceSpline::through(surface);
        let (nx, ny) = spline.nodes();
        let (lx, ly) = (2 * nx - 1, 2 * ny - 1);
        let (tables_x, tables_y) = (self.along_x.lattice(lx), self.along_y.lattice(ly));
        let scale = DVec2::new(self.along_x.intervals(), self.along_y.intervals()) / self.extent.as_vec();
        let width = self.heights_mm.nx();
        // Sums of a row each, added in order: the same for any number of threads.
        let rows: Vec<[f64; 4]> = (0..ly)
            .into_par_iter()
            .map_init(
                || vec![[0.0; 3]; width],
                |mixed, j| {
                    let (first, y) = &tables_y[j];
                    for (i, mixed) in mixed.iter_mut().enumerate() {
                        *mixed = [0, 1, 2].map(|d| (0..ORDER).map(|l| y[d][l] * self.heights_mm[(i, first + l)]).sum());
                    }
                    let mut sums = [0.0_f64; 4];
                    for (i, (first, x)) in tables_x.iter().enumerate() {
                        let at =
                            |dx: usize, dy: usize| -> f64 { (0..ORDER).map(|l| x[dx][l] * mixed[first + l][dy]).sum() };
                        let truth = spline.sample(self.extent.node(i, j, lx, ly));
                        let slope = DVec2::new(at(1, 0), at(0, 1)) * scale - truth.slope;
                        let laplacian = at(2, 0) * scale.x * scale.x + at(0, 2) * scale.y * scale.y
                            - truth.curvature[0]
                            - truth.curvature[2];
                        let height = at(0, 0) - truth.height_mm;
                        sums[0] = sums[0].max(height.abs());
                        sums[1] += height * height;
                        sums[2] += slope.length_squared();
                        sums[3] += laplacian * laplacian;
                    }
                    sums
                },
            )
            .collect();
        let rms = |k: usize| (rows.iter().map(|row| row[k]).sum::<f64>() / (lx * ly) as f64).sqrt();
        FitError {
            greatest_mm: rows.iter().map(|row| row[0]).fold(0.0, f64::max),
            rms_mm: rms(1),
            slope_rms: rms(2),
            laplacian_rms: rms(3),
        }
    }
}

/// First B-spline that does not vanish at a point, and values, slopes and second derivatives of the four.
type Weights = (usize, [[f64; ORDER]; 3]);

/// The B-splines along one side.
#[derive(Clone, Debug)]
struct Axis {
    /// All knots, with their multiplicity.
    knots: Vec<f64>,
    /// The weights at every node.
    nodes: Vec<Weights>,
    /// Banded Cholesky factor of the normal matrix: `factor[r][d]` stands in column `r - d`.
    factor: Vec<[f64; ORDER]>,
}

impl Axis {
    fn new(nodes: usize, points: usize) -> Self {
        assert!((ORDER..=nodes).contains(&points), "{points} control points for {nodes} nodes");
        let last = if points == nodes { nodes - 1 } else { points - DEGREE };
        // Not-a-knot: the first and the last inner node carry no knot.
        let inner = if points == nodes { 2..nodes - 2 } else { 1..last };
        let mut knots = vec![0.0; ORDER];
        knots.extend(inner.map(|k| k as f64));
        knots.extend([last as f64; ORDER]);
        let mut axis = Self { knots, nodes: Vec::new(), factor: Vec::new() };
        debug_assert_eq!(axis.points(), points);
        axis.nodes = axis.lattice(nodes);
        axis.factor = axis.cholesky();
        axis
    }

    fn points(&self) -> usize {
        self.knots.len() - ORDER
    }

    /// Length of the parameter's range.
    fn intervals(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    fn distinct(&self) -> &[f64] {
        &self.knots[DEGREE..self.knots.len() - DEGREE]
    }

    fn greville(&self, size: f64) -> Vec<f64> {
        let per_interval = size / self.intervals();
        let mut places: Vec<f64> = (0..self.points())
            .map(|i| (self.knots[i + 1..i + ORDER].iter().sum::<f64>() / 3.0 - 0.5 * self.intervals()) * per_interval)
            .collect();
        let last = places.len() - 1;
        (places[0], places[last]) = (-0.5 * size, 0.5 * size);
        places
    }

    /// Weights at `n` equidistant places from end to end.
    fn lattice(&self, n: usize) -> Vec<Weights> {
        (0..n).map(|k| self.weights(k as f64 * self.intervals() / (n - 1) as f64)).collect()
    }

    /// Weights at a parameter, by the recursion of Cox and de Boor.
    fn weights(&self, at: f64) -> Weights {
        let t = &self.knots;
        // The last knot not above the parameter; at the end the last interval that is not empty.
        let span = t.partition_point(|&knot| knot <= at).clamp(ORDER, self.points()) - 1;
        // `basis[d]` are the B-splines of degree d that do not vanish, from `span - d` on.
        let mut basis = [[0.0; ORDER]; ORDER];
        basis[0][0] = 1.0;
        for degree in 1..=DEGREE {
            for k in 0..degree {
                let (left, right) = (t[span + 1 + k - degree], t[span + 1 + k]);
                let part = basis[degree - 1][k] / (right - left);
                basis[degree][k] += (right - at) * part;
                basis[degree][k + 1] += (at - left) * part;
            }
        }
        // The derivative of a B-spline is a difference of two of the degree below.
        let derivative = |of: [f64; ORDER], degree: usize| {
            let mut out = [0.0; ORDER];
            for k in 0..degree {
                let (left, right) = (t[span + 1 + k - degree], t[span + 1 + k]);
                let part = degree as f64 * of[k] / (right - left);
                out[k] -= part;
                out[k + 1] += part;
            }
            out
        };
        let slope = derivative(basis[DEGREE - 1], DEGREE);
        let curvature = derivative(derivative(basis[DEGREE - 2], DEGREE - 1), DEGREE);
        (span - DEGREE, [basis[DEGREE], slope, curvature])
    }

    /// Weight of node `k` of the trapezoidal rule.
    fn share(&self, k: usize) -> f64 {
        if k == 0 || k + 1 == self.nodes.len() { 0.5 } else { 1.0 }
    }

    /// The Cholesky factor of `B^T W B`, where `B` holds the B-splines at the nodes. It is positive definite, because every
    /// B-spline has a node of its own under it (Schoenberg and Whitney).
    fn cholesky(&self) -> Vec<[f64; ORDER]> {
        let mut factor = vec![[0.0; ORDER]; self.points()];
        for (k, (first, [value, ..])) in self.nodes.iter().enumerate() {
            for r in 0..ORDER {
                for c in 0..=r {
                    factor[first + r][r - c] += self.share(k) * value[r] * value[c];
                }
            }
        }
        for r in 0..factor.len() {
            for d in (0..ORDER.min(r + 1)).rev() {
                let column = r - d;
                let mut sum = factor[r][d];
                for e in d + 1..ORDER.min(r + 1) {
                    sum -= factor[r][e] * factor[column][e - d];
                }
                factor[r][d] = if d == 0 { sum.sqrt() } else { sum / factor[column][0] };
            }
        }
        factor
    }

    /// Solves `L L^T c = b` in place for `width` right-hand sides beside each other.
    fn solve(&self, b: &mut [f64], width: usize) {
        let n = self.factor.len();
        for r in 0..n {
            let (done, rest) = b.split_at_mut(r * width);
            let row = &mut rest[..width];
            for d in 1..ORDER.min(r + 1) {
                let other = &done[(r - d) * width..(r - d + 1) * width];
                row.iter_mut().zip(other).for_each(|(v, o)| *v -= self.factor[r][d] * o);
            }
            row.iter_mut().for_each(|v| *v /= self.factor[r][0]);
        }
        for r in (0..n).rev() {
            let (head, done) = b.split_at_mut((r + 1) * width);
            let row = &mut head[r * width..];
            for d in 1..ORDER.min(n - r) {
                let other = &done[(d - 1) * width..d * width];
                row.iter_mut().zip(other).for_each(|(v, o)| *v -= self.factor[r + d][d] * o);
            }
            row.iter_mut().for_each(|v| *v /= self.factor[r][0]);
        }
    }

    fn fit_rows(&self, nodes: &Field<f64>) -> Field<f64> {
        let mut data = vec![0.0; self.points() * nodes.ny()];
        data.par_chunks_mut(self.points()).enumerate().for_each(|(j, out)| {
            for (k, &height) in nodes.row(j).iter().enumerate() {
                let (first, [value, ..]) = &self.nodes[k];
                let weighted = self.share(k) * height;
                (0..ORDER).for_each(|l| out[first + l] += value[l] * weighted);
            }
            self.solve(out, 1);
        });
        Field::from_vec(self.points(), nodes.ny(), data)
    }

    fn fit_columns(&self, rows: &Field<f64>) -> Field<f64> {
        const COLUMNS: usize = 32;
        let nx = rows.nx();
        // Bands of columns are independent, and run along memory.
        let bands: Vec<Vec<f64>> = (0..nx)
            .into_par_iter()
            .step_by(COLUMNS)
            .map(|i0| {
                let width = COLUMNS.min(nx - i0);
                let mut band = vec![0.0; width * self.points()];
                for (k, (first, [value, ..])) in self.nodes.iter().enumerate() {
                    let row = &rows.row(k)[i0..i0 + width];
                    for l in 0..ORDER {
                        let weight = self.share(k) * value[l];
                        let out = &mut band[(first + l) * width..(first + l + 1) * width];
                        out.iter_mut().zip(row).for_each(|(out, v)| *out += weight * v);
                    }
                }
                self.solve(&mut band, width);
                band
            })
            .collect();
        let mut data = vec![0.0; nx * self.points()];
        data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            for (part, band) in row.chunks_mut(COLUMNS).zip(&bands) {
                part.copy_from_slice(&band[j * part.len()..(j + 1) * part.len()]);
            }
        });
        Field::from_vec(nx, self.points(), data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(nx: usize, ny: usize, h: impl Fn(DVec2) -> f64) -> HeightField {
        let extent = Extent::new(30.0, 20.0);
        HeightField::new(extent, Field::from_fn(nx, ny, |i, j| h(extent.node(i, j, nx, ny))))
    }

    fn wave(p: DVec2) -> f64 {
        (0.4 * p.x + 0.3).sin() * (0.5 * p.y - 0.2).cos()
    }

    #[test]
    fn with_a_control_point_per_node_it_is_the_spline_through_them() {
        for (nx, ny) in [(4, 5), (6, 9), (41, 30)] {
            let surface = surface(nx, ny, wave);
            let error = ControlNet::interpolating(&surface).error(&surface);
            assert!(error.greatest_mm < 1e-13 && error.slope_rms < 1e-12 && error.laplacian_rms < 1e-10, "{error:?}");
        }
    }

    #[test]
    fn bicubic_polynomials_are_reproduced_by_any_net() {
        let surface = surface(25, 19, |p| 1e-3 * p.x.powi(3) - 2e-3 * p.y.powi(3) + 0.02 * p.x * p.y * p.y);
        for points in [(4, 4), (5, 8), (17, 11), (25, 6)] {
            let error = ControlNet::fitted(&surface, points).error(&surface);
            assert!(error.greatest_mm < 1e-11, "{points:?}: {error:?}");
        }
    }

    #[test]
    fn heights_converge_with_the_fourth_power_and_slopes_with_the_third() {
        let surface = surface(401, 301, wave);
        let [coarse, fine] = [23, 43].map(|m| ControlNet::fitted(&surface, (m, m)).error(&surface));
        let orders = [coarse.rms_mm / fine.rms_mm, coarse.slope_rms / fine.slope_rms].map(f64::log2);
        assert!((3.7..4.6).contains(&orders[0]) && (2.7..3.6).contains(&orders[1]), "{orders:?}");
    }

    #[test]
    fn the_volume_under_the_nodes_is_kept() {
        let surface = surface(101, 81, |p| wave(p) + 0.01 * p.x * p.x);
        let trapezoid = |f: &Field<f64>| {
            let half = |k: usize, n: usize| if k == 0 || k + 1 == n { 0.5 } else { 1.0 };
            (0..f.ny())
                .flat_map(|j| (0..f.nx()).map(move |i| (i, j)))
                .map(|(i, j)| half(i, f.nx()) * half(j, f.ny()) * f[(i, j)])
                .sum::<f64>()
        };
        let net = ControlNet::fitted(&surface, (20, 16));
        let at_nodes = Field::from_fn(101, 81, |i, j| {
            let ((a, x), (b, y)) = (&net.along_x.nodes[i], &net.along_y.nodes[j]);
            (0..ORDER)
                .map(|l| y[0][l] * (0..ORDER).map(|k| x[0][k] * net.heights_mm[(a + k, b + l)]).sum::<f64>())
                .sum()
        });
        assert!((trapezoid(&at_nodes) - trapezoid(surface.heights_mm())).abs() < 1e-10);
    }

    #[test]
    fn control_points_stand_where_the_surface_is_linear_in_its_parameters() {
        let net = ControlNet::fitted(&surface(60, 50, wave), (12, 50));
        let [x, y] = net.places_mm();
        assert_eq!((x[0], x[11], y[0], y[49]), (-15.0, 15.0, -10.0, 10.0));
        for (axis, places, size) in [(&net.along_x, x, 30.0), (&net.along_y, y, 20.0)] {
            for k in 0..=40 {
                let t = f64::from(k) / 40.0;
                let (first, [value, ..]) = axis.weights(t * axis.intervals());
                let place: f64 = (0..ORDER).map(|l| value[l] * places[first + l]).sum();
                assert!((place - size * (t - 0.5)).abs() < 1e-13 * size);
            }
        }
    }
}
