use super::Field;
use glam::DVec2;
use rayon::prelude::*;

/// Averages a cell grid over the cells of another cell grid on the same rectangle.
///
/// Values are densities, constant inside a cell: the integral over the rectangle is conserved
/// exactly, whichever of the two grids is finer and whether or not one divides the other.
pub fn area_resample(cells: &Field<f64>, nx: usize, ny: usize) -> Field<f64> {
    if (nx, ny) == (cells.nx(), cells.ny()) {
        return cells.clone();
    }
    let along_x = overlaps(cells.nx(), nx);
    let along_y = overlaps(cells.ny(), ny);
    let mut narrow = vec![0.0; nx * cells.ny()];
    narrow.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        let row = cells.row(j);
        for (value, parts) in out.iter_mut().zip(&along_x) {
            *value = parts.iter().map(|&(i, weight)| weight * row[i]).sum();
        }
    });
    let mut data = vec![0.0; nx * ny];
    data.par_chunks_mut(nx).zip(&along_y).for_each(|(out, parts)| {
        for &(j, weight) in parts {
            for (value, &source) in out.iter_mut().zip(&narrow[j * nx..(j + 1) * nx]) {
                *value += weight * source;
            }
        }
    });
    Field::from_vec(nx, ny, data)
}

/// For each of `to` equal cells of the unit interval: which of `from` equal cells it overlaps, with
/// weights of sum one.
fn overlaps(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    // In units of 1 / (from * to) all borders are integers, so no sliver is ever lost or counted
    // twice.
    (0..to)
        .map(|k| {
            let (begin, end) = (k * from, (k + 1) * from);
            (begin / to..end.div_ceil(to))
                .map(|i| {
                    let overlap = end.min((i + 1) * to) - begin.max(i * to);
                    (i, overlap as f64 / from as f64)
                })
                .collect()
        })
        .collect()
}

/// The value at a position in units of nodes: bilinear between them, constant beyond the outermost.
#[inline]
pub(crate) fn bilinear(field: &Field<f64>, at: DVec2) -> f64 {
    let along = |at: f64, n: usize| {
        let at = at.clamp(0.0, (n - 1) as f64);
        let k = (at as usize).min(n - 2);
        (k, at - k as f64)
    };
    let ((i, fx), (j, fy)) = (along(at.x, field.nx()), along(at.y, field.ny()));
    let lerp = |j: usize| field[(i, j)] + fx * (field[(i + 1, j)] - field[(i, j)]);
    lerp(j) + fy * (lerp(j + 1) - lerp(j))
}

/// Interpolates a node grid bilinearly at the nodes of another node grid on the same rectangle.
pub fn bilinear_resample(nodes: &Field<f64>, nx: usize, ny: usize) -> Field<f64> {
    if (nx, ny) == (nodes.nx(), nodes.ny()) {
        return nodes.clone();
    }
    let position = |k: usize, to: usize, from: usize| {
        let at = k as f64 * (from - 1) as f64 / (to - 1) as f64;
        let cell = (at as usize).min(from - 2);
        (cell, at - cell as f64)
    };
    let mut data = vec![0.0; nx * ny];
    data.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        let (row, fy) = position(j, ny, nodes.ny());
        let (below, above) = (nodes.row(row), nodes.row(row + 1));
        for (i, value) in out.iter_mut().enumerate() {
            let (column, fx) = position(i, nx, nodes.nx());
            let lerp = |r: &[f64]| r[column] + fx * (r[column + 1] - r[column]);
            *value = lerp(below) + fy * (lerp(above) - lerp(below));
        }
    });
    Field::from_vec(nx, ny, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_resampling_conserves_the_integral_between_unrelated_sizes() {
        let cells = Field::from_fn(37, 23, |i, j| ((i * 31 + j * 17) % 11) as f64);
        for (nx, ny) in [(37, 23), (5, 3), (64, 99), (1, 1), (36, 24)] {
            let out = area_resample(&cells, nx, ny);
            assert!((out.mean() - cells.mean()).abs() < 1e-13, "{nx} x {ny}: {} against {}", out.mean(), cells.mean());
        }
    }

    #[test]
    fn area_resampling_by_a_whole_factor_and_back_is_the_identity() {
        let cells = Field::from_fn(8, 6, |i, j| (i * i + 3 * j) as f64);
        let fine = area_resample(&cells, 24, 18);
        let back = area_resample(&fine, 8, 6);
        for (a, b) in back.as_slice().iter().zip(cells.as_slice()) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn bilinear_resampling_reproduces_linear_functions() {
        let plane = |i: usize, j: usize, nx: usize, ny: usize| {
            2.0 * i as f64 / (nx - 1) as f64 - 3.0 * j as f64 / (ny - 1) as f64
        };
        let nodes = Field::from_fn(9, 7, |i, j| plane(i, j, 9, 7));
        let out = bilinear_resample(&nodes, 31, 40);
        for j in 0..40 {
            for i in 0..31 {
                assert!((out[(i, j)] - plane(i, j, 31, 40)).abs() < 1e-14);
            }
        }
    }
}
