//! The relation in light that is not parallel: what has no closed form, and the derivatives that
//! parallel light lacks.

use super::relation::{Arrived, CurvedLight, CurvedRay, OpticalPath, Ray, bend};
use crate::light::{Congruence, Label, PointWave};
use crate::transport::map::Jet;
use glam::{DMat2, DVec2, DVec3};

/// The light that a flat face sends to a point of the receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatRay {
    /// The part of its direction along the receiver.
    pub(super) along: DVec2,
    /// Second derivatives of `b_flat` along the receiver, 1/mm.
    bend: DMat2,
    /// `b_flat`, up to the constant of the phase, less the distance of the receiver.
    phase_mm: f64,
}

/// Most Newton steps for the length of a ray or the height of an oval.
const STEPS: usize = 30;

impl OpticalPath<'_> {
    /// The reference: the light behind a flat face. That of a source is again that of a source, behind
    /// a plate; of light that has passed known faces it is that of its middle, parallel.
    pub(super) fn flat_from(&self, light: &CurvedLight<'_>, y: DVec2) -> Option<FlatRay> {
        match &light.congruence {
            Congruence::Point(wave) => self.flat_from_point(wave, y),
            Congruence::Passed(_) => {
                Some(FlatRay { along: self.flat_tangential, bend: DMat2::ZERO, phase_mm: self.flat_tangential.dot(y) })
            }
        }
    }

    #[inline(always)]
    fn flat_from_point(&self, wave: &PointWave, y: DVec2) -> Option<FlatRay> {
        let to = self.receiver.point(y);
        let wave = wave.continued(to.z);
        let flat = wave.at(to.truncate(), 0.0)?;
        let axes = self.receiver.axes();
        let phase_mm = flat.phase_mm + (to.z - self.receiver.distance_mm());
        let bend = wave.bend(&flat);
        if !self.receiver.is_turned() {
            return Some(FlatRay { along: flat.tangential, bend, phase_mm });
        }
        // In air the gradient of the phase is a unit vector e, so that its second derivatives
        // vanish along it. For any v they are those of the tangential part of v - e v_z / e_z.
        let e = flat.tangential.extend((1.0 - flat.tangential.length_squared()).sqrt());
        let sheared = |v: DVec3| v.truncate() - e.truncate() * (v.z / e.z);
        let sheared = DMat2::from_cols(sheared(axes.x_axis), sheared(axes.y_axis));
        Some(FlatRay { along: self.along(e), bend: sheared.transpose() * bend * sheared, phase_mm })
    }

    /// [`OpticalPath::ray`] in light that is not parallel. Along a straight line `W + l` is
    /// convex, and on real rays monotone: Newton's iteration for `l` cannot miss.
    pub(super) fn ray_from(&self, light: &CurvedLight<'_>, y: DVec2, u: f64, slope: DVec2) -> Option<Ray> {
        let flat = self.flat_from(light, y)?;
        let s = flat.along + self.kappa * slope;
        let c2 = 1.0 - s.length_squared();
        // False, too, where it is not a number.
        let forward = c2 > 1e-6;
        if !forward {
            return None;
        }
        let c = c2.sqrt();
        let (to, direction) = (self.receiver.point(y), self.direction(s, c));
        let path = flat.phase_mm + self.kappa * u;
        let distance_mm = self.receiver.distance_mm();
        let mut length = distance_mm / c;
        let mut nearby = None;
        for _ in 0..STEPS {
            let from = to - direction * length;
            let arrival = light.congruence.near(from.truncate(), from.z, nearby.as_ref())?;
            let incident = arrival.incident();
            let q = incident.dot(direction) - 1.0;
            let refracted = q * self.kappa > 1e-9;
            if !refracted {
                return None;
            }
            let step = (arrival.phase_mm() + (length - distance_mm) - path) / q;
            length += step;
            if step.abs() <= light.last_mm {
                let arrival = light.congruence.moved(arrival, to - direction * length);
                let incident = arrival.incident();
                let q = incident.dot(direction) - 1.0;
                let arrived = Arrived::new(incident, &self.receiver.axes());
                let curved = Some(CurvedRay { arrival, flat_bend: flat.bend * (1.0 / self.kappa) });
                return (length > 0.0).then_some(Ray { s, c, length, q, arrived, curved });
            }
            nearby = Some(arrival);
        }
        None
    }

    /// [`OpticalPath::footprint_variation`] in light that is not parallel.
    ///
    /// `X` turns `N` by the curvature `K = dm/dX_t` of the wave: `dm = K M (-dl e - l E ds)`, and
    /// as the receiver sees it `dN'_t = M^T dm`. With `N` turn `tilt`, `e`, `E`, `q`, `dq`, `M` and
    /// `B`; `B` also follows the height of `X`.
    pub(super) fn footprint_variation_from(
        &self,
        light: &CurvedLight<'_>,
        of: &CurvedRay,
        (ray, jet): (&Ray, &Jet),
        label: &Label,
        w: DMat2,
    ) -> [f64; 6] {
        let Ray { s, c, length, q, arrived, .. } = *ray;
        let Arrived { tangential: n, axial, tilt, crossing } = arrived;
        let along_receiver = self.crossing_jacobian(ray, jet);
        let (by_place, by_z) = label.variation(w * (crossing * along_receiver).transpose());
        let w = label.matrix().transpose() * w;
        // M follows the tilt on the block, -dtilt (x) lean.
        let (lean, incident) = (self.lean(), of.arrival.incident());
        let block_tilt = incident.truncate() / incident.z;
        let of_block_tilt = -(w * (along_receiver.transpose() * lean));
        let by_m = (of_block_tilt + block_tilt * block_tilt.dot(of_block_tilt)) / incident.z;
        let w = crossing.transpose() * w;
        let h = bend(ray, jet) * self.kappa;
        let g = (n - s) / q + h * self.dl_ds(ray);
        let (e, de) = self.footprint_direction(ray);
        let v = w.transpose() * e;
        let hv = h * v;
        let of_tilt = w * (g * c - h * s * (length / c));
        let of_q = (v.dot(n - s) - length * hv.dot(self.dq_ds(ray))) / (q * q);
        let of_n = (of_tilt + tilt * tilt.dot(of_tilt)) / axial - v / q + e * of_q + de * hv * (length / q);
        let bend_of_light = light.congruence.bend(&of.arrival);
        let of_crossing = crossing.transpose() * (bend_of_light * (crossing * of_n + by_m) + by_place);
        let of_l = -of_crossing.dot(e) - by_z * self.direction(s, c).z;
        let upright = self.receiver.axes().z_axis.z;
        let of_s = self.dl_ds(ray) * of_l
            - (de.transpose() * of_crossing) * length
            - (lean - s * (upright / c)) * (by_z * length);
        let mut variation = self.crossing_variation(ray, jet, w);
        variation[0] -= of_l * self.kappa / q;
        variation[1] += of_s.x * self.kappa;
        variation[2] += of_s.y * self.kappa;
        variation
    }

    /// [`OpticalPath::oval_height`] in light that is not parallel: the root of `W(x, h) + |Y - (x,
    /// h)| = b`, which is convex in `h`.
    pub(super) fn oval_height_from(&self, light: &CurvedLight<'_>, x: DVec2, y: DVec2, u: f64) -> f64 {
        let Some(flat) = self.flat_from(light, y) else { return f64::NAN };
        let (at, distance_mm) = (self.receiver.point(y), self.receiver.distance_mm());
        let path = flat.phase_mm + self.kappa * u;
        let mut height = 0.0;
        let mut nearby = None;
        for _ in 0..STEPS {
            let Some(arrival) = light.congruence.near(x, height, nearby.as_ref()) else { break };
            let to = at - x.extend(height);
            let length = to.length();
            let slope = arrival.incident().z - to.z / length;
            let monotone = slope * self.kappa > 0.0;
            if !monotone {
                break;
            }
            let step = (arrival.phase_mm() + (length - distance_mm) - path) / slope;
            height -= step;
            if step.abs() <= light.last_mm {
                return height;
            }
            nearby = Some(arrival);
        }
        f64::NAN
    }
}
