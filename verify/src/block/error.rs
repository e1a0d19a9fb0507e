//! Why a mesh is no block.

use crate::solid;

/// Why a mesh is not such a block.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BlockError {
    /// The surface is not closed, not oriented, or not sound in another way.
    #[error("the solid is not sound: {0}")]
    Unsound(solid::Soundness),
    /// There is nothing to stand on.
    #[error(
        "no planar entry face: only {triangles} triangles lie in the plane z = {z_mm} mm, with {area_mm2:.1} mm2 of {needed_mm2:.1} mm2"
    )]
    EntryFace {
        /// Triangles in the lowest plane.
        triangles: usize,
        /// The lowest plane, mm.
        z_mm: f64,
        /// Area of those triangles, mm².
        area_mm2: f64,
        /// Area of the block's outline, mm².
        needed_mm2: f64,
    },
    /// The vertices of the exit face are no regular grid.
    #[error("the vertices of the exit face are no regular grid: {why}")]
    Grid {
        /// What does not fit.
        why: String,
    },
    /// A triangle of the exit face is not half a cell of the grid.
    #[error("triangle {triangle} of the exit face is not half a cell of the grid")]
    Cell {
        /// Its index.
        triangle: usize,
    },
}
