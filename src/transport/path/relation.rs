//! What the relation is made of; the equations are in the [module](super).

use crate::{
    bench::{Bench, Receiver},
    light::{Arrival, Congruence, outer},
    transport::map::Jet,
};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// The relation for one bench; see the [module](super).
#[derive(Clone, Copy, Debug)]
pub(crate) struct OpticalPath<'a> {
    pub(super) receiver: Receiver,
    /// `N`, and the ray behind a flat face; both in the frame of the bench.
    pub(super) incident: DVec3,
    pub(super) flat: DVec3,
    /// `b = flat . Y + kappa u`: a flat face has `u = 0`.
    pub(super) kappa: f64,
    /// The constants of parallel light, in the frame of the receiver.
    pub(super) constant: Arrived,
    pub(super) flat_tangential: DVec2,
    /// Its light, if it is not parallel: then the above, but for `kappa`, is that of the middle of the
    /// face.
    pub(super) curved: Option<CurvedLight<'a>>,
}

/// The light where a ray leaves the block, in the frame of the receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrived {
    /// `N`: its parts along the receiver and across it.
    pub(super) tangential: DVec2,
    pub(super) axial: f64,
    /// Their quotient: light that is `z` before a plane along the receiver crosses it `tilt z`
    /// further on.
    pub(super) tilt: DVec2,
    /// `M`, from crossings of such a plane to those of the block's plane `z = 0`.
    pub(super) crossing: DMat2,
}

impl Arrived {
    pub(super) fn new(incident: DVec3, axes: &DMat3) -> Self {
        let turned = axes.transpose() * incident;
        let tilt = incident.truncate() / incident.z;
        let crossing = DMat2::from_cols(axes.x_axis.truncate(), axes.y_axis.truncate())
            - outer(tilt, DVec2::new(axes.x_axis.z, axes.y_axis.z));
        Self { tangential: turned.truncate(), axial: turned.z, tilt: turned.truncate() / turned.z, crossing }
    }
}

/// The ray that lands on one point of the receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// Its direction in air: the part along the receiver and that across it.
    pub(super) s: DVec2,
    pub(super) c: f64,
    /// Its length from the block to the receiver, mm.
    pub(super) length: f64,
    pub(super) q: f64,
    /// The light where it leaves the block.
    pub(super) arrived: Arrived,
    pub(super) curved: Option<CurvedRay>,
}

/// Light that is not parallel.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvedLight<'a> {
    pub(super) congruence: Congruence<'a>,
    /// Steps of `l` and of heights behind which there is nothing left to do, mm.
    pub(super) last_mm: f64,
}

/// What a ray knows of its light.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvedRay {
    pub(super) arrival: Arrival,
    /// Second derivatives of `b_flat`, over kappa.
    pub(super) flat_bend: DMat2,
}

impl<'a> CurvedLight<'a> {
    pub(super) fn of(bench: &'a Bench) -> Option<Self> {
        bench.congruence().map(|congruence| Self { congruence, last_mm: congruence.near_mm(bench.distance_mm()) })
    }
}

/// Second derivatives of `b` over kappa.
#[inline(always)]
pub(super) fn bend(ray: &Ray, jet: &Jet) -> DMat2 {
    match &ray.curved {
        None => jet.hessian(),
        Some(of) => jet.hessian() + of.flat_bend,
    }
}
