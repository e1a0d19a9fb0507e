//! Two-dimensional arrays on a rectangle, and the ways between resolutions.
//!
//! Node grids span a rectangle edge to edge; cell grids tile it. Both are row-major: row `j` runs
//! along `+y`, column `i` along `+x`.

mod convolve;
pub mod dct;
mod extent;
mod field;
mod outline;
mod resample;

pub use convolve::Convolution;
pub use extent::Extent;
pub use field::Field;
pub(crate) use outline::cut_off;
pub use outline::{Contour, Outline};
pub(crate) use resample::bilinear;
pub use resample::{area_resample, bilinear_resample};
