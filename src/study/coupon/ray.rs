//! The way of a single ray from the lamp to the sheet.

use super::plan::CouponPlan;
use crate::surface::{HeightField, SurfaceSpline};
use glam::{DVec2, DVec3};

/// The way of a ray from the lamp through a place of the face to the sheet.
#[derive(Clone, Debug)]
pub(super) struct Ray {
    spline: SurfaceSpline,
    lamp: DVec3,
    entry_z_mm: f64,
    distance_mm: f64,
}

impl Ray {
    pub(super) fn of(plan: &CouponPlan, surface: &HeightField, entry_z_mm: f64) -> Self {
        Self {
            spline: SurfaceSpline::through(surface),
            lamp: DVec3::Z * (entry_z_mm - plan.lamp_mm),
            entry_z_mm,
            distance_mm: plan.distance_mm + entry_z_mm,
        }
    }

    /// The same with the sheet further away.
    pub(super) fn further(&self, by_mm: f64) -> Self {
        Self { distance_mm: self.distance_mm + by_mm, ..self.clone() }
    }

    /// Where the light of a place of the face lands, mm, if the face had this slope besides its
    /// own.
    pub(super) fn landing(&self, at: DVec2, slope: DVec2, ior: f64) -> DVec2 {
        let sample = self.spline.sample(at);
        self.from(at.extend(sample.height_mm), sample.slope + slope, ior)
    }

    /// The same of the face without its slope along x.
    pub(super) fn plain_landing(&self, at: DVec2, ior: f64) -> DVec2 {
        let sample = self.spline.sample(at);
        self.from(at.extend(sample.height_mm), sample.slope * DVec2::Y, ior)
    }

    fn from(&self, exit: DVec3, slope: DVec2, ior: f64) -> DVec2 {
        // Where the ray enters is found from where it leaves.
        let mut entry = exit.truncate();
        let mut inside = DVec3::Z;
        for _ in 0..8 {
            let before = (entry.extend(self.entry_z_mm) - self.lamp).normalize();
            inside = refracted(before, DVec3::Z, 1.0 / ior);
            entry = exit.truncate() - inside.truncate() * ((exit.z - self.entry_z_mm) / inside.z);
        }
        let after = refracted(inside, (-slope).extend(1.0).normalize(), ior);
        exit.truncate() + after.truncate() * ((self.distance_mm - exit.z) / after.z)
    }
}

/// Snell's law in vectors; `eta` is the quotient of the indices before and behind. Total
/// reflection, which no coupon comes near, goes on along the face.
fn refracted(ray: DVec3, normal: DVec3, eta: f64) -> DVec3 {
    let cos = ray.dot(normal);
    let square = 1.0 - eta * eta * (1.0 - cos * cos);
    eta * ray + (square.max(1e-6).sqrt() - eta * cos) * normal
}
