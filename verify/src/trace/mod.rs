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
mod row;
mod solid;
mod stand;
mod tracer;

pub(crate) use block::{FromFacet, RayRow};
pub use path::{End, RayEnd, RayExit, RayPath};
pub use rays::RayTracer;
pub use row::{Row, RowBlock};
pub use tracer::Tracer;
