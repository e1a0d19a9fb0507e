//! A block of glass in a mesh: what makes it one, how it stands, and what is known of its exit
//! face.

mod cell;
mod error;
mod face;
mod grid;
mod model;
mod outline;
mod placement;
mod recognise;
mod relief;
mod shading;

pub(crate) use cell::{Diagonal, Half, corners, halves};
pub use error::BlockError;
pub use model::Block;
pub use placement::{ExpectedPose, PlacedBlock, Placement};
pub(crate) use relief::Relief;
pub(crate) use shading::node_normals;
