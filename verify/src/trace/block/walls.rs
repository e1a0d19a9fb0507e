//! The side walls of a rectangular block, as light sees them.

use glam::DVec2;

/// How far beyond a wall light counts as inside, mm.
pub(super) const WALL_MM: f64 = 1e-9;

/// Whether a point is in a rectangle, or on its border but for rounding.
#[inline]
pub(super) fn in_rectangle(at: DVec2, (lower, upper): (DVec2, DVec2)) -> bool {
    (at + WALL_MM).cmpge(lower).all() && (at - WALL_MM).cmple(upper).all()
}
