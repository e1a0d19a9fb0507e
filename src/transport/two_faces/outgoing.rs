//! The light in air before the first receiver, as a congruence of rays that is known from its phase
//! there.
//!
//! The ray through the point `X = (x, h)` meets the receiver, at `z = D`, in the root `y` of
//!
//! ```text
//! y - (D - h) s(y) / c(y) = x,      s = grad phi,      W(X) = phi(y) - (D - h) / c,      grad W = (s, c)
//! ```
//!
//! With `H` the second derivatives of `phi`, `G = I / c + s (x) s / c^3` and `J = dx/dy = I - (D - h) G
//! H`, the wave bends by `S = ds/dx = H J^-1` and `ds/dh = -S s / c`, and its irradiance on the plane
//! through `X` across the axis is that on the receiver over `det J`.

use super::{film::Film, margins::narrowest};
use crate::{
    light::outer,
    transport::{map::Jet, spline::PathSpline},
};
use glam::{DMat2, DVec2};

/// The congruence; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct Outgoing<'a> {
    /// `phi`, mm.
    pub(super) phase: &'a PathSpline,
    /// What the first receiver shall show.
    pub(super) first: &'a Film,
    /// `D`, mm.
    pub(super) distance_mm: f64,
}

/// The ray through a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaving {
    /// Its position on the receiver, mm.
    pub(super) at: DVec2,
    x: DVec2,
    pub(super) s: DVec2,
    pub(super) c: f64,
    /// `W`, mm.
    pub(super) phase_mm: f64,
    /// `S`, 1/mm.
    pub(super) bend: DMat2,
    /// `J^-1`.
    inverse: DMat2,
    /// Irradiance on a plane across the axis, of which that on the receiver has the mean 1.
    pub(super) irradiance: f64,
}

/// Most Newton steps for the position of a ray.
const STEPS: usize = 20;
/// Steps that detail may mislead, which are held back.
const FREE_STEPS: usize = 8;
/// How close two positions are, mm, for the parabola of the phase to lead from one to the other: with
/// details of a tenth of a millimetre it is off by 1e-10 in direction.
const NEAR_MM: f64 = 1e-4;
/// Cosine of the flattest ray.
const LEAST_COSINE: f64 = 0.1;
/// Least `det J`: light that is gathered more than so has nearly a focus before the receiver.
const LEAST_STRETCH: f64 = 1e-3;

impl Outgoing<'_> {
    /// The ray through a point; none where no light can be, or where it crosses itself before the
    /// receiver. Found sooner from one nearby.
    #[inline]
    pub(super) fn through(&self, x: DVec2, h: f64, nearby: Option<&Leaving>) -> Option<Leaving> {
        let to_mm = self.distance_mm - h;
        let mut at = nearby.map_or(x, |nearby| nearby.towards(x, to_mm));
        for step in 0..STEPS {
            let ray = self.from(at, to_mm)?;
            let miss = at - ray.s * (to_mm / ray.c) - x;
            let change = ray.inverse * miss;
            if change.length_squared() < NEAR_MM * NEAR_MM {
                return Some(self.along_parabola(&ray, change, x));
            }
            at -= if step < FREE_STEPS { change.clamp_length_max(0.1 * to_mm) } else { 0.5 * change };
        }
        None
    }

    /// The ray that meets the receiver at a point, so far before it.
    #[inline(always)]
    fn from(&self, at: DVec2, to_mm: f64) -> Option<Leaving> {
        let jet = self.phase.jet_beyond(self.phase.grid.position(at));
        let s = jet.slope;
        let c2 = 1.0 - s.length_squared();
        let c = c2.sqrt();
        let hessian = jet.hessian();
        let stretch = stretch(&jet, to_mm);
        let determinant = stretch.determinant();
        let forward = determinant > LEAST_STRETCH && stretch.x_axis.x + stretch.y_axis.y > 0.0;
        // False, too, where it is not a number.
        if !(c2 > LEAST_COSINE * LEAST_COSINE && forward) {
            return None;
        }
        let inverse = stretch.inverse();
        Some(Leaving {
            at,
            x: at - s * (to_mm / c),
            s,
            c,
            phase_mm: jet.value - to_mm / c,
            bend: hessian * inverse,
            inverse,
            irradiance: self.first.at(at) / determinant,
        })
    }

    /// The ray through `x` that meets the receiver at `change` before another one.
    #[inline(always)]
    fn along_parabola(&self, ray: &Leaving, change: DVec2, x: DVec2) -> Leaving {
        // grad W and its derivatives at the other one's point lead to this one.
        let aside = x - ray.x;
        let turned = ray.bend * aside;
        let s = ray.s + turned;
        let c = (1.0 - s.length_squared()).sqrt();
        Leaving {
            at: ray.at - change,
            x,
            s,
            c,
            phase_mm: ray.phase_mm + ray.s.dot(aside) + 0.5 * turned.dot(aside),
            ..*ray
        }
    }

    /// Nearly the ray through the point `(x, h)`, from one nearby: its position on the receiver is right
    /// to first order.
    #[inline(always)]
    pub(super) fn shifted(&self, nearby: &Leaving, x: DVec2, h: f64) -> Option<Leaving> {
        let to_mm = self.distance_mm - h;
        self.from(nearby.towards(x, to_mm), to_mm)
    }
}

/// `J` for the phase on the receiver, so far before it.
#[inline(always)]
pub(super) fn stretch(phase: &Jet, to_mm: f64) -> DMat2 {
    let s = phase.slope;
    let c = (1.0 - s.length_squared()).sqrt();
    let lever = DMat2::from_diagonal(DVec2::splat(1.0 / c)) + outer(s, s) * (1.0 / (c * c * c));
    DMat2::IDENTITY - lever * phase.hessian() * to_mm
}

impl Leaving {
    /// The narrowest stretch of the light from here to the receiver.
    pub(super) fn narrowest(&self) -> f64 {
        narrowest(self.inverse.inverse())
    }

    /// The position on the receiver of the ray through `x`, so far before it, to first order.
    #[inline(always)]
    fn towards(&self, x: DVec2, to_mm: f64) -> DVec2 {
        self.at + self.inverse * (x + self.s * (to_mm / self.c) - self.at)
    }
}
