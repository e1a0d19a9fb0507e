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
    block.exit.normals()
}
