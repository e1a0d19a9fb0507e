//! Dropping a cutter onto the face: how low its tip may go.

use super::Cutter;
use crate::{
    grid::Field,
    surface::{HeightField, SurfaceSpline},
};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// Where a dropped cutter comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Height of the cutter's tip, mm.
    pub tip_mm: f64,
    /// The point of the face that it touches, mm.
    pub at: DVec2,
}

/// Drops one cutter onto one face.
///
/// The face is the spline through its nodes, cut off at the block's border. The tip's height is the
/// greatest of `h(p) - profile(|p - axis|)` over the points `p` of the block under the cutter.
/// Where the cutter is a ball and no hollow in question is as sharp as the ball, that is a concave
/// problem, which Newton's iteration solves to 1e-9 mm. Elsewhere the nodes are searched, with
/// bounds over tiles of the face, and the best are improved by pattern search between the nodes to
/// 1e-6 mm.
#[derive(Debug)]
pub struct DropCutter<'a> {
    surface: &'a HeightField,
    spline: SurfaceSpline,
    cutter: Cutter,
    tiles: Tiles,
}

/// Cells along the side of a tile.
const TILE: usize = 8;
/// A hollow this much less sharp than the ball still makes a concave problem.
const CONCAVE: f64 = 0.98;
/// Newton steps; the start is close.
const STEPS: usize = 12;

/// Bounds over square tiles of the face.
#[derive(Debug)]
struct Tiles {
    nx: usize,
    ny: usize,
    size: DVec2,
    /// No point of the tile is higher, mm.
    highest: Vec<f64>,
    /// Greatest second derivative in any direction at the tile's nodes, per mm.
    bend: Vec<f64>,
}

impl Tiles {
    fn new(surface: &HeightField, spline: &SurfaceSpline) -> Self {
        let heights = surface.heights_mm();
        let (nodes_x, nodes_y) = (heights.nx(), heights.ny());
        let (nx, ny) = ((nodes_x - 1).div_ceil(TILE), (nodes_y - 1).div_ceil(TILE));
        let spacing = surface.extent().node_spacing(nodes_x, nodes_y);
        let tiles: Vec<[f64; 2]> = (0..nx * ny)
            .into_par_iter()
            .map(|tile| {
                let (a, b) = (tile % nx * TILE, tile / nx * TILE);
                let (mut highest, mut bend, mut strongest) = (f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0_f64);
                for j in b..=(b + TILE).min(nodes_y - 1) {
                    for i in a..=(a + TILE).min(nodes_x - 1) {
                        let [xx, xy, yy] = spline.sample(surface.extent().node(i, j, nodes_x, nodes_y)).curvature;
                        let (mean, spread) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
                        highest = highest.max(heights[(i, j)]);
                        bend = bend.max(mean + spread);
                        strongest = strongest.max(mean.abs() + spread);
                    }
                }
                // Between nodes the face may be higher by what it bends over half a diagonal.
                [highest + 0.125 * strongest * spacing.length_squared(), bend]
            })
            .collect();
        let (highest, bend) = tiles.into_iter().map(|[highest, bend]| (highest, bend)).unzip();
        Self { nx, ny, size: spacing * TILE as f64, highest, bend }
    }

    /// Tiles from and to which a disc reaches, along x and y.
    fn range(&self, low: DVec2, high: DVec2) -> [(usize, usize); 2] {
        let along = |low: f64, high: f64, n: usize| {
            let clamped = |v: f64| (v.max(0.0) as usize).min(n - 1);
            (clamped(low), clamped(high))
        };
        let (low, high) = (low / self.size, high / self.size);
        [along(low.x, high.x, self.nx), along(low.y, high.y, self.ny)]
    }
}

impl<'a> DropCutter<'a> {
    /// Prepares a face for a cutter.
    pub fn new(surface: &'a HeightField, cutter: Cutter) -> Self {
        let spline = SurfaceSpline::through(surface);
        let tiles = Tiles::new(surface, &spline);
        Self { surface, spline, cutter, tiles }
    }

    /// The cutter.
    pub fn cutter(&self) -> Cutter {
        self.cutter
    }

    /// Where the cutter comes to rest with its axis at `axis`, mm; `None` if it passes the block.
    /// `guess` is a point that may be near the contact, such as the contact of a neighbour; it has
    /// no influence on the result beyond rounding.
    pub fn drop(&self, axis: DVec2, guess: DVec2) -> Option<Contact> {
        let radius = self.cutter.radius_mm();
        let (lower, upper) = (self.surface.extent().lower(), -self.surface.extent().lower());
        let nearest = axis.clamp(lower, upper);
        if nearest.distance_squared(axis) > radius * radius {
            return None;
        }
        let climbed = self.climb(axis, guess);
        let mut best = climbed.unwrap_or_else(|| {
            // Anything that is not too bad serves as a bound.
            let slope = self.spline.sample(nearest).slope;
            let uphill = axis + self.cutter.contact_mm(slope.length()) * slope.normalize_or_zero();
            let candidates = [nearest, self.within(axis, uphill)].map(|at| Contact { tip_mm: self.rest(axis, at), at });
            candidates[usize::from(candidates[1].tip_mm > candidates[0].tip_mm)]
        });
        // Tiles in which a higher point may be, and whether the problem is concave on all that they
        // span.
        let mut survivors: [(usize, f64); MOST_SURVIVORS] = [(0, 0.0); MOST_SURVIVORS];
        let (mut count, mut span) = (0, [(usize::MAX, 0), (usize::MAX, 0)]);
        let origin = axis - lower;
        let [(i0, i1), (j0, j1)] = self.tiles.range(origin - radius, origin + radius);
        for j in j0..=j1 {
            let dy = apart(origin.y, j, self.tiles.size.y);
            for i in i0..=i1 {
                let tile = j * self.tiles.nx + i;
                if self.tiles.highest[tile] <= best.tip_mm {
                    continue;
                }
                let dx = apart(origin.x, i, self.tiles.size.x);
                let square = dx * dx + dy * dy;
                if square > radius * radius {
                    continue;
                }
                let bound = self.tiles.highest[tile] - self.cutter.profile_mm(square.sqrt());
                if bound > best.tip_mm {
                    span = [(span[0].0.min(i), span[0].1.max(i)), (span[1].0.min(j), span[1].1.max(j))];
                    if count < MOST_SURVIVORS {
                        survivors[count] = (tile, bound);
                    }
                    count += 1;
                }
            }
        }
        if count == 0 || climbed.is_some_and(|contact| self.is_concave(span, contact.at)) {
            return Some(best);
        }
        if count > MOST_SURVIVORS {
            let all = (j0..=j1).flat_map(|j| (i0..=i1).map(move |i| j * self.tiles.nx + i));
            let bounded: Vec<(usize, f64)> = all.map(|tile| (tile, f64::INFINITY)).collect();
            self.search(axis, &bounded, &mut best);
        } else {
            self.search(axis, &survivors[..count], &mut best);
        }
        Some(best)
    }

    /// Whether a ball has one place of rest on the tiles of `span` and that of `at`.
    fn is_concave(&self, span: [(usize, usize); 2], at: DVec2) -> bool {
        let own = (at - self.surface.extent().lower()) / self.tiles.size;
        let own = [(own.x as usize).min(self.tiles.nx - 1), (own.y as usize).min(self.tiles.ny - 1)];
        let [(i0, i1), (j0, j1)] = [0, 1].map(|axis| (span[axis].0.min(own[axis]), span[axis].1.max(own[axis])));
        let least = CONCAVE / self.cutter.radius_mm();
        (j0..=j1).all(|j| (i0..=i1).all(|i| self.tiles.bend[j * self.tiles.nx + i] < least))
    }

    /// Height of the tip if the cutter touched `at`.
    fn rest(&self, axis: DVec2, at: DVec2) -> f64 {
        self.spline.sample(at).height_mm - self.cutter.profile_mm(at.distance(axis))
    }

    /// The nearest point of the block under the cutter, as nearly as two projections find it.
    fn within(&self, axis: DVec2, at: DVec2) -> DVec2 {
        let lower = self.surface.extent().lower();
        let under = |at: DVec2| axis + (at - axis).clamp_length_max(self.cutter.radius_mm() * (1.0 - 1e-12));
        let inside = under(at).clamp(lower, -lower);
        // A projection onto the block brings a point nearer to an axis above it; beside it once
        // more around.
        under(inside).clamp(lower, -lower)
    }

    /// Newton's iteration for a ball. `None` where it leaves the block or the ball, or the problem
    /// is not concave.
    fn climb(&self, axis: DVec2, guess: DVec2) -> Option<Contact> {
        if self.cutter.disc_mm() > 0.0 || self.cutter.corner_mm() == 0.0 {
            return None;
        }
        let (radius, lower) = (self.cutter.radius_mm(), self.surface.extent().lower());
        let mut at = guess;
        for _ in 0..STEPS {
            let from_axis = at - axis;
            let square = radius * radius - from_axis.length_squared();
            if square <= 1e-4 * radius * radius || (at.abs() + lower).max_element() > 0.0 {
                return None;
            }
            let depth = square.sqrt();
            let face = self.spline.sample(at);
            let gradient = face.slope - from_axis / depth;
            let [xx, xy, yy] = face.curvature;
            let cube = depth * square;
            let hessian = DMat2::from_cols(
                DVec2::new(xx - 1.0 / depth - from_axis.x * from_axis.x / cube, xy - from_axis.x * from_axis.y / cube),
                DVec2::new(xy - from_axis.x * from_axis.y / cube, yy - 1.0 / depth - from_axis.y * from_axis.y / cube),
            );
            if hessian.x_axis.x >= 0.0 || hessian.determinant() <= 0.0 {
                return None;
            }
            let step = -(hessian.inverse() * gradient).clamp_length_max(0.25 * radius);
            // The error of the height, and after this step that of the place too, is quadratic in
            // the step.
            if step.length_squared() < 1e-10 {
                return Some(Contact { tip_mm: face.height_mm + depth - radius, at: at + step });
            }
            at += step;
        }
        None
    }

    /// The best node of the tiles, and what is to be gained around it and around others that might
    /// be as good.
    fn search(&self, axis: DVec2, tiles: &[(usize, f64)], best: &mut Contact) {
        let heights = self.surface.heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let extent = self.surface.extent();
        let spacing = extent.node_spacing(nx, ny);
        let square = self.cutter.radius_mm() * self.cutter.radius_mm();
        let mut found: Vec<Contact> = Vec::with_capacity(tiles.len());
        for &(tile, _) in tiles {
            let (a, b) = (tile % self.tiles.nx * TILE, tile / self.tiles.nx * TILE);
            let mut top = Contact { tip_mm: f64::NEG_INFINITY, at: axis };
            for j in b..=(b + TILE).min(ny - 1) {
                for i in a..=(a + TILE).min(nx - 1) {
                    let at = extent.node(i, j, nx, ny);
                    if at.distance_squared(axis) < square {
                        let tip_mm = heights[(i, j)] - self.cutter.profile_mm(at.distance(axis));
                        if tip_mm > top.tip_mm {
                            top = Contact { tip_mm, at };
                        }
                    }
                }
            }
            if top.tip_mm > f64::NEG_INFINITY {
                found.push(top);
            }
        }
        found.push(*best);
        found.sort_by(|a, b| b.tip_mm.total_cmp(&a.tip_mm));
        let most = found[0].tip_mm;
        let slack = self.slack(spacing);
        let mut improved: Vec<DVec2> = Vec::new();
        for start in found.iter().take_while(|contact| contact.tip_mm + slack > most) {
            if improved.iter().any(|at| at.distance(start.at) < 2.0 * spacing.max_element()) {
                continue;
            }
            let end = self.improve(axis, *start, spacing);
            improved.extend([start.at, end.at]);
            if end.tip_mm > best.tip_mm {
                *best = end;
            }
            if improved.len() == 2 * MOST_IMPROVED {
                break;
            }
        }
    }

    /// How much higher than at the nodes the cutter may rest between them.
    fn slack(&self, spacing: DVec2) -> f64 {
        if self.cutter.corner_mm() == 0.0 {
            // The rim runs between nodes.
            return 0.5 * spacing.max_element();
        }
        0.25 * spacing.length_squared() / self.cutter.corner_mm()
    }

    /// Pattern search over the eight neighbours, with a step that halves.
    fn improve(&self, axis: DVec2, start: Contact, spacing: DVec2) -> Contact {
        if let Some(contact) = self.climb(axis, start.at).filter(|contact| contact.tip_mm >= start.tip_mm) {
            return contact;
        }
        let mut best = start;
        let mut step = 0.5 * spacing.max_element();
        let last = 1e-4 * step;
        while step > last {
            let mut moved = false;
            for direction in COMPASS {
                let at = self.within(axis, best.at + step * direction);
                let tip_mm = self.rest(axis, at);
                if tip_mm > best.tip_mm {
                    (best, moved) = (Contact { tip_mm, at }, true);
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        best
    }
}

/// Tiles whose bounds are kept; where there are more, all are searched.
const MOST_SURVIVORS: usize = 256;
/// Places that are looked at between the nodes.
const MOST_IMPROVED: usize = 12;
/// The directions of the pattern search.
const COMPASS: [DVec2; 8] = {
    const H: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        DVec2::new(1.0, 0.0),
        DVec2::new(0.0, 1.0),
        DVec2::new(-1.0, 0.0),
        DVec2::new(0.0, -1.0),
        DVec2::new(H, H),
        DVec2::new(-H, H),
        DVec2::new(-H, -H),
        DVec2::new(H, -H),
    ]
};

/// Distance of a coordinate from the interval of tile `k`.
fn apart(at: f64, k: usize, size: f64) -> f64 {
    let low = k as f64 * size;
    (low - at).max(at - low - size).max(0.0)
}

/// Heights of a cutter's tip with its axis over each node of a face, mm: the face as a machine
/// needs it that moves the tip of that cutter (dilation of the face by the cutter). On the face's
/// own zero: the mean of the result is not 0.
pub fn tool_offset(surface: &HeightField, cutter: Cutter) -> Field<f64> {
    let (nx, ny) = (surface.heights_mm().nx(), surface.heights_mm().ny());
    let drop = DropCutter::new(surface, cutter);
    let mut data = vec![0.0; nx * ny];
    data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        let mut offset = DVec2::ZERO;
        for (i, tip) in row.iter_mut().enumerate() {
            let axis = surface.extent().node(i, j, nx, ny);
            // Over the block the cutter always finds something.
            if let Some(contact) = drop.drop(axis, axis + offset) {
                *tip = contact.tip_mm;
                offset = contact.at - axis;
            }
        }
    });
    Field::from_vec(nx, ny, data)
}

#[cfg(test)]
mod tests;
