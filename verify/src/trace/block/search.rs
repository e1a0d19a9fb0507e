//! Finding the cell and the triangle of a face that a ray meets, or that lies above a point.

use super::hit::{Hierarchy, Hit, Patch};
use crate::{
    block::{Diagonal, Relief, corners, halves},
    scene::Traversal,
    trace::accel::{Accelerator, Crossing, SearchRay, crossing, passes_beside},
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::{ops::RangeInclusive, sync::OnceLock};

/// How far beyond its computed place a ray is looked for: as a part of a cell, and as a part of all
/// heights. Rounding is many orders of magnitude less.
const SLACK: f64 = 1e-6;

/// How often a steep ray is taken to the height of the face before it is looked for; twice or three
/// times will do.
const APPROACHES: usize = 8;

/// A cell of a face.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Heights at its corners, as [`corners`] lists them, mm.
    heights: [f64; 4],
    number: u32,
    diagonal: Diagonal,
}

/// A face, and the search structure over its cells.
#[derive(Debug)]
pub(super) struct FaceSearch {
    pub(super) relief: Relief,
    traversal: Traversal,
    pub(super) cells_per_mm: DVec2,
    /// Greatest slope: light that runs steeper than this crosses the face once at most.
    pub(super) steepest: f64,
    /// Between least and greatest height, mm.
    middle_mm: f64,
    /// Bounds the coordinates of places from which rays are followed to the face, mm.
    reach_mm: f64,
    /// Built when first needed, see [`FaceSearch::hierarchy`].
    hierarchy: OnceLock<Hierarchy>,
}

impl FaceSearch {
    /// Rays come from no further along the axis than `beyond_mm`.
    pub(super) fn new(relief: &Relief, traversal: Traversal, beyond_mm: f64) -> Self {
        let (low, high) = relief.range_mm();
        let across = relief.lower.abs().max(relief.upper.abs()).max_element();
        Self {
            traversal,
            cells_per_mm: DVec2::new((relief.nx - 1) as f64, (relief.ny - 1) as f64) / (relief.upper - relief.lower),
            steepest: relief.steepest(),
            middle_mm: 0.5 * (low + high),
            reach_mm: 2.0 * across + low.abs().max(high.abs()).max(beyond_mm.abs()),
            hierarchy: OnceLock::new(),
            relief: relief.clone(),
        }
    }

    /// The search structure over the face.
    pub(super) fn hierarchy(&self) -> &Hierarchy {
        // Not while a lock is held: it is built on all cores, and one that waits for others takes
        // up other rays, which ask for it too.
        self.hierarchy.get().unwrap_or_else(|| {
            let built = self.build_hierarchy();
            self.hierarchy.get_or_init(|| built)
        })
    }

    fn build_hierarchy(&self) -> Hierarchy {
        let relief = &self.relief;
        let patches: Vec<Patch> = (0..Patch::count(relief)).into_par_iter().map(|k| Patch::new(relief, k)).collect();
        let accelerator = Accelerator::build(patches.len(), self.reach_mm, |k| patches[k].bounds(relief));
        let patches = accelerator.order().iter().map(|&k| patches[k as usize]).collect();
        Hierarchy { accelerator, patches }
    }

    /// Whether a ray runs so much along the axis that it crosses the face once at most.
    #[inline]
    pub(super) fn is_steep(&self, direction: DVec3) -> bool {
        direction.z.abs() > self.steepest * direction.truncate().length()
    }

    #[inline]
    fn cell(&self, number: u32) -> Cell {
        let (i, j) = self.place(number);
        let heights = corners(i, j).map(|(i, j)| self.relief.heights[j * self.relief.nx + i]);
        Cell { heights, number, diagonal: self.relief.diagonals[number as usize] }
    }

    /// Column and row of a cell.
    #[inline]
    fn place(&self, number: u32) -> (usize, usize) {
        let columns = self.relief.nx as u32 - 1;
        ((number % columns) as usize, (number / columns) as usize)
    }

    /// Where a ray meets the triangles of the face first.
    #[inline]
    pub(super) fn first_crossing(&self, ray: &SearchRay) -> Option<Hit> {
        if self.traversal == Traversal::Grid {
            let hit = if ray.direction.x == 0.0 && ray.direction.y == 0.0 {
                // It crosses a height field once: if it meets the cell above it, that is the crossing.
                self.cross(&self.cell(self.cell_above(ray.origin.truncate())), ray, |_| true)
            } else {
                self.approach(ray)
            };
            if hit.is_some() {
                return hit;
            }
        }
        self.search(ray, |_| true)
    }

    /// The crossing of a ray that runs so steep that there is one at most, if it is found by going
    /// to where the ray is as high as the face, as last seen, again and again. Not on an edge, where
    /// more than one cell has it.
    #[inline]
    fn approach(&self, ray: &SearchRay) -> Option<Hit> {
        if !self.is_steep(ray.direction) {
            return None;
        }
        let mut z = self.middle_mm;
        for _ in 0..APPROACHES {
            let at = ray.at((z - ray.origin.z) / ray.direction.z).truncate();
            let cell = self.cell(self.cell_above(at));
            if let Some(hit) = self.cross(&cell, ray, |_| true) {
                return (hit.crossing.weights.min_element() > 0.0).then_some(hit);
            }
            let (i, j) = self.place(cell.number);
            let part = (at - self.relief.lower) * self.cells_per_mm - DVec2::new(i as f64, j as f64);
            let DVec2 { x: u, y: v } = part.clamp(DVec2::ZERO, DVec2::ONE);
            let [a, b, c, d] = cell.heights;
            z = (a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + c * u) * v;
        }
        None
    }

    /// The nearest crossing of the face's triangles that `accept` lets pass.
    pub(super) fn search(&self, ray: &SearchRay, accept: impl Fn(&Crossing) -> bool) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let Hierarchy { accelerator, patches } = self.hierarchy();
        accelerator.visit(ray, |slot| {
            let mut met = None;
            let (columns, rows) = self.passed(&patches[slot], ray);
            for number in rows.flat_map(|j| columns.clone().map(move |i| j * (self.relief.nx as u32 - 1) + i)) {
                let Some(hit) = self.cross(&self.cell(number), ray, &accept) else { continue };
                if nearest.is_none_or(|n| (hit.crossing.t, hit.cell) < (n.crossing.t, n.cell)) {
                    nearest = Some(hit);
                    met = Some(hit.crossing.t);
                }
            }
            met
        });
        nearest
    }

    /// The columns and rows of a patch above or below which a ray passes between the patch's least
    /// and greatest height.
    #[inline]
    fn passed(&self, patch: &Patch, ray: &SearchRay) -> (RangeInclusive<u32>, RangeInclusive<u32>) {
        let (origin, direction, [low, high]) = (ray.origin, ray.direction, patch.z);
        let slack = SLACK * (high - low + low.abs().max(high.abs()));
        let [from, to] = [low - slack, high + slack].map(|z| (z - origin.z) / direction.z);
        if !(from.is_finite() && to.is_finite()) {
            return (patch.columns[0]..=patch.columns[1], patch.rows[0]..=patch.rows[1]);
        }
        let at = |t: f64| (ray.at(t).truncate() - self.relief.lower) * self.cells_per_mm;
        let (from, to) = (at(from), at(to));
        let (least, greatest) = ((from.min(to) - SLACK), (from.max(to) + SLACK));
        let among = |at: f64, [first, last]: [u32; 2]| at.clamp(f64::from(first), f64::from(last)) as u32;
        (
            among(least.x, patch.columns)..=among(greatest.x, patch.columns),
            among(least.y, patch.rows)..=among(greatest.y, patch.rows),
        )
    }

    /// The nearer of the crossings of the two triangles of a cell that `accept` lets pass.
    #[inline(always)]
    fn cross(&self, cell: &Cell, ray: &SearchRay, accept: impl Fn(&Crossing) -> bool) -> Option<Hit> {
        let (i, j) = self.place(cell.number);
        let (x, y) = self.relief.lines(i, j);
        let z = cell.heights;
        let corners = [(x[0], y[0], z[0]), (x[1], y[0], z[1]), (x[1], y[1], z[2]), (x[0], y[1], z[3])]
            .map(|(x, y, z)| ray.sheared(DVec3::new(x, y, z)));
        if passes_beside(&corners) {
            return None;
        }
        let mut nearest: Option<Hit> = None;
        for half in halves(cell.diagonal) {
            let Some(crossing) = crossing(half.map(|k| corners[k])).filter(|c| accept(c)) else { continue };
            if nearest.is_none_or(|n| crossing.t < n.crossing.t) {
                nearest = Some(Hit { crossing, cell: cell.number, half });
            }
        }
        nearest
    }

    /// The cell above or below a point; outside of the face the nearest one.
    #[inline]
    fn cell_above(&self, at: DVec2) -> u32 {
        let cells = DVec2::new((self.relief.nx - 1) as f64, (self.relief.ny - 1) as f64);
        let corner = ((at - self.relief.lower) * self.cells_per_mm).floor().clamp(DVec2::ZERO, cells - 1.0);
        corner.y as u32 * (self.relief.nx as u32 - 1) + corner.x as u32
    }

    /// The triangle above or below a point, whatever its height.
    pub(super) fn hit_at(&self, at: DVec2) -> Hit {
        let cell = self.cell_above(at);
        // The triangle in which the point lies deepest, so that rounding at the border decides
        // nothing.
        let candidates = halves(self.relief.diagonals[cell as usize]).map(|half| {
            let mut hit = Hit { crossing: Crossing { t: 0.0, weights: DVec3::ZERO, outwards: true }, cell, half };
            let [a, b, c] = self.nodes_of(&hit).map(|(i, j)| self.relief.node(i, j).truncate());
            let area = (b - a).perp_dot(c - a);
            hit.crossing.weights =
                DVec3::new((b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)) / area;
            hit
        });
        let depth = candidates.map(|hit| hit.crossing.weights.min_element());
        candidates[usize::from(depth[1] > depth[0])]
    }

    /// The nodes (column, row) of the corners of a triangle.
    #[inline]
    pub(super) fn nodes_of(&self, hit: &Hit) -> [(usize, usize); 3] {
        let (i, j) = self.place(hit.cell);
        let corners = corners(i, j);
        hit.half.map(|k| corners[k])
    }
}
