//! Tracing a block: its exit face is a height field on a regular grid, in which much is known
//! beforehand.

mod hit;
mod imperfect;
mod incident;
mod lit;
mod rows;
mod search;
mod tracer;
mod walls;

pub(in crate::trace) use rows::{FacetLines, Lattice};
pub(crate) use rows::{FromFacet, Row};
pub(in crate::trace) use tracer::BlockTracer;
