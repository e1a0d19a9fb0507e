//! From the solution to the heights of both faces.

use super::solve::{Solved, Task, rectangle};
use crate::{
    grid::Field,
    transport::{carry::Carrier, spline::PathSpline},
};
use glam::DVec2;
use rayon::prelude::*;

/// Heights of both faces over the mean exit plane, mm.
pub(super) struct Faces {
    pub(super) entry: Field<f64>,
    pub(super) exit: Field<f64>,
    /// Nodes of the entry face whose ray was not found.
    pub(super) missed: usize,
}

impl Faces {
    /// The least glass between them at any node, mm; below 0 they cut each other.
    pub(super) fn least_glass_mm(&self) -> f64 {
        let pairs = self.exit.as_slice().iter().zip(self.entry.as_slice());
        pairs.map(|(exit, entry)| exit - entry).fold(f64::INFINITY, f64::min)
    }
}

/// Most steps from a point of the block to the place of the unknown, and how close to it is on it, mm.
const PLACINGS: usize = 50;
const NEAR_MM: f64 = 1e-12;

impl Task<'_> {
    /// Both faces on nodes that span the block.
    pub(super) fn faces(&self, solved: &Solved, (nx, ny): (usize, usize)) -> Faces {
        let spline = &solved.exit.state.spline;
        let carried = Carrier::new(rectangle(self.block), (nx, ny)).heights(&solved.exit_map(self), spline);
        let mut exit = Field::filled(nx, ny, 0.0);
        exit.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            row.iter_mut().enumerate().for_each(|(i, h)| *h = self.height(spline, self.block.node(i, j, nx, ny)));
        });
        Faces { entry: carried.heights_mm, exit, missed: carried.missed }
    }

    /// The height of the exit face over a point of the block. Beyond what is lit the face goes on as it
    /// comes.
    fn height(&self, spline: &PathSpline, x: DVec2) -> f64 {
        let beta = self.spread().beta;
        let (mut xi, mut height) = (x, 0.0);
        for _ in 0..PLACINGS {
            height = spline.jet_beyond(spline.grid.position(xi)).value;
            let next = x / (DVec2::ONE + beta * height);
            if (next - xi).length_squared() < NEAR_MM * NEAR_MM {
                break;
            }
            xi = next;
        }
        height
    }
}
