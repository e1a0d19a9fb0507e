//! Light on a receiver, between the nodes of a grid.

use crate::{
    grid::{Field, bilinear},
    transport::spline::ReceiverGrid,
};
use glam::DVec2;

/// Bilinear between its nodes; beyond them as at the border.
#[derive(Clone, Debug)]
pub(super) struct Film {
    pub(super) grid: ReceiverGrid,
    /// Of trapezoidal mean 1.
    pub(super) light: Field<f64>,
}

impl Film {
    /// The light at a point of the receiver, mm.
    #[inline(always)]
    pub(super) fn at(&self, point: DVec2) -> f64 {
        bilinear(&self.light, self.grid.position(point))
    }

    /// Of its nodes, mm.
    #[inline(always)]
    pub(super) fn spacing(&self) -> DVec2 {
        self.grid.spacing
    }
}
