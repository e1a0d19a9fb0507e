//! The block as files.
//!
//! Every mesh format holds the same `f32` vertices: in millimetres in STL, OBJ, 3MF and PLY, in
//! metres and turned to `+y` up in GLB. What the encoding costs on the wall is the resolution of
//! `f32` near 0, about a micrometre of spot displacement. STEP holds the exit face as a B-spline
//! surface, in decimals of a millimetre. Height maps hold the exit face alone.

mod format;
mod glb;
mod height_map;
mod obj;
mod ply;
mod step;
mod stl;
mod text;
mod three_mf;
mod write;

pub use format::{Design, ExportError, Format};
#[cfg(feature = "files")]
pub use glasswarp_files::{Held, WriteError, probe, remove_unfinished, write_atomically};
pub use glb::write_glb;
pub use height_map::{HeightMap, HeightMapError, HeightMapFormat};
pub use obj::write_obj;
pub use ply::write_ply;
pub use step::{NetFit, StepError, StepTolerance, choose_net, write_step};
pub use stl::write_stl;
pub use three_mf::write_3mf;
#[cfg(feature = "files")]
pub use write::export;

#[cfg(test)]
pub(crate) mod tests;
