//! The part of the receiver that is pictured.

use super::error::{SceneError, in_range};
use glam::DVec2;

/// The part of the receiver on which the picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Size along x and y, mm.
    pub size_mm: DVec2,
    /// Centre, mm from the axis.
    pub centre_mm: DVec2,
    /// Pixels along x.
    pub nx: usize,
    /// Pixels along y.
    pub ny: usize,
}

impl Window {
    /// Most pixels along a side.
    pub const MOST_ALONG: usize = 32_768;
    /// Most pixels in all: a film of them takes half a gigabyte.
    pub const MOST_PIXELS: usize = 1 << 26;

    /// Its corners of least and of greatest coordinates, mm.
    pub fn corners_mm(&self) -> [DVec2; 2] {
        [self.centre_mm - 0.5 * self.size_mm, self.centre_mm + 0.5 * self.size_mm]
    }

    pub(crate) fn validate(&self) -> Result<(), SceneError> {
        in_range("the width of the window (mm)", self.size_mm.x, 1e-6, 1e9)?;
        in_range("the height of the window (mm)", self.size_mm.y, 1e-6, 1e9)?;
        in_range("the centre of the window along x (mm)", self.centre_mm.x, -1e9, 1e9)?;
        in_range("the centre of the window along y (mm)", self.centre_mm.y, -1e9, 1e9)?;
        in_range("the number of pixels along x", self.nx as f64, 1.0, Self::MOST_ALONG as f64)?;
        in_range("the number of pixels along y", self.ny as f64, 1.0, Self::MOST_ALONG as f64)?;
        self.holds_at_most(Self::MOST_PIXELS)
    }

    /// Refuses more pixels than that.
    pub(crate) fn holds_at_most(&self, most: usize) -> Result<(), SceneError> {
        let pixels = self.nx.saturating_mul(self.ny);
        in_range("the number of pixels of the window, columns times rows,", pixels as f64, 1.0, most as f64)
    }
}
