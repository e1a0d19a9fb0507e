//! From the target's cells to light at the receiver's nodes.

use crate::grid::Field;
use rayon::prelude::*;

/// Added before logarithms are taken, relative to the mean.
const HAZE: f64 = 0.05;

/// Interpolates the irradiance of cells at the nodes of a grid that divides every cell into
/// `per_cell` along x and y.
///
/// Bilinear between the centres of cells, in the logarithm: between black and white the light of
/// the middle is a dark grey, so that an edge stays on its side. What is darker than `floor` is
/// raised to that.
pub(super) fn nodal(cells: &Field<f64>, per_cell: (usize, usize), floor: f64) -> Field<f64> {
    let logarithms = cells.map(|&e| (e.max(floor) + HAZE).ln());
    interpolate(&logarithms, per_cell, |v| (v.exp() - HAZE).max(floor))
}

/// Bilinear interpolation between the centres of cells at the nodes of the divided grid, constant
/// beyond the outermost centres, and then `map`.
pub(super) fn interpolate(cells: &Field<f64>, per_cell: (usize, usize), map: impl Fn(f64) -> f64 + Sync) -> Field<f64> {
    let (nx, ny) = (cells.nx() * per_cell.0 + 1, cells.ny() * per_cell.1 + 1);
    let along_x: Vec<_> = (0..nx).map(|i| between(i, per_cell.0, cells.nx())).collect();
    let mut data = vec![0.0; nx * ny];
    data.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        let (row, fy) = between(j, per_cell.1, cells.ny());
        let (below, above) = (cells.row(row), cells.row(row + 1));
        for (out, &(i, fx)) in out.iter_mut().zip(&along_x) {
            let lerp = |r: &[f64]| r[i] + fx * (r[i + 1] - r[i]);
            *out = map(lerp(below) + fy * (lerp(above) - lerp(below)));
        }
    });
    Field::from_vec(nx, ny, data)
}

/// The cell before node `k`, and how far the node is from its centre towards the next.
fn between(k: usize, per_cell: usize, cells: usize) -> (usize, f64) {
    let position = (k as f64 / per_cell as f64 - 0.5).clamp(0.0, (cells - 1) as f64);
    let cell = (position as usize).min(cells - 2);
    (cell, position - cell as f64)
}

/// Divides light at nodes by its trapezoidal mean.
pub(super) fn normalise(light: &mut Field<f64>) {
    let (nx, ny) = (light.nx(), light.ny());
    let weight = super::equation::trapezoid;
    let sums: Vec<f64> = light
        .as_slice()
        .par_chunks(nx)
        .enumerate()
        .map(|(j, row)| weight(j, ny) * row.iter().enumerate().map(|(i, v)| weight(i, nx) * v).sum::<f64>())
        .collect();
    let factor = ((nx - 1) * (ny - 1)) as f64 / sums.iter().sum::<f64>();
    light.as_mut_slice().par_chunks_mut(nx).for_each(|row| row.iter_mut().for_each(|v| *v *= factor));
}

/// Root mean square of the difference, both with mean 1.
pub(super) fn relative_rms(seen: &Field<f64>, wanted: &Field<f64>) -> f64 {
    let (a, b) = (seen.mean(), wanted.mean());
    let sum: f64 = seen.as_slice().iter().zip(wanted.as_slice()).map(|(s, w)| (s / a - w / b) * (s / a - w / b)).sum();
    (sum / seen.as_slice().len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::within_tenth_of;

    #[test]
    fn centres_keep_their_light_and_edges_are_geometric_means() {
        let cells = Field::from_fn(6, 4, |i, _| if i < 3 { 0.0 } else { 2.0 });
        let nodes = nodal(&cells, (2, 2), 1e-6);
        assert_eq!((nodes.nx(), nodes.ny()), (13, 9));
        assert!((nodes[(5, 1)] - 1e-6).abs() < 1e-12 && (nodes[(7, 3)] - 2.0).abs() < 1e-12);
        let edge = (0.05_f64 * 2.05).sqrt() - 0.05;
        within_tenth_of(3.2e-6, (nodes[(6, 4)] - edge).abs(), "edge");
        assert_eq!(nodes[(0, 0)], nodes[(1, 1)]);
    }

    #[test]
    fn normalised_light_has_the_trapezoidal_mean_one() {
        let mut light = Field::from_fn(7, 5, |i, j| 1.0 + (i * j) as f64);
        normalise(&mut light);
        let mut sum = 0.0;
        for j in 0..4 {
            for i in 0..6 {
                sum += 0.25 * (light[(i, j)] + light[(i + 1, j)] + light[(i, j + 1)] + light[(i + 1, j + 1)]);
            }
        }
        assert!((sum / 24.0 - 1.0).abs() < 1e-14);
    }
}
