//! A small piece of glass that tells of a bench what nobody knows of his own: how far the polish
//! blurs, which index the glass has, and what the cutter's rows leave.
//!
//! In the light of a small lamp the piece draws a ladder on a sheet of paper. Every rung is the
//! light of a ruling, a sinusoidal wave along x, spread over a bar as long as the wave is steep. A
//! polish shortens the bars of short waves first; that of a long wave, half as steep, marks half of
//! their length. Two uprights come from wedges, as far apart as the index says, and a spot at the
//! top from a plain lens, which scallops draw out to a streak.

mod face;
mod light;
mod piece;
mod plan;
mod ray;
mod read;
mod seen;

pub use face::Ruling;
pub use light::CouponState;
pub use piece::{Coupon, Rung, RungShows};
pub use plan::{CouponError, CouponPlan};
pub use read::{Ladder, Polished, Reading, Streak, Unreadable};
pub use seen::SeenCoupon;
