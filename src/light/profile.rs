//! Light whose flux is spread unevenly over the block: a torch's cone, a lamp's published
//! intensity, a beam that was photographed.

use crate::grid::{Extent, Field, bilinear};
use glam::DVec2;

/// Why light cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// A factor is no light.
    #[error("the light at x = {:.1} mm, y = {:.1} mm of the block is {value} of another's; it must be finite and not negative", at_mm.x, at_mm.y)]
    Value {
        /// Where, mm.
        at_mm: DVec2,
        /// The value.
        value: f64,
    },
    /// A part of the block is as good as dark.
    #[error(
        "the block gets only {:.2} % of the mean light at x = {:.1} mm, y = {:.1} mm; at least {} % are needed to draw with: aim the light at the middle of the block, widen its beam, or take a smaller block",
        100.0 * share, at_mm.x, at_mm.y, 100.0 * Profile::LEAST
    )]
    Dark {
        /// Where, mm.
        at_mm: DVec2,
        /// Flux there over its mean.
        share: f64,
    },
    /// Light that passes other faces before the block, whose rays in air are not those of the block's own entry face.
    #[error(
        "light that comes through other faces first is spread by them, and no other profile is known behind them: leave it out"
    )]
    Passed,
    /// Too few values to interpolate.
    #[error("the picture of the beam has {nx} x {ny} pixels; at least 2 x 2 are needed")]
    TooSmall {
        /// Columns.
        nx: usize,
        /// Rows.
        ny: usize,
    },
}

/// Factors by which flux differs from that of the even light, or of the source, that lights the
/// block; by the place where a ray crosses the mean plane of the exit face. Between its nodes it is
/// bilinear.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    extent: Extent,
    factors: Field<f64>,
}

impl Profile {
    /// Least flux as a share of the mean.
    pub const LEAST: f64 = 0.02;

    /// From factors at nodes that span the block edge to edge.
    pub(super) fn new(extent: Extent, factors: Field<f64>) -> Self {
        Self { extent, factors }
    }

    /// The factor of the ray that crosses the mean plane here.
    #[inline]
    pub fn at(&self, crossing_mm: DVec2) -> f64 {
        let cells = DVec2::new((self.factors.nx() - 1) as f64, (self.factors.ny() - 1) as f64);
        bilinear(&self.factors, (crossing_mm - self.extent.lower()) / self.extent.as_vec() * cells)
    }
}
