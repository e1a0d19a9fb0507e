//! How frames stand in each other.

use glam::{DMat3, DVec3};

/// How a frame stands in another: turned about its own origin, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stand {
    pub(super) turn: DMat3,
    /// mm.
    pub(super) shift: DVec3,
}

impl Stand {
    /// The two frames are one.
    pub(super) const NONE: Self = Self { turn: DMat3::IDENTITY, shift: DVec3::ZERO };

    /// A point of this frame in the other, mm.
    #[inline]
    pub(super) fn point(&self, at: DVec3) -> DVec3 {
        self.turn * at + self.shift
    }

    /// A direction of this frame in the other.
    #[inline]
    pub(super) fn direction(&self, along: DVec3) -> DVec3 {
        self.turn * along
    }

    /// How the other stands in this one.
    pub(super) fn inverse(&self) -> Self {
        let turn = self.turn.transpose();
        Self { turn, shift: turn * -self.shift }
    }

    /// How this frame stands where the other stands so.
    pub(super) fn within(&self, other: &Self) -> Self {
        Self { turn: other.turn * self.turn, shift: other.point(self.shift) }
    }
}
