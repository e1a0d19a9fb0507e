//! Traces light through an exported block of glass and judges the picture it draws.
//!
//! ```text
//! file -> Mesh -> Block (or any solid) -> Tracer on a Scene -> beams, photons -> Image -> Metrics
//! ```
//!
//! The verifier knows nothing of what made a file. It opens it as a stranger would and measures.
//!
//! # Frame
//!
//! Millimetres; light travels `+z`; the entry face is planar at the least z; the exit face is
//! `z = h(x, y)` with its mean at 0; the receiver is the plane `z = distance`. The picture is seen
//! on the receiver from the block's side: its left is `+x`, its top is `+y`, and images here are in
//! the order of pictures, row 0 on top.
//!
//! # Guarantees
//!
//! - No ray is lost between two triangles, at an edge or at a vertex of a sound solid.
//! - Power is counted in integers: it adds up to what was sent out, and every result is the same
//!   for any number of threads.
//! - Hit points, normals, refraction and landing points are computed in f64; f32 only proposes
//!   candidate triangles.

mod block;
pub mod crosscheck;
mod estimate;
mod image;
pub mod image_file;
pub mod load;
mod mesh;
mod random;
pub mod reference;
mod scene;
pub mod solid;
mod spline;
mod trace;

pub use self::image::Image;
pub use block::{Block, BlockError, ExpectedPose, PlacedBlock, Placement};
pub use estimate::{
    Beams, Flux, MOST_BEAMS, PhotonAgreement, PhotonError, PhotonPlan, PhotonTally, TallyError, UnbiasedError, beams,
    dispersion, facet_beams, metrics, photons,
};
pub use mesh::{CornerNormals, Mesh, TrimmedFace};
pub use scene::{
    BeamProfile, Emission, Fresnel, Geometry, IntensityTable, Light, Optics, Scene, SceneError, SourceExtent, Surface,
    Traversal, Window,
};
pub use trace::{End, RayPath, Tracer};
