//! Heights of nodes that have none.

use crate::grid::Field;
use rayon::prelude::*;

/// What is left of the bend from node to node.
const DAMPING: f64 = 0.7;

/// Gives a height to every node without one (not a number), smoothly: along its row and along its
/// column the heights go on with their slope and a bend that fades, and the nearer of both counts
/// more; a gap between heights is bridged by a straight line. Nothing is done where there are no
/// heights at all.
///
/// A node matters to the spline a quarter as much from row to row, so that what is far beyond the
/// outline does not matter at all.
pub(super) fn fill_missing(heights: &mut Field<f64>) {
    let missing = |heights: &Field<f64>| heights.as_slice().iter().filter(|z| z.is_nan()).count();
    let mut left = missing(heights);
    while left > 0 {
        fill_once(heights);
        // What neither a row nor a column reached lies behind others that now have heights.
        let still = missing(heights);
        if still == left {
            return;
        }
        left = still;
    }
}

fn fill_once(heights: &mut Field<f64>) {
    let (nx, ny) = (heights.nx(), heights.ny());
    let along_x: Vec<Vec<Estimate>> = (0..ny).into_par_iter().map(|j| estimates(nx, |i| heights[(i, j)])).collect();
    let along_y: Vec<Vec<Estimate>> = (0..nx).into_par_iter().map(|i| estimates(ny, |j| heights[(i, j)])).collect();
    heights.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, z) in row.iter_mut().enumerate().filter(|(_, z)| z.is_nan()) {
            let both = [along_x[j][i], along_y[i][j]];
            let weight: f64 = both.iter().map(|e| e.weight).sum();
            if weight > 0.0 {
                *z = both.iter().map(|e| e.weight * e.height).sum::<f64>() / weight;
            }
        }
    });
}

#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    height: f64,
    weight: f64,
}

/// Continues the known part of a line to both ends, and bridges its gaps.
fn estimates(n: usize, at: impl Fn(usize) -> f64) -> Vec<Estimate> {
    let mut line = vec![Estimate::default(); n];
    let Some(first) = (0..n).find(|&k| !at(k).is_nan()) else { return line };
    let last = (first..n).rev().find(|&k| !at(k).is_nan()).unwrap_or(first);
    if last < first + 2 {
        // One or two heights, where a line touches the outline, tell no slope: other lines do.
        return line;
    }
    let mut before = first;
    for k in (first..=last).filter(|&k| !at(k).is_nan()) {
        for gap in before + 1..k {
            let share = (gap - before) as f64 / (k - before) as f64;
            let height = at(before) + share * (at(k) - at(before));
            line[gap] = Estimate { height, weight: ((gap - before).min(k - gap) as f64).powi(-4) };
        }
        before = k;
    }
    let inward = |k: usize, steps: usize| {
        if k == first { (first + steps).min(last) } else { last.saturating_sub(steps).max(first) }
    };
    for (end, outward) in [(first, (0..first).rev().collect::<Vec<_>>()), (last, (last + 1..n).collect())] {
        let [a, b, c] = [0, 1, 2].map(|steps| at(inward(end, steps)));
        let b = if b.is_nan() { a } else { b };
        let c = if c.is_nan() { 2.0 * b - a } else { c };
        let (mut height, mut rise, mut bend) = (a, a - b, a - 2.0 * b + c);
        for (steps, k) in outward.into_iter().enumerate() {
            bend *= DAMPING;
            rise += bend;
            height += rise;
            line[k] = Estimate { height, weight: ((steps + 1) as f64).powi(-4) };
        }
    }
    line
}
