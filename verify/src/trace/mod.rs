//! Following rays of light through a solid to the receiver.

mod accel;
mod block;
mod facets;
mod illumination;
mod path;
mod rays;
mod receiver;
mod reentry;
mod refraction;
mod solid;
mod tracer;

pub(crate) use block::{FromFacet, Row};
pub use path::{End, RayEnd, RayExit, RayPath};
pub use rays::RayTracer;
pub use tracer::Tracer;
