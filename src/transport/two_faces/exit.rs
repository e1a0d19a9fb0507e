//! From the exit face to the entry face: where light that leaves the block as the two pictures want
//! it enters that.
//!
//! The unknown is the exit face itself, `h(x)`: the light behind it is known in space
//! ([`Outgoing`]), so that nothing of third order occurs. With `p = grad h` the phase along the face
//! is `q = s + c p`, which the light in glass has too: its direction times the index is `(q - w p, w)`
//! with
//!
//! ```text
//! w = (q.p + r) / (1 + p^2),      r^2 = (q.p)^2 - (1 + p^2)(q^2 - n^2)
//! ```
//!
//! Light that travels along the axis has the phase `z + t` before it enters; after `k` more in glass it
//! is that of the point `X = (x, h)`, so that
//!
//! ```text
//! k = (W - h) / (n - w/n),      T = x - k (q - w p)/n,      det dT/dx = E (1 - s.p/c)
//! ```
//!
//! with `W` up to the constant that makes the block as thick as it shall be, `E` the irradiance on the
//! plane through `X`, and areas in units of the block's and the window's.
//!
//! # Windows of different size
//!
//! The outermost rays go from the border of the first window to that of the second, so that the lit
//! part of the face at height `h` is `1 + beta h` times as large as that at 0 along each axis. The
//! unknown is a function on the latter: `h(xi)`, `x = (1 + beta h) xi`. With `g` its gradient,
//!
//! ```text
//! p = g / ((1 + beta h) N),    N = 1 + sum xi beta g / (1 + beta h),    det dx/dxi = N prod (1 + beta h)
//! ```

use super::{
    margins::Margins,
    outgoing::{Leaving, Outgoing},
};
use crate::{
    light::outer,
    transport::map::{Face, Jet, Map},
};
use glam::{DMat2, DVec2};

/// From the exit face to the entry face; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct Exit<'a> {
    pub(super) outgoing: Outgoing<'a>,
    /// Index of the glass.
    pub(super) ior: f64,
    /// What is added to the phase so that the mean of the entry face lies as far before that of the
    /// exit face as it shall, mm.
    pub(super) constant_mm: f64,
    pub(super) spread: Spread,
}

/// How the lit part of the exit face grows with height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// `beta`, 1/mm.
    pub(super) beta: DVec2,
    /// Area of the lit part at the mean height over that of the first window.
    pub(super) share: f64,
}

/// A place of the face, and how it and the slope there follow the unknown.
#[derive(Clone, Copy, Debug)]
struct Place {
    x: DVec2,
    /// `1 + beta h`.
    growth: DVec2,
    /// `N`.
    tilt: f64,
    xi: DVec2,
    g: DVec2,
    p: DVec2,
}

impl Spread {
    #[inline(always)]
    fn place(&self, xi: DVec2, h: f64, g: DVec2) -> Place {
        let growth = DVec2::ONE + self.beta * h;
        let tilt = 1.0 + (xi * self.beta).dot(g / growth);
        Place { x: xi * growth, growth, tilt, xi, g, p: g / growth / tilt }
    }

    /// `dx/dxi` along the face.
    #[inline(always)]
    fn along_face(&self, at: &Place) -> DMat2 {
        DMat2::from_diagonal(at.growth) + outer(self.beta * at.xi, at.g)
    }

    /// Derivatives by the unknown's place, value and slope of what has these by `x`, `h` and `p`.
    #[inline(always)]
    fn follow(&self, at: &Place, by: &Partial) -> Partial {
        let Place { growth, tilt, xi, g, p, .. } = *at;
        let of_xi = self.beta * g / growth;
        let of_h = -(xi * self.beta * self.beta).dot(g / (growth * growth));
        let of_g = self.beta * xi / growth;
        let p_h = -p * (self.beta / growth + of_h / tilt);
        Partial {
            by_x: by.by_x * DMat2::from_diagonal(growth) + by.by_p * outer(-p / tilt, of_xi),
            by_h: by.by_x * (self.beta * xi) + by.by_h + by.by_p * p_h,
            by_p: by.by_p * (DMat2::from_diagonal(1.0 / (growth * tilt)) - outer(p / tilt, of_g)),
        }
    }
}

/// The ray that leaves at a point of the exit face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    h: f64,
    at: Place,
    leaving: Leaving,
    glass: Glass,
}

/// The same before the face.
#[derive(Clone, Copy, Debug)]
struct Glass {
    p: DVec2,
    /// `q - w p`.
    g: DVec2,
    w: f64,
    /// `r`.
    root: f64,
    /// `n - w/n`.
    delay: f64,
    /// `k`, mm.
    length: f64,
    /// `1 - s.p/c`.
    flux: f64,
}

/// First derivatives of the entry point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partial {
    by_x: DMat2,
    by_h: DVec2,
    by_p: DMat2,
}

/// Squared cosine of the flattest ray that leaves, with the normal of the face.
const GRAZING: f64 = 0.02;
/// Step of differences by slopes.
const SLOPE_STEP: f64 = 1e-4;
/// Greatest step of differences by the height, as a share of the distance.
const MOST_HEIGHT_STEP: f64 = 1e-3;

impl Exit<'_> {
    /// The path of the light up to the face, mm.
    #[inline(always)]
    fn path_mm(&self, leaving: &Leaving) -> f64 {
        leaving.phase_mm + self.constant_mm
    }

    /// The light in glass before a face of slope `p`; none if it would not leave there, or not come
    /// from before.
    #[inline(always)]
    fn glass(&self, leaving: &Leaving, h: f64, p: DVec2) -> Option<Glass> {
        let Leaving { s, c, .. } = *leaving;
        let n = self.ior;
        let steep = 1.0 + p.length_squared();
        let up = c - s.dot(p);
        let q = s + p * c;
        let qp = q.dot(p);
        let root = (qp * qp - steep * (q.length_squared() - n * n)).sqrt();
        let w = (qp + root) / steep;
        let delay = n - w / n;
        let length = (self.path_mm(leaving) - h) / delay;
        let real = up > 0.0 && up * up > GRAZING * steep && length > 0.0;
        real.then(|| Glass { p, g: q - p * w, w, root, delay, length, flux: up / c })
    }

    #[inline(always)]
    fn entry(&self, x: DVec2, glass: &Glass) -> DVec2 {
        x - glass.g * (glass.length / self.ior)
    }

    /// The change of the entry point with those of `x`, `s` and `c`, the path, `h` and `p`.
    #[inline(always)]
    fn change(&self, leaving: &Leaving, glass: &Glass, d: Change) -> DVec2 {
        let Glass { p, g, w, root, delay, length, .. } = *glass;
        let n = self.ior;
        let dq = d.s + p * d.c + d.p * leaving.c;
        let dw = (w * g.dot(d.p) - g.dot(dq)) / root;
        let dk = (d.path - d.h + length * dw / n) / delay;
        let dg = dq - d.p * w - p * dw;
        d.x - (g * dk + dg * length) / n
    }

    /// First derivatives of the entry point by the unknown's place, value and slope.
    #[inline(always)]
    fn partial(&self, at: &Place, leaving: &Leaving, glass: &Glass) -> Partial {
        let Leaving { s, c, bend, .. } = *leaving;
        let along = |x: DVec2| {
            let ds = bend * x;
            self.change(leaving, glass, Change { x, s: ds, c: -s.dot(ds) / c, path: s.dot(x), ..Change::default() })
        };
        let by_p = |p: DVec2| self.change(leaving, glass, Change { p, ..Change::default() });
        let ds = bend * s * (-1.0 / c);
        let by_h =
            self.change(leaving, glass, Change { s: ds, c: -s.dot(ds) / c, path: c, h: 1.0, ..Change::default() });
        let by = Partial {
            by_x: DMat2::from_cols(along(DVec2::X), along(DVec2::Y)),
            by_h,
            by_p: DMat2::from_cols(by_p(DVec2::X), by_p(DVec2::Y)),
        };
        self.spread.follow(at, &by)
    }

    /// The light that a node shall send on.
    #[inline(always)]
    fn light(&self, at: &Place, leaving: &Leaving, glass: &Glass) -> f64 {
        leaving.irradiance * glass.flux * self.spread.share * at.tilt * at.growth.element_product()
    }

    /// Where a ray lands on the first receiver, mm.
    #[cfg(test)]
    pub(super) fn landing(&self, ray: &Ray) -> DVec2 {
        ray.leaving.at
    }

    /// What a ray leaves of what is possible.
    pub(super) fn margins(&self, ray: &Ray) -> Margins {
        Margins { stretch: ray.leaving.narrowest(), slope: ray.at.p.length(), highest_mm: ray.h }
    }

    /// `sum_ij w_ij A_ij + of_light ln g` of a ray.
    #[inline(always)]
    fn weighed(
        &self,
        at: &Place,
        leaving: &Leaving,
        glass: &Glass,
        hessian: &DMat2,
        (w, of_light): (&DMat2, f64),
    ) -> f64 {
        let a = self.partial(at, leaving, glass).jacobian(at.g, hessian);
        w.x_axis.dot(a.x_axis) + w.y_axis.dot(a.y_axis) + of_light * self.light(at, leaving, glass).ln()
    }

    /// The height over `x` of the entry face that sends all of its light to the point of the exit face
    /// at `from`: the Cartesian oval through `x`. From `z + n |X - (x, z)| = W`.
    #[inline(always)]
    fn oval(&self, x: DVec2, from: DVec2, h: f64, leaving: &Leaving) -> f64 {
        let n = self.ior;
        let (path, aside) = (self.path_mm(leaving) - h, from.distance_squared(x));
        let delay = n * n - 1.0;
        // (h - z) of the root that lies before the exit face.
        let below = (path + (path * path - delay * (n * n * aside - path * path)).sqrt()) / delay;
        h - below
    }
}

impl Face for Exit<'_> {
    #[inline(always)]
    fn point_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        self.jacobian(ray, jet, &self.label(ray))
    }

    #[inline(always)]
    fn oval_height(&self, x: DVec2, xi: DVec2, h: f64, ray: Option<&Ray>) -> f64 {
        let from = self.spread.place(xi, h, DVec2::ZERO).x;
        let leaving = match ray {
            Some(ray) => Some(ray.leaving),
            None => self.outgoing.through(from, h, None),
        };
        leaving.map_or(f64::NAN, |leaving| self.oval(x, from, h, &leaving))
    }

    /// From `z + n |X - (x, z)| - W(X) = 0`, `X` along the face.
    #[inline(always)]
    fn oval_gradient(&self, x: DVec2, _: DVec2, height_mm: f64, ray: &Ray) -> DVec2 {
        let to = (ray.at.x - x).extend(ray.h - height_mm).normalize() * self.ior;
        let p = ray.at.p;
        let along_face = ray.leaving.s + p * ray.leaving.c;
        let by_x = (to.truncate() + p * to.z - along_face) / (to.z - 1.0);
        self.spread.along_face(&ray.at).transpose() * by_x
    }

    /// Light takes the shortest way: the lower one.
    #[inline(always)]
    fn forms_face(&self, height: f64, other: f64) -> bool {
        height < other
    }
}

/// Changes of what the entry point depends on.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    x: DVec2,
    s: DVec2,
    c: f64,
    path: f64,
    h: f64,
    p: DVec2,
}

impl Partial {
    /// `dT/dxi` along the face.
    #[inline(always)]
    fn jacobian(&self, g: DVec2, hessian: &DMat2) -> DMat2 {
        self.by_x + outer(self.by_h, g) + self.by_p * *hessian
    }
}

impl Map for Exit<'_> {
    type Ray = Ray;
    type Label = Partial;

    #[inline(always)]
    fn ray(&self, xi: DVec2, h: f64, g: DVec2, nearby: Option<&Ray>) -> Option<Ray> {
        let at = self.spread.place(xi, h, g);
        let leaving = self.outgoing.through(at.x, h, nearby.map(|ray| &ray.leaving))?;
        let glass = self.glass(&leaving, h, at.p)?;
        Some(Ray { h, at, leaving, glass })
    }

    #[inline(always)]
    fn point(&self, _: DVec2, ray: &Ray) -> DVec2 {
        self.entry(ray.at.x, &ray.glass)
    }

    fn point_variation(&self, ray: &Ray, along: DVec2) -> [f64; 3] {
        let partial = self.partial(&ray.at, &ray.leaving, &ray.glass);
        let by_p = partial.by_p.transpose() * along;
        [partial.by_h.dot(along), by_p.x, by_p.y]
    }

    #[inline(always)]
    fn label(&self, ray: &Ray) -> Partial {
        self.partial(&ray.at, &ray.leaving, &ray.glass)
    }

    #[inline(always)]
    fn jacobian(&self, ray: &Ray, jet: &Jet, partial: &Partial) -> DMat2 {
        partial.jacobian(ray.at.g, &jet.hessian())
    }

    #[inline(always)]
    fn gain(&self, ray: &Ray, _: &Partial) -> f64 {
        self.light(&ray.at, &ray.leaving, &ray.glass)
    }

    /// By differences, but for the second derivatives: over half of a cell of the first picture for
    /// what follows the height.
    #[inline(always)]
    fn variation(&self, ray: &Ray, jet: &Jet, partial: &Partial, w: DMat2, of_light: f64) -> [f64; 6] {
        let Ray { h, at, leaving, .. } = ray;
        let hessian = jet.hessian();
        let of_h = partial.by_p.transpose() * w;
        let weights = (&w, of_light);
        let by_slope = |step: DVec2| {
            let side = |g: DVec2| {
                let at = self.spread.place(at.xi, *h, g);
                Some(self.weighed(&at, leaving, &self.glass(leaving, *h, at.p)?, &hessian, weights))
            };
            match (side(at.g + step), side(at.g - step)) {
                (Some(more), Some(less)) => (more - less) / (2.0 * (step.x + step.y)),
                _ => 0.0,
            }
        };
        let moved = (leaving.s.length() / leaving.c).max(1e-3);
        let step = (0.5 * self.outgoing.first.spacing().min_element() / moved)
            .min(MOST_HEIGHT_STEP * self.outgoing.distance_mm);
        let side = |step: f64| {
            let at = self.spread.place(at.xi, h + step, at.g);
            let leaving = self.outgoing.shifted(leaving, at.x, h + step)?;
            Some(self.weighed(&at, &leaving, &self.glass(&leaving, h + step, at.p)?, &hessian, weights))
        };
        let by_height = match (side(step), side(-step)) {
            (Some(more), Some(less)) => (more - less) / (2.0 * step),
            _ => 0.0,
        };
        [
            by_height,
            by_slope(DVec2::new(SLOPE_STEP, 0.0)),
            by_slope(DVec2::new(0.0, SLOPE_STEP)),
            of_h.x_axis.x,
            of_h.x_axis.y + of_h.y_axis.x,
            of_h.y_axis.y,
        ]
    }

    #[inline(always)]
    fn height(&self, _: DVec2, ray: &Ray) -> (f64, f64) {
        (ray.h, 1.0)
    }

    #[inline(always)]
    fn area(&self, _: &Ray, _: &Jet, _: f64) -> f64 {
        1.0
    }

    fn distance_mm(&self) -> f64 {
        self.outgoing.distance_mm
    }
}
