//! How many layers of a mesh lie over every point of the window.

use super::mesh::CausticMesh;
use crate::{bench::Bench, grid::Field};
use glam::DVec2;
use rayon::prelude::*;

/// Numbers of layers on a raster of points over the window.
pub(super) struct Layers {
    corner: DVec2,
    step: DVec2,
    /// Points for each cell along a side.
    points: usize,
    counts: Field<u8>,
}

/// Points for each cell along a side, as long as the raster stays below this.
const POINTS: usize = 4;
const MOST_POINTS: usize = 4096;
/// Points across a facet of the mesh.
const POINTS_PER_FACET: usize = 6;
/// Rows of points filled by one task.
const BAND: usize = 64;

impl Layers {
    pub(super) fn of(mesh: &CausticMesh, bench: &Bench, cells: (usize, usize)) -> Self {
        let points = (MOST_POINTS / cells.0.max(cells.1)).clamp(1, POINTS);
        let (nx, ny) = (cells.0 * points, cells.1 * points);
        let corner = bench.window_centre_mm() + bench.window().lower();
        let step = bench.window().as_vec() / DVec2::new(nx as f64, ny as f64);
        let facets = mesh.pixels(step);
        let facet = |n: usize, vertices: usize| n.div_ceil(POINTS_PER_FACET).max(2 * (vertices - 1));
        let (fx, fy) = (facet(facets.0, mesh.size().0), facet(facets.1, mesh.size().1));
        // In points from here on; points lie at whole numbers.
        let vertices = Field::from_fn(fx + 1, fy + 1, |i, j| {
            let place = DVec2::new(i as f64 / fx as f64, j as f64 / fy as f64);
            (mesh.at(place).0 - corner) / step - 0.5
        });
        let spans: Vec<(f64, f64)> = (0..fy)
            .map(|j| {
                let rows = vertices.row(j).iter().chain(vertices.row(j + 1));
                rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.y), high.max(v.y)))
            })
            .collect();
        let mut counts = vec![0_u8; nx * ny];
        counts.par_chunks_mut(nx * BAND).enumerate().for_each(|(band, counts)| {
            let (first, last) = (band * BAND, band * BAND + counts.len() / nx - 1);
            for (j, _) in spans.iter().enumerate().filter(|(_, s)| s.0 <= last as f64 && s.1 >= first as f64) {
                for i in 0..fx {
                    let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|k| vertices[k]);
                    for triangle in [[a, b, c], [a, c, d]] {
                        fill(triangle, (first, last), nx, |k| counts[k] = counts[k].saturating_add(1));
                    }
                }
            }
        });
        Self { corner, step, points, counts: Field::from_vec(nx, ny, counts) }
    }

    /// The number of layers at a point of the receiver that lies on the mesh, at least 1.
    pub(super) fn at(&self, at: DVec2) -> f64 {
        let k = ((at - self.corner) / self.step).max(DVec2::ZERO);
        let (i, j) = ((k.x as usize).min(self.counts.nx() - 1), (k.y as usize).min(self.counts.ny() - 1));
        f64::from(self.counts[(i, j)].max(1))
    }

    /// Which part of every cell has any.
    pub(super) fn coverage(&self) -> Field<f64> {
        let n = self.points;
        Field::from_fn(self.counts.nx() / n, self.counts.ny() / n, |i, j| {
            let lit = (0..n * n).filter(|k| self.counts[(i * n + k % n, j * n + k / n)] > 0).count();
            lit as f64 / (n * n) as f64
        })
    }
}

/// Calls `hit` for every point in a triangle, whichever way it turns, in these rows; a point on an
/// edge belongs to one of its two triangles.
fn fill([a, b, c]: [DVec2; 3], (first, last): (usize, usize), nx: usize, mut hit: impl FnMut(usize)) {
    let corners = if (b - a).perp_dot(c - a) < 0.0 { [a, c, b] } else { [a, b, c] };
    let low = a.min(b).min(c).ceil().max(DVec2::new(0.0, first as f64));
    let high = a.max(b).max(c).floor().min(DVec2::new((nx - 1) as f64, last as f64));
    if low.x > high.x || low.y > high.y {
        return;
    }
    for y in low.y as usize..=high.y as usize {
        for x in low.x as usize..=high.x as usize {
            let at = DVec2::new(x as f64, y as f64);
            if (0..3).all(|k| is_left(corners[k], corners[(k + 1) % 3], at)) {
                hit((y - first) * nx + x);
            }
        }
    }
}

/// Whether a point is to the left of the edge from `a` to `b`; on it, of one of its two directions.
/// Both ask the same product, so that rounding cannot have both or neither.
fn is_left(a: DVec2, b: DVec2, at: DVec2) -> bool {
    let is_forward = (a.x, a.y) < (b.x, b.y);
    let (from, to) = if is_forward { (a, b) } else { (b, a) };
    let side = (to - from).perp_dot(at - from);
    if is_forward { side >= 0.0 } else { side < 0.0 }
}
