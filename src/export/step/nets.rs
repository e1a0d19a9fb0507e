//! The B-spline faces of a block, and where their control points stand in the file.

use crate::surface::ControlNet;

/// The B-spline faces of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nets<'a> {
    pub(super) exit: &'a ControlNet,
    /// Of an entry face that is no plane.
    pub(super) entry: Option<&'a ControlNet>,
}

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Exit,
    Entry,
}

impl<'a> Nets<'a> {
    /// In the order of their control points in the file.
    pub(super) fn all(self) -> impl Iterator<Item = &'a ControlNet> {
        [Some(self.exit), self.entry].into_iter().flatten()
    }

    /// The net of a side, and how many control points are written before its own.
    pub(super) fn of(self, side: Side) -> (&'a ControlNet, usize) {
        match (side, self.entry) {
            (Side::Entry, Some(entry)) => (entry, count(self.exit)),
            _ => (self.exit, 0),
        }
    }
}

/// Control points of a net.
pub(super) fn count(net: &ControlNet) -> usize {
    net.points().0 * net.points().1
}
