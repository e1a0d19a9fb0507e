//! Filters that are diagonal in cosines: the direct solution of Poisson's equation and its kin on a
//! rectangle.

use super::Field;
use rayon::prelude::*;
use rustdct::{DctPlanner, TransformType2And3};
use rustfft::{Fft, FftPlanner, num_complex::Complex64};
use std::{f64::consts::PI, sync::Arc};

/// Where the even reflection sits that makes the cosines complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// Even about the outermost values (DCT-I): values on nodes. Frequency `k` of `n` is `cos(pi k
    /// i / (n - 1))`.
    Nodes,
    /// Even about half a step outside of them (DCT-II and III): values in cells. Frequency `k` of
    /// `n` is `cos(pi k (i + 1/2) / n)`.
    Cells,
}

/// A planned transform of one size, with the memory it needs.
pub struct CosineFilter {
    along_x: Transform,
    along_y: Transform,
    transposed: Vec<f64>,
}

impl std::fmt::Debug for CosineFilter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CosineFilter").field("nx", &self.along_x.len).field("ny", &self.along_y.len).finish()
    }
}

impl CosineFilter {
    /// Plans for fields of `nx` by `ny`.
    ///
    /// # Panics
    /// If one of them is less than 2.
    pub fn new(symmetry: Symmetry, nx: usize, ny: usize) -> Self {
        assert!(nx >= 2 && ny >= 2, "a cosine transform needs 2 x 2 values, not {nx} x {ny}");
        Self {
            along_x: Transform::new(symmetry, nx),
            along_y: Transform::new(symmetry, ny),
            transposed: vec![0.0; nx * ny],
        }
    }

    /// Multiplies the cosine of frequency `(kx, ky)` in `field` by `symbol(kx, ky)`. A symbol of 1
    /// is the identity.
    ///
    /// # Panics
    /// If the field has another size than planned for.
    pub fn apply(&mut self, field: &mut Field<f64>, symbol: impl Fn(usize, usize) -> f64 + Sync) {
        let (nx, ny) = (self.along_x.len, self.along_y.len);
        assert_eq!((field.nx(), field.ny()), (nx, ny), "a filter planned for another size");
        let data = field.as_mut_slice();
        self.along_x.forward(data);
        transpose(data, &mut self.transposed, nx, ny);
        self.along_y.forward(&mut self.transposed);
        let scale = self.along_x.scale() * self.along_y.scale();
        self.transposed.par_chunks_mut(ny).enumerate().for_each(|(kx, column)| {
            for (ky, value) in column.iter_mut().enumerate() {
                *value *= scale * symbol(kx, ky);
            }
        });
        self.along_y.inverse(&mut self.transposed);
        transpose(&self.transposed, data, ny, nx);
        self.along_x.inverse(data);
    }
}

/// A transform of rows of one length.
struct Transform {
    len: usize,
    plan: Plan,
}

enum Plan {
    /// A complex transform of the even extension, which takes two real rows at once: their spectra
    /// are real, so that one rides in the real part and the other in the imaginary part.
    Nodes(Arc<dyn Fft<f64>>),
    Cells(Arc<dyn TransformType2And3<f64>>),
}

impl Transform {
    fn new(symmetry: Symmetry, len: usize) -> Self {
        let plan = match symmetry {
            Symmetry::Nodes => Plan::Nodes(FftPlanner::new().plan_fft_forward(2 * (len - 1))),
            Symmetry::Cells => Plan::Cells(DctPlanner::new().plan_dct2(len)),
        };
        Self { len, plan }
    }

    /// What forward and inverse together multiply by, inverted.
    fn scale(&self) -> f64 {
        match self.plan {
            Plan::Nodes(_) => 1.0 / (2 * (self.len - 1)) as f64,
            Plan::Cells(_) => 2.0 / self.len as f64,
        }
    }

    fn forward(&self, rows: &mut [f64]) {
        match &self.plan {
            Plan::Nodes(fft) => even_rows(fft.as_ref(), rows, self.len),
            Plan::Cells(dct) => each_row(rows, self.len, dct.get_scratch_len(), |row, scratch| {
                dct.process_dct2_with_scratch(row, scratch);
            }),
        }
    }

    fn inverse(&self, rows: &mut [f64]) {
        match &self.plan {
            // The transform of an even sequence is its own inverse.
            Plan::Nodes(fft) => even_rows(fft.as_ref(), rows, self.len),
            Plan::Cells(dct) => each_row(rows, self.len, dct.get_scratch_len(), |row, scratch| {
                dct.process_dct3_with_scratch(row, scratch);
            }),
        }
    }
}

/// Rows handled by one task; a constant, so that the split does not depend on the number of
/// threads.
const ROWS_PER_TASK: usize = 16;

fn each_row(rows: &mut [f64], len: usize, scratch_len: usize, f: impl Fn(&mut [f64], &mut [f64]) + Sync) {
    rows.par_chunks_mut(len * ROWS_PER_TASK)
        .for_each_init(|| vec![0.0; scratch_len], |scratch, rows| rows.chunks_mut(len).for_each(|row| f(row, scratch)));
}

fn even_rows(fft: &dyn Fft<f64>, rows: &mut [f64], len: usize) {
    let zero = Complex64::ZERO;
    rows.par_chunks_mut(len * ROWS_PER_TASK).for_each_init(
        || (vec![zero; fft.len()], vec![zero; fft.get_inplace_scratch_len()]),
        |(buffer, scratch), rows| {
            for pair in rows.chunks_mut(2 * len) {
                let (first, second) = pair.split_at_mut(len);
                for i in 0..len {
                    buffer[i] = Complex64::new(first[i], second.get(i).copied().unwrap_or(0.0));
                }
                for i in 1..len - 1 {
                    buffer[fft.len() - i] = buffer[i];
                }
                fft.process_with_scratch(buffer, scratch);
                for (value, spectrum) in first.iter_mut().zip(buffer.iter()) {
                    *value = spectrum.re;
                }
                for (value, spectrum) in second.iter_mut().zip(buffer.iter()) {
                    *value = spectrum.im;
                }
            }
        },
    );
}

/// Writes the transpose of `ny` rows of `nx` values.
pub(super) fn transpose<T: Copy + Send + Sync>(from: &[T], to: &mut [T], nx: usize, ny: usize) {
    const TILE: usize = 32;
    to.par_chunks_mut(ny * TILE).enumerate().for_each(|(band, columns)| {
        for j0 in (0..ny).step_by(TILE) {
            for (di, column) in columns.chunks_mut(ny).enumerate() {
                let i = band * TILE + di;
                for j in j0..(j0 + TILE).min(ny) {
                    column[j] = from[j * nx + i];
                }
            }
        }
    });
}

/// Eigenvalue of the grid graph's Laplacian (`-1, 2, -1`, natural ends) for frequency `k` of `n`
/// values with symmetry about cells: `2 - 2 cos(pi k / n)`.
pub fn path_laplacian_eigenvalue(k: usize, n: usize) -> f64 {
    let half = PI * k as f64 / (2 * n) as f64;
    4.0 * half.sin().powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(nx: usize, ny: usize) -> Field<f64> {
        Field::from_fn(nx, ny, |i, j| ((i * 7919 + j * 104_729) % 1009) as f64 / 1009.0 - 0.5)
    }

    #[test]
    fn the_unit_symbol_is_the_identity_for_any_size() {
        for symmetry in [Symmetry::Nodes, Symmetry::Cells] {
            for (nx, ny) in [(2, 2), (3, 5), (17, 33), (64, 47), (129, 65)] {
                let field = noise(nx, ny);
                let mut out = field.clone();
                CosineFilter::new(symmetry, nx, ny).apply(&mut out, |_, _| 1.0);
                let error = out.as_slice().iter().zip(field.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "{symmetry:?} {nx} x {ny}: {error:e}");
            }
        }
    }

    #[test]
    fn a_symbol_picks_its_own_cosine() {
        let (nx, ny) = (21, 13);
        for symmetry in [Symmetry::Nodes, Symmetry::Cells] {
            let cosine = |k: usize, i: usize, n: usize| match symmetry {
                Symmetry::Nodes => (PI * (k * i) as f64 / (n - 1) as f64).cos(),
                Symmetry::Cells => (PI * k as f64 * (i as f64 + 0.5) / n as f64).cos(),
            };
            let mode = |kx: usize, ky: usize| Field::from_fn(nx, ny, |i, j| cosine(kx, i, nx) * cosine(ky, j, ny));
            let (wanted, other) = (mode(3, 5), mode(4, 5));
            let mut sum = Field::from_fn(nx, ny, |i, j| wanted[(i, j)] + other[(i, j)]);
            CosineFilter::new(symmetry, nx, ny).apply(&mut sum, |kx, ky| if (kx, ky) == (3, 5) { 2.0 } else { 0.0 });
            for (a, b) in sum.as_slice().iter().zip(wanted.as_slice()) {
                assert!((a - 2.0 * b).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_inverse_laplacian_undoes_the_laplacian() {
        let (nx, ny) = (30, 22);
        let mut field = noise(nx, ny);
        let mean = field.mean();
        field.as_mut_slice().iter_mut().for_each(|v| *v -= mean);
        let mut image = Field::from_fn(nx, ny, |i, j| {
            let mut sum = 0.0;
            let mut edge = |other: (usize, usize)| sum += field[(i, j)] - field[other];
            if i > 0 {
                edge((i - 1, j));
            }
            if i + 1 < nx {
                edge((i + 1, j));
            }
            if j > 0 {
                edge((i, j - 1));
            }
            if j + 1 < ny {
                edge((i, j + 1));
            }
            sum
        });
        CosineFilter::new(Symmetry::Cells, nx, ny).apply(&mut image, |kx, ky| {
            let eigenvalue = path_laplacian_eigenvalue(kx, nx) + path_laplacian_eigenvalue(ky, ny);
            if kx + ky == 0 { 0.0 } else { 1.0 / eigenvalue }
        });
        for (a, b) in image.as_slice().iter().zip(field.as_slice()) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
