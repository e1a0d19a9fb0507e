//! What the relation is made of; the equations are in the [module](super).

use crate::{
    bench::{Bench, Receiver},
    light::{Arrival, PointWave, outer},
};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Value and derivatives of the unknown `u` at a point of the receiver, u in mm.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) slope: DVec2,
    /// `u_xx, u_xy, u_yy`.
    pub(crate) curvature: [f64; 3],
}

impl Jet {
    pub(crate) fn hessian(&self) -> DMat2 {
        let [xx, xy, yy] = self.curvature;
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }
}

/// The relation for one bench; see the [module](super).
#[derive(Clone, Copy, Debug)]
pub(crate) struct OpticalPath {
    pub(super) receiver: Receiver,
    /// `N`, and the ray behind a flat face; both in the frame of the bench.
    pub(super) incident: DVec3,
    pub(super) flat: DVec3,
    /// `b = flat . Y + kappa u`: a flat face has `u = 0`.
    pub(super) kappa: f64,
    /// The constants of parallel light, in the frame of the receiver.
    pub(super) constant: Arrived,
    pub(super) flat_tangential: DVec2,
    /// Its light, if it does not come from infinity: then the above, but for `kappa`, is that of
    /// the middle of the face.
    pub(super) point: Option<PointSource>,
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
    pub(super) point: Option<PointRay>,
}

/// The wave of a point source, and how it goes on behind a flat face.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointSource {
    pub(super) wave: PointWave,
    /// Steps of `l` and of heights that are below rounding, mm.
    pub(super) negligible_mm: f64,
}

/// What a ray knows of its source.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointRay {
    pub(super) arrival: Arrival,
    /// Second derivatives of `b_flat`, over kappa.
    pub(super) flat_bend: DMat2,
}

impl PointSource {
    pub(super) fn of(bench: &Bench) -> Option<Self> {
        bench.wave().map(|wave| Self { wave, negligible_mm: 1e-11 * bench.distance_mm() + 1e-14 * wave.reach_mm() })
    }
}

/// Second derivatives of `b` over kappa.
#[inline(always)]
pub(super) fn bend(ray: &Ray, jet: &Jet) -> DMat2 {
    match &ray.point {
        None => jet.hessian(),
        Some(of) => jet.hessian() + of.flat_bend,
    }
}
