//! The wave of light that has passed known faces
//!
//! Within the glass before the structured face light travels straight, so that all of it is known
//! from one plane, `z = 0`: its phase `phi(p)` there, whose gradient `m` is the tangential part of
//! direction times index, and the label `q(p)` of the ray through each point, a coordinate in which
//! equal areas carry equal flux. Both are bicubic splines. The ray through the point `X = (x, z)`
//! crosses the plane at the root `p` of
//!
//! ```text
//! p + z m / N_z = x,     N_z = sqrt(n^2 - |m|^2),     W(X) = phi(p) + z n^2 / N_z,     grad W = N = (m, N_z)
//! ```
//!
//! With `H` the second derivatives of `phi`, `G = I / N_z + m (x) m / N_z^3` and `J = dx/dp = I + z G
//! H`, the wave bends by `dm/dX_t = H J^-1`, and its label, along which nothing changes, follows the
//! point by `B = dq/dX_t = (dq/dp) J^-1`.

use super::wave::outer;
use crate::surface::{SurfaceSample, SurfaceSpline};
use glam::{DMat2, DVec2};

/// The wave behind known faces; see the [module](self).
#[derive(Clone, Debug)]
pub(crate) struct Wavefront {
    /// Of the glass.
    index: f64,
    /// `phi`, mm, 0 in the middle.
    phase: SurfaceSpline,
    /// `q`, mm.
    label: [SurfaceSpline; 2],
}

/// The ray through a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// `p`, mm.
    pub(super) at: DVec2,
    /// How far behind the plane the point is, mm.
    z_mm: f64,
    /// `m`.
    pub(crate) tangential: DVec2,
    /// `N_z`.
    pub(crate) axial: f64,
    /// `W`, mm.
    pub(crate) phase_mm: f64,
    /// `H`, 1/mm.
    hessian: DMat2,
}

/// `B`, and how it follows the point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CarriedLabel {
    matrix: DMat2,
    /// `J^-1`.
    inverse: DMat2,
    /// `G H`.
    spread: DMat2,
    /// Second derivatives of both components of the label on the plane.
    second: [DMat2; 2],
}

/// Most Newton steps for the crossing of a ray.
const STEPS: usize = 20;
/// How close two crossings are, mm, for the parabola of the phase to lead from one to the other: with
/// details of a tenth of a millimetre it is off by 1e-10 in direction.
pub(crate) const NEAR_MM: f64 = 1e-4;
/// Cosine of the steepest ray in glass that is followed.
const LEAST_COSINE: f64 = 0.1;

impl Wavefront {
    pub(super) fn new(index: f64, phase: SurfaceSpline, label: [SurfaceSpline; 2]) -> Self {
        Self { index, phase, label }
    }

    /// The index of the glass that it travels in.
    pub(crate) fn index(&self) -> f64 {
        self.index
    }

    /// The ray through a point; none where no light can be. Found sooner from one nearby.
    pub(crate) fn near(&self, x: DVec2, z: f64, nearby: Option<&Crossing>) -> Option<Crossing> {
        let mut at = nearby.map_or(x, |nearby| {
            let miss = nearby.at + nearby.tangential * (z / nearby.axial) - x;
            nearby.at - stretch(nearby.tangential, nearby.axial, &nearby.hessian, z).inverse() * miss
        });
        for _ in 0..STEPS {
            let SurfaceSample { height_mm: phase, slope: m, curvature } = self.phase.continued(at);
            let axial_2 = self.index * self.index - m.length_squared();
            // False, too, where it is not a number.
            let forward = axial_2 > (LEAST_COSINE * self.index).powi(2);
            if !forward {
                return None;
            }
            let axial = axial_2.sqrt();
            let hessian = symmetric(curvature);
            let miss = at + m * (z / axial) - x;
            let step = stretch(m, axial, &hessian, z).inverse() * miss;
            if miss.length_squared() < NEAR_MM * NEAR_MM {
                return Some(self.along_parabola((at, phase, m, hessian), step, z));
            }
            at -= step;
        }
        None
    }

    /// The ray through a point that is so close to another one's that the parabola of the phase is
    /// exact.
    pub(crate) fn moved(&self, from: &Crossing, x: DVec2, z: f64) -> Crossing {
        let Crossing { at, tangential: m, axial, hessian, .. } = *from;
        let miss = at + m * (z / axial) - x;
        let step = stretch(m, axial, &hessian, z).inverse() * miss;
        let phase = from.phase_mm - from.z_mm * self.index * self.index / axial;
        self.along_parabola((at, phase, m, hessian), step, z)
    }

    /// The ray that crosses the plane at `at - step`.
    fn along_parabola(&self, (at, phase, m, hessian): (DVec2, f64, DVec2, DMat2), step: DVec2, z: f64) -> Crossing {
        let turned = hessian * step;
        let tangential = m - turned;
        let axial = (self.index * self.index - tangential.length_squared()).sqrt();
        let phase_mm = phase - m.dot(step) + 0.5 * turned.dot(step) + z * self.index * self.index / axial;
        Crossing { at: at - step, z_mm: z, tangential, axial, phase_mm, hessian }
    }

    /// `dm/dX_t`, 1/mm.
    pub(crate) fn bend(&self, of: &Crossing) -> DMat2 {
        of.hessian * stretch(of.tangential, of.axial, &of.hessian, of.z_mm).inverse()
    }

    /// The label, mm.
    #[cfg(test)]
    pub(super) fn place_of_label(&self, of: &Crossing) -> DVec2 {
        let [u, v] = [0, 1].map(|k| self.label[k].continued(of.at).height_mm);
        DVec2::new(u, v)
    }

    /// How the label follows the point.
    pub(crate) fn carried_label(&self, of: &Crossing) -> CarriedLabel {
        let [u, v] = [0, 1].map(|k| self.label[k].continued(of.at));
        let by_crossing = DMat2::from_cols(u.slope, v.slope).transpose();
        let inverse = stretch(of.tangential, of.axial, &of.hessian, of.z_mm).inverse();
        CarriedLabel {
            matrix: by_crossing * inverse,
            inverse,
            spread: spread(of.tangential, of.axial) * of.hessian,
            second: [symmetric(u.curvature), symmetric(v.curvature)],
        }
    }
}

impl CarriedLabel {
    /// `B`.
    #[inline(always)]
    pub(crate) fn matrix(&self) -> DMat2 {
        self.matrix
    }

    /// The derivatives of `sum_ij w_ij B_ij` with respect to `X_t`, and to `z` along the ray. How `J`
    /// changes across the ray is left out: it is by the height of the relief over the size of its
    /// details less than what the label does.
    pub(crate) fn variation(&self, w: DMat2) -> (DVec2, f64) {
        let v = w * self.inverse.transpose();
        let rows = v.transpose();
        let by_crossing = self.second[0] * rows.x_axis + self.second[1] * rows.y_axis;
        let along = self.matrix * self.spread * self.inverse;
        let by_z = -(w.x_axis.dot(along.x_axis) + w.y_axis.dot(along.y_axis));
        (self.inverse.transpose() * by_crossing, by_z)
    }
}

/// `J`.
#[inline(always)]
fn stretch(m: DVec2, axial: f64, hessian: &DMat2, z: f64) -> DMat2 {
    DMat2::IDENTITY + spread(m, axial) * *hessian * z
}

/// `G`.
#[inline(always)]
fn spread(m: DVec2, axial: f64) -> DMat2 {
    DMat2::from_diagonal(DVec2::splat(1.0 / axial)) + outer(m, m) * (1.0 / (axial * axial * axial))
}

#[inline(always)]
fn symmetric([xx, xy, yy]: [f64; 3]) -> DMat2 {
    DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
}
