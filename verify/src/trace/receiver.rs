//! The receiver plane.

use crate::scene::Scene;
use glam::{DMat3, DVec2, DVec3};

/// The plane on which light lands, in the bench's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    distance_mm: f64,
    /// From its own axes to the bench's, where it is turned.
    turned: Option<DMat3>,
}

impl Receiver {
    pub(super) fn of(scene: &Scene) -> Self {
        Self { distance_mm: scene.distance_mm, turned: Scene::rotation(scene.receiver_turned) }
    }

    /// One that is not turned.
    pub(super) fn across_axis(distance_mm: f64) -> Self {
        Self { distance_mm, turned: None }
    }

    /// Where it meets the axis, mm, if it is not turned.
    pub(super) fn distance_across_axis_mm(&self) -> Option<f64> {
        self.turned.is_none().then_some(self.distance_mm)
    }

    /// Where light lands, in the plane's own coordinates; nowhere, if it never comes there from in
    /// front.
    #[inline]
    pub(super) fn landing(&self, point: DVec3, direction: DVec3) -> Option<DVec2> {
        let Some(turned) = self.turned else {
            let t = (self.distance_mm - point.z) / direction.z;
            return (direction.z > 0.0 && t.is_finite()).then(|| (point + direction * t).truncate());
        };
        let from_centre = point - DVec3::new(0.0, 0.0, self.distance_mm);
        let towards = direction.dot(turned.z_axis);
        let t = -from_centre.dot(turned.z_axis) / towards;
        let landing = from_centre + direction * t;
        (towards > 0.0 && t.is_finite() && t >= 0.0)
            .then(|| DVec2::new(landing.dot(turned.x_axis), landing.dot(turned.y_axis)))
    }
}
