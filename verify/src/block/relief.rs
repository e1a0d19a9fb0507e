//! A height field on a regular grid of vertices: what a face of a block is that is not planar.

use super::{cell::Diagonal, error::BlockError};
use crate::spline::Bicubic;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// A height field on a regular grid, each cell of which is cut into two triangles.
#[derive(Clone, Debug)]
pub(crate) struct Relief {
    /// Least and greatest corner of its plan, mm.
    pub(crate) lower: DVec2,
    pub(crate) upper: DVec2,
    /// Nodes along x and y.
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    /// Places of the grid lines, mm.
    xs: Vec<f64>,
    ys: Vec<f64>,
    /// Heights at the nodes, mm, row-major, rows along +y.
    pub(crate) heights: Arc<Vec<f64>>,
    /// How every cell is cut into two triangles.
    pub(crate) diagonals: Arc<Vec<Diagonal>>,
    /// The spline through the nodes, if it is at hand.
    spline: Option<Arc<Bicubic>>,
}

impl Relief {
    /// One whose cells are cut by these diagonals.
    pub(super) fn new(
        (lower, upper): (DVec2, DVec2),
        (nx, ny): (usize, usize),
        heights: Vec<f64>,
        diagonals: Vec<Diagonal>,
    ) -> Self {
        let (xs, ys) = (places(nx, lower.x, upper.x), places(ny, lower.y, upper.y));
        Self { lower, upper, nx, ny, xs, ys, heights: Arc::new(heights), diagonals: Arc::new(diagonals), spline: None }
    }

    /// One of these heights alone.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for fewer than 4 nodes along a side, another number of heights, or one
    /// that is not finite.
    pub(super) fn from_heights(
        plan: (DVec2, DVec2),
        (nx, ny): (usize, usize),
        heights: Vec<f64>,
    ) -> Result<Self, BlockError> {
        let refused = |why: String| Err(BlockError::Grid { why });
        if nx.min(ny) < Bicubic::LEAST_NODES || nx.checked_mul(ny) != Some(heights.len()) {
            return refused(format!("{} heights on {nx} columns and {ny} rows", heights.len()));
        }
        if let Some(k) = heights.iter().position(|z| !z.is_finite()) {
            return refused(format!("the height at column {}, row {} is {} mm", k % nx, k / nx, heights[k]));
        }
        Ok(Self::new(plan, (nx, ny), heights, vec![Diagonal::Rising; (nx - 1) * (ny - 1)]))
    }

    /// The same with the spline through its nodes at hand.
    pub(super) fn with_spline(mut self) -> Self {
        self.spline = Some(self.spline());
        self
    }

    /// The spline through the nodes.
    pub(crate) fn spline(&self) -> Arc<Bicubic> {
        let (lower, upper) = (self.lower.to_array(), self.upper.to_array());
        let through = || Arc::new(Bicubic::through(&self.heights, self.nx, self.ny, lower, upper));
        self.spline.clone().unwrap_or_else(through)
    }

    /// Unit normals of the spline at the nodes.
    pub(crate) fn normals(&self) -> Vec<DVec3> {
        let spline = self.spline();
        let normal = |k: usize| {
            let p = self.place(k);
            let jet = spline.jet(p.x, p.y);
            DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
        };
        (0..self.heights.len()).into_par_iter().map(normal).collect()
    }

    /// Position of node `(i, j)`, mm. The ends are exact.
    #[inline]
    pub(crate) fn node(&self, i: usize, j: usize) -> DVec3 {
        DVec3::new(self.xs[i], self.ys[j], self.heights[j * self.nx + i])
    }

    /// Position of a node that is counted row by row, in the plan, mm.
    pub(super) fn place(&self, node: usize) -> DVec2 {
        DVec2::new(self.xs[node % self.nx], self.ys[node / self.nx])
    }

    /// The grid lines on both sides of cell `(i, j)`, mm.
    #[inline]
    pub(crate) fn lines(&self, i: usize, j: usize) -> ([f64; 2], [f64; 2]) {
        ([self.xs[i], self.xs[i + 1]], [self.ys[j], self.ys[j + 1]])
    }

    /// Least and greatest height of the nodes, mm.
    pub(crate) fn range_mm(&self) -> (f64, f64) {
        self.heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &z| (lo.min(z), hi.max(z)))
    }

    /// Mean of the heights of the nodes, mm.
    pub(super) fn mean_mm(&self) -> f64 {
        self.heights.chunks(self.nx).map(|row| row.iter().sum::<f64>()).sum::<f64>() / self.heights.len() as f64
    }

    /// Height above a point of the plan, bilinear between nodes, mm.
    pub(super) fn height_between_nodes(&self, at: DVec2) -> f64 {
        let cells = DVec2::new((self.nx - 1) as f64, (self.ny - 1) as f64);
        let place = (at - self.lower) / (self.upper - self.lower) * cells;
        let corner = place.floor().clamp(DVec2::ZERO, cells - 1.0);
        let (part, first) = (place - corner, corner.y as usize * self.nx + corner.x as usize);
        let along = |k: usize| self.heights[k] * (1.0 - part.x) + self.heights[k + 1] * part.x;
        along(first) * (1.0 - part.y) + along(first + self.nx) * part.y
    }

    /// A bound for the slope between any two points, from the grid lines.
    pub(crate) fn steepest(&self) -> f64 {
        let spacing = (self.upper - self.lower) / DVec2::new((self.nx - 1) as f64, (self.ny - 1) as f64);
        let (mut along_x, mut along_y) = (0f64, 0f64);
        for j in 0..self.ny {
            let row = &self.heights[j * self.nx..(j + 1) * self.nx];
            row.windows(2).for_each(|w| along_x = along_x.max((w[1] - w[0]).abs()));
            if j + 1 < self.ny {
                let above = &self.heights[(j + 1) * self.nx..(j + 2) * self.nx];
                row.iter().zip(above).for_each(|(a, b)| along_y = along_y.max((b - a).abs()));
            }
        }
        // The spline may be steeper than its nodes suggest; this only decides whether to look.
        1.5 * (DVec2::new(along_x, along_y) / spacing).length()
    }

    /// The same height field further along z, mm.
    pub(super) fn moved(mut self, by_mm: f64) -> Self {
        Arc::make_mut(&mut self.heights).iter_mut().for_each(|z| *z += by_mm);
        self.spline = None;
        self
    }

    /// Heights at the nodes, without a copy where nothing else holds on to them.
    pub(super) fn into_heights(self) -> Vec<f64> {
        Arc::try_unwrap(self.heights).unwrap_or_else(|shared| shared.to_vec())
    }
}

/// Places of `n` grid lines from `lo` to `hi`. The ends are exact.
fn places(n: usize, lo: f64, hi: f64) -> Vec<f64> {
    let place = |k: usize| k as f64 / (n - 1) as f64;
    (0..n).map(|k| lo * (1.0 - place(k)) + hi * place(k)).collect()
}
