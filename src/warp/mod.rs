//! Brightness warping, the method of the paper (section 3): deform a mesh on the specular plane
//! until each of its quads has the area, and so the flux, that its fixed partner on the receiver
//! shall get, while the normals stay integrable.
//!
//! Two solvers: [`WarpingPaper`] as printed, and [`Warping`], which goes further in every step.
//!
//! # Corrections to the paper
//! - Equation (12) as printed reduces to 1; the derivative is `d|o|/du = -o/|o|`.
//! - `lambda` in (14) is free of units but not of resolution: under refinement the area term stays
//!   while the integrability term falls with the square of the cell size.
//!   [`WarpObjective::balanced_weight_mm2`] derives the balanced value.
//!
//! # Limits
//! The objective is relative to the desired area of each quad, so that every part of the target
//! needs some light ([`LEAST_TARGET`] of the mean). Folds are possible below an offset of about
//! 0.1; they are counted and reported.

mod improved;
mod limits;
mod locate;
mod mesh;
mod objective;
#[cfg(test)]
mod onto_mesh;
mod paper;
mod pullback;
mod relief;
mod solve;
#[cfg(test)]
mod tests;

pub use improved::{Warping, WarpingOptions};
pub use limits::LEAST_TARGET;
pub use mesh::{FoldCount, WarpMesh, pyramid};
pub use objective::WarpObjective;
pub use paper::{WarpingPaper, WarpingPaperOptions};
pub use solve::AreaWeight;
