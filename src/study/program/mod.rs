//! A program of a machine: what it cuts out of the stock, the picture that this draws, and what is
//! wrong with it.

mod deviation;
mod diagnosis;
mod examine;
mod faults;
mod question;
mod sweep;
mod write;

pub use deviation::Deviation;
pub use examine::ProgramStudy;
pub use faults::{FaultKind, ProgramFaults, ProgramWarning};
pub use question::{CORNER_MM, ProgramQuestion, Setup, Source, Zero};
pub use write::{ProgramPlan, WrittenProgram};
