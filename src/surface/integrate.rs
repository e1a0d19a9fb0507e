//! From slopes at nodes to heights (section 2.3 of the paper): least squares over the edges of the
//! grid.

use super::HeightField;
use crate::grid::{
    Extent, Field,
    dct::{CosineFilter, Symmetry, path_laplacian_eigenvalue},
};
use glam::DVec2;
use rayon::prelude::*;

/// How the rise along an edge follows from slopes at nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeRule {
    /// The mean of the two ends, as in the paper; second order.
    TwoPoint,
    /// The integral of the cubic through four nodes in a row, `(-1, 13, 13, -1) / 24`; fourth
    /// order. The outermost edges use the four nodes nearest to them, `(9, 19, -5, 1) / 24`, of the
    /// same order.
    FourPoint,
}

impl EdgeRule {
    /// Mean slope on edge `k` of a line of `n` nodes.
    fn mean(self, k: usize, n: usize, slope: impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::TwoPoint => 0.5 * (slope(k) + slope(k + 1)),
            Self::FourPoint if k == 0 => (9.0 * slope(0) + 19.0 * slope(1) - 5.0 * slope(2) + slope(3)) / 24.0,
            Self::FourPoint if k + 2 == n => {
                (9.0 * slope(n - 1) + 19.0 * slope(n - 2) - 5.0 * slope(n - 3) + slope(n - 4)) / 24.0
            }
            Self::FourPoint => (13.0 * (slope(k) + slope(k + 1)) - slope(k - 1) - slope(k + 2)) / 24.0,
        }
    }
}

/// The heights whose rises along the edges of the grid fit the slopes best.
///
/// Minimises the sum over edges of the squared difference between slopes, `((z_b - z_a) / length -
/// slope)^2`; on square cells this is the paper's system (5). Solved directly: see
/// [`least_squares`].
///
/// # Panics
/// With fewer than 4 nodes along a side.
pub fn heights_of_slopes(slopes: &Field<DVec2>, extent: Extent, rule: EdgeRule) -> HeightField {
    let (nx, ny) = (slopes.nx(), slopes.ny());
    assert!(nx >= 4 && ny >= 4, "a height field needs 4 x 4 nodes");
    let spacing = extent.node_spacing(nx, ny);
    let heights = least_squares(
        (nx, ny),
        spacing.powf(-2.0),
        |i, j| spacing.x * rule.mean(i, nx, |i| slopes[(i, j)].x),
        |i, j| spacing.y * rule.mean(j, ny, |j| slopes[(i, j)].y),
    );
    HeightField::new(extent, heights)
}

/// Node values of mean 0 whose differences along the edges of an `nx` by `ny` grid fit the given
/// rises best, with the weight `weights.x` for edges along x and `weights.y` along y.
///
/// `rise_x(i, j)` is wanted from node `(i, j)` to `(i + 1, j)`, `rise_y(i, j)` to `(i, j + 1)`. The
/// normal equations (5) have the Laplacian of the grid graph as their matrix, with natural
/// boundaries, which the cosines of the DCT-II diagonalise: no iteration, and the singular mode (a
/// constant) is left at 0.
pub fn least_squares(
    (nx, ny): (usize, usize),
    weights: DVec2,
    rise_x: impl Fn(usize, usize) -> f64 + Sync,
    rise_y: impl Fn(usize, usize) -> f64 + Sync,
) -> Field<f64> {
    let mut field = divergence((nx, ny), weights, rise_x, rise_y);
    let along_x: Vec<f64> = (0..nx).map(|k| weights.x * path_laplacian_eigenvalue(k, nx)).collect();
    let along_y: Vec<f64> = (0..ny).map(|k| weights.y * path_laplacian_eigenvalue(k, ny)).collect();
    CosineFilter::new(Symmetry::Cells, nx, ny)
        .apply(&mut field, |kx, ky| if kx + ky == 0 { 0.0 } else { 1.0 / (along_x[kx] + along_y[ky]) });
    field
}

/// The right-hand side of the normal equations (5): rises that end at a node less rises that begin
/// there.
fn divergence(
    (nx, ny): (usize, usize),
    weights: DVec2,
    rise_x: impl Fn(usize, usize) -> f64 + Sync,
    rise_y: impl Fn(usize, usize) -> f64 + Sync,
) -> Field<f64> {
    let mut data = vec![0.0; nx * ny];
    data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for i in 0..nx - 1 {
            let rise = weights.x * rise_x(i, j);
            row[i] -= rise;
            row[i + 1] += rise;
        }
        for (i, value) in row.iter_mut().enumerate() {
            if j > 0 {
                *value += weights.y * rise_y(i, j - 1);
            }
            if j + 1 < ny {
                *value -= weights.y * rise_y(i, j);
            }
        }
    });
    Field::from_vec(nx, ny, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent::new(6.0, 4.0);
    const RULES: [EdgeRule; 2] = [EdgeRule::TwoPoint, EdgeRule::FourPoint];

    fn sampled<T>(nx: usize, ny: usize, f: impl Fn(DVec2) -> T) -> Field<T> {
        Field::from_fn(nx, ny, |i, j| f(EXTENT.node(i, j, nx, ny)))
    }

    fn worst(a: &Field<f64>, b: &Field<f64>) -> f64 {
        let shift = a.mean() - b.mean();
        a.as_slice().iter().zip(b.as_slice()).map(|(x, y)| (x - y - shift).abs()).fold(0.0, f64::max)
    }

    fn error(rule: EdgeRule, nx: usize, ny: usize) -> f64 {
        let truth = sampled(nx, ny, |p| (0.8 * p.x).sin() * (1.1 * p.y + 0.3).cos());
        let slopes = sampled(nx, ny, |p| {
            DVec2::new(
                0.8 * (0.8 * p.x).cos() * (1.1 * p.y + 0.3).cos(),
                -1.1 * (0.8 * p.x).sin() * (1.1 * p.y + 0.3).sin(),
            )
        });
        worst(heights_of_slopes(&slopes, EXTENT, rule).heights_mm(), &truth)
    }

    #[test]
    fn heights_converge_with_the_order_of_the_rule_on_oblong_cells() {
        for (rule, order) in RULES.into_iter().zip([4.0, 16.0]) {
            let ratio = error(rule, 41, 33) / error(rule, 81, 65);
            assert!((0.8 * order..1.6 * order).contains(&ratio), "{rule:?}: {ratio}");
        }
    }

    #[test]
    fn polynomials_of_the_order_of_the_rule_are_exact_up_to_the_border() {
        for (rule, degree) in RULES.into_iter().zip([2, 4]) {
            let truth = sampled(9, 6, |p| p.x.powi(degree) - 0.5 * p.y.powi(degree));
            let slopes =
                sampled(9, 6, |p| f64::from(degree) * DVec2::new(p.x.powi(degree - 1), -0.5 * p.y.powi(degree - 1)));
            let heights = heights_of_slopes(&slopes, EXTENT, rule);
            assert!(worst(heights.heights_mm(), &truth) < 1e-11, "{rule:?}");
        }
    }

    /// The same as [`least_squares`] by matrix-free conjugate gradients, as the paper does it: the
    /// independent check.
    ///
    /// Stops when the residual of the normal equations is `tolerance` times its first value, or
    /// after `iteration_limit` steps; returns the steps made.
    fn least_squares_by_conjugate_gradients(
        (nx, ny): (usize, usize),
        weights: DVec2,
        rise_x: impl Fn(usize, usize) -> f64 + Sync,
        rise_y: impl Fn(usize, usize) -> f64 + Sync,
        tolerance: f64,
        iteration_limit: usize,
    ) -> (Field<f64>, usize) {
        let dot =
            |a: &Field<f64>, b: &Field<f64>| a.as_slice().iter().zip(b.as_slice()).map(|(x, y)| x * y).sum::<f64>();
        let add = |a: &mut Field<f64>, factor: f64, b: &Field<f64>| {
            a.as_mut_slice().iter_mut().zip(b.as_slice()).for_each(|(x, y)| *x += factor * y);
        };
        let mut z = Field::filled(nx, ny, 0.0);
        let mut residual = divergence((nx, ny), weights, rise_x, rise_y);
        let mut direction = residual.clone();
        let mut rr = dot(&residual, &residual);
        let enough = tolerance * tolerance * rr;
        for step in 0..iteration_limit {
            if rr <= enough {
                return (z, step);
            }
            let d = &direction;
            let image =
                divergence((nx, ny), weights, |i, j| d[(i + 1, j)] - d[(i, j)], |i, j| d[(i, j + 1)] - d[(i, j)]);
            let alpha = rr / dot(&direction, &image);
            add(&mut z, alpha, &direction);
            add(&mut residual, -alpha, &image);
            let new = dot(&residual, &residual);
            direction.as_mut_slice().iter_mut().for_each(|v| *v *= new / rr);
            add(&mut direction, 1.0, &residual);
            rr = new;
        }
        (z, iteration_limit)
    }

    #[test]
    fn the_direct_solution_is_that_of_conjugate_gradients_for_slopes_of_no_surface() {
        let noise = |i: usize, j: usize| ((i * 7919 + j * 104_729 + i * j * 31) % 1009) as f64 / 1009.0 - 0.4;
        let weights = DVec2::new(3.0, 0.7);
        let direct = least_squares((37, 22), weights, noise, |i, j| noise(j, i));
        let (iterated, steps) =
            least_squares_by_conjugate_gradients((37, 22), weights, noise, |i, j| noise(j, i), 1e-12, 2000);
        assert!(steps < 2000);
        assert!(worst(&direct, &iterated) < 1e-9);
        assert!(direct.mean().abs() < 1e-12);
    }
}
