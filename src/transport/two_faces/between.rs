//! Light between two receivers in air: from a phase on the first to the map of that onto the second.
//!
//! With the phase `phi(y)` of the light on the window of the first receiver, `s = grad phi` and `c =
//! sqrt(1 - |s|^2)`, the ray through `y` meets the second one, `L` behind, at
//!
//! ```text
//! y2 = y + L s / c,      dy2/dy = I + L G grad grad phi,      G = I / c + s (x) s / c^3
//! ```
//!
//! and carries the light of the first picture to that of the second where `det dy2/dy = f_1(y) /
//! f_2(y2)`. The border of the first window goes to that of the second.

use super::film::Film;
use crate::{
    light::outer,
    transport::map::{Jet, Map},
};
use glam::{DMat2, DVec2};

/// From the window of the first receiver to that of the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between<'a> {
    /// From the first receiver to the second, mm.
    pub(super) gap_mm: f64,
    /// What the second shall show.
    pub(super) second: &'a Film,
}

/// The ray through a point of the first receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    s: DVec2,
    c: f64,
    at: DVec2,
}

/// Cosine of the flattest ray.
const LEAST_COSINE: f64 = 0.1;

impl Between<'_> {
    /// `L G`.
    #[inline(always)]
    fn lever(&self, s: DVec2, c: f64) -> DMat2 {
        (DMat2::from_diagonal(DVec2::splat(1.0 / c)) + outer(s, s) * (1.0 / (c * c * c))) * self.gap_mm
    }

    /// `sum_ij w_ij A_ij + of_light ln g` for the ray with another direction.
    #[inline(always)]
    fn turned(&self, s: DVec2, ray: &Ray, hessian: &DMat2, w: &DMat2, of_light: f64) -> f64 {
        let c = (1.0 - s.length_squared()).max(LEAST_COSINE * LEAST_COSINE).sqrt();
        let a = self.lever(s, c) * *hessian;
        let at = ray.at + (s / c - ray.s / ray.c) * self.gap_mm;
        w.x_axis.dot(a.x_axis) + w.y_axis.dot(a.y_axis) - of_light * self.second.at(at).ln()
    }
}

impl Map for Between<'_> {
    type Ray = Ray;
    type Label = f64;

    #[inline(always)]
    fn ray(&self, y: DVec2, _: f64, slope: DVec2, _: Option<&Ray>) -> Option<Ray> {
        let c2 = 1.0 - slope.length_squared();
        (c2 > LEAST_COSINE * LEAST_COSINE).then(|| {
            let c = c2.sqrt();
            Ray { s: slope, c, at: y + slope * (self.gap_mm / c) }
        })
    }

    #[inline(always)]
    fn point(&self, _: DVec2, ray: &Ray) -> DVec2 {
        ray.at
    }

    fn point_variation(&self, ray: &Ray, along: DVec2) -> [f64; 3] {
        let by_slope = self.lever(ray.s, ray.c) * along;
        [0.0, by_slope.x, by_slope.y]
    }

    #[inline(always)]
    fn label(&self, ray: &Ray) -> f64 {
        1.0 / self.second.at(ray.at)
    }

    #[inline(always)]
    fn jacobian(&self, ray: &Ray, jet: &Jet, _: &f64) -> DMat2 {
        DMat2::IDENTITY + self.lever(ray.s, ray.c) * jet.hessian()
    }

    #[inline(always)]
    fn gain(&self, _: &Ray, label: &f64) -> f64 {
        *label
    }

    /// By differences over a cell of the second picture: what is between its nodes has no better
    /// derivative.
    #[inline(always)]
    fn variation(&self, ray: &Ray, jet: &Jet, _: &f64, w: DMat2, of_light: f64) -> [f64; 6] {
        let lever = self.lever(ray.s, ray.c);
        let of_h = lever.transpose() * w;
        let hessian = jet.hessian();
        let step = 0.5 * self.second.spacing() / self.gap_mm;
        let by = |step: DVec2| {
            let [more, less] = [ray.s + step, ray.s - step].map(|s| self.turned(s, ray, &hessian, &w, of_light));
            (more - less) / (2.0 * (step.x + step.y))
        };
        let [x, y] = [DVec2::new(step.x, 0.0), DVec2::new(0.0, step.y)].map(by);
        [0.0, x, y, of_h.x_axis.x, of_h.x_axis.y + of_h.y_axis.x, of_h.y_axis.y]
    }

    /// A constant moves nothing.
    #[inline(always)]
    fn height(&self, _: DVec2, _: &Ray) -> (f64, f64) {
        (0.0, 1.0)
    }

    #[inline(always)]
    fn area(&self, _: &Ray, _: &Jet, _: f64) -> f64 {
        1.0
    }

    fn distance_mm(&self) -> f64 {
        self.gap_mm
    }
}
