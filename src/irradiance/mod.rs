//! From a picture to the irradiance that the receiver shall get.

mod caustic;
mod deconvolve;
mod framing;
mod imperfect;
mod picture;
mod psf;
mod target;

pub use caustic::{CausticMesh, CausticMeshError};
pub use deconvolve::{Border, Deconvolution, DeconvolutionError, Deconvolved, Ending};
pub use framing::{Framing, FramingError, Vignette};
pub use imperfect::{ImperfectLight, SourceSize};
pub use picture::{
    Background, Crop, EditError, Edits, Flip, Levels, Measure, Picture, PictureError, PictureOptions, Rotation,
    Transfer, Understood,
};
pub use psf::{Psf, PsfError, PsfPicture};
pub use target::{TargetError, TargetIrradiance, to_picture_order};
