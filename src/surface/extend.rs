//! Heights beyond the outline of a block, where there is no glass: what the spline through a grid
//! needs there.

use super::{height_field::HeightField, spline::SurfaceSpline};
use crate::grid::{Contour, Extent, Field};
use glam::DVec2;
use rayon::prelude::*;

/// Nodes beyond the outline whose heights are kept as far as there are any, and up to which they
/// blend into the continuation, spacings: the spline within notices two of them.
const KEPT: (f64, f64) = (3.0, 9.0);
/// From where to where detail of the slope and of the bend across the outline fades, spacings.
const DETAIL: (f64, f64) = (2.0, 5.0);
/// Detail is what is finer along the outline than this, spacings: the width of a Gaussian.
const SMOOTH: f64 = 12.0;

/// The heights of a face on a grid of `cells` more along each side, mm: those of the face where it
/// has any, and beyond its outline a continuation straight on across it, with the slope that the
/// face has there and, as far as `bends_mm`, its bend. Detail of both along the outline soon fades,
/// so that neighbours go on side by side.
///
/// With the bend, light of a face on which it is spread without folds goes on from the border of
/// its picture outwards: there the map from the face to its landing points has the Jacobian `J`,
/// symmetric and positive, which takes the tangent `t` of the outline to the border of the picture.
/// Its normal is then along `J^-1 n`, and `J n . J^-1 n = 1`. Without the bend that may be negative
/// where the map shears.
pub(super) fn go_on_beyond(surface: &HeightField, (cx, cy): (usize, usize), bends_mm: f64) -> Field<f64> {
    let (old, extent, contour) = (surface.heights_mm(), surface.extent(), surface.contour());
    let (nx, ny) = (old.nx(), old.ny());
    let spacing = extent.node_spacing(nx, ny);
    let step = spacing.min_element();
    let edge = Edge::of(surface, step, bends_mm);
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
                *z += (1.0 - kept) * edge.beyond(contour.foot(at), at);
            }
        }
    });
    Field::from_vec(wx, wy, heights)
}

/// The face at its outline: what its continuation begins with.
struct Edge {
    spline: SurfaceSpline,
    contour: Contour,
    step: f64,
    bends_mm: f64,
    /// Gradient (x, y) and second derivatives (xx, xy, yy) without detail, at equal angles around
    /// the middle, in parts of the half width and height.
    smooth: Vec<[f64; 5]>,
}

impl Edge {
    fn of(surface: &HeightField, step: f64, bends_mm: f64) -> Self {
        let (spline, contour) = (SurfaceSpline::through(surface), surface.contour());
        let half = 0.5 * contour.extent().as_vec();
        let count = (4.0 * half.element_sum() / step).ceil().max(8.0) as usize;
        let mut edge = Self { spline, contour, step, bends_mm, smooth: Vec::new() };
        let face: Vec<[f64; 5]> = (0..count)
            .into_par_iter()
            .map(|k| {
                let ray = half * DVec2::from_angle(std::f64::consts::TAU * k as f64 / count as f64);
                edge.derivatives(contour.crossing(DVec2::ZERO, 2.0 * ray))
            })
            .collect();
        let reach = (3.0 * SMOOTH) as isize;
        let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / SMOOTH).powi(2)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let around = |k: usize, offset: isize| face[(k as isize + offset).rem_euclid(count as isize) as usize];
        edge.smooth = (0..count)
            .map(|k| {
                let parts = (-reach..=reach).zip(&weights).map(|(offset, w)| around(k, offset).map(|v| w * v / sum));
                parts.fold([0.0; 5], |sum, part| std::array::from_fn(|k| sum[k] + part[k]))
            })
            .collect();
        edge
    }

    fn derivatives(&self, at: DVec2) -> [f64; 5] {
        let face = self.spline.sample(at);
        let [xx, xy, yy] = face.curvature;
        [face.slope.x, face.slope.y, xx, xy, yy]
    }

    /// The face gone on from a point of its outline to one straight out from there.
    fn beyond(&self, foot: DVec2, at: DVec2) -> f64 {
        let way = at - foot;
        let (length, along) = (way.length(), way.normalize_or_zero());
        // Slope and bend along the way.
        let across = |[zx, zy, xx, xy, yy]: [f64; 5]| {
            let bend = xx * along.x * along.x + 2.0 * xy * along.x * along.y + yy * along.y * along.y;
            (zx * along.x + zy * along.y, bend)
        };
        let (slope, bend) = across(self.derivatives(foot));
        let turn = (foot / self.contour.extent().as_vec()).to_angle() / std::f64::consts::TAU;
        let place = turn.rem_euclid(1.0) * self.smooth.len() as f64;
        let (k, t) = (place as usize, place.fract());
        let (a, b) = (self.smooth[k % self.smooth.len()], self.smooth[(k + 1) % self.smooth.len()]);
        let (smooth_slope, smooth_bend) = across(std::array::from_fn(|part| a[part] * (1.0 - t) + b[part] * t));
        let detail = (DETAIL.0 * self.step, DETAIL.1 * self.step);
        let bends = (self.bends_mm.max(detail.0), (1.5 * self.bends_mm).max(detail.1));
        let [_, fine_slope, fine_bend] = faded(length, detail);
        let [_, _, whole_bend] = faded(length, bends);
        self.spline.sample(foot).height_mm
            + smooth_slope * length
            + (slope - smooth_slope) * fine_slope
            + smooth_bend * whole_bend
            + (bend - smooth_bend) * fine_bend
    }
}

/// What is 1 up to a place and falls in a straight line to 0 at another: itself, and integrated
/// once and twice from 0.
fn faded(at: f64, (begin, end): (f64, f64)) -> [f64; 3] {
    let within = at.min(end);
    let part = (within - begin).max(0.0);
    let fall = end - begin;
    let value = (1.0 - (at - begin).max(0.0) / fall).max(0.0);
    let once = within - part * part / (2.0 * fall);
    let twice = 0.5 * within * within - part * part * part / (6.0 * fall) + (at - within) * 0.5 * (begin + end);
    [value, once, twice]
}

/// Keeps the heights far beyond the outline within those of the face: above soon, where there is no
/// stock; below late, so that no hollow that this makes keeps a cutter from the face.
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

/// Where heights beyond the outline begin to be kept within those of the face, and where they all
/// are, spacings. Of what is eight nodes further the spline notices less than a ten-thousandth.
const LEVEL: (f64, f64) = (8.0, 12.0);

/// Keeps the heights beyond the outline within those of the face, but for the next few nodes, of
/// which the spline within takes notice.
pub(super) fn level(surface: &HeightField, heights: &mut Field<f64>) {
    let ((low, high), contour) = (surface.range_mm(), surface.contour());
    let (nx, ny) = (heights.nx(), heights.ny());
    let extent = surface.extent();
    let step = extent.node_spacing(nx, ny).min_element();
    heights.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, z) in row.iter_mut().enumerate() {
            let beyond = contour.level(extent.node(i, j, nx, ny)).distance_mm;
            *z += ramp(beyond / step, LEVEL) * (z.clamp(low, high) - *z);
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
    use super::{super::fill::fill_missing, *};
    use crate::grid::Outline;
    use crate::measured::at_worst;

    #[test]
    fn what_fades_is_integrated() {
        let limits = (0.3, 1.1);
        let step = 1e-4;
        for k in 0..20 {
            let at = 0.1 * f64::from(k);
            let [a, b, c] = [at, at + step, at + 2.0 * step].map(|at| faded(at, limits));
            assert!(((b[1] - a[1]) / step - 0.5 * (a[0] + b[0])).abs() < 1e-10, "{at}");
            assert!(((c[2] - a[2]) / (2.0 * step) - b[1]).abs() < 1e-8, "{at}");
        }
        assert_eq!(faded(0.0, limits), [1.0, 0.0, 0.0]);
    }

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
                    at_worst(
                        0.0156,
                        (dome[(i, j)] - truth).abs(),
                        format_args!("{i} {j}: {} for {truth}", dome[(i, j)]),
                    );
                }
                assert!(dome[(i, j)] > -9.0 && dome[(i, j)] < 0.1);
            }
        }
    }
}
