//! The normals that smooth shading interpolates.

use super::model::Block;
use glam::DVec3;
use rayon::prelude::*;

/// Unit normals at the nodes of the exit face: those of known slopes, the file's own, or else those
/// of the spline through the nodes.
pub(crate) fn node_normals(block: &Block) -> Vec<DVec3> {
    if let Some(slopes) = &block.slopes {
        return slopes.par_iter().map(|slope| (-slope).extend(1.0).normalize()).collect();
    }
    if let Some(normals) = &block.normals {
        return normals.clone();
    }
    let spline = block.exit.spline();
    let normal = |k: usize| {
        let p = block.exit.node(k % block.exit.nx, k / block.exit.nx);
        let jet = spline.jet(p.x, p.y);
        DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
    };
    (0..block.exit.heights.len()).into_par_iter().map(normal).collect()
}
