//! The exit face: normals to slopes, slopes to heights, the spline through the heights, and the
//! control net of CAD files.

mod axis;
mod beyond;
mod extend;
mod fill;
mod finish;
mod height_field;
mod integrate;
mod net;
mod polish;
mod spline;

pub use axis::DEGREE;
pub use finish::Finish;
pub use height_field::HeightField;
pub use integrate::{EdgeRule, heights_of_slopes, least_squares};
pub use net::{ControlNet, FitError};
pub use polish::{Polish, PolishError};
pub use spline::{SurfaceSample, SurfaceSpline};
