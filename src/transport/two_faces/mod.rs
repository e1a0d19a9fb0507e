//! Two free faces: two pictures, on receivers one behind the other.
//!
//! Between the receivers the light is a wavefront, whose phase on the first is one unknown with one
//! equation ([`between`]). Given that, the phase of the light that enters, of that which leaves, and
//! the length of the way between them leave one unknown for both faces, the exit face, with another
//! equation ([`exit`]); the entry face follows in closed form. Both equations have the same shape as
//! that of one free face, and are solved as it is, coarse to fine and in a closed loop.

mod between;
mod exit;
mod faces;
mod feasible;
mod film;
mod margins;
mod outgoing;
mod rounds;
mod solve;

pub use solve::TwoFaces;

#[cfg(test)]
mod tests;
