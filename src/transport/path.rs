//! The optical-path relation: from the path length of the ray that lands on a point of the receiver to where and how high it
//! leaves the block. Everything the solver knows of the bench's optics is here.
//!
//! With `N` the incident direction times the index (for a mirror, the direction itself), a plane wave reaches the point
//! `X = (x, h)` of the exit face with the phase `N . X`, and the receiver point `Y = (y, D)` after `|Y - X|` more:
//!
//! ```text
//! b(y) = N . X + |Y - X|,      s = grad b = (y - x) / |Y - X|,      c = sqrt(1 - |s|^2)
//! ```
//!
//! (the path is stationary in `x`, Fermat, so that only the explicit `y` counts). Hence `X = Y - l (s, c)`, and from `b`
//! itself `l = P / Q` with `P = N_t . y + N_z D - b` and `Q = N_t . s + N_z c - 1`. Nothing is linearised about a plane.
//!
//! # A source at a finite distance
//!
//! The phase is that of [`PointWave`](crate::light::PointWave), `W(X)` in place of `N . X`, with `N = grad W` at the point:
//! `l` is the root of `W(Y - l (s, c)) + l = b`. Its first derivatives are those of parallel light along the local `N`. So
//! is the jacobian of the footprint, but for the factor `B` that measures flux: `A = B (I - e (x) dl/dy - l E grad grad
//! b)`. Its variation has, besides, the terms by which `N` and `B` follow the point `X`. The reference is again the flat
//! face, behind which the wave goes on as a wave of the same kind: `b = b_flat(y) + kappa u`.
//!
//! The equation does not notice: `footprint_jacobian` has it all.

mod point;

use crate::{bench::Bench, light::outer};
use glam::{DMat2, DVec2, DVec3};
use point::{PointRay, PointSource};

/// Value and derivatives of the unknown `u` at a point of the receiver, u in mm.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) slope: DVec2,
    /// `u_xx, u_xy, u_yy`.
    pub(super) curvature: [f64; 3],
}

impl Jet {
    fn hessian(&self) -> DMat2 {
        let [xx, xy, yy] = self.curvature;
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }
}

/// The relation for one bench; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct OpticalPath {
    /// Tangential and axial part of `N`.
    tangential: DVec2,
    axial: f64,
    distance_mm: f64,
    /// `b = N_t . y + flat_cos D + kappa u`: a flat face has `u = 0`.
    kappa: f64,
    flat_cos: f64,
    /// Tangent of the incidence: light that passes `(x, h)` crosses the plane `z = 0` at `x - tilt h`.
    tilt: DVec2,
    /// Its light, if it does not come from infinity: then the above, but for `kappa`, is that of the middle of the face.
    point: Option<PointSource>,
}

/// The ray that lands on one point of the receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// Its direction in air: tangential part and cosine.
    s: DVec2,
    c: f64,
    /// Its length from the block to the receiver, mm.
    length: f64,
    q: f64,
    /// `N` where it leaves the block, and its tangent.
    tangential: DVec2,
    axial: f64,
    tilt: DVec2,
    point: Option<PointRay>,
}

impl OpticalPath {
    pub(super) fn new(bench: &Bench) -> Self {
        let index = bench.exit_face().ior();
        let n: DVec3 = bench.light_direction() * index;
        let tangential = n.truncate();
        // A flat face keeps the tangential part of N; beyond the critical angle the ray along it is only a reference.
        let flat_cos = (1.0 - tangential.length_squared()).max(0.01).sqrt();
        Self {
            tangential,
            axial: n.z,
            distance_mm: bench.distance_mm(),
            kappa: n.z - flat_cos,
            flat_cos,
            tilt: tangential / n.z,
            point: PointSource::of(bench),
        }
    }

    pub(super) fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    fn path(&self, y: DVec2, u: f64) -> f64 {
        self.tangential.dot(y) + self.flat_cos * self.distance_mm + self.kappa * u
    }

    /// The gradient of `u` for which the light arrives at `y` with the tangential direction `s`.
    pub(super) fn slope_for(&self, y: DVec2, s: DVec2) -> DVec2 {
        let flat = match &self.point {
            None => self.tangential,
            Some(point) => point.flat.at(y, 0.0).map_or(DVec2::NAN, |flat| flat.tangential),
        };
        (s - flat) / self.kappa
    }

    /// The ray that lands on `y`; none if no face of this kind can send it there.
    #[inline(always)]
    pub(super) fn ray(&self, y: DVec2, u: f64, slope: DVec2) -> Option<Ray> {
        if let Some(point) = &self.point {
            return self.ray_from(point, y, u, slope);
        }
        let s = self.tangential + self.kappa * slope;
        let c2 = 1.0 - s.length_squared();
        let c = c2.max(1e-12).sqrt();
        let q = self.tangential.dot(s) + self.axial * c - 1.0;
        let p = self.tangential.dot(y) + self.axial * self.distance_mm - self.path(y, u);
        // Both have the sign of kappa on a real ray; q = 0 is grazing exit, the limit of total reflection.
        (c2 > 1e-6 && q * self.kappa > 1e-9 && p * self.kappa > 0.0).then(|| Ray {
            s,
            c,
            length: p / q,
            q,
            tangential: self.tangential,
            axial: self.axial,
            tilt: self.tilt,
            point: None,
        })
    }

    /// The ray from the point `x` of a flat face at the mean plane to `y`; none if no face of this kind can send it there.
    pub(super) fn plain_ray(&self, x: DVec2, y: DVec2) -> Option<DVec2> {
        let direction = (y - x).extend(self.distance_mm).normalize();
        let (tangential, axial) = match &self.point {
            None => (self.tangential, self.axial),
            Some(point) => point.wave.at(x, 0.0).map(|at| (at.tangential, at.axial))?,
        };
        let bent = tangential.dot(direction.truncate()) + axial * direction.z - 1.0;
        (bent * self.kappa > 1e-9).then(|| direction.truncate())
    }

    /// Where on the block the ray leaves, mm.
    #[inline(always)]
    pub(super) fn lens_point(&self, y: DVec2, ray: &Ray) -> DVec2 {
        y - ray.length * ray.s
    }

    /// How high it leaves, mm, and the derivative of that with respect to `u` as a constant.
    #[inline(always)]
    pub(super) fn height(&self, ray: &Ray) -> (f64, f64) {
        (self.distance_mm - ray.length * ray.c, self.kappa * ray.c / ray.q)
    }

    /// The jacobian matrix of the lens point with respect to `y`.
    #[inline(always)]
    pub(super) fn lens_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        let h = bend(ray, jet);
        let g = self.length_gradient(ray, &h);
        outer(-ray.s, g) + DMat2::IDENTITY - h * (ray.length * self.kappa)
    }

    /// Up to a factor, the area of the lens that lights an area of the receiver on which this much light is wanted.
    #[inline(always)]
    pub(super) fn lens_area(&self, ray: &Ray, jet: &Jet, light: f64) -> f64 {
        match ray.point {
            // Parallel light is even: but for its obliquity, areas are what flux is.
            None => light,
            Some(_) => self.lens_jacobian(ray, jet).determinant(),
        }
    }

    /// `dl/dy` along the receiver.
    #[inline(always)]
    fn length_gradient(&self, ray: &Ray, h: &DMat2) -> DVec2 {
        (ray.tangential - ray.s) / ray.q + *h * (self.dl_ds(ray) * self.kappa)
    }

    #[inline(always)]
    fn dq_ds(&self, ray: &Ray) -> DVec2 {
        ray.tangential - ray.s * (ray.axial / ray.c)
    }

    #[inline(always)]
    fn dl_ds(&self, ray: &Ray) -> DVec2 {
        self.dq_ds(ray) * (-ray.length / ray.q)
    }

    /// The jacobian matrix of the footprint with respect to `y`: of the point where the light that is refracted towards `y`
    /// crosses the plane `z = 0` undisturbed, which is what measures flux. For light along the axis it is the lens point's.
    ///
    /// The footprint is `y - tilt D - l e` with `e = s - tilt c`, so that its jacobian is
    /// `A = I - e (x) dl/dy - l kappa E H`, `E = de/ds`.
    #[inline(always)]
    pub(super) fn footprint_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        let crossing = self.crossing_jacobian(ray, jet);
        match (&self.point, &ray.point) {
            (Some(point), Some(of)) => point.wave.footprint(&of.arrival).matrix() * crossing,
            _ => crossing,
        }
    }

    /// `A` for parallel light along the local `N`.
    #[inline(always)]
    fn crossing_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        let h = bend(ray, jet);
        let g = self.length_gradient(ray, &h);
        let (e, de) = self.footprint_direction(ray);
        outer(-e, g) + DMat2::IDENTITY - de * h * (ray.length * self.kappa)
    }

    #[inline(always)]
    fn footprint_direction(&self, ray: &Ray) -> (DVec2, DMat2) {
        (ray.s - ray.tilt * ray.c, outer(ray.tilt, ray.s / ray.c) + DMat2::IDENTITY)
    }

    /// Derivatives of `sum_ij w_ij A_ij`, `A` the footprint's jacobian, with respect to
    /// `u, u_x, u_y, u_xx, u_xy, u_yy`.
    #[inline(always)]
    pub(super) fn footprint_variation(&self, ray: &Ray, jet: &Jet, w: DMat2) -> [f64; 6] {
        match (&self.point, &ray.point) {
            (Some(point), Some(of)) => self.footprint_variation_from(point, of, ray, jet, w),
            _ => self.crossing_variation(ray, jet, w),
        }
    }

    /// The same for `sum_ij w_ij A_ij` with the `A` of parallel light along the local `N`, as if that stayed.
    #[inline(always)]
    fn crossing_variation(&self, ray: &Ray, jet: &Jet, w: DMat2) -> [f64; 6] {
        let Ray { s, c, length, q, tangential: n, axial, tilt, .. } = *ray;
        let kappa = self.kappa;
        let h = bend(ray, jet);
        let (dq, dl) = (self.dq_ds(ray), self.dl_ds(ray));
        let g = self.length_gradient(ray, &h);
        let (e, de) = self.footprint_direction(ray);
        let wt = w.transpose();
        let v = wt * e;
        let hv = h * v;
        let hv_dq = hv.dot(dq);
        let deh = de * h;
        let contracted = w.col(0).dot(deh.col(0)) + w.col(1).dot(deh.col(1));
        // Factors of the variations of l, of s, and of s/c.
        let of_l = kappa * (hv_dq / q - contracted);
        let of_sc = (hv * (axial / q) + h * (wt * tilt)) * (-kappa * length);
        let mut of_s = de.transpose() * (w * g) * -1.0
            + v / q
            + dq * ((v.dot(n - s) - kappa * length * hv_dq) / (q * q))
            + dl * of_l;
        of_s += of_sc / c + s * (s.dot(of_sc) / (c * c * c));
        of_s *= kappa;
        let of_h = outer(dl, v) + de.transpose() * w * length;
        [
            -of_l * kappa / q,
            of_s.x,
            of_s.y,
            -kappa * of_h.x_axis.x,
            -kappa * (of_h.x_axis.y + of_h.y_axis.x),
            -kappa * of_h.y_axis.y,
        ]
    }

    /// Derivatives of the lens point's component along the unit vector `along` with respect to `u, u_x, u_y`.
    pub(super) fn lens_point_variation(&self, ray: &Ray, along: DVec2) -> [f64; 3] {
        let s = ray.s.dot(along);
        let of_slope = (self.dl_ds(ray) * -s - along * ray.length) * self.kappa;
        [s * self.kappa / ray.q, of_slope.x, of_slope.y]
    }

    /// The height over `x` of the face that sends all of its light to `y` with this path: the Cartesian oval through `x`.
    ///
    /// From `(q' - N_z h)^2 = |x - y|^2 + (D - h)^2` with `q' = b - N_t . x`, solved without cancellation. Not finite where
    /// the oval does not reach over `x`.
    #[inline(always)]
    pub(super) fn oval_height(&self, x: DVec2, y: DVec2, u: f64) -> f64 {
        if let Some(point) = &self.point {
            return self.oval_height_from(point, x, y, u);
        }
        // Differences from the flat face's path keep the digits: q' = q0 + (q' - q0) with q0 = flat_cos D.
        let q0 = self.flat_cos * self.distance_mm;
        let rest = self.tangential.dot(y - x) + self.kappa * u;
        let path = q0 + rest;
        let constant = rest * (2.0 * q0 + rest)
            - (x - y).length_squared()
            - self.distance_mm * self.distance_mm * (1.0 - self.flat_cos * self.flat_cos);
        let half = self.axial * path - self.distance_mm;
        let root = (half * half - (self.axial * self.axial - 1.0) * constant).sqrt();
        constant / (half + half.signum() * root)
    }

    /// Of two ovals over one point, whether the face is formed by the first: the higher one of glass, the lower one of a
    /// mirror.
    #[inline(always)]
    pub(super) fn forms_face(&self, height: f64, other: f64) -> bool {
        if self.kappa > 0.0 { height > other } else { height < other }
    }
}

/// Second derivatives of `b` over kappa.
#[inline(always)]
fn bend(ray: &Ray, jet: &Jet) -> DMat2 {
    match &ray.point {
        None => jet.hessian(),
        Some(of) => jet.hessian() + of.flat_bend,
    }
}

#[cfg(test)]
mod tests;
