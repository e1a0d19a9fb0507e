//! The receiver: a plane, across the axis or leaning, with a window for the picture.

use crate::grid::Extent;
use glam::{DMat3, DQuat, DVec2, DVec3};

/// The receiver plane, through the point `C = (0, 0, distance)` and turned about it by a rotation
/// `R`. A place on it is given in its own coordinates `y`: the point `C + R (y, 0)` of the bench.
/// The picture is drawn in a window, a rectangle along these coordinates.
///
/// Nothing is checked here; a [bench](super::Bench::check_receiver) refuses what cannot stand
/// behind its block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    distance_mm: f64,
    rotation: DVec3,
    axes: DMat3,
    window: Extent,
    window_centre_mm: DVec2,
}

impl Receiver {
    /// A plane across the axis, at a distance from the mean exit plane, mm, with a window about the
    /// axis.
    pub fn new(distance_mm: f64, window: Extent) -> Self {
        Self { distance_mm, rotation: DVec3::ZERO, axes: DMat3::IDENTITY, window, window_centre_mm: DVec2::ZERO }
    }

    /// The same plane with another window, by its size and its centre in the plane's coordinates,
    /// mm.
    #[must_use]
    pub fn with_window(self, window: Extent, centre_mm: DVec2) -> Self {
        Self { window, window_centre_mm: centre_mm, ..self }
    }

    /// The same plane, turned to a rotation vector, radians.
    #[must_use]
    pub fn turned(self, rotation: DVec3) -> Self {
        Self { rotation, axes: DMat3::from_quat(DQuat::from_scaled_axis(rotation)), ..self }
    }

    /// Along the axis, from the mean exit plane, mm.
    pub fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// Size of the window.
    pub fn window(&self) -> Extent {
        self.window
    }

    /// Centre of the window in the plane's coordinates, mm.
    pub fn window_centre_mm(&self) -> DVec2 {
        self.window_centre_mm
    }

    /// How it is turned: a rotation vector, radians.
    pub fn rotation(&self) -> DVec3 {
        self.rotation
    }

    /// The directions of its coordinates and of its normal, which points away from the block: `R`.
    pub fn axes(&self) -> DMat3 {
        self.axes
    }

    /// Whether it leans.
    pub fn is_turned(&self) -> bool {
        self.rotation != DVec3::ZERO
    }

    /// The point of the bench at the place `y`, mm.
    #[inline(always)]
    pub fn point(&self, y: DVec2) -> DVec3 {
        let at = self.axes.x_axis * y.x + self.axes.y_axis * y.y;
        DVec3::new(at.x, at.y, at.z + self.distance_mm)
    }

    /// How far in front of the plane a point lies, mm.
    #[inline(always)]
    pub fn gap_mm(&self, point: DVec3) -> f64 {
        self.axes.z_axis.dot(DVec3::new(-point.x, -point.y, self.distance_mm - point.z))
    }

    /// Least gap of a block of this size whose face rises to `height_mm` everywhere, mm.
    pub fn clearance_mm(&self, block: Extent, height_mm: f64) -> f64 {
        (0..4).map(|k| self.gap_mm(block.node(k % 2, k / 2, 2, 2).extend(height_mm))).fold(f64::INFINITY, f64::min)
    }

    /// Where a ray lands, in the plane's coordinates, mm; not finite if it goes away from the
    /// plane.
    #[inline(always)]
    pub fn landing(&self, from: DVec3, direction: DVec3) -> DVec2 {
        let towards = self.axes.z_axis.dot(direction);
        if towards.is_nan() || towards <= 0.0 {
            return DVec2::NAN;
        }
        let at = from + direction * (self.gap_mm(from) / towards) - DVec3::new(0.0, 0.0, self.distance_mm);
        DVec2::new(self.axes.x_axis.dot(at), self.axes.y_axis.dot(at))
    }
}
