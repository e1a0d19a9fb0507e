//! Light on a receiver, between the nodes of a grid.

use crate::{grid::Field, transport::spline::ReceiverGrid};
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
        let (mx, my) = self.grid.cells;
        let at = self.grid.position(point).clamp(DVec2::ZERO, DVec2::new(mx as f64, my as f64));
        let (i, j) = ((at.x as usize).min(mx - 1), (at.y as usize).min(my - 1));
        let f = at - DVec2::new(i as f64, j as f64);
        let along = |j: usize| {
            let row = &self.light.row(j)[i..i + 2];
            row[0] + f.x * (row[1] - row[0])
        };
        let below = along(j);
        below + f.y * (along(j + 1) - below)
    }

    /// Of its nodes, mm.
    #[inline(always)]
    pub(super) fn spacing(&self) -> DVec2 {
        self.grid.spacing
    }
}
