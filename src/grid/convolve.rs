//! Convolution of fields with a kernel, by Fourier transforms.

use super::{Field, dct::transpose};
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner, num_complex::Complex64};
use std::sync::Arc;

/// Convolution of fields of one size with one kernel. What lies outside of a field counts as 0, and
/// nothing wraps round.
pub struct Convolution {
    size: (usize, usize),
    /// With room for the kernel.
    padded: (usize, usize),
    rows: (Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>),
    columns: (Arc<dyn Fft<f64>>, Arc<dyn Fft<f64>>),
    /// Of the kernel, over the number of padded values: column after column.
    spectrum: Vec<Complex64>,
    by_rows: Vec<Complex64>,
    by_columns: Vec<Complex64>,
}

impl std::fmt::Debug for Convolution {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Convolution").field("size", &self.size).field("padded", &self.padded).finish()
    }
}

/// Rows handled by one task; a constant, so that the split does not depend on the number of
/// threads.
const ROWS_PER_TASK: usize = 16;

impl Convolution {
    /// Plans for fields of `nx` by `ny` and a kernel with an odd number of values along each side,
    /// whose middle one stands for no shift.
    ///
    /// # Panics
    /// If a side of the kernel is even.
    pub fn new(kernel: &Field<f64>, nx: usize, ny: usize) -> Self {
        let (rx, ry) = (kernel.nx() / 2, kernel.ny() / 2);
        assert!(kernel.nx() % 2 == 1 && kernel.ny() % 2 == 1, "a kernel has a middle");
        // The kernel itself may be wider than the field.
        let (px, py) = (quick_length(nx.max(kernel.nx()) + rx), quick_length(ny.max(kernel.ny()) + ry));
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        let half = px / 2 + 1;
        let mut plan = Self {
            size: (nx, ny),
            padded: (px, py),
            rows: (real.plan_fft_forward(px), real.plan_fft_inverse(px)),
            columns: (complex.plan_fft_forward(py), complex.plan_fft_inverse(py)),
            spectrum: Vec::new(),
            by_rows: vec![Complex64::ZERO; half * py],
            by_columns: vec![Complex64::ZERO; half * py],
        };
        // The middle of the kernel at the origin, what lies before it at the far end.
        let mut rolled = vec![0.0; px * py];
        for j in 0..kernel.ny() {
            for i in 0..kernel.nx() {
                rolled[(j + py - ry) % py * px + (i + px - rx) % px] += kernel[(i, j)];
            }
        }
        plan.forward(&rolled, px);
        let scale = 1.0 / (px * py) as f64;
        plan.spectrum = plan.by_columns.iter().map(|v| v * scale).collect();
        plan
    }

    /// Writes the convolution of `field` with the kernel.
    ///
    /// # Panics
    /// If a field has another size than planned for.
    pub fn apply(&mut self, field: &Field<f64>, out: &mut Field<f64>) {
        self.filter(field, out, |v, kernel| v * kernel);
    }

    /// Writes the correlation of `field` with the kernel: the transpose of [`apply`](Self::apply).
    ///
    /// # Panics
    /// If a field has another size than planned for.
    pub fn apply_transposed(&mut self, field: &Field<f64>, out: &mut Field<f64>) {
        self.filter(field, out, |v, kernel| v * kernel.conj());
    }

    fn filter(
        &mut self,
        field: &Field<f64>,
        out: &mut Field<f64>,
        product: impl Fn(Complex64, Complex64) -> Complex64 + Sync,
    ) {
        for field in [field, &*out] {
            assert_eq!((field.nx(), field.ny()), self.size, "a convolution planned for another size");
        }
        self.forward(field.as_slice(), self.size.0);
        let py = self.padded.1;
        let inverse = &self.columns.1;
        self.by_columns
            .par_chunks_mut(py * ROWS_PER_TASK)
            .zip(self.spectrum.par_chunks(py * ROWS_PER_TASK))
            .for_each_init(
                || vec![Complex64::ZERO; inverse.get_inplace_scratch_len()],
                |scratch, (values, kernel)| {
                    values.iter_mut().zip(kernel).for_each(|(v, k)| *v = product(*v, *k));
                    inverse.process_with_scratch(values, scratch);
                },
            );
        self.backward(out);
    }

    /// Transforms rows of `width` values, as many as there are, into `by_columns`.
    fn forward(&mut self, rows: &[f64], width: usize) {
        let (px, py) = self.padded;
        let half = px / 2 + 1;
        let transform = &self.rows.0;
        let filled = rows.len() / width * half;
        self.by_rows[..filled]
            .par_chunks_mut(half * ROWS_PER_TASK)
            .zip(rows.par_chunks(width * ROWS_PER_TASK))
            .for_each_init(
                || (transform.make_input_vec(), transform.make_scratch_vec()),
                |(input, scratch), (spectra, rows)| {
                    for (spectrum, row) in spectra.chunks_mut(half).zip(rows.chunks(width)) {
                        input[..width].copy_from_slice(row);
                        input[width..].fill(0.0);
                        // The lengths are those of the plan.
                        let done = transform.process_with_scratch(input, spectrum, scratch);
                        debug_assert!(done.is_ok());
                    }
                },
            );
        self.by_rows[filled..].fill(Complex64::ZERO);
        transpose(&self.by_rows, &mut self.by_columns, half, py);
        let columns = &self.columns.0;
        self.by_columns.par_chunks_mut(py * ROWS_PER_TASK).for_each_init(
            || vec![Complex64::ZERO; columns.get_inplace_scratch_len()],
            |scratch, values| columns.process_with_scratch(values, scratch),
        );
    }

    /// Transforms `by_columns`, whose columns are back already, into rows.
    fn backward(&mut self, out: &mut Field<f64>) {
        let (px, py) = self.padded;
        let (nx, half) = (self.size.0, px / 2 + 1);
        transpose(&self.by_columns, &mut self.by_rows, py, half);
        let transform = &self.rows.1;
        out.as_mut_slice()
            .par_chunks_mut(nx * ROWS_PER_TASK)
            .zip(self.by_rows.par_chunks_mut(half * ROWS_PER_TASK))
            .for_each_init(
                || (transform.make_output_vec(), transform.make_scratch_vec()),
                |(output, scratch), (rows, spectra)| {
                    for (row, spectrum) in rows.chunks_mut(nx).zip(spectra.chunks_mut(half)) {
                        // The spectrum of a real row: these are 0 but for rounding, which the
                        // transform would refuse.
                        spectrum[0].im = 0.0;
                        if px % 2 == 0 {
                            spectrum[half - 1].im = 0.0;
                        }
                        let done = transform.process_with_scratch(spectrum, output, scratch);
                        debug_assert!(done.is_ok());
                        row.copy_from_slice(&output[..nx]);
                    }
                },
            );
    }
}

/// The least length from `n` on whose transform is quick: products of 2, 3 and 5, even ones.
fn quick_length(n: usize) -> usize {
    let is_quick = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (n.div_ceil(2)..).map(|k| 2 * k).find(|&k| is_quick(k)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(nx: usize, ny: usize) -> Field<f64> {
        Field::from_fn(nx, ny, |i, j| ((i * 7919 + j * 104_729) % 1009) as f64 / 1009.0)
    }

    /// By the definition.
    fn direct(kernel: &Field<f64>, field: &Field<f64>) -> Field<f64> {
        let (rx, ry) = (kernel.nx() as i64 / 2, kernel.ny() as i64 / 2);
        Field::from_fn(field.nx(), field.ny(), |i, j| {
            let mut sum = 0.0;
            for q in 0..kernel.ny() {
                for p in 0..kernel.nx() {
                    let (x, y) = (i as i64 - (p as i64 - rx), j as i64 - (q as i64 - ry));
                    if (0..field.nx() as i64).contains(&x) && (0..field.ny() as i64).contains(&y) {
                        sum += kernel[(p, q)] * field[(x as usize, y as usize)];
                    }
                }
            }
            sum
        })
    }

    #[test]
    fn it_is_the_sum_of_shifted_copies_also_for_kernels_wider_than_the_field() {
        for (nx, ny, kx, ky) in [(17, 9, 5, 3), (40, 33, 1, 7), (6, 5, 15, 21), (64, 64, 9, 9)] {
            let (kernel, field) = (noise(kx, ky), noise(nx, ny));
            let mut plan = Convolution::new(&kernel, nx, ny);
            let mut out = Field::filled(nx, ny, 0.0);
            plan.apply(&field, &mut out);
            let expected = direct(&kernel, &field);
            let error = out.as_slice().iter().zip(expected.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-12, "{nx} x {ny} with {kx} x {ky}: {error:e}");
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let (kernel, a) = (noise(7, 11), noise(30, 26));
        let b = a.map(|v| (40.0 * v).sin());
        let mut plan = Convolution::new(&kernel, 30, 26);
        let (mut ka, mut kb) = (a.clone(), a.clone());
        plan.apply(&a, &mut ka);
        plan.apply_transposed(&b, &mut kb);
        let dot =
            |a: &Field<f64>, b: &Field<f64>| a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&ka, &b) / dot(&a, &kb) - 1.0).abs() < 1e-12);
    }
}
