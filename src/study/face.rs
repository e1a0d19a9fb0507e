//! The exit face of a block of the verifier as a height field of the designer, and back.

use crate::{
    failure::Failure,
    grid::{Extent, Field, Outline},
    surface::HeightField,
};
use glam::DVec2;
use glasswarp_verify::Block;

/// A block with another face.
pub fn with_face(block: &Block, surface: &HeightField) -> Result<Block, Failure> {
    let heights = surface.heights_mm();
    block.clone().with_face((heights.nx(), heights.ny()), heights.as_slice().to_vec()).map_err(Failure::refused)
}

/// The exit face of a block as a height field in the block's own frame, which goes on smoothly
/// beyond its outline.
///
/// # Errors
/// An outline that is neither an ellipse nor a rectangle with round corners.
pub fn surface_of(block: &Block) -> Result<HeightField, Failure> {
    let (size, (nx, ny)) = (block.size_mm(), block.nodes());
    let extent = Extent::new(size.x, size.y);
    let heights = Field::from_vec(nx, ny, block.heights_mm().to_vec());
    let Some(points) = block.outline() else { return Ok(HeightField::found(extent, Outline::Rectangle, heights)) };
    let points: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
    let tolerance_mm = OUTLINE_TOLERANCE * extent.node_spacing(nx, ny).min_element();
    let outline = Outline::through(&points, extent, tolerance_mm).ok_or_else(|| Failure::refused(UnknownOutline))?;
    Ok(HeightField::found(extent, outline, heights).continued())
}

/// How far the points of a file may lie off the curve of an outline, in spacings of its nodes.
const OUTLINE_TOLERANCE: f64 = 0.1;

/// An outline that nobody made here.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error(
    "the outline of this block is neither an ellipse nor a rectangle with round corners, which checks and milling take; a verification takes any"
)]
struct UnknownOutline;
