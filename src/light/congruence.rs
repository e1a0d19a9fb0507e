//! Light that is not parallel, as a congruence of rays: through every point goes one, across a
//! phase `W` with `grad W = N`, direction times index, and with a label `F` that measures flux:
//! equal areas of it carry equal flux, and it moves with the point by `dF = B (dX_t - (N_t / N_z)
//! dX_z)`. This is all that the solvers ask of a light.

use super::{
    wave::{Footprint, PointArrival, PointWave},
    wavefront::{CarriedLabel, Crossing, NEAR_MM, Wavefront},
};
use glam::{DMat2, DVec2, DVec3};

/// A congruence; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(crate) enum Congruence<'a> {
    /// Of a point source behind a planar entry face, or before a mirror.
    Point(PointWave),
    /// Of light that has passed known faces.
    Passed(&'a Wavefront),
}

/// The ray through a point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Arrival {
    /// Of a point source.
    Point(PointArrival),
    /// Of light that has passed known faces.
    Passed(Crossing),
}

/// `B` at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Label {
    /// Of a point source, with the wave's bend.
    Point(Footprint, DMat2),
    /// Of light that has passed known faces.
    Passed(CarriedLabel),
}

impl Congruence<'_> {
    /// The ray through a point, mm; none where no light is.
    #[inline(always)]
    pub(crate) fn at(&self, x: DVec2, z: f64) -> Option<Arrival> {
        self.near(x, z, None)
    }

    /// The same, found sooner from the ray through a point nearby.
    pub(crate) fn near(&self, x: DVec2, z: f64, nearby: Option<&Arrival>) -> Option<Arrival> {
        match self {
            Self::Point(wave) => {
                let nearby = match nearby {
                    Some(Arrival::Point(nearby)) => Some(nearby),
                    _ => None,
                };
                wave.near(x, z, nearby).map(Arrival::Point)
            }
            Self::Passed(wave) => {
                let nearby = match nearby {
                    Some(Arrival::Passed(nearby)) => Some(nearby),
                    _ => None,
                };
                wave.near(x, z, nearby).map(Arrival::Passed)
            }
        }
    }

    /// The ray through a point, from that through a point within [`near_mm`](Self::near_mm) of it.
    pub(crate) fn moved(&self, from: Arrival, to: DVec3) -> Arrival {
        match (self, from) {
            (Self::Passed(wave), Arrival::Passed(at)) => Arrival::Passed(wave.moved(&at, to.truncate(), to.z)),
            _ => from,
        }
    }

    /// How close two points are for [`moved`](Self::moved), mm. What is left of a Newton step of that length
    /// along a ray is below rounding.
    pub(crate) fn near_mm(&self, distance_mm: f64) -> f64 {
        match self {
            Self::Point(wave) => 1e-11 * distance_mm + 1e-14 * wave.reach_mm(),
            Self::Passed(_) => NEAR_MM,
        }
    }

    /// `dm/dX_t`: the curvature of the wave's trace on a plane across the axis, 1/mm.
    pub(crate) fn bend(&self, arrival: &Arrival) -> DMat2 {
        match (self, arrival) {
            (Self::Point(wave), Arrival::Point(at)) => wave.bend(at),
            (Self::Passed(wave), Arrival::Passed(at)) => wave.bend(at),
            _ => DMat2::NAN,
        }
    }

    /// How the label follows the point.
    pub(crate) fn label(&self, arrival: &Arrival) -> Option<Label> {
        match (self, arrival) {
            (Self::Point(wave), Arrival::Point(at)) => Some(Label::Point(wave.footprint(at), wave.bend(at))),
            (Self::Passed(wave), Arrival::Passed(at)) => Some(Label::Passed(wave.carried_label(at))),
            _ => None,
        }
    }

    /// The label, mm.
    #[cfg(test)]
    pub(crate) fn place_of_label(&self, arrival: &Arrival) -> DVec2 {
        match (self, arrival) {
            (Self::Point(wave), Arrival::Point(at)) => wave.footprint_place(at),
            (Self::Passed(wave), Arrival::Passed(at)) => wave.place_of_label(at),
            _ => DVec2::NAN,
        }
    }

    /// Of the medium before the structured face.
    #[inline(always)]
    pub(super) fn index(&self) -> f64 {
        match self {
            Self::Point(wave) => wave.index,
            Self::Passed(wave) => wave.index(),
        }
    }
}

impl Arrival {
    /// `N`.
    #[inline(always)]
    pub(crate) fn incident(&self) -> DVec3 {
        match self {
            Self::Point(at) => at.tangential.extend(at.axial),
            Self::Passed(at) => at.tangential.extend(at.axial),
        }
    }

    /// `W`, up to a constant, mm.
    #[inline(always)]
    pub(crate) fn phase_mm(&self) -> f64 {
        match self {
            Self::Point(at) => at.phase_mm,
            Self::Passed(at) => at.phase_mm,
        }
    }
}

impl Label {
    /// `B`.
    pub(crate) fn matrix(&self) -> DMat2 {
        match self {
            Self::Point(footprint, _) => footprint.matrix(),
            Self::Passed(label) => label.matrix(),
        }
    }

    /// Flux per area of a plane across the axis.
    pub(super) fn density(&self) -> f64 {
        match self {
            Self::Point(footprint, _) => footprint.determinant(),
            Self::Passed(label) => label.matrix().determinant().abs(),
        }
    }

    /// The derivatives of `sum_ij w_ij B_ij` with respect to `X_t`, and to `z` along the ray.
    pub(crate) fn variation(&self, w: DMat2) -> (DVec2, f64) {
        match self {
            Self::Point(footprint, bend) => {
                let (by_m, by_z) = footprint.variation(w);
                (*bend * by_m, by_z)
            }
            Self::Passed(label) => label.variation(w),
        }
    }
}
