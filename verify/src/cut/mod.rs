//! What a cutter leaves: the lower envelope of all its moves, with its slopes.
//!
//! ```text
//! moves -> strokes (stroke, arc) -> sheet: heights and slopes on a grid
//!                                -> stock: what a rapid or a plunge meets on its way
//! ```
//!
//! A cutter of revolution about z whose tip goes along a straight line leaves the surface `min over
//! s of z(s) + f(|p - a(s)|)`, with the profile `f` of the cutter. `f` is convex, so that this is a
//! convex function of `p` and, at every `p`, a convex problem in `s` with a solution in closed form
//! (`profile.rs`). What many moves leave is the least of them.
//!
//! # Guarantees
//!
//! Heights are those of the exact envelope to rounding on straight moves, and to 1e-9 mm on arcs.
//! The same bits for any number of threads, and however the moves are cut into batches.
//!
//! # Limitations
//!
//! The cutter is as it is named: no runout, no deflection, no wear. Nothing is left standing
//! because a shank would not pass.

mod profile;
mod sheet;
mod stock;
mod stroke;

pub use profile::Profile;
pub use sheet::{Cut, Plan, Sheet, SheetError};
pub use stock::{Passes, Removal, Stock};
pub use stroke::Strokes;
