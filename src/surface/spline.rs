use super::height_field::HeightField;
use crate::grid::{Extent, Field};
use glam::DVec2;
use rayon::prelude::*;

/// The bicubic spline through the nodes of a height field, twice continuously differentiable.
///
/// Uniform cubic B-splines in both directions, with the not-a-knot condition at the ends: it
/// assumes nothing of the slope at the border, and reproduces every bicubic polynomial exactly. It
/// is the surface that "the height field" means wherever a point between nodes is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSpline {
    extent: Extent,
    /// `nx + 2` by `ny + 2` coefficients: one more beyond each border.
    coefficients: Field<f64>,
    /// Nodes to a millimetre.
    per_mm: DVec2,
}

/// Value and first and second derivatives at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Height, mm.
    pub height_mm: f64,
    /// Gradient, mm per mm.
    pub slope: DVec2,
    /// Second derivatives xx, xy, yy, per mm.
    pub curvature: [f64; 3],
}

impl SurfaceSpline {
    /// Interpolates the nodes of `surface`.
    pub fn through(surface: &HeightField) -> Self {
        Self::interpolating(surface.extent(), surface.heights_mm())
    }

    /// Interpolates values at nodes that span a rectangle edge to edge, at least 4 along each side.
    pub(crate) fn interpolating(extent: Extent, nodes: &Field<f64>) -> Self {
        let per_mm = 1.0 / extent.node_spacing(nodes.nx(), nodes.ny());
        Self { extent, coefficients: prefilter(nodes), per_mm }
    }

    /// Size of the face.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Nodes along x and y.
    pub fn nodes(&self) -> (usize, usize) {
        (self.coefficients.nx() - 2, self.coefficients.ny() - 2)
    }

    /// The spline at a point, mm. Outside of the face its border polynomial continues.
    pub fn sample(&self, at: DVec2) -> SurfaceSample {
        let (nx, ny) = self.nodes();
        let position = (at - self.extent.lower()) * self.per_mm;
        let (i, x) = Basis::locate(position.x, nx);
        let (j, y) = Basis::locate(position.y, ny);
        // Value, x, y, xx, xy, yy in units of nodes.
        let mut sums = [0.0; 6];
        for l in 0..4 {
            let row = &self.coefficients.row(j + l)[i..i + 4];
            let dot = |w: &[f64; 4]| w[0] * row[0] + w[1] * row[1] + w[2] * row[2] + w[3] * row[3];
            let (value, slope, curvature) = (dot(&x.value), dot(&x.slope), dot(&x.curvature));
            sums[0] += y.value[l] * value;
            sums[1] += y.value[l] * slope;
            sums[2] += y.slope[l] * value;
            sums[3] += y.value[l] * curvature;
            sums[4] += y.slope[l] * slope;
            sums[5] += y.curvature[l] * value;
        }
        let DVec2 { x, y } = self.per_mm;
        SurfaceSample {
            height_mm: sums[0],
            slope: DVec2::new(sums[1] * x, sums[2] * y),
            curvature: [sums[3] * (x * x), sums[4] * (x * y), sums[5] * (y * y)],
        }
    }

    /// The spline at a point, mm. Outside of the face the parabola at the nearest point of its border
    /// continues, which goes astray less than a cubic does.
    pub(crate) fn continued(&self, at: DVec2) -> SurfaceSample {
        let half = 0.5 * self.extent.as_vec();
        let nearest = at.clamp(-half, half);
        let mut sample = self.sample(nearest);
        let by = at - nearest;
        if by != DVec2::ZERO {
            let [xx, xy, yy] = sample.curvature;
            let rise = DVec2::new(xx * by.x + xy * by.y, xy * by.x + yy * by.y);
            sample.height_mm += (sample.slope + 0.5 * rise).dot(by);
            sample.slope += rise;
        }
        sample
    }

    /// What a height and a slope at one point depend on: hands out the places of the nodes'
    /// coefficients around it with the derivative of `of_height h + of_slope . grad h` with respect
    /// to each. Those beyond the border follow from the others, not-a-knot.
    pub(crate) fn gradient(&self, at: DVec2, of_height: f64, of_slope: DVec2, mut out: impl FnMut(usize, f64)) {
        let (nx, ny) = self.nodes();
        let spacing = self.extent.node_spacing(nx, ny);
        let position = (at - self.extent.lower()) / spacing;
        let of_slope = of_slope / spacing;
        let along_x = Basis::of_nodes(position.x, nx);
        for (row, [of_y, of_dy]) in Basis::of_nodes(position.y, ny) {
            for &(column, [of_x, of_dx]) in &along_x {
                let value = of_height * of_x * of_y + of_slope.x * of_dx * of_y + of_slope.y * of_x * of_dy;
                out(row * (nx + 2) + column, value);
            }
        }
    }

    /// Changes coefficients of nodes.
    pub(crate) fn change(&mut self, changes: impl Iterator<Item = (usize, f64)>) {
        let (nx, ny) = self.nodes();
        let c = &mut self.coefficients;
        changes.for_each(|(place, by)| c.as_mut_slice()[place] += by);
        let beyond = |near: [f64; 4]| NOT_A_KNOT.iter().zip(near).map(|(factor, c)| factor * c).sum::<f64>();
        for j in 1..=ny {
            c[(0, j)] = beyond([1, 2, 3, 4].map(|i| c[(i, j)]));
            c[(nx + 1, j)] = beyond([0, 1, 2, 3].map(|i| c[(nx - i, j)]));
        }
        for i in 0..nx + 2 {
            c[(i, 0)] = beyond([1, 2, 3, 4].map(|j| c[(i, j)]));
            c[(i, ny + 1)] = beyond([0, 1, 2, 3].map(|j| c[(i, ny - j)]));
        }
    }

    /// Heights at the nodes, mm.
    pub(crate) fn heights_mm(&self) -> Field<f64> {
        let (nx, ny) = self.nodes();
        Field::from_fn(nx, ny, |i, j| {
            let row = |l: usize| {
                let c = &self.coefficients.row(j + l)[i..i + 3];
                c[0] + 4.0 * c[1] + c[2]
            };
            (row(0) + 4.0 * row(1) + row(2)) / 36.0
        })
    }

    /// Slopes at the nodes, mm per mm.
    pub fn node_slopes(&self) -> Field<DVec2> {
        let (nx, ny) = self.nodes();
        let spacing = self.extent.node_spacing(nx, ny);
        let mut data = vec![DVec2::ZERO; nx * ny];
        data.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
            let rows = [0, 1, 2].map(|l| self.coefficients.row(j + l));
            for (i, slope) in out.iter_mut().enumerate() {
                // Values of the basis at a node are 1/6, 4/6, 1/6, its slopes -1/2, 0, 1/2.
                let value = |r: &[f64]| (r[i] + 4.0 * r[i + 1] + r[i + 2]) / 6.0;
                let rise = |r: &[f64]| 0.5 * (r[i + 2] - r[i]);
                let along_x = (rise(rows[0]) + 4.0 * rise(rows[1]) + rise(rows[2])) / 6.0;
                let along_y = 0.5 * (value(rows[2]) - value(rows[0]));
                *slope = DVec2::new(along_x, along_y) / spacing;
            }
        });
        Field::from_vec(nx, ny, data)
    }

    /// A sampler of the lattice of `nx` by `ny` points that span the face edge to edge.
    pub(crate) fn lattice(&self, nx: usize, ny: usize) -> Lattice<'_> {
        let table = |points: usize, nodes: usize| {
            (0..points)
                .map(|k| Basis::locate(k as f64 * (nodes - 1) as f64 / (points - 1) as f64, nodes))
                .collect::<Vec<_>>()
        };
        let (nodes_x, nodes_y) = self.nodes();
        Lattice { spline: self, along_x: table(nx, nodes_x), along_y: table(ny, nodes_y) }
    }
}

/// Precomputed weights of a lattice of points, see [`SurfaceSpline::lattice`].
pub(crate) struct Lattice<'a> {
    spline: &'a SurfaceSpline,
    along_x: Vec<(usize, Basis)>,
    along_y: Vec<(usize, Basis)>,
}

impl Lattice<'_> {
    /// Heights and slopes of row `j`, handed to `out(i, height_mm, slope)`. `scratch` is grown as
    /// needed.
    pub(crate) fn row(&self, j: usize, scratch: &mut Vec<[f64; 2]>, mut out: impl FnMut(usize, f64, DVec2)) {
        let coefficients = &self.spline.coefficients;
        let (nx, ny) = self.spline.nodes();
        let spacing = self.spline.extent.node_spacing(nx, ny);
        let (first, basis) = &self.along_y[j];
        let rows = [0, 1, 2, 3].map(|l| coefficients.row(first + l));
        scratch.clear();
        scratch.extend((0..coefficients.nx()).map(|i| {
            let dot = |w: &[f64; 4]| w[0] * rows[0][i] + w[1] * rows[1][i] + w[2] * rows[2][i] + w[3] * rows[3][i];
            [dot(&basis.value), dot(&basis.slope)]
        }));
        for (i, (first, basis)) in self.along_x.iter().enumerate() {
            let c = &scratch[*first..first + 4];
            let mut sums = [0.0; 3];
            for k in 0..4 {
                sums[0] += basis.value[k] * c[k][0];
                sums[1] += basis.slope[k] * c[k][0];
                sums[2] += basis.value[k] * c[k][1];
            }
            out(i, sums[0], DVec2::new(sums[1] / spacing.x, sums[2] / spacing.y));
        }
    }
}

/// The four cubic B-splines that do not vanish on a cell, and their derivatives with respect to the
/// cell's coordinate.
#[derive(Clone, Copy)]
struct Basis {
    value: [f64; 4],
    slope: [f64; 4],
    curvature: [f64; 4],
}

impl Basis {
    /// Cell and basis for a position in units of nodes.
    fn locate(position: f64, nodes: usize) -> (usize, Self) {
        let cell = (position.max(0.0) as usize).min(nodes - 2);
        (cell, Self::at(position - cell as f64))
    }

    /// The nodes' coefficients that a position depends on along an axis, by their place, with the
    /// weights of value and slope.
    fn of_nodes(position: f64, nodes: usize) -> Vec<(usize, [f64; 2])> {
        let (first, basis) = Self::locate(position, nodes);
        let mut found: Vec<(usize, [f64; 2])> = Vec::with_capacity(5);
        let mut add = |place: usize, factor: f64, k: usize| {
            let weights = [factor * basis.value[k], factor * basis.slope[k]];
            match found.iter_mut().find(|(known, _)| *known == place) {
                Some((_, sums)) => sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight),
                None => found.push((place, weights)),
            }
        };
        for k in 0..4 {
            let place = first + k;
            if place == 0 {
                NOT_A_KNOT.iter().zip(1..).for_each(|(&factor, place)| add(place, factor, k));
            } else if place == nodes + 1 {
                NOT_A_KNOT.iter().zip((1..=nodes).rev()).for_each(|(&factor, place)| add(place, factor, k));
            } else {
                add(place, 1.0, k);
            }
        }
        found
    }

    fn at(t: f64) -> Self {
        let s = 1.0 - t;
        Self {
            value: [
                s * s * s / 6.0,
                (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                t * t * t / 6.0,
            ],
            slope: [-0.5 * s * s, -2.0 * t + 1.5 * t * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t],
            curvature: [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t],
        }
    }
}

/// The coefficient beyond an end from the four next to it: the third derivative is continuous at
/// the second node.
const NOT_A_KNOT: [f64; 4] = [4.0, -6.0, 4.0, -1.0];

/// Coefficients of the interpolating spline, along y and then along x.
fn prefilter(nodes: &Field<f64>) -> Field<f64> {
    let (nx, ny) = (nodes.nx(), nodes.ny());
    let pivots = pivots(nx.max(ny));
    let mut data = vec![0.0; (nx + 2) * (ny + 2)];
    // Along y first, in the interior columns: whole rows at a time, so that the sweep runs along
    // memory. Bands of columns are independent.
    let bands: Vec<Vec<f64>> = (0..nx)
        .into_par_iter()
        .step_by(COLUMNS_PER_TASK)
        .map(|i0| {
            let width = COLUMNS_PER_TASK.min(nx - i0);
            let mut band = vec![0.0; width * (ny + 2)];
            for (row, out) in band[width..].chunks_mut(width).take(ny).enumerate() {
                out.copy_from_slice(&nodes.row(row)[i0..i0 + width]);
            }
            interpolate(&mut band, width, ny, &pivots);
            band
        })
        .collect();
    data.par_chunks_mut(nx + 2).enumerate().for_each(|(j, row)| {
        for (b, band) in bands.iter().enumerate() {
            let width = band.len() / (ny + 2);
            let i0 = 1 + b * COLUMNS_PER_TASK;
            row[i0..i0 + width].copy_from_slice(&band[j * width..(j + 1) * width]);
        }
        interpolate(row, 1, nx, &pivots);
    });
    Field::from_vec(nx + 2, ny + 2, data)
}

const COLUMNS_PER_TASK: usize = 32;

/// Forward elimination factors of the tridiagonal matrix (1, 4, 1).
fn pivots(n: usize) -> Vec<f64> {
    let mut pivots = Vec::with_capacity(n);
    let mut previous = 0.0;
    for _ in 0..n {
        previous = 1.0 / (4.0 - previous);
        pivots.push(previous);
    }
    pivots
}

/// Solves `(c[i-1] + 4 c[i] + c[i+1]) / 6 = z[i]` with not-a-knot ends for `width` interleaved
/// sequences of `n` nodes, stored in places 1..=n of n + 2.
///
/// The third derivative of the spline is continuous at the second node exactly if `c[-1] - 4 c[0] +
/// 6 c[1] - 4 c[2] + c[3] = 0`. With the interpolation at the first three nodes that gives `c[1] =
/// (8 z[1] - z[0] - z[2]) / 6` outright, and likewise at the other end; what is left between is
/// tridiagonal.
fn interpolate(c: &mut [f64], width: usize, n: usize, pivots: &[f64]) {
    let at = |i: usize, k: usize| (i + 1) * width + k;
    // The known coefficients next to the ends, before the nodes are overwritten.
    let ends: Vec<[f64; 4]> = (0..width)
        .map(|k| {
            let z = |i: usize| c[at(i, k)];
            [z(0), (8.0 * z(1) - z(0) - z(2)) / 6.0, (8.0 * z(n - 2) - z(n - 1) - z(n - 3)) / 6.0, z(n - 1)]
        })
        .collect();
    let (z1, zn): (Vec<f64>, Vec<f64>) = (0..width).map(|k| (c[at(1, k)], c[at(n - 2, k)])).unzip();
    for k in 0..width {
        c[at(1, k)] = ends[k][1];
        c[at(n - 2, k)] = ends[k][2];
    }
    // Unknowns 2..=n-3: c[i-1] + 4 c[i] + c[i+1] = 6 z[i].
    for i in 2..n.saturating_sub(2) {
        let pivot = pivots[i - 2];
        for k in 0..width {
            // At i = 2 the one before is the known end; later ones are already eliminated.
            c[at(i, k)] = (6.0 * c[at(i, k)] - c[at(i - 1, k)]) * pivot;
        }
    }
    for i in (2..n.saturating_sub(2)).rev() {
        let pivot = pivots[i - 2];
        for k in 0..width {
            c[at(i, k)] -= pivot * c[at(i + 1, k)];
        }
    }
    for k in 0..width {
        // Interpolation at the second node gives the first coefficient, at the first node the one
        // outside.
        c[at(0, k)] = 6.0 * z1[k] - 4.0 * c[at(1, k)] - c[at(2, k)];
        c[at(n - 1, k)] = 6.0 * zn[k] - 4.0 * c[at(n - 2, k)] - c[at(n - 3, k)];
        c[k] = 6.0 * ends[k][0] - 4.0 * c[at(0, k)] - c[at(1, k)];
        c[at(n, k)] = 6.0 * ends[k][3] - 4.0 * c[at(n - 1, k)] - c[at(n - 2, k)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent::new(10.0, 6.0);

    fn surface(nx: usize, ny: usize, f: impl Fn(DVec2) -> f64) -> HeightField {
        HeightField::new(EXTENT, Field::from_fn(nx, ny, |i, j| f(EXTENT.node(i, j, nx, ny))))
    }

    #[test]
    fn bicubic_polynomials_are_reproduced_to_the_border_and_with_all_derivatives() {
        let f = |p: DVec2| 0.3 * p.x.powi(3) - p.x * p.y * p.y + 0.2 * p.y.powi(3) * p.x.powi(2) - 2.0 * p.y + 1.0;
        for (nx, ny) in [(4, 4), (5, 7), (6, 5), (13, 9), (40, 33)] {
            let surface = surface(nx, ny, f);
            let shift = surface.heights_mm()[(0, 0)] - f(EXTENT.node(0, 0, nx, ny));
            let spline = SurfaceSpline::through(&surface);
            for k in 0..200 {
                let at = EXTENT.lower()
                    + EXTENT.as_vec() * DVec2::new(f64::from(k) / 199.0, f64::from(k * 37 % 200) / 199.0);
                let s = spline.sample(at);
                let slope = DVec2::new(
                    0.9 * at.x * at.x - at.y * at.y + 0.4 * at.y.powi(3) * at.x,
                    -2.0 * at.x * at.y + 0.6 * at.y * at.y * at.x * at.x - 2.0,
                );
                let xy = -2.0 * at.y + 1.2 * at.y * at.y * at.x;
                assert!((s.height_mm - f(at) - shift).abs() < 1e-10, "{nx} x {ny} at {at}");
                assert!((s.slope - slope).length() < 1e-9);
                assert!((s.curvature[1] - xy).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn a_changed_coefficient_changes_heights_and_slopes_by_their_gradient_up_to_the_border() {
        let field = surface(9, 8, |p| (p.x * 0.4).sin() + 0.1 * p.y * p.x);
        let spline = SurfaceSpline::through(&field);
        let heights = spline.heights_mm();
        assert!(heights.as_slice().iter().zip(field.heights_mm().as_slice()).all(|(a, b)| (a - b).abs() < 1e-13));
        for at in [DVec2::new(-4.9, -2.9), DVec2::new(0.3, 0.1), DVec2::new(4.8, -2.6), DVec2::new(3.9, 2.99)] {
            let weights = (0.7, DVec2::new(0.4, -1.3));
            let functional = |spline: &SurfaceSpline| {
                let sample = spline.sample(at);
                weights.0 * sample.height_mm + weights.1.dot(sample.slope)
            };
            let mut gradient = Vec::new();
            spline.gradient(at, weights.0, weights.1, |place, of| gradient.push((place, of)));
            for &(place, of) in &gradient {
                let mut changed = spline.clone();
                changed.change([(place, 0.1)].into_iter());
                assert!((functional(&changed) - functional(&spline) - 0.1 * of).abs() < 1e-12, "{at} {place}");
                // It is still the spline through its own heights.
                let again = SurfaceSpline::through(&field.with_heights(changed.heights_mm()));
                assert!((again.sample(at).slope - changed.sample(at).slope).length() < 1e-11, "{at} {place}");
            }
        }
    }

    #[test]
    fn slopes_converge_with_the_fourth_order_at_the_nodes() {
        let f = |p: DVec2| (0.7 * p.x).sin() * (0.9 * p.y).cos();
        let error = |nx: usize, ny: usize| {
            let slopes = SurfaceSpline::through(&surface(nx, ny, f)).node_slopes();
            let (mut worst, margin) = (0.0_f64, nx / 4);
            for j in margin..ny - margin {
                for i in margin..nx - margin {
                    let p = EXTENT.node(i, j, nx, ny);
                    worst = worst.max((slopes[(i, j)].x - 0.7 * (0.7 * p.x).cos() * (0.9 * p.y).cos()).abs());
                }
            }
            worst
        };
        let ratio = error(41, 41) / error(81, 81);
        assert!(ratio > 14.0, "halving the spacing divides the error by {ratio}");
    }

    #[test]
    fn a_lattice_gives_what_single_samples_give() {
        let spline = SurfaceSpline::through(&surface(23, 17, |p| (p.x * 0.4).sin() + 0.1 * p.y * p.x));
        let lattice = spline.lattice(50, 41);
        let mut scratch = Vec::new();
        for j in 0..41 {
            lattice.row(j, &mut scratch, |i, height, slope| {
                let s = spline.sample(EXTENT.node(i, j, 50, 41));
                assert!((s.height_mm - height).abs() < 1e-12 && (s.slope - slope).length() < 1e-11);
            });
        }
    }
}
