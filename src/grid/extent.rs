//! The rectangle that a grid spans.

use glam::DVec2;

/// Width and height of a rectangle centred on the optical axis, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Size along x, mm.
    pub width_mm: f64,
    /// Size along y, mm.
    pub height_mm: f64,
}

impl Extent {
    /// A rectangle of the given size, mm.
    pub const fn new(width_mm: f64, height_mm: f64) -> Self {
        Self { width_mm, height_mm }
    }

    /// Both sizes as a vector, mm.
    pub const fn as_vec(self) -> DVec2 {
        DVec2::new(self.width_mm, self.height_mm)
    }

    /// The corner of least x and y, mm.
    pub fn lower(self) -> DVec2 {
        -0.5 * self.as_vec()
    }

    /// Area, mm².
    pub fn area_mm2(self) -> f64 {
        self.width_mm * self.height_mm
    }

    /// Spacing of `nx` by `ny` nodes that span the rectangle edge to edge, mm.
    pub fn node_spacing(self, nx: usize, ny: usize) -> DVec2 {
        DVec2::new(self.width_mm / (nx - 1) as f64, self.height_mm / (ny - 1) as f64)
    }

    /// Position of node `(i, j)` of `nx` by `ny` nodes that span the rectangle edge to edge, mm.
    pub fn node(self, i: usize, j: usize, nx: usize, ny: usize) -> DVec2 {
        // Written symmetrically, so that the grid is exactly its own mirror image.
        let axis = |k: usize, n: usize, size: f64| size * (2.0 * k as f64 - (n - 1) as f64) / (2.0 * (n - 1) as f64);
        DVec2::new(axis(i, nx, self.width_mm), axis(j, ny, self.height_mm))
    }
}
