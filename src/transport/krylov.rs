//! Flexible GMRES (Saad 1993) in single precision with sums in double precision: it steers a Newton
//! iteration, to a tenth.

use rayon::prelude::*;
use std::ops::ControlFlow;

/// Memory of the iteration, reused from solve to solve.
#[derive(Debug, Default)]
pub(super) struct Gmres {
    basis: Vec<Vec<f32>>,
    directions: Vec<Vec<f32>>,
    partial: Vec<f64>,
}

/// How a solve ended.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    /// Weights of the directions, which [`Gmres::combine`] adds up.
    pub(super) weights: Vec<f64>,
    /// Norm of the residual relative to that of the right-hand side.
    #[cfg_attr(not(test), expect(dead_code, reason = "the Newton iteration judges by its own residual"))]
    pub(super) reduction: f64,
}

/// Values in one partial sum; a constant, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;

impl Gmres {
    /// Minimises `|rhs - sum_k w_k apply(k)|` over at most `most` directions. `apply(v, z, w)`
    /// turns the vector `v` into a direction `z` (the preconditioner) and `w`, the operator's value
    /// of that, or ends the solve.
    pub(super) fn solve(
        &mut self,
        rhs: &[f32],
        tolerance: f64,
        most: usize,
        mut apply: impl FnMut(&[f32], &mut [f32], &mut [f32]) -> ControlFlow<()>,
    ) -> Solved {
        let n = rhs.len();
        self.reserve(0, n);
        self.basis[0].copy_from_slice(rhs);
        let norm = norm(&self.basis[0], &mut self.partial);
        if norm == 0.0 {
            return Solved { weights: Vec::new(), reduction: 0.0 };
        }
        scale(&mut self.basis[0], 1.0 / norm);
        // Columns of the Hessenberg matrix, made triangular by rotations as they come.
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(most);
        let mut rotations: Vec<(f64, f64)> = Vec::with_capacity(most);
        let mut right = vec![norm];
        while columns.len() < most {
            let k = columns.len();
            self.reserve(k + 1, n);
            let (known, next) = self.basis.split_at_mut(k + 1);
            let w = &mut next[0];
            if apply(&known[k], &mut self.directions[k], w).is_break() {
                break;
            }
            let mut column = dots(known, w, &mut self.partial);
            let length = subtract(known, &column, w, &mut self.partial);
            for (i, &(c, s)) in rotations.iter().enumerate() {
                (column[i], column[i + 1]) = (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
            }
            let radius = column[k].hypot(length);
            if !(radius > 0.0 && radius.is_finite()) {
                break;
            }
            let (c, s) = (column[k] / radius, length / radius);
            column[k] = radius;
            rotations.push((c, s));
            right.push(-s * right[k]);
            right[k] *= c;
            columns.push(column);
            if right[k + 1].abs() <= tolerance * norm || length <= 1e-7 * radius {
                break;
            }
            scale(w, 1.0 / length);
        }
        let mut weights = right[..columns.len()].to_vec();
        for k in (0..columns.len()).rev() {
            weights[k] /= columns[k][k];
            for i in 0..k {
                weights[i] -= columns[k][i] * weights[k];
            }
        }
        Solved { weights, reduction: right[columns.len()].abs() / norm }
    }

    /// The directions of the last solve.
    pub(super) fn directions(&self) -> &[Vec<f32>] {
        &self.directions
    }

    fn reserve(&mut self, k: usize, n: usize) {
        for list in [&mut self.basis, &mut self.directions] {
            while list.len() <= k {
                list.push(Vec::new());
            }
            list[k].resize(n, 0.0);
        }
        self.partial.resize(n.div_ceil(CHUNK) * (k + 2), 0.0);
    }
}

fn norm(v: &[f32], partial: &mut [f64]) -> f64 {
    partial.par_iter_mut().zip(v.par_chunks(CHUNK)).for_each(|(sum, v)| {
        *sum = v.iter().map(|&v| f64::from(v) * f64::from(v)).sum();
    });
    partial[..v.len().div_ceil(CHUNK)].iter().sum::<f64>().sqrt()
}

fn scale(v: &mut [f32], by: f64) {
    let by = by as f32;
    v.par_chunks_mut(CHUNK).for_each(|v| v.iter_mut().for_each(|v| *v *= by));
}

/// Inner products of `w` with every vector of the basis, in one pass over `w`.
fn dots(basis: &[Vec<f32>], w: &[f32], partial: &mut [f64]) -> Vec<f64> {
    let k = basis.len();
    partial.par_chunks_mut(k).zip(w.par_chunks(CHUNK)).enumerate().for_each(|(chunk, (sums, w))| {
        let begin = chunk * CHUNK;
        for (sum, v) in sums.iter_mut().zip(basis) {
            *sum = dot(&v[begin..begin + w.len()], w);
        }
    });
    let mut totals = vec![0.0; k];
    for sums in partial.chunks(k).take(w.len().div_ceil(CHUNK)) {
        totals.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
    }
    totals
}

/// Products in single, sums of eight lanes in double precision.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut lanes = [0.0_f64; 8];
    let (heads, tails) = (a.chunks_exact(8).zip(b.chunks_exact(8)), a.len() / 8 * 8);
    for (a, b) in heads {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += f64::from(a * b);
        }
    }
    lanes.iter().sum::<f64>() + a[tails..].iter().zip(&b[tails..]).map(|(a, b)| f64::from(a * b)).sum::<f64>()
}

/// Subtracts the combination from `w` and returns the norm of what is left.
fn subtract(basis: &[Vec<f32>], weights: &[f64], w: &mut [f32], partial: &mut [f64]) -> f64 {
    partial.par_iter_mut().zip(w.par_chunks_mut(CHUNK)).enumerate().for_each(|(chunk, (sum, w))| {
        let begin = chunk * CHUNK;
        for (v, &weight) in basis.iter().zip(weights) {
            let weight = weight as f32;
            let v = &v[begin..begin + w.len()];
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= weight * v);
        }
        *sum = dot(w, w);
    });
    partial[..w.len().div_ceil(CHUNK)].iter().sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    #[test]
    fn a_nonsymmetric_system_is_solved() {
        let n = 300;
        let matrix = |v: &[f32], out: &mut [f32]| {
            for i in 0..n {
                let before = if i > 0 { v[i - 1] } else { 0.0 };
                let after = if i + 1 < n { v[i + 1] } else { 0.0 };
                out[i] = (2.5 + 0.3 * (i % 7) as f32) * v[i] - 1.2 * before - 0.7 * after;
            }
        };
        let wanted: Vec<f32> = (0..n).map(|i| ((i * 37 % 101) as f32 / 50.0) - 1.0).collect();
        let mut rhs = vec![0.0; n];
        matrix(&wanted, &mut rhs);
        let mut gmres = Gmres::default();
        let solved = gmres.solve(&rhs, 1e-5, 80, |v, z, w| {
            z.iter_mut().zip(v).for_each(|(z, v)| *z = v / 3.0);
            matrix(z, w);
            ControlFlow::Continue(())
        });
        assert!(solved.reduction <= 1e-5);
        for i in 0..n {
            let x: f64 = solved.weights.iter().zip(gmres.directions()).map(|(a, z)| a * f64::from(z[i])).sum();
            at_worst(3.3e-5, (x - f64::from(wanted[i])).abs(), format_args!("{i}: {x} against {}", wanted[i]));
        }
    }

    #[test]
    fn a_tenth_takes_few_steps_and_is_reported() {
        let rhs = vec![1.0_f32; 5000];
        let solved = Gmres::default().solve(&rhs, 0.1, 5, |v, z, w| {
            z.copy_from_slice(v);
            w.copy_from_slice(v);
            ControlFlow::Continue(())
        });
        assert_eq!(solved.weights.len(), 1);
        assert!(solved.reduction < 1e-6);
    }
}
