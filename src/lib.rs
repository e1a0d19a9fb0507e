//! Turns a picture into a block of glass whose light draws that picture.
//!
//! # The pipeline
//!
//! ```text
//! image -> TargetIrradiance -> (WarpMesh -> NormalField ->) HeightField -> Solid -> files
//! ```
//!
//! The verifier (`glasswarp-verify`) starts at the other end: it opens the files, and knows nothing of what made them.
//!
//! # Frame, units, signs
//!
//! Millimetres and radians, a right-handed frame. Light travels along `+z`. The planar entry face lies at a constant
//! negative z, the exit face is `z = h(x, y)` with the mean of its nodes at 0, the receiver is the plane `z = distance`.
//! `x` and `y` are centred on the optical axis. The picture is seen on the wall from the block's side: its left is `+x`, its
//! top is `+y`. Inside the library every grid has row `j` along `+y` and column `i` along `+x`; a picture is turned into
//! that order once, where it becomes a [`target::TargetIrradiance`], and back once, where it is shown.
//!
//! Irradiance is linear and has the mean 1.

pub mod bench;
pub mod export;
pub mod fabricate;
pub mod forward;
pub mod grid;
pub mod light;
pub mod materials;
pub mod optics;
pub mod optim;
pub mod pipeline;
pub mod report;
pub mod solid;
pub mod solver;
pub mod surface;
pub mod target;
pub mod transport;
pub mod warp;
