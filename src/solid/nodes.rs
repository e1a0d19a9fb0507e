//! Vertices on a regular grid.

use super::face::Face;
use crate::grid::Extent;
use glam::DVec3;

/// A regular grid of vertices, numbered row by row from `first`.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub(super) first: usize,
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
}

impl Nodes {
    pub(super) fn new(first: usize, extent: Extent, (nx, ny): (usize, usize), origin: DVec3) -> Self {
        // The ends are set to half the size, not computed: the walls are exactly planar and exactly
        // where they belong.
        let axis = |n: usize, size: f64, origin: f64, place: &dyn Fn(usize) -> f64| -> Vec<f32> {
            let mut axis: Vec<f32> = (0..n).map(|k| (place(k) - origin) as f32).collect();
            (axis[0], axis[n - 1]) = ((-0.5 * size - origin) as f32, (0.5 * size - origin) as f32);
            axis
        };
        let x = axis(nx, extent.width_mm, origin.x, &|i| extent.node(i, 0, nx, ny).x);
        let y = axis(ny, extent.height_mm, origin.y, &|j| extent.node(0, j, nx, ny).y);
        Self { first, x, y }
    }

    pub(super) fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    pub(super) fn index(&self, i: usize, j: usize) -> u32 {
        (self.first + j * self.x.len() + i) as u32
    }

    /// The nodes along a wall, in the order of a viewer outside of it, from left to right.
    pub(super) fn border(&self, wall: Face) -> Vec<u32> {
        let (right, top) = (self.x.len() - 1, self.y.len() - 1);
        match wall {
            Face::South => (0..=right).map(|i| self.index(i, 0)).collect(),
            Face::East => (0..=top).map(|j| self.index(right, j)).collect(),
            Face::North => (0..=right).rev().map(|i| self.index(i, top)).collect(),
            Face::West => (0..=top).rev().map(|j| self.index(0, j)).collect(),
            Face::Exit | Face::Entry | Face::Rim | Face::Side | Face::Inner | Face::Mark => Vec::new(),
        }
    }
}
