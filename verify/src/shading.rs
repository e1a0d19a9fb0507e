//! The normals that smooth shading interpolates.

use crate::{block::Block, spline::Bicubic};
use glam::DVec3;

/// Unit normals at the nodes of the exit face: the file's own, else those of the spline through the nodes.
pub(crate) fn node_normals(block: &Block) -> Vec<DVec3> {
    if let Some(normals) = &block.normals {
        return normals.clone();
    }
    let spline = spline_through(block);
    let normal = |k: usize| {
        let p = block.node(k % block.nx, k / block.nx);
        let jet = spline.jet(p.x, p.y);
        DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
    };
    (0..block.heights.len()).map(normal).collect()
}

/// The spline through the nodes.
pub(crate) fn spline_through(block: &Block) -> Bicubic {
    let (lower, upper) = (block.lower.to_array(), block.upper.to_array());
    Bicubic::through(&block.heights, block.nx, block.ny, lower, upper)
}
