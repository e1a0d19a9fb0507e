//! Vector kernels in parallel over chunks of a fixed length, so that sums do not depend on the
//! number of threads.

use rayon::prelude::*;

/// Elements per task. Below one chunk everything runs on the calling thread, which keeps small
/// problems fast.
const CHUNK: usize = 1 << 14;

/// Partial sums, kept to be reused.
#[derive(Debug, Default)]
pub(crate) struct Sums(Vec<[f64; 2]>);

impl Sums {
    /// Two sums of products at once: `a.b` and `a.c`.
    pub(crate) fn dot2(&mut self, a: &[f64], b: &[f64], c: &[f64]) -> [f64; 2] {
        if a.len() <= CHUNK {
            return dot2_chunk(a, b, c);
        }
        a.par_chunks(CHUNK)
            .zip(b.par_chunks(CHUNK).zip(c.par_chunks(CHUNK)))
            .map(|(a, (b, c))| dot2_chunk(a, b, c))
            .collect_into_vec(&mut self.0);
        self.0.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]])
    }

    /// The scalar product.
    pub(crate) fn dot(&mut self, a: &[f64], b: &[f64]) -> f64 {
        if a.len() <= CHUNK {
            return dot_chunk(a, b);
        }
        a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| [dot_chunk(a, b), 0.0]).collect_into_vec(&mut self.0);
        self.0.iter().map(|part| part[0]).sum()
    }
}

/// `out = x + step * d`.
pub(crate) fn step_along(out: &mut [f64], x: &[f64], step: f64, d: &[f64]) {
    let kernel = |out: &mut [f64], x: &[f64], d: &[f64]| {
        for ((out, x), d) in out.iter_mut().zip(x).zip(d) {
            *out = x + step * d;
        }
    };
    if out.len() <= CHUNK {
        return kernel(out, x, d);
    }
    out.par_chunks_mut(CHUNK)
        .zip(x.par_chunks(CHUNK).zip(d.par_chunks(CHUNK)))
        .for_each(|(out, (x, d))| kernel(out, x, d));
}

/// `d = beta * d - g`.
pub(crate) fn turn(d: &mut [f64], beta: f64, g: &[f64]) {
    let kernel = |d: &mut [f64], g: &[f64]| {
        for (d, g) in d.iter_mut().zip(g) {
            *d = beta * *d - g;
        }
    };
    if d.len() <= CHUNK {
        return kernel(d, g);
    }
    d.par_chunks_mut(CHUNK).zip(g.par_chunks(CHUNK)).for_each(|(d, g)| kernel(d, g));
}

// Four running sums: the compiler may not reorder one, and one alone waits for its own latency.
fn dot_chunk(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            lanes[k] += x[k] * y[k];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail
}

fn dot2_chunk(a: &[f64], b: &[f64], c: &[f64]) -> [f64; 2] {
    [dot_chunk(a, b), dot_chunk(a, c)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_the_number_of_threads() {
        let a: Vec<f64> = (0..3 * CHUNK + 77).map(|k| (k as f64 * 0.37).sin()).collect();
        let b: Vec<f64> = a.iter().rev().copied().collect();
        let in_pool = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (Sums::default().dot(&a, &b), Sums::default().dot2(&a, &b, &a)))
        };
        let (one, both) = in_pool(1);
        assert_eq!((one, both), in_pool(3));
        assert_eq!(one, both[0]);
        let plain: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
        assert!((one - plain).abs() < 1e-9);
    }
}
