//! Finding the cell and the triangle of the exit face that a ray meets, or that lies above a point.

use super::{
    hit::{Hierarchy, Hit, Patch},
    tracer::BlockTracer,
};
use crate::{
    block::{Diagonal, corners, halves},
    scene::{Optics, Traversal},
    trace::{
        accel::{Accelerator, Crossing, SearchRay, crossing, passes_beside},
        illumination::Rays,
    },
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::{f64::consts::FRAC_PI_2, ops::RangeInclusive};

/// How far beyond its computed place a ray is looked for: as a part of a cell, and as a part of all
/// heights. Rounding is many orders of magnitude less.
const SLACK: f64 = 1e-6;

/// A cell of the exit face.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Heights at its corners, as [`corners`] lists them, mm.
    heights: [f64; 4],
    number: u32,
    diagonal: Diagonal,
}

impl BlockTracer {
    /// Builds the search structure, if it will be needed for sure.
    pub(in crate::trace) fn prepare(&self) {
        if !self.even || self.traversal == Traversal::Bvh {
            self.hierarchy();
        }
    }

    /// The same for beams, which look for the face a second time only where light runs flat over
    /// it.
    pub(in crate::trace) fn prepare_beams(&self) {
        let needed = if self.even { self.traversal == Traversal::Bvh } else { self.may_meet_twice() };
        if needed {
            self.hierarchy();
        }
    }

    /// Whether light may run so flat that it meets the face a second time, by bounds for its angles
    /// to the axis.
    fn may_meet_twice(&self) -> bool {
        let mirror = self.optics == Optics::Reflects;
        let arrives = match self.rays {
            Rays::Parallel(direction) => direction.z.abs().clamp(0.0, 1.0).acos(),
            Rays::From(source) => {
                let aside =
                    (self.block.upper - source.truncate()).abs().max((self.block.lower - source.truncate()).abs());
                let away = if mirror { source.z - self.highest_mm } else { self.block.entry_z - source.z };
                aside.length().atan2(away)
            }
        };
        let turns = self.steepest.atan();
        let (within, leaves) = match self.optics {
            Optics::Reflects => (arrives, arrives + 2.0 * turns),
            Optics::Refracts { ior } => {
                let within = (arrives.sin() / ior).asin();
                let sin = ior * (within + turns).min(FRAC_PI_2).sin();
                (within, sin.min(1.0).asin() + turns)
            }
        };
        // False where an angle is not a number.
        let steep = |angle: f64| angle < FRAC_PI_2 && angle.tan() * self.steepest < 1.0;
        !(steep(within) && steep(leaves))
    }

    /// The search structure over the exit face.
    fn hierarchy(&self) -> &Hierarchy {
        // Not while a lock is held: it is built on all cores, and one that waits for others takes
        // up other rays, which ask for it too.
        self.hierarchy.get().unwrap_or_else(|| {
            let built = self.build_hierarchy();
            self.hierarchy.get_or_init(|| built)
        })
    }

    fn build_hierarchy(&self) -> Hierarchy {
        let block = &self.block;
        let (low, high) = block.height_range_mm();
        let reach = block.lower.abs().max(block.upper.abs()).max_element() * 2.0
            + low.abs().max(high.abs()).max(block.entry_z.abs());
        let patches: Vec<Patch> = (0..Patch::count(block)).into_par_iter().map(|k| Patch::new(block, k)).collect();
        let accelerator = Accelerator::build(patches.len(), reach, |k| patches[k].bounds(block));
        let patches = accelerator.order().iter().map(|&k| patches[k as usize]).collect();
        Hierarchy { accelerator, patches }
    }

    #[inline]
    fn cell(&self, number: u32) -> Cell {
        let (i, j) = self.place(number);
        let heights = corners(i, j).map(|(i, j)| self.block.heights[j * self.block.nx + i]);
        Cell { heights, number, diagonal: self.block.diagonals[number as usize] }
    }

    /// Column and row of a cell.
    #[inline]
    fn place(&self, number: u32) -> (usize, usize) {
        let columns = self.block.nx as u32 - 1;
        ((number % columns) as usize, (number / columns) as usize)
    }

    /// Where a ray inside the glass meets the triangles of the exit face first.
    #[inline]
    pub(super) fn first_crossing(&self, ray: &SearchRay) -> Option<Hit> {
        if self.traversal == Traversal::Grid && ray.direction.x == 0.0 && ray.direction.y == 0.0 {
            // It crosses a height field once: if it meets the cell above it, that is the crossing.
            let hit = self.cross(&self.cell(self.cell_above(ray.origin.truncate())), ray, |_| true);
            if hit.is_some() {
                return hit;
            }
        }
        self.search(ray, |_| true)
    }

    /// The nearest crossing of the exit face's triangles that `accept` lets pass.
    pub(super) fn search(&self, ray: &SearchRay, accept: impl Fn(&Crossing) -> bool) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let Hierarchy { accelerator, patches } = self.hierarchy();
        accelerator.visit(ray, |slot| {
            let mut met = None;
            let (columns, rows) = self.passed(&patches[slot], ray);
            for number in rows.flat_map(|j| columns.clone().map(move |i| j * (self.block.nx as u32 - 1) + i)) {
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
        let at = |t: f64| (ray.at(t).truncate() - self.block.lower) * self.cells_per_mm;
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
        let (x, y) = self.block.lines(i, j);
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
        let cells = DVec2::new((self.block.nx - 1) as f64, (self.block.ny - 1) as f64);
        let corner = ((at - self.block.lower) * self.cells_per_mm).floor().clamp(DVec2::ZERO, cells - 1.0);
        corner.y as u32 * (self.block.nx as u32 - 1) + corner.x as u32
    }

    /// The triangle above or below a point, whatever its height.
    pub(super) fn hit_at(&self, at: DVec2) -> Hit {
        let cell = self.cell_above(at);
        // The triangle in which the point lies deepest, so that rounding at the border decides
        // nothing.
        let candidates = halves(self.block.diagonals[cell as usize]).map(|half| {
            let mut hit = Hit { crossing: Crossing { t: 0.0, weights: DVec3::ZERO, outwards: true }, cell, half };
            let [a, b, c] = self.nodes_of(&hit).map(|(i, j)| self.block.node(i, j).truncate());
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
