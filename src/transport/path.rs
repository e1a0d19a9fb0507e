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
//! (the path is stationary in `x`, Fermat, so that only the explicit `y` counts). Hence `X = Y - l (s, c)`, and from `b` itself
//! `l = P / Q` with `P = N_t . y + N_z D - b` and `Q = N_t . s + N_z c - 1`. Nothing is linearised about a plane.
//!
//! A source at a finite distance would change two things here: `l`, the root of a quadratic, and the footprint, which measures
//! flux. No other file would notice.

use crate::bench::Bench;
use glam::{DMat2, DVec2, DVec3};

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
        }
    }

    pub(super) fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    fn path(&self, y: DVec2, u: f64) -> f64 {
        self.tangential.dot(y) + self.flat_cos * self.distance_mm + self.kappa * u
    }

    /// The gradient of `u` for which the light arrives at `y` with the tangential direction `s`.
    pub(super) fn slope_for(&self, s: DVec2) -> DVec2 {
        (s - self.tangential) / self.kappa
    }

    /// The ray that lands on `y`; none if no face of this kind can send it there.
    #[inline(always)]
    pub(super) fn ray(&self, y: DVec2, u: f64, slope: DVec2) -> Option<Ray> {
        let s = self.tangential + self.kappa * slope;
        let c2 = 1.0 - s.length_squared();
        let c = c2.max(1e-12).sqrt();
        let q = self.tangential.dot(s) + self.axial * c - 1.0;
        let p = self.tangential.dot(y) + self.axial * self.distance_mm - self.path(y, u);
        // Both have the sign of kappa on a real ray; q = 0 is grazing exit, the limit of total reflection.
        (c2 > 1e-6 && q * self.kappa > 1e-9 && p * self.kappa > 0.0).then(|| Ray { s, c, length: p / q, q })
    }

    /// The ray from the point `x` of a flat face at the mean plane to `y`; none if no face of this kind can send it there.
    pub(super) fn plain_ray(&self, x: DVec2, y: DVec2) -> Option<DVec2> {
        let direction = (y - x).extend(self.distance_mm).normalize();
        let bent = self.tangential.dot(direction.truncate()) + self.axial * direction.z - 1.0;
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
        let h = jet.hessian();
        let g = self.length_gradient(ray, &h);
        outer(-ray.s, g) + DMat2::IDENTITY - h * (ray.length * self.kappa)
    }

    /// `dl/dy` along the receiver.
    #[inline(always)]
    fn length_gradient(&self, ray: &Ray, h: &DMat2) -> DVec2 {
        (self.tangential - ray.s) / ray.q + *h * (self.dl_ds(ray) * self.kappa)
    }

    #[inline(always)]
    fn dq_ds(&self, ray: &Ray) -> DVec2 {
        self.tangential - ray.s * (self.axial / ray.c)
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
        let h = jet.hessian();
        let g = self.length_gradient(ray, &h);
        let (e, de) = self.footprint_direction(ray);
        outer(-e, g) + DMat2::IDENTITY - de * h * (ray.length * self.kappa)
    }

    #[inline(always)]
    fn footprint_direction(&self, ray: &Ray) -> (DVec2, DMat2) {
        (ray.s - self.tilt * ray.c, outer(self.tilt, ray.s / ray.c) + DMat2::IDENTITY)
    }

    /// Derivatives of `sum_ij w_ij A_ij`, `A` the footprint's jacobian, with respect to
    /// `u, u_x, u_y, u_xx, u_xy, u_yy`.
    #[inline(always)]
    pub(super) fn footprint_variation(&self, ray: &Ray, jet: &Jet, w: DMat2) -> [f64; 6] {
        let Ray { s, c, length, q } = *ray;
        let (n, kappa) = (self.tangential, self.kappa);
        let h = jet.hessian();
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
        let of_sc = (hv * (self.axial / q) + h * (wt * self.tilt)) * (-kappa * length);
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

    /// Derivatives of the lens point's component along `axis` with respect to `u, u_x, u_y`.
    pub(super) fn lens_point_variation(&self, ray: &Ray, axis: usize) -> [f64; 3] {
        let s = ray.s[axis];
        let mut of_slope = self.dl_ds(ray) * -s;
        of_slope[axis] -= ray.length;
        of_slope *= self.kappa;
        [s * self.kappa / ray.q, of_slope.x, of_slope.y]
    }

    /// The height over `x` of the face that sends all of its light to `y` with this path: the Cartesian oval through `x`.
    ///
    /// From `(q' - N_z h)^2 = |x - y|^2 + (D - h)^2` with `q' = b - N_t . x`, solved without cancellation. Not finite where the
    /// oval does not reach over `x`.
    #[inline(always)]
    pub(super) fn oval_height(&self, x: DVec2, y: DVec2, u: f64) -> f64 {
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

    /// Of two ovals over one point, whether the face is formed by the first: the higher one of glass, the lower one of a mirror.
    #[inline(always)]
    pub(super) fn forms_face(&self, height: f64, other: f64) -> bool {
        if self.kappa > 0.0 { height > other } else { height < other }
    }
}

/// `a b^T`.
#[inline(always)]
fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bench::ExitFace, grid::Extent};

    fn benches() -> Vec<Bench> {
        let block = Extent::new(100.0, 80.0);
        let glass = Bench::new(block, 150.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let mirror = Bench::new(block, 150.0, ExitFace::Reflects).unwrap();
        vec![
            glass,
            mirror,
            glass.with_light_direction(DVec3::new(0.15, -0.1, 1.0)).unwrap(),
            mirror.with_light_direction(DVec3::new(-0.1, 0.2, -1.0)).unwrap(),
        ]
    }

    fn jet(u: f64) -> Jet {
        Jet { value: u, slope: DVec2::new(0.11, -0.07), curvature: [2e-3, -7e-4, -1e-3] }
    }

    /// A quadratic u with the given jet at `y0`.
    fn around(jet: &Jet, y0: DVec2, y: DVec2) -> Jet {
        let d = y - y0;
        let bend = jet.hessian() * d;
        Jet { value: jet.value + jet.slope.dot(d) + 0.5 * d.dot(bend), slope: jet.slope + bend, ..*jet }
    }

    #[test]
    fn the_ray_has_the_stated_path_and_obeys_snell() {
        for bench in benches() {
            let path = OpticalPath::new(&bench);
            let (y, jet) = (DVec2::new(21.0, -13.0), jet(0.4));
            let ray = path.ray(y, jet.value, jet.slope).unwrap();
            let x = path.lens_point(y, &ray);
            let (h, dh) = path.height(&ray);
            let n = path.tangential.extend(path.axial);
            let (from, to) = (x.extend(h), y.extend(150.0));
            let length = n.dot(from) + (to - from).length();
            assert!((length - path.path(y, jet.value)).abs() < 1e-11);
            assert!(((to - from).normalize().truncate() - ray.s).length() < 1e-13);
            assert!((path.oval_height(x, y, jet.value) - h).abs() < 1e-11);
            let moved = path.ray(y, jet.value + 1e-5, jet.slope).unwrap();
            assert!(((path.height(&moved).0 - h) / 1e-5 - dh).abs() < 1e-5);
        }
    }

    #[test]
    fn a_flat_face_has_u_zero() {
        for bench in benches() {
            let path = OpticalPath::new(&bench);
            let ray = path.ray(DVec2::new(3.0, 4.0), 0.0, DVec2::ZERO).unwrap();
            assert!(path.height(&ray).0.abs() < 1e-12);
            assert!((ray.s - path.tangential).length() < 1e-15);
        }
    }

    #[test]
    fn the_jacobians_agree_with_finite_differences() {
        for bench in benches() {
            let path = OpticalPath::new(&bench);
            let (y, jet) = (DVec2::new(-17.0, 28.0), jet(-0.3));
            let points = |at: DVec2| {
                let jet = around(&jet, y, at);
                let ray = path.ray(at, jet.value, jet.slope).unwrap();
                let x = path.lens_point(at, &ray);
                (x, x - path.tilt * path.height(&ray).0)
            };
            let ray = path.ray(y, jet.value, jet.slope).unwrap();
            let (lens, foot) = (path.lens_jacobian(&ray, &jet), path.footprint_jacobian(&ray, &jet));
            for (axis, step) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
                let (a, b) = (points(y + 1e-4 * step), points(y - 1e-4 * step));
                assert!(((a.0 - b.0) / 2e-4 - lens.col(axis)).length() < 1e-9);
                assert!(((a.1 - b.1) / 2e-4 - foot.col(axis)).length() < 1e-9);
            }
        }
    }

    #[test]
    fn the_variations_agree_with_finite_differences() {
        let weights = DMat2::from_cols(DVec2::new(0.7, -0.2), DVec2::new(0.3, 1.2));
        for bench in benches() {
            let path = OpticalPath::new(&bench);
            let (y, jet) = (DVec2::new(25.0, 9.0), jet(0.2));
            let moved = |k: usize, step: f64| {
                let mut jet = jet;
                match k {
                    0 => jet.value += step,
                    1 | 2 => jet.slope[k - 1] += step,
                    _ => jet.curvature[k - 3] += step,
                }
                let ray = path.ray(y, jet.value, jet.slope).unwrap();
                let a = path.footprint_jacobian(&ray, &jet);
                let x = path.lens_point(y, &ray);
                (weights.col(0).dot(a.col(0)) + weights.col(1).dot(a.col(1)), x)
            };
            let ray = path.ray(y, jet.value, jet.slope).unwrap();
            let variation = path.footprint_variation(&ray, &jet, weights);
            for k in 0..6 {
                let step = 1e-6;
                let (a, b) = (moved(k, step), moved(k, -step));
                let difference = (a.0 - b.0) / (2.0 * step);
                assert!(
                    (variation[k] - difference).abs() < 1e-7 * (1.0 + difference.abs()),
                    "component {k}: {} against {difference}",
                    variation[k]
                );
                if k < 3 {
                    for axis in 0..2 {
                        let difference = (a.1 - b.1)[axis] / (2.0 * step);
                        assert!((path.lens_point_variation(&ray, axis)[k] - difference).abs() < 1e-6);
                    }
                }
            }
        }
    }
}
