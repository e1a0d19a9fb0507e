//! The relation for a point source: what has no closed form, and the derivatives that parallel light lacks.

use super::{Jet, OpticalPath, Ray, bend};
use crate::{
    bench::Bench,
    light::{Arrival, PointWave},
};
use glam::{DMat2, DVec2};

/// The wave of a point source, and how it goes on behind a flat face.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointSource {
    pub(super) wave: PointWave,
    pub(super) flat: PointWave,
    /// Steps of `l` and of heights that are below rounding, mm.
    negligible_mm: f64,
}

/// What a ray knows of its source.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointRay {
    pub(super) arrival: Arrival,
    /// Second derivatives of `b_flat`, over kappa.
    pub(super) flat_bend: DMat2,
}

/// Most Newton steps for the length of a ray or the height of an oval.
const STEPS: usize = 30;

impl PointSource {
    pub(super) fn of(bench: &Bench) -> Option<Self> {
        PointWave::of(bench).map(|wave| Self {
            wave,
            flat: wave.continued(bench.distance_mm()),
            negligible_mm: 1e-11 * bench.distance_mm() + 1e-14 * wave.reach_mm(),
        })
    }
}

impl OpticalPath {
    /// [`OpticalPath::ray`] in the light of a point source. Along a straight line `W + l` is convex, and on real rays
    /// monotone: Newton's iteration for `l` cannot miss.
    pub(super) fn ray_from(&self, point: &PointSource, y: DVec2, u: f64, slope: DVec2) -> Option<Ray> {
        let flat = point.flat.at(y, 0.0)?;
        let s = flat.tangential + self.kappa * slope;
        let c2 = 1.0 - s.length_squared();
        // False, too, where it is not a number.
        let forward = c2 > 1e-6;
        if !forward {
            return None;
        }
        let c = c2.sqrt();
        let path = flat.phase_mm + self.kappa * u;
        let mut length = self.distance_mm / c;
        let mut nearby = None;
        for _ in 0..STEPS {
            let arrival = point.wave.near(y - length * s, self.distance_mm - length * c, nearby.as_ref())?;
            let (tangential, axial) = (arrival.tangential, arrival.axial);
            let q = tangential.dot(s) + axial * c - 1.0;
            let refracted = q * self.kappa > 1e-9;
            if !refracted {
                return None;
            }
            let step = (arrival.phase_mm + (length - self.distance_mm) - path) / q;
            length += step;
            if step.abs() <= point.negligible_mm {
                let flat_bend = point.flat.bend(&flat) * (1.0 / self.kappa);
                let tilt = tangential / axial;
                let point = Some(PointRay { arrival, flat_bend });
                return (length > 0.0).then_some(Ray { s, c, length, q, tangential, axial, tilt, point });
            }
            nearby = Some(arrival);
        }
        None
    }

    /// [`OpticalPath::footprint_variation`] in the light of a point source.
    ///
    /// `X` moves the footprint's direction by `dm = M^-1 (-dl e - l E ds)`, `M^-1 = dm/dX_t`, which turns `N` and with it
    /// `tilt`, `e`, `E`, `q`, `dq` and `B`; `B` also follows the height of `X`.
    pub(super) fn footprint_variation_from(
        &self,
        point: &PointSource,
        of: &PointRay,
        ray: &Ray,
        jet: &Jet,
        w: DMat2,
    ) -> [f64; 6] {
        let Ray { s, c, length, q, tangential: n, axial, tilt, .. } = *ray;
        let footprint = point.wave.footprint(&of.arrival);
        let (by_m, by_z) = footprint.variation(w * self.crossing_jacobian(ray, jet).transpose());
        let w = footprint.matrix() * w;
        let h = bend(ray, jet) * self.kappa;
        let g = (n - s) / q + h * self.dl_ds(ray);
        let (e, de) = self.footprint_direction(ray);
        let v = w.transpose() * e;
        let hv = h * v;
        let of_tilt = w * (g * c - h * s * (length / c));
        let of_q = (v.dot(n - s) - length * hv.dot(self.dq_ds(ray))) / (q * q);
        let of_n = (of_tilt + tilt * tilt.dot(of_tilt)) / axial - v / q + e * of_q + de * hv * (length / q) + by_m;
        let of_crossing = point.wave.bend(&of.arrival) * of_n;
        let of_l = -of_crossing.dot(e) - by_z * c;
        let of_s = self.dl_ds(ray) * of_l - (de.transpose() * of_crossing) * length + s * (by_z * length / c);
        let mut variation = self.crossing_variation(ray, jet, w);
        variation[0] -= of_l * self.kappa / q;
        variation[1] += of_s.x * self.kappa;
        variation[2] += of_s.y * self.kappa;
        variation
    }

    /// [`OpticalPath::oval_height`] in the light of a point source: the root of `W(x, h) + |Y - (x, h)| = b`, which is
    /// convex in `h`.
    pub(super) fn oval_height_from(&self, point: &PointSource, x: DVec2, y: DVec2, u: f64) -> f64 {
        let Some(flat) = point.flat.at(y, 0.0) else { return f64::NAN };
        let path = flat.phase_mm + self.kappa * u;
        let mut height = 0.0;
        let mut nearby = None;
        for _ in 0..STEPS {
            let Some(arrival) = point.wave.near(x, height, nearby.as_ref()) else { break };
            let to = (y - x).extend(self.distance_mm - height);
            let length = to.length();
            let slope = arrival.axial - to.z / length;
            let monotone = slope * self.kappa > 0.0;
            if !monotone {
                break;
            }
            let step = (arrival.phase_mm + (length - self.distance_mm) - path) / slope;
            height -= step;
            if step.abs() <= point.negligible_mm {
                return height;
            }
            nearby = Some(arrival);
        }
        f64::NAN
    }
}
