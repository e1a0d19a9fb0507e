//! Following rays of light through a solid to the receiver.

mod accel;
mod block;
mod facets;
mod reentry;
mod illumination;
mod path;
mod receiver;
mod refraction;
mod solid;
mod tracer;

pub(crate) use block::{FromFacet, Row};
pub use path::{End, Path};
pub use tracer::Tracer;
