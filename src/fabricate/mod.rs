//! What a workshop makes of an exit face: cutters, the rows they are moved in, the scallops they
//! leave, polishing, and whether a face can be made at all.
//!
//! The cutter's axis is the z axis and the designed face is the not-a-knot bicubic spline through
//! its nodes, cut off at the block's border; nothing here works on triangles. [`DropCutter`] finds
//! how deep the cutter may go at a place without touching glass that shall stay; [`Rows`] moves it
//! along parallel rows; [`Rows::milled`] is what is left when every row has been cut. Feed and
//! spindle do not matter for that: runout, deflection and chatter are not modelled.
//! [`Program::write`] is the same way for a machine.
//!
//! Beside [`surface`](crate::surface) and [`grid`](crate::grid) nothing of the solvers is known
//! here.

mod cutter;
mod drop;
mod envelope;
mod program;
mod rows;
mod scallop;
mod shape;
mod walls;

pub use cutter::{Cutter, CutterError, CutterShape};
pub use drop::{Contact, DropCutter, tool_offset};
pub use envelope::{Milled, SAMPLES_PER_ROW};
pub use program::{CHORD_MM, Machining, MachiningError, Pattern, Place, Post, Program, Roughing, Sense};
pub use rows::{Direction, Pass, PassError, Rows, RowsCost};
pub use scallop::Scallop;
pub use shape::{FaceShape, Hollow};
pub use walls::{Unreached, Walls};
