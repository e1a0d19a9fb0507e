//! The search structure over a face, and what is found in it.

use crate::{
    block::{Half, Relief},
    trace::accel::{Accelerator, Crossing},
};
use glam::DVec3;

/// A search structure over patches of a face. Within a patch the grid tells which cells a
/// ray passes.
#[derive(Debug)]
pub(super) struct Hierarchy {
    pub(super) accelerator: Accelerator,
    /// The patch in every slot.
    pub(super) patches: Vec<Patch>,
}

/// Cells along each side of a patch: their heights are a few lines of a cache, and the hierarchy
/// over the patches fits into one.
const SIDE: usize = 4;

/// Neighbouring cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// First and last column, first and last row.
    pub(super) columns: [u32; 2],
    pub(super) rows: [u32; 2],
    /// Least and greatest height of its nodes, mm.
    pub(super) z: [f64; 2],
}

impl Patch {
    /// Patch `k` of a face.
    pub(super) fn new(relief: &Relief, k: usize) -> Self {
        let across = (relief.nx - 1).div_ceil(SIDE);
        let span = |k: usize, nodes: usize| [SIDE * k, (SIDE * (k + 1)).min(nodes - 1) - 1];
        let (columns, rows) = (span(k % across, relief.nx), span(k / across, relief.ny));
        let heights = (rows[0]..=rows[1] + 1)
            .flat_map(|j| &relief.heights[j * relief.nx..][columns[0]..=columns[1] + 1])
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], &z| [z.min(lo), z.max(hi)]);
        Self { columns: columns.map(|i| i as u32), rows: rows.map(|j| j as u32), z: heights }
    }

    pub(super) fn count(relief: &Relief) -> usize {
        (relief.nx - 1).div_ceil(SIDE) * (relief.ny - 1).div_ceil(SIDE)
    }

    /// Least and greatest corner, mm.
    pub(super) fn bounds(&self, relief: &Relief) -> (DVec3, DVec3) {
        let [first, last] = [0, 1].map(|k| relief.lines(self.columns[k] as usize, self.rows[k] as usize));
        (DVec3::new(first.0[0], first.1[0], self.z[0]), DVec3::new(last.0[1], last.1[1], self.z[1]))
    }
}

/// A crossing of the triangulated face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub(super) crossing: Crossing,
    pub(super) cell: u32,
    /// Which corners of the cell the triangle has.
    pub(super) half: Half,
}
