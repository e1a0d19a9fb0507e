//! Tracing blocks: their faces are planes and height fields on regular grids, in which much is
//! known beforehand.

mod body;
mod face;
mod hit;
mod imperfect;
mod incident;
mod lit;
mod rows;
mod search;
mod tracer;
mod walls;

pub(in crate::trace) use rows::{FacetLines, Lattice};
pub(crate) use rows::{FromFacet, RayRow};
pub(in crate::trace) use tracer::BlockTracer;
