//! What a solution leaves of what is possible.

use glam::DMat2;

/// What a solution on some grid leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Margins {
    /// The narrowest stretch of the light between the first receiver and the exit face: less than 1
    /// where it gathers towards the block.
    pub(super) stretch: f64,
    /// Steepest slope of the exit face.
    pub(super) slope: f64,
    /// Highest point of the exit face, mm.
    pub(super) highest_mm: f64,
}

impl Margins {
    pub(super) const NONE: Self = Self { stretch: f64::INFINITY, slope: 0.0, highest_mm: f64::NEG_INFINITY };

    pub(super) fn with(self, other: &Self) -> Self {
        Self {
            stretch: self.stretch.min(other.stretch),
            slope: self.slope.max(other.slope),
            highest_mm: self.highest_mm.max(other.highest_mm),
        }
    }
}

/// The lesser stretch of a jacobian that is nearly symmetric.
pub(super) fn narrowest(stretch: DMat2) -> f64 {
    let (trace, determinant) = (stretch.x_axis.x + stretch.y_axis.y, stretch.determinant());
    0.5 * (trace - (trace * trace - 4.0 * determinant).max(0.0).sqrt())
}
