//! A clamped bicubic B-spline surface near a height field: what CAD files hold.
//!
//! Along each side the net has its own cubic B-splines over knots of multiplicity 4 at both ends,
//! so that the border of the surface is the curve of the outermost control points. With as many
//! control points as nodes the knots are those of the not-a-knot spline, and the surface is that of
//! [`SurfaceSpline`] itself; with fewer they are equidistant, and the heights are the weighted
//! least-squares fit to the nodes. Both are one direct solution: two sweeps of banded Cholesky,
//! `O(nodes)`.

use super::{
    HeightField, SurfaceSpline,
    axis::{Axis, ORDER},
};
use crate::grid::{Extent, Field};
use glam::DVec2;
use rayon::prelude::*;

/// A control net of heights over a rectangle. Parameters are counted in intervals from the lower
/// corner; the control points stand above the Greville abscissae, so that `x` and `y` are linear in
/// them.
#[derive(Clone, Debug)]
pub struct ControlNet {
    extent: Extent,
    along_x: Axis,
    along_y: Axis,
    heights_mm: Field<f64>,
}

/// How far a net is from the height field within its outline, over a lattice twice as dense as the
/// nodes.
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

    /// The net of `points` control points nearest to the nodes, in the sense of least squares with
    /// the weights of the trapezoidal rule: it keeps the volume under the nodes.
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

    /// Distinct knots along x and y, in intervals: whole numbers from 0. The first and the last are
    /// fourfold.
    pub fn knots(&self) -> [&[f64]; 2] {
        [self.along_x.distinct(), self.along_y.distinct()]
    }

    /// Places of the control points along x and y, mm. The ends are exactly half the size.
    pub fn places_mm(&self) -> [Vec<f64>; 2] {
        [self.along_x.greville(self.extent.width_mm), self.along_y.greville(self.extent.height_mm)]
    }

    /// Height, mm, and slope at a point of the face.
    pub fn sample(&self, at: DVec2) -> (f64, DVec2) {
        let per_mm = DVec2::new(self.along_x.intervals(), self.along_y.intervals()) / self.extent.as_vec();
        let place = (at - self.extent.lower()) * per_mm;
        let ((i, x), (j, y)) = (self.along_x.weights(place.x), self.along_y.weights(place.y));
        let (mut height, mut slope) = (0.0, DVec2::ZERO);
        for l in 0..ORDER {
            let row = &self.heights_mm.row(j + l)[i..i + ORDER];
            let along = |weights: &[f64; ORDER]| weights.iter().zip(row).map(|(w, h)| w * h).sum::<f64>();
            let value = along(&x[0]);
            height += y[0][l] * value;
            slope += DVec2::new(y[0][l] * along(&x[1]), y[1][l] * value);
        }
        (height, slope * per_mm)
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
        let contour = surface.contour();
        // Sums of a row each, added in order: the same for any number of threads.
        let rows: Vec<[f64; 5]> = (0..ly)
            .into_par_iter()
            .map_init(
                || vec![[0.0; 3]; width],
                |mixed, j| {
                    let (first, y) = &tables_y[j];
                    for (i, mixed) in mixed.iter_mut().enumerate() {
                        *mixed = [0, 1, 2].map(|d| (0..ORDER).map(|l| y[d][l] * self.heights_mm[(i, first + l)]).sum());
                    }
                    let mut sums = [0.0_f64; 5];
                    for (i, (first, x)) in tables_x.iter().enumerate() {
                        let place = self.extent.node(i, j, lx, ly);
                        if !contour.contains(place) {
                            continue;
                        }
                        let at =
                            |dx: usize, dy: usize| -> f64 { (0..ORDER).map(|l| x[dx][l] * mixed[first + l][dy]).sum() };
                        let truth = spline.sample(place);
                        let slope = DVec2::new(at(1, 0), at(0, 1)) * scale - truth.slope;
                        let laplacian = at(2, 0) * scale.x * scale.x + at(0, 2) * scale.y * scale.y
                            - truth.curvature[0]
                            - truth.curvature[2];
                        let height = at(0, 0) - truth.height_mm;
                        sums[0] = sums[0].max(height.abs());
                        sums[1] += height * height;
                        sums[2] += slope.length_squared();
                        sums[3] += laplacian * laplacian;
                        sums[4] += 1.0;
                    }
                    sums
                },
            )
            .collect();
        let sum = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>();
        let rms = |k: usize| (sum(k) / sum(4)).sqrt();
        FitError {
            greatest_mm: rows.iter().map(|row| row[0]).fold(0.0, f64::max),
            rms_mm: rms(1),
            slope_rms: rms(2),
            laplacian_rms: rms(3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Outline;
    use crate::measured::within_tenth_of;

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
    fn samples_are_those_of_the_spline_through_the_nodes_with_its_slope() {
        let surface = surface(31, 24, wave);
        let (net, spline) = (ControlNet::interpolating(&surface), SurfaceSpline::through(&surface));
        for k in 0..=300 {
            let at = DVec2::new(30.0, 20.0) * (DVec2::new(f64::from(k), f64::from(k * 7 % 301)) / 300.0 - 0.5);
            let ((height, slope), wanted) = (net.sample(at), spline.sample(at));
            assert!((height - wanted.height_mm).abs() < 1e-12 && (slope - wanted.slope).length() < 1e-11, "{at}");
        }
    }

    #[test]
    fn how_far_a_net_is_away_beyond_the_outline_does_not_count() {
        let extent = Extent::new(30.0, 20.0);
        let contour = Outline::Circle.within(extent);
        let error = |outline: Outline| {
            let of = |beyond: f64| {
                let h = |p: DVec2| wave(p) + if contour.level(p).distance_mm > 2.0 { beyond } else { 0.0 };
                HeightField::outlined(extent, outline, Field::from_fn(81, 61, |i, j| h(extent.node(i, j, 81, 61))))
            };
            ControlNet::interpolating(&of(0.0)).error(&of(5.0))
        };
        let (within, whole) = (error(Outline::Circle), error(Outline::Rectangle));
        within_tenth_of(1.82e-4, within.greatest_mm, "greatest, mm");
        within_tenth_of(5.5e-6, within.rms_mm, "rms, mm");
        assert!(whole.greatest_mm > 4.0 && whole.rms_mm > 0.5, "{whole:?}");
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
