//! B-spline faces as lattices of samples.

use super::{
    builder::SolidBuilder,
    fault::malformed,
    part21::Value,
    values::{GAP_MM, MOST_SAMPLES, degree, knots, odd},
};
use crate::load::error::LoadError;
use glam::DVec3;
use rayon::prelude::*;

impl SolidBuilder<'_> {
    /// A face whose loop is its border, or trims it.
    pub(super) fn net(
        &mut self,
        values: &[Value<'_>],
        number: u64,
        around: &[u32],
        same_sense: bool,
    ) -> Result<(), LoadError> {
        let (degree_u, degree_v) = (degree(values, 1, number)?, degree(values, 2, number)?);
        let rows: Vec<Vec<u64>> = values
            .get(3)
            .and_then(Value::list)
            .and_then(|rows| rows.iter().map(Value::references).collect())
            .ok_or_else(|| odd(number))?;
        let width = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|row| row.len() != width) {
            return Err(malformed(format!("the rows of the net #{number} have different lengths")));
        }
        let u = knots(degree_u, values, (8, 10), rows.len(), number)?;
        let v = knots(degree_v, values, (9, 11), width, number)?;
        let points: Vec<Vec<DVec3>> = rows
            .par_iter()
            .map(|row| row.iter().map(|&p| self.point(p)).collect())
            .collect::<Result<_, LoadError>>()?;
        let (nu, nv) = (u.samples(), v.samples());
        if nu.saturating_mul(nv) > MOST_SAMPLES {
            return Err(malformed(format!("the face #{number} needs {nu} x {nv} samples, more than are taken")));
        }
        self.allowance.take(nu * nv, "STEP")?;
        let samples: Vec<Vec<DVec3>> = (0..nu)
            .into_par_iter()
            .map(|k| {
                let (first, weights) = u.weights(u.parameter(k, nu));
                let mixed: Vec<DVec3> =
                    (0..width).map(|j| (0..=u.degree()).map(|l| weights[l] * points[first + l][j]).sum()).collect();
                (0..nv)
                    .map(|m| {
                        let (first, weights) = v.weights(v.parameter(m, nv));
                        (0..=v.degree()).map(|l| weights[l] * mixed[first + l]).sum()
                    })
                    .collect()
            })
            .collect();
        // The border in the order of the loop, which has it anticlockwise around the outward
        // normal.
        let mut border: Vec<usize> = (0..nu - 1).map(|k| k * nv).collect();
        border.extend((0..nv - 1).map(|m| (nu - 1) * nv + m));
        border.extend((1..nu).rev().map(|k| k * nv + nv - 1));
        border.extend((1..nv).rev());
        if !same_sense {
            border.reverse();
        }
        let Some(start) = self.fit_border(&samples, nv, &border, around) else {
            return self.trimmed(&samples, around, number);
        };
        let mut vertex = vec![u32::MAX; nu * nv];
        (0..border.len()).for_each(|k| vertex[border[k]] = around[(start + k) % border.len()]);
        for (k, column) in samples.iter().enumerate() {
            for (m, &at) in column.iter().enumerate() {
                if vertex[k * nv + m] == u32::MAX {
                    vertex[k * nv + m] = self.vertex(at)?;
                }
            }
        }
        for k in 0..nu - 1 {
            for m in 0..nv - 1 {
                let [a, b, c, d] =
                    [k * nv + m, (k + 1) * nv + m, (k + 1) * nv + m + 1, k * nv + m + 1].map(|n| vertex[n]);
                let halves = if same_sense { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                self.triangles.extend(halves);
            }
        }
        Ok(())
    }

    /// Where in its loop the border of a face begins, if it goes through the same places; if not,
    /// the loop trims the face.
    fn fit_border(&self, samples: &[Vec<DVec3>], nv: usize, border: &[usize], around: &[u32]) -> Option<usize> {
        if border.len() != around.len() {
            return None;
        }
        let sample = |k: usize| samples[border[k] / nv][border[k] % nv];
        let place = |k: usize| self.vertices[around[k] as usize];
        let n = around.len();
        let start =
            (0..n).min_by(|&a, &b| place(a).distance(sample(0)).total_cmp(&place(b).distance(sample(0)))).unwrap_or(0);
        let gap = (0..n).map(|k| place((start + k) % n).distance(sample(k))).fold(0.0, f64::max);
        (gap <= GAP_MM).then_some(start)
    }
}
