//! Programs of machine tools: what the words of a file make a machine do.
//!
//! ```text
//! bytes -> lines of words (line) -> modal state (modal) -> moves of the tip (interpret, motion)
//! ```
//!
//! The language is RS-274/NGC as LinuxCNC runs it, with what posts for Fanuc, Haas, GRBL and Mach
//! write besides. What is not understood is refused with its line and never passed over:
//! a word that is ignored here may move a machine.
//!
//! # Frame
//!
//! Millimetres, as the program counts them in the first work offset that it uses. Places are those
//! of the cutter's tip: tool lengths are the machine's affair.
//!
//! # Limitations
//!
//! Three axes. No parameters, expressions, O-words, subprograms, canned cycles, cutter radius
//! compensation, splines, polar coordinates, scaling, lathes.

mod error;
mod geometry;
mod interpret;
mod line;
mod modal;
mod moves;
mod survey;
mod time;
mod tool;

pub use error::{ProgramError, ProgramFault};
pub use geometry::{Arc, Plane};
pub use interpret::{Run, Units, run};
pub use modal::Blending;
pub use moves::{Move, Way};
pub use survey::{Survey, SurveyLimits, survey};
pub use time::{Clock, Dynamics};
pub use tool::{Tool, ToolError, tools_in};
