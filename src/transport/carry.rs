//! Carries the solution from the receiver to the heights of the lens: for every lens node, the
//! point of the receiver that it lights, and from the path of that point the height.

use super::{map::Face, spline::PathSpline};
use crate::{
    bench::Bench,
    grid::{Contour, Extent, Field},
};
use glam::DVec2;
use rayon::prelude::*;

/// The lens's nodes, and the point of the receiver that each lights.
#[derive(Clone, Debug)]
pub(super) struct Carrier {
    lens: Extent,
    outline: Contour,
    /// In units of receiver nodes. Kept from call to call as a start of the next search.
    landing: Field<DVec2>,
}

/// Heights, and how well they could be found.
#[derive(Clone, Debug)]
pub(super) struct Carried {
    /// Not a number where no ray of the window leaves the lens: beyond its outline, but for a few
    /// nodes.
    pub(super) heights_mm: Field<f64>,
    /// Lens nodes whose ray did not land within a tenth of a receiver cell of its wanted place.
    pub(super) missed: usize,
}

/// Width of the margin beyond a curved outline, in lens nodes, whose heights are those of the path
/// continued beyond the window: the spline through the nodes then knows the face up to its outline.
const COLLAR: f64 = 4.5;
/// How far beyond the window the path is continued for that, in receiver cells.
const BEYOND: f64 = 40.0;
impl Carried {
    /// Mean height of the lens's nodes, mm: where the face stands.
    pub(super) fn mean_mm(&self, bench: &Bench) -> f64 {
        let (outline, heights) = (bench.contour(), &self.heights_mm);
        if outline.is_rectangle() {
            return heights.mean();
        }
        let (nx, ny) = (heights.nx(), heights.ny());
        let within = |k: &usize| outline.contains(bench.block().node(k % nx, k / nx, nx, ny));
        let (sum, count) =
            (0..nx * ny).filter(within).fold((0.0, 0), |(sum, count), k| (sum + heights.as_slice()[k], count + 1));
        sum / f64::from(count)
    }
}

/// Newton steps for the landing point of a node.
const STEPS: usize = 8;
/// The error of a height is cubic in that of the landing point: this, in receiver cells, puts it
/// below 1e-9 mm.
const ENOUGH: f64 = 2e-2;

impl Carrier {
    pub(super) fn new(outline: Contour, nodes: (usize, usize)) -> Self {
        Self { lens: outline.extent(), outline, landing: Field::filled(nodes.0, nodes.1, DVec2::NAN) }
    }

    /// The heights at the lens's nodes.
    pub(super) fn heights(&mut self, path: &impl Face, spline: &PathSpline) -> Carried {
        self.rasterise(path, spline);
        let (nx, ny) = (self.landing.nx(), self.landing.ny());
        let (lens, outline) = (self.lens, self.outline);
        let collar = COLLAR * lens.node_spacing(nx, ny).max_element();
        let mut heights = vec![0.0; nx * ny];
        let missed: Vec<usize> = heights
            .par_chunks_mut(nx)
            .zip(self.landing.as_mut_slice().par_chunks_mut(nx))
            .enumerate()
            .map(|(j, (heights, landing))| {
                let mut missed = 0;
                let mut nearby = None;
                for (i, (height, landing)) in heights.iter_mut().zip(landing).enumerate() {
                    let x = lens.node(i, j, nx, ny);
                    if outline.contains(x) {
                        let (found, hit) = search(path, spline, x, landing, 0.0, &mut nearby);
                        *height = found;
                        missed += usize::from(!hit);
                        continue;
                    }
                    *height = f64::NAN;
                    if outline.level(x).distance_mm < collar {
                        let (found, hit) = search(path, spline, x, landing, BEYOND, &mut nearby);
                        *height = if hit { found } else { f64::NAN };
                    }
                }
                missed
            })
            .collect();
        Carried { heights_mm: Field::from_vec(nx, ny, heights), missed: missed.iter().sum() }
    }

    /// Finds a start for every lens node: the receiver triangle whose image under the map contains
    /// it, and of several, and of the last call's landing point, the one whose oval forms the face
    /// (the Legendre guard where the image is folded). Without it a node next to a crease would
    /// stay on the side that it was on before the crease moved.
    fn rasterise(&mut self, path: &impl Face, spline: &PathSpline) {
        let (nx, ny) = (self.landing.nx(), self.landing.ny());
        let grid = spline.grid;
        let (gx, gy) = grid.nodes();
        let (lower, spacing) = (self.lens.lower(), self.lens.node_spacing(nx, ny));
        let mut image = vec![DVec2::NAN; gx * gy];
        let ranges: Vec<(f64, f64)> = image
            .par_chunks_mut(gx)
            .enumerate()
            .map(|(j, row)| {
                let mut range = (f64::INFINITY, f64::NEG_INFINITY);
                let mut nearby = None;
                spline.row_jets(j, |i, jet| {
                    let y = grid.node(i, j);
                    let ray = path.ray(y, jet.value, jet.slope, nearby.as_ref());
                    nearby = ray.or(nearby);
                    if let Some(ray) = ray {
                        row[i] = (path.point(y, &ray) - lower) / spacing;
                        range = (range.0.min(row[i].y), range.1.max(row[i].y));
                    }
                });
                range
            })
            .collect();
        let lens = self.lens;
        self.landing.as_mut_slice().par_chunks_mut(nx * ROWS_PER_BAND).enumerate().for_each(|(band, out)| {
            let first = band * ROWS_PER_BAND;
            let rows = (first, first + out.len() / nx);
            for j in 0..gy - 1 {
                let low = ranges[j].0.min(ranges[j + 1].0) - SLACK;
                let high = ranges[j].1.max(ranges[j + 1].1) + SLACK;
                if high < rows.0 as f64 || low > (rows.1 - 1) as f64 {
                    continue;
                }
                for i in 0..gx - 1 {
                    let corner = |di: usize, dj: usize| image[(j + dj) * gx + i + di];
                    let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
                    let origin = DVec2::new(i as f64, j as f64);
                    for (corners, places) in [
                        ([a, b, d], [DVec2::ZERO, DVec2::X, DVec2::ONE]),
                        ([a, d, c], [DVec2::ZERO, DVec2::ONE, DVec2::Y]),
                    ] {
                        cover(corners, nx, rows, |column, row, [wa, wb, wc]| {
                            let place = origin + places[0] * wa + places[1] * wb + places[2] * wc;
                            let start = &mut out[(row - first) * nx + column];
                            if start.is_finite() {
                                let x = lens.node(column, row, nx, ny);
                                let height = |p: DVec2| path.oval_height(x, grid.point(p), spline.jet(p).value, None);
                                if !path.forms_face(height(place), height(*start)) {
                                    return;
                                }
                            }
                            *start = place;
                        });
                    }
                }
            }
        });
        let undistorted = DVec2::new((gx - 1) as f64, (gy - 1) as f64) / DVec2::new((nx - 1) as f64, (ny - 1) as f64);
        fill_gaps(&mut self.landing, undistorted);
    }
}

/// Lens rows of one task; a constant, so that results do not depend on the number of threads.
const ROWS_PER_BAND: usize = 16;
/// How far the border of the lens may lie outside of the map's image, in lens nodes: the border
/// condition's own accuracy.
const SLACK: f64 = 1e-5;

/// Calls `f(column, row, barycentric weights)` for every node inside the triangle.
#[inline(always)]
fn cover([a, b, c]: [DVec2; 3], nx: usize, rows: (usize, usize), mut f: impl FnMut(usize, usize, [f64; 3])) {
    let low = (a.min(b).min(c) - SLACK).max(DVec2::new(0.0, rows.0 as f64));
    let high = (a.max(b).max(c) + SLACK).min(DVec2::new((nx - 1) as f64, (rows.1 - 1) as f64));
    // Also where a corner is not a number.
    if !(low.x <= high.x && low.y <= high.y) {
        return;
    }
    let ceil = |v: f64| v as usize + usize::from(v as usize as f64 != v);
    let (columns, rows) = (ceil(low.x)..=high.x as usize, ceil(low.y)..=high.y as usize);
    if columns.is_empty() || rows.is_empty() {
        return;
    }
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    for row in rows {
        for column in columns.clone() {
            let p = DVec2::new(column as f64, row as f64);
            let wb = (p - a).perp_dot(c - a) / area;
            let wc = (b - a).perp_dot(p - a) / area;
            let wa = 1.0 - wb - wc;
            if wa >= -SLACK && wb >= -SLACK && wc >= -SLACK {
                f(column, row, [wa, wb, wc]);
            }
        }
    }
}

/// Gives nodes that no triangle covers the start of their neighbour in the row, and rows without
/// any that of the nearest row: by rounding, the border of the lens may lie just outside of the
/// map's image. `undistorted` is taken where nothing is covered.
fn fill_gaps(landing: &mut Field<DVec2>, undistorted: DVec2) {
    let (nx, ny) = (landing.nx(), landing.ny());
    landing.as_mut_slice().par_chunks_mut(nx).for_each(|line| {
        let Some(first) = line.iter().position(|p| p.is_finite()) else { return };
        let mut last = line[first];
        for place in line {
            if place.is_finite() {
                last = *place;
            } else {
                *place = last;
            }
        }
    });
    let Some(first) = (0..ny).find(|&j| landing[(0, j)].is_finite()) else {
        for j in 0..ny {
            for i in 0..nx {
                landing[(i, j)] = DVec2::new(i as f64, j as f64) * undistorted;
            }
        }
        return;
    };
    let rows = landing.as_mut_slice();
    for j in (0..first).rev() {
        rows.copy_within((j + 1) * nx..(j + 2) * nx, j * nx);
    }
    for j in first + 1..ny {
        if !rows[j * nx].is_finite() {
            rows.copy_within((j - 1) * nx..j * nx, j * nx);
        }
    }
}

/// Newton's iteration for `T(y) = x` from `landing`, which is updated. The height is the best oval
/// met on the way, since the face is their envelope; returned with it is whether the ray hit. It
/// may go so many cells `beyond` the window.
#[inline(always)]
fn search<F: Face>(
    path: &F,
    spline: &PathSpline,
    x: DVec2,
    landing: &mut DVec2,
    beyond: f64,
    nearby: &mut Option<F::Ray>,
) -> (f64, bool) {
    let grid = spline.grid;
    let (least, most) = (DVec2::splat(-beyond), DVec2::new(grid.cells.0 as f64, grid.cells.1 as f64) + beyond);
    let mut at = landing.clamp(least, most);
    let mut best = (f64::NAN, at);
    let mut miss = f64::INFINITY;
    for _ in 0..STEPS {
        let jet = if beyond > 0.0 { spline.jet_beyond(at) } else { spline.jet(at) };
        let y = grid.point(at);
        let ray = path.ray(y, jet.value, jet.slope, nearby.as_ref());
        *nearby = ray.or(*nearby);
        let height = path.oval_height(x, y, jet.value, ray.as_ref());
        if best.0.is_nan() || path.forms_face(height, best.0) {
            best = (height, at);
        }
        let Some(ray) = ray else { break };
        let error = path.point(y, &ray) - x;
        let jacobian = path.point_jacobian(&ray, &jet);
        if jacobian.determinant().abs() < 1e-12 {
            break;
        }
        let step = jacobian.inverse() * error / grid.spacing;
        // A step of more than a few cells says that the map is folded or flat here.
        let step = step.clamp_length_max(4.0);
        let next = (at - step).clamp(least, most);
        miss = (next - at).length();
        if miss < ENOUGH {
            // The height of the oval is quadratic in the miss, and at its best where the search
            // would end.
            if best.1 == at {
                best.0 += 0.5 * path.oval_gradient(x, y, height, &ray).dot((next - at) * grid.spacing);
            }
            break;
        }
        at = next;
    }
    *landing = best.1;
    (best.0, miss < 0.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_triangle_covers_starts_from_its_neighbours() {
        let covered = |i: usize, j: usize| DVec2::new(i as f64 + 0.25, j as f64 + 0.5);
        let mut landing = Field::from_fn(5, 40, |i, j| {
            let gap = j < 2 || j == 17 || j == 39 || (j == 20 && i != 2);
            if gap { DVec2::NAN } else { covered(i, j) }
        });
        fill_gaps(&mut landing, DVec2::ONE);
        for (i, j, from) in
            [(3, 0, (3, 2)), (4, 1, (4, 2)), (0, 17, (0, 16)), (1, 39, (1, 38)), (0, 20, (2, 20)), (4, 20, (2, 20))]
        {
            assert_eq!(landing[(i, j)], covered(from.0, from.1), "{i}, {j}");
        }
        assert_eq!(landing[(2, 30)], covered(2, 30));
        let mut nothing = Field::filled(5, 4, DVec2::NAN);
        fill_gaps(&mut nothing, DVec2::new(2.0, 3.0));
        assert_eq!(nothing[(1, 2)], DVec2::new(2.0, 6.0));
    }
}
