//! The wave of a point source
//!
//! A source `d` in front of the planar entry face of a block of index `n` lights the point `X` of
//! the exit face, `rho` to the side of the source and `a` behind the entry face. The tangential
//! part `m` of the ray's direction times the index is the same on both sides of the entry face
//! (Snell), so that with `mu = |m|^2`
//!
//! ```text
//! X_t - P_t = chi m,     chi(mu, a) = d / sqrt(1 - mu) + a / sqrt(n^2 - mu)
//! W = m . (X_t - P_t) + d sqrt(1 - mu) + a sqrt(n^2 - mu),     grad W = N = (m, sqrt(n^2 - mu))
//! ```
//!
//! `W` being the phase (eikonal) and stationary in `m`. A mirror, lit from the receiver's side, is
//! the case `d = 0`, `n = 1` with `a` counted from the source downwards and `N_z` negative. Nothing
//! is paraxial.
//!
//! # Flux
//!
//! The footprint `F = C psi(mu) m` measures flux: equal areas carry equal flux. For constant
//! intensity it is Lambert's equal-area projection of the solid angle, `psi = sqrt(2 / (1 + sqrt(1
//! - mu)))`; for a Lambertian source `psi = 1`. `C` gives it the area of the block. Over the block
//! it moves by `dF = B (dX_t - (m / N_z) dX_z)` with `B = b_t I + b_m m (x) m`.

use super::source::Intensity;
use crate::{bench::ExitFace, grid::Extent};
use glam::{DMat2, DVec2, DVec3};

/// The wave of a point source; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PointWave {
    /// The source seen along the axis, mm.
    pub(super) source: DVec2,
    /// `d`, mm.
    pub(super) air_mm: f64,
    pub(super) index: f64,
    /// Where `a` is 0 on the bench's axis, mm, and the sign with which it grows along it.
    pub(super) origin_mm: f64,
    sense: f64,
    /// `C`, mm.
    scale_mm: f64,
    pub(super) intensity: Intensity,
}

/// The wave at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointArrival {
    /// `m`.
    pub(crate) tangential: DVec2,
    /// `N_z`.
    pub(crate) axial: f64,
    /// `W` less that of the axial ray to the mean plane, mm.
    pub(crate) phase_mm: f64,
    mu: f64,
    /// `a`, mm.
    depth_mm: f64,
    /// Tangent of the ray's angle in air.
    tangent: f64,
}

/// `B` and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    m: DVec2,
    /// `b_t` and `b_m`.
    factors: [f64; 2],
    by_mu: [f64; 2],
    /// With respect to z.
    by_height: [f64; 2],
}

impl PointWave {
    /// Least `air + a / n` at which light counts as coming from the source, mm. A relief that cuts
    /// through the entry face, on the way to a solution, is lit by the wave continued backwards.
    const LEAST_MM: f64 = 1e-3;

    /// The wave of a point source that lights a block with this face.
    pub(crate) fn new(
        (position_mm, thickness_mm): (DVec3, f64),
        intensity: Intensity,
        exit_face: ExitFace,
        block: Extent,
    ) -> Self {
        let source = position_mm.truncate();
        let mut wave = match exit_face {
            ExitFace::Refracts { ior } => Self {
                source,
                air_mm: -thickness_mm - position_mm.z,
                index: ior,
                origin_mm: -thickness_mm,
                sense: 1.0,
                scale_mm: 1.0,
                intensity,
            },
            ExitFace::Reflects => Self {
                source,
                air_mm: 0.0,
                index: 1.0,
                origin_mm: position_mm.z,
                sense: -1.0,
                scale_mm: 1.0,
                intensity,
            },
        };
        wave.scale_mm = 1.0 / wave.mean_density(block).sqrt();
        wave
    }

    /// The same wave behind `more_mm` of air: behind a flat face, unfolded in the case of a mirror.
    pub(crate) fn continued(self, more_mm: f64) -> Self {
        Self { air_mm: self.air_mm + more_mm, ..self }
    }

    /// A length that its phases and offsets do not exceed by much, mm.
    pub(crate) fn reach_mm(&self) -> f64 {
        self.air_mm + self.origin_mm.abs() + self.source.length()
    }

    /// Mean of the flux per area over the mean plane of the face.
    fn mean_density(&self, block: Extent) -> f64 {
        const POINTS: usize = 16;
        let mut sum = 0.0;
        for k in 0..POINTS * POINTS {
            let place = DVec2::new((k % POINTS) as f64 + 0.5, (k / POINTS) as f64 + 0.5) / POINTS as f64;
            let at = block.lower() + place * block.as_vec();
            sum += self.at(at, 0.0).map_or(0.0, |arrival| self.footprint(&arrival).determinant());
        }
        sum / (POINTS * POINTS) as f64
    }

    /// The wave at a point; none where no light of the source is.
    #[inline(always)]
    pub(crate) fn at(&self, x: DVec2, z: f64) -> Option<PointArrival> {
        self.near(x, z, None)
    }

    /// The same, found sooner from the wave at a point nearby.
    pub(crate) fn near(&self, x: DVec2, z: f64, nearby: Option<&PointArrival>) -> Option<PointArrival> {
        let (d, n) = (self.air_mm, self.index);
        let depth = self.sense * (z - self.origin_mm);
        // False, too, where the point is not a number.
        let lit = d + depth / n > Self::LEAST_MM;
        if !lit {
            return None;
        }
        let offset = x - self.source;
        let rho = offset.length();
        // With g the tangent of the angle in air: d g + a g / sqrt(n^2 + k g^2) = rho, whose left
        // side is concave for a > 0. Newton's steps grow towards the root from below, where at most
        // the first of them leads. They end when the next would be below rounding.
        let (n2, k) = (n * n, n * n - 1.0);
        let mut g = nearby.map_or(rho / (d + depth / n), |nearby| nearby.tangent);
        for _ in 0..STEPS {
            let r2 = n2 + k * g * g;
            let r = r2.sqrt();
            let miss = d * g + depth * g / r - rho;
            let step = miss / (d + depth * n2 / (r2 * r));
            g -= step;
            if step.abs() <= 1e-8 * g {
                break;
            }
        }
        let mu = g * g / (1.0 + g * g);
        let (air, glass) = ((1.0 - mu).sqrt(), (n2 - mu).sqrt());
        let chi = d / air + depth / glass;
        let tangential = offset / chi;
        let phase = tangential.dot(offset) - d * mu / (1.0 + air) - depth * mu / (n + glass) + self.sense * n * z;
        (chi > 0.0).then_some(PointArrival {
            tangential,
            axial: self.sense * glass,
            phase_mm: phase,
            mu,
            depth_mm: depth,
            tangent: g,
        })
    }

    /// `chi` and its first two derivatives with respect to `mu`.
    #[inline(always)]
    fn chi(&self, at: &PointArrival) -> [f64; 3] {
        let (air, glass) = (1.0 / (1.0 - at.mu), 1.0 / (self.index * self.index - at.mu));
        let (a, b) = (self.air_mm * air.sqrt(), at.depth_mm * glass.sqrt());
        [a + b, 0.5 * (a * air + b * glass), 0.75 * (a * air * air + b * glass * glass)]
    }

    /// `dm/dX_t`: the curvature of the wave's trace on a plane across the axis, 1/mm.
    #[inline(always)]
    pub(crate) fn bend(&self, at: &PointArrival) -> DMat2 {
        let [chi, by_mu, _] = self.chi(at);
        let m = at.tangential;
        DMat2::IDENTITY * (1.0 / chi) - outer(m, m) * (2.0 * by_mu / (chi * (chi + 2.0 * at.mu * by_mu)))
    }

    /// The footprint, mm.
    #[cfg(test)]
    pub(crate) fn footprint_place(&self, at: &PointArrival) -> DVec2 {
        let psi = match self.intensity {
            Intensity::Lambertian => 1.0,
            Intensity::Isotropic => (2.0 / (1.0 + (1.0 - at.mu).sqrt())).sqrt(),
        };
        at.tangential * (self.scale_mm * psi)
    }

    /// How the footprint follows the point.
    #[inline(always)]
    pub(crate) fn footprint(&self, at: &PointArrival) -> Footprint {
        let mu = at.mu;
        let [chi, chi_1, chi_2] = self.chi(at);
        let glass = 1.0 / (self.index * self.index - mu);
        let (chi_a, chi_1a) = (glass.sqrt(), 0.5 * glass * glass.sqrt());
        let [psi, psi_1, psi_2] = match self.intensity {
            Intensity::Lambertian => [1.0, 0.0, 0.0],
            Intensity::Isotropic => {
                let cos = (1.0 - mu).sqrt();
                let psi = (2.0 / (1.0 + cos)).sqrt();
                let cube = psi * psi * psi;
                let second = 3.0 * cube * psi * psi / (64.0 * cos * cos) + cube / (16.0 * cos * cos * cos);
                [psi, cube / (8.0 * cos), second]
            }
        };
        // b_t = C psi / chi across m, (psi + 2 mu psi') / (chi + 2 mu chi') C along it; b_m is
        // their difference over mu.
        let (c, radial) = (self.scale_mm, chi + 2.0 * mu * chi_1);
        let both = chi * radial;
        let cross = psi_1 * chi - psi * chi_1;
        let b_m = 2.0 * c * cross / both;
        let (radial_1, radial_a) = (3.0 * chi_1 + 2.0 * mu * chi_2, chi_a + 2.0 * mu * chi_1a);
        let (cross_1, cross_a) = (psi_2 * chi - psi * chi_2, psi_1 * chi_a - psi * chi_1a);
        let of_a = [-c * psi * chi_a / (chi * chi), 2.0 * c * cross_a / both - b_m * (chi_a / chi + radial_a / radial)];
        Footprint {
            m: at.tangential,
            factors: [c * psi / chi, b_m],
            by_mu: [c * cross / (chi * chi), 2.0 * c * cross_1 / both - b_m * (chi_1 / chi + radial_1 / radial)],
            by_height: of_a.map(|v| self.sense * v),
        }
    }
}

/// Most Newton steps for the direction of a ray.
const STEPS: usize = 30;

impl Footprint {
    /// `B`, which is symmetric.
    #[inline(always)]
    pub(crate) fn matrix(&self) -> DMat2 {
        DMat2::IDENTITY * self.factors[0] + outer(self.m, self.m) * self.factors[1]
    }

    pub(super) fn determinant(&self) -> f64 {
        self.factors[0] * (self.factors[0] + self.factors[1] * self.m.length_squared())
    }

    /// The derivatives of `sum_ij q_ij B_ij` with respect to `m`, and to `z` as `m` stays.
    #[inline(always)]
    pub(crate) fn variation(&self, q: DMat2) -> (DVec2, f64) {
        let both = (q + q.transpose()) * self.m;
        let (trace, square) = (q.x_axis.x + q.y_axis.y, 0.5 * self.m.dot(both));
        let contracted = |by: [f64; 2]| by[0] * trace + by[1] * square;
        (self.m * (2.0 * contracted(self.by_mu)) + both * self.factors[1], contracted(self.by_height))
    }
}

/// `a b^T`.
#[inline(always)]
pub(crate) fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

#[cfg(test)]
mod tests;
