//! Heights beyond the outline of a block, where there is no glass: what the spline through a grid needs there.

use super::{HeightField, SurfaceSpline};
use crate::grid::{Extent, Field};
use glam::DVec2;
use rayon::prelude::*;

/// What is left of the bend from node to node.
const DAMPING: f64 = 0.7;

/// Gives a height to every node without one (not a number), smoothly: along its row and along its column the heights go on with
/// their slope and a bend that fades, and the nearer of both counts more; a gap between heights is bridged by a straight line.
/// Nothing is done where there are no heights at all.
///
/// A node matters to the spline a quarter as much from row to row, so that what is far beyond the outline does not matter at all.
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

/// Nodes beyond the outline whose heights are kept as far as there are any, and up to which they blend into the continuation, spacings:
/// the spline within notices two of them.
const KEPT: (f64, f64) = (2.0, 5.0);
/// From where to where the bend across the outline fades, spacings.
const FADES: (f64, f64) = (2.0, 5.0);

/// The heights of a face on a grid of `cells` more along each side, mm: those of the face where it has any, and beyond its outline a
/// continuation that goes straight on along the normals of the outline, with the slope of the face there and a bend that soon fades.
/// Neighbours along the outline go on side by side, so that nothing beyond is sharper than the outline of the face itself.
pub(super) fn go_on_beyond(surface: &HeightField, (cx, cy): (usize, usize)) -> Field<f64> {
    let (old, extent, contour) = (surface.heights_mm(), surface.extent(), surface.contour());
    let (nx, ny) = (old.nx(), old.ny());
    let spacing = extent.node_spacing(nx, ny);
    let step = spacing.min_element();
    let spline = SurfaceSpline::through(surface);
    let size = extent.as_vec() + 2.0 * DVec2::new(cx as f64, cy as f64) * spacing;
    let wide = Extent::new(size.x, size.y);
    let (wx, wy) = (nx + 2 * cx, ny + 2 * cy);
    let mut heights = vec![0.0; wx * wy];
    heights.par_chunks_mut(wx).enumerate().for_each(|(j, row)| {
        for (i, z) in row.iter_mut().enumerate() {
            let (own_i, own_j) = (i.wrapping_sub(cx), j.wrapping_sub(cy));
            let own = (own_i < nx && own_j < ny).then(|| old[(own_i, own_j)]);
            let at = wide.node(i, j, wx, wy);
            let beyond = contour.level(at).distance_mm / step;
            let kept = own.map_or(0.0, |_| 1.0 - ramp(beyond, KEPT));
            *z = kept * own.unwrap_or_default();
            if kept < 1.0 {
                *z += (1.0 - kept) * straight_on(&spline, contour.foot(at), at, step);
            }
        }
    });
    Field::from_vec(wx, wy, heights)
}

/// The face gone on from a point of its outline to one beyond.
fn straight_on(spline: &SurfaceSpline, foot: DVec2, at: DVec2, step: f64) -> f64 {
    let (face, way) = (spline.sample(foot), at - foot);
    let length = way.length();
    let along = way.normalize_or_zero();
    let [xx, xy, yy] = face.curvature;
    let bend = xx * along.x * along.x + 2.0 * xy * along.x * along.y + yy * along.y * along.y;
    // The bend is constant, then falls in a straight line to nothing: integrated twice.
    let (begin, end) = (FADES.0 * step, FADES.1 * step);
    let part = (length - begin).clamp(0.0, end - begin);
    let lacks = part * part * part / (6.0 * (end - begin));
    let risen = 0.5 * length.min(end) * length.min(end) - lacks;
    let after = (length - end).max(0.0) * 0.5 * (begin + end);
    face.height_mm + face.slope.dot(way) + bend * (risen + after)
}

/// Keeps the heights far beyond the outline within those of the face: above soon, where there is no stock; below late, so that no hollow
/// that this makes keeps a cutter from the face.
pub(super) fn limit(surface: &HeightField, heights: &mut Field<f64>) {
    let ((low, high), contour) = (surface.range_mm(), surface.contour());
    let (nx, ny) = (heights.nx(), heights.ny());
    let extent = surface.extent();
    let (step, size) = (extent.node_spacing(nx, ny).min_element(), extent.as_vec().min_element());
    heights.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, z) in row.iter_mut().enumerate() {
            let beyond = contour.level(extent.node(i, j, nx, ny)).distance_mm;
            if beyond > 0.0 {
                *z += ramp(beyond, (5.0 * step, 12.0 * step)) * (z.min(high) - *z);
                *z += ramp(beyond, (0.05 * size, 0.1 * size)) * (z.max(low) - *z);
            }
        }
    });
}

/// Rises smoothly from 0 to 1 between two places.
fn ramp(at: f64, (begin, end): (f64, f64)) -> f64 {
    let t = ((at - begin) / (end - begin)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Outline;

    #[test]
    fn a_plane_goes_on_and_a_dome_does_so_smoothly() {
        let extent = Extent::new(40.0, 40.0);
        let n = 81;
        let contour = Outline::Circle.within(extent);
        let masked = |f: &dyn Fn(f64, f64) -> f64| {
            let mut field = Field::from_fn(n, n, |i, j| {
                let p = extent.node(i, j, n, n);
                if contour.contains(p) { f(p.x, p.y) } else { f64::NAN }
            });
            fill_missing(&mut field);
            field
        };
        let plane = |x: f64, y: f64| 0.3 * x - 0.1 * y + 2.0;
        let field = masked(&plane);
        let dome = masked(&|x, y| -0.01 * (x * x + y * y));
        for j in 0..n {
            for i in 0..n {
                let p = extent.node(i, j, n, n);
                assert!((field[(i, j)] - plane(p.x, p.y)).abs() < 1e-9, "{i} {j}: {}", field[(i, j)]);
                let truth = -0.01 * p.length_squared();
                let beyond = contour.level(p).distance_mm;
                if beyond < 1.0 {
                    assert!((dome[(i, j)] - truth).abs() < 0.02, "{i} {j}: {} for {truth}", dome[(i, j)]);
                }
                assert!(dome[(i, j)] > -9.0 && dome[(i, j)] < 0.1);
            }
        }
    }
}
