//! From heights to a closed solid.
//!
//! # Guarantees
//! Every [`Solid`] is a closed, outward oriented surface of genus 0 without degenerate triangles,
//! for any aspect and size that [`Solid::new`] accepts; [`Solid::check`] proves it triangle by
//! triangle. Coordinates are `f32`, as in the files: what is checked is what is written, bit for
//! bit.
//!
//! # Triangulation
//! - *Exit face*: the height nodes, two triangles a cell. Each cell is split along the diagonal on
//!   which the surface bends less, so that the flat facets stay nearer to it than with a fixed
//!   diagonal. The rule is the same after a mirroring, and so is the mesh (ties go to the diagonal
//!   that points to the centre).
//! - *Entry face*: a plane of square-like cells, about as wide as the block is thick. A fan, or a
//!   single quad with all border nodes on it, would be thousands of slivers; a full grid would
//!   double the file and say nothing. Or a relief, as the exit face is, on as many nodes.
//! - *Walls*: one strip each, between the exit border's own nodes and the few nodes of the entry
//!   border. There is no vertex between the two faces: a reader finds the height nodes as all
//!   vertices above the entry plane.
//! - *Other outlines* than a rectangle: whole cells inside, a ring between them and the curve, one
//!   wall all around, and an entry face fanned out from its middle. A rim there is a ring as long
//!   as the border, with an outer wall of its own.
//! - *Rim*, if there is one: inner walls as above, between the exit border and the inner edge of
//!   the rim's plane; a ring of triangles between that edge and the few corners of the outline; one
//!   quad for every outer wall.

mod blank;
mod body;
mod check;
mod close;
mod entry;
mod error;
mod face;
mod nodes;
mod ring;
mod shape;
mod stock;
mod trim;
mod walls;

pub use blank::Blank;
pub use body::Solid;
pub use check::{Fault, Invariants};
pub(crate) use check::{cross, sub};
pub use error::SolidError;
pub use face::Face;
pub use shape::{Origin, Rim, Shape};
pub use stock::{STANDARD_SHEETS_MM, Stock};

#[cfg(test)]
mod tests;
