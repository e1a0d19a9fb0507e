//! Clamped cubic B-splines along one side of a face, and the least-squares fit with them: one sweep
//! of banded Cholesky.

use crate::grid::Field;
use rayon::prelude::*;

/// Degree of the surface.
pub const DEGREE: usize = 3;
/// B-splines that do not vanish at a point.
pub(super) const ORDER: usize = DEGREE + 1;

/// First B-spline that does not vanish at a point, and values, slopes and second derivatives of the
/// four.
pub(super) type Weights = (usize, [[f64; ORDER]; 3]);

/// The B-splines along one side.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// All knots, with their multiplicity.
    knots: Vec<f64>,
    /// The weights at every node.
    pub(super) nodes: Vec<Weights>,
    /// Banded Cholesky factor of the normal matrix: `factor[r][d]` stands in column `r - d`.
    factor: Vec<[f64; ORDER]>,
}

impl Axis {
    pub(super) fn new(nodes: usize, points: usize) -> Self {
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

    pub(super) fn points(&self) -> usize {
        self.knots.len() - ORDER
    }

    /// Length of the parameter's range.
    pub(super) fn intervals(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    pub(super) fn distinct(&self) -> &[f64] {
        &self.knots[DEGREE..self.knots.len() - DEGREE]
    }

    pub(super) fn greville(&self, size: f64) -> Vec<f64> {
        let per_interval = size / self.intervals();
        let mut places: Vec<f64> = (0..self.points())
            .map(|i| (self.knots[i + 1..i + ORDER].iter().sum::<f64>() / 3.0 - 0.5 * self.intervals()) * per_interval)
            .collect();
        let last = places.len() - 1;
        (places[0], places[last]) = (-0.5 * size, 0.5 * size);
        places
    }

    /// Weights at `n` equidistant places from end to end.
    pub(super) fn lattice(&self, n: usize) -> Vec<Weights> {
        (0..n).map(|k| self.weights(k as f64 * self.intervals() / (n - 1) as f64)).collect()
    }

    /// Weights at a parameter, by the recursion of Cox and de Boor.
    pub(super) fn weights(&self, at: f64) -> Weights {
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

    /// The Cholesky factor of `B^T W B`, where `B` holds the B-splines at the nodes. It is positive
    /// definite, because every B-spline has a node of its own under it (Schoenberg and Whitney).
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

    pub(super) fn fit_rows(&self, nodes: &Field<f64>) -> Field<f64> {
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

    pub(super) fn fit_columns(&self, rows: &Field<f64>) -> Field<f64> {
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
