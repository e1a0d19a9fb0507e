//! The optical-path relation: from the path length of the ray that lands on a point of the receiver
//! to where and how high it leaves the block. Everything the solver knows of the bench's optics is
//! here.
//!
//! With `N` the incident direction times the index (for a mirror, the direction itself), a plane
//! wave reaches the point `X = (x, h)` of the exit face with the phase `N . X`, and the receiver
//! point `Y = (y, D)` after `|Y - X|` more:
//!
//! ```text
//! b(y) = N . X + |Y - X|,      s = grad b = (y - x) / |Y - X|,      c = sqrt(1 - |s|^2)
//! ```
//!
//! (the path is stationary in `x`, Fermat, so that only the explicit `y` counts). Hence `X = Y - l
//! (s, c)`, and from `b` itself `l = P / Q` with `P = N_t . y + N_z D - b` and `Q = N_t . s + N_z c
//! - 1`. Nothing is linearised about a plane.
//!
//! # Light that is not parallel
//!
//! The phase is that of a congruence of rays ([`Congruence`](crate::light::Congruence): a source at a
//! finite distance, or light that has passed known faces), `W(X)` in place of `N . X`, with `N =
//! grad W` at the point: `l` is the root of `W(Y - l (s, c)) + l = b`. Its first derivatives are
//! those of parallel light along the local `N`. So is the jacobian of the footprint, but for the
//! factor `B` that measures flux: `A = B (I - e (x) dl/dy - l E grad grad b)`. Its variation has,
//! besides, the terms by which `N` and `B` follow the point `X`. The reference is the flat face,
//! behind which the wave of a source goes on as a wave of the same kind, `b = b_flat(y) + kappa u`;
//! of light that has passed known faces, that of its middle, parallel.
//!
//! The equation does not notice: `footprint_jacobian` has it all.
//!
//! # A receiver that leans
//!
//! `y` and `s` are then coordinates in its plane and of the ray along it, `Y = C + R (y, 0)`, `b`
//! is a function on the plane, and its gradient is still `s`. With the frame turned by `R` the
//! light arrives obliquely, `N' = R^T N`, which is a case that is already there. Only where the
//! block counts does the frame come in: `X = Y - l R (s, c)`, and the footprint, being the crossing
//! of the plane `z = 0` along `N`, is an affine image of the crossing of a plane along the
//! receiver: `A = M A'`, `M = (I | -N_t/N_z) R` without its last column.

mod curved;
mod relation;

pub(super) use relation::{OpticalPath, Ray};

use super::map::{Face, Jet, Map};
use crate::{
    bench::Bench,
    light::{Label, outer},
};
use glam::{DMat2, DVec2, DVec3};
use relation::{Arrived, CurvedLight, bend};

impl<'a> OpticalPath<'a> {
    pub(super) fn new(bench: &'a Bench) -> Self {
        let index = bench.exit_face().ior();
        let incident: DVec3 = bench.light_direction() * index;
        let tangential = incident.truncate();
        // A flat face keeps the tangential part of N; beyond the critical angle the ray along it is
        // only a reference.
        let flat = tangential.extend((1.0 - tangential.length_squared()).max(0.01).sqrt());
        let receiver = *bench.receiver();
        let along = |v: DVec3| DVec2::new(receiver.axes().x_axis.dot(v), receiver.axes().y_axis.dot(v));
        Self {
            receiver,
            incident,
            flat,
            kappa: incident.z - flat.z,
            constant: Arrived::new(incident, &receiver.axes()),
            flat_tangential: along(flat),
            curved: CurvedLight::of(bench),
        }
    }

    /// A direction with the given parts along the receiver and across it, in the frame of the
    /// bench.
    #[inline(always)]
    fn direction(&self, s: DVec2, c: f64) -> DVec3 {
        let axes = self.receiver.axes();
        axes.x_axis * s.x + axes.y_axis * s.y + axes.z_axis * c
    }

    /// The part of a direction along the receiver.
    #[inline(always)]
    fn along(&self, direction: DVec3) -> DVec2 {
        let axes = self.receiver.axes();
        DVec2::new(axes.x_axis.dot(direction), axes.y_axis.dot(direction))
    }

    /// `z` of the receiver's coordinate directions.
    #[inline(always)]
    fn lean(&self) -> DVec2 {
        let axes = self.receiver.axes();
        DVec2::new(axes.x_axis.z, axes.y_axis.z)
    }

    /// The gradient of `u` for which the light arrives at `y` along the unit vector `direction` of
    /// the bench.
    pub(super) fn slope_for(&self, y: DVec2, direction: DVec3) -> DVec2 {
        let flat = match &self.curved {
            None => self.flat_tangential,
            Some(light) => self.flat_from(light, y).map_or(DVec2::NAN, |flat| flat.along),
        };
        (self.along(direction) - flat) / self.kappa
    }

    /// The ray that lands on `y`; none if no face of this kind can send it there.
    #[inline(always)]
    pub(super) fn ray(&self, y: DVec2, u: f64, slope: DVec2) -> Option<Ray> {
        if let Some(light) = &self.curved {
            return self.ray_from(light, y, u, slope);
        }
        let arrived = self.constant;
        let s = self.flat_tangential + self.kappa * slope;
        let c2 = 1.0 - s.length_squared();
        let c = c2.max(1e-12).sqrt();
        let q = arrived.tangential.dot(s) + arrived.axial * c - 1.0;
        // N . Y - b: what the two references have in common cancels.
        let p = (arrived.tangential - self.flat_tangential).dot(y) + self.kappa * (self.receiver.distance_mm() - u);
        // Both have the sign of kappa on a real ray; q = 0 is grazing exit, the limit of total
        // reflection.
        (c2 > 1e-6 && q * self.kappa > 1e-9 && p * self.kappa > 0.0).then(|| Ray {
            s,
            c,
            length: p / q,
            q,
            arrived,
            curved: None,
        })
    }

    /// The direction of the ray from the point `x` of a flat face at the mean plane to `y`; none if
    /// no face of this kind can send it there.
    pub(super) fn plain_ray(&self, x: DVec2, y: DVec2) -> Option<DVec3> {
        let direction = (self.receiver.point(y) - x.extend(0.0)).normalize();
        let incident = match &self.curved {
            None => self.incident,
            Some(light) => light.congruence.at(x, 0.0)?.incident(),
        };
        ((incident.dot(direction) - 1.0) * self.kappa > 1e-9 && direction.z > 0.0).then_some(direction)
    }

    /// Where the ray leaves, mm.
    #[inline(always)]
    fn leaves(&self, y: DVec2, ray: &Ray) -> DVec3 {
        self.receiver.point(y) - self.direction(ray.s, ray.c) * ray.length
    }

    /// Where on the block the ray leaves, mm.
    #[inline(always)]
    pub(super) fn lens_point(&self, y: DVec2, ray: &Ray) -> DVec2 {
        self.leaves(y, ray).truncate()
    }

    /// Where its light crosses the plane `z = 0` of the block, undisturbed, mm.
    pub(super) fn crossing_point(&self, y: DVec2, ray: &Ray) -> DVec2 {
        let from = self.leaves(y, ray);
        let incident = self.direction(ray.arrived.tangential, ray.arrived.axial);
        from.truncate() - incident.truncate() * (from.z / incident.z)
    }

    /// How high it leaves, mm, and the derivative of that with respect to `u` as a constant.
    #[inline(always)]
    pub(super) fn height(&self, y: DVec2, ray: &Ray) -> (f64, f64) {
        let steep = self.direction(ray.s, ray.c).z;
        (self.receiver.point(y).z - ray.length * steep, self.kappa * steep / ray.q)
    }

    /// The jacobian matrix of the lens point with respect to `y`.
    #[inline(always)]
    pub(super) fn lens_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        let h = bend(ray, jet);
        let g = self.length_gradient(ray, &h);
        let along = outer(-ray.s, g) + DMat2::IDENTITY - h * (ray.length * self.kappa);
        if !self.receiver.is_turned() {
            return along;
        }
        // Across the receiver the ray's end moves by -d(l c).
        let across = h * (ray.s * (ray.length * self.kappa / ray.c)) - g * ray.c;
        let axes = self.receiver.axes();
        DMat2::from_cols(axes.x_axis.truncate(), axes.y_axis.truncate()) * along + outer(axes.z_axis.truncate(), across)
    }

    /// Up to a factor, the area of the lens that lights an area of the receiver on which this much
    /// light is wanted.
    #[inline(always)]
    pub(super) fn lens_area(&self, ray: &Ray, jet: &Jet, light: f64) -> f64 {
        match ray.curved {
            // Parallel light is even: but for its obliquity, areas are what flux is.
            None => light,
            Some(_) => self.lens_jacobian(ray, jet).determinant(),
        }
    }

    /// `dl/dy` along the receiver.
    #[inline(always)]
    fn length_gradient(&self, ray: &Ray, h: &DMat2) -> DVec2 {
        (ray.arrived.tangential - ray.s) / ray.q + *h * (self.dl_ds(ray) * self.kappa)
    }

    #[inline(always)]
    fn dq_ds(&self, ray: &Ray) -> DVec2 {
        ray.arrived.tangential - ray.s * (ray.arrived.axial / ray.c)
    }

    #[inline(always)]
    fn dl_ds(&self, ray: &Ray) -> DVec2 {
        self.dq_ds(ray) * (-ray.length / ray.q)
    }

    /// The jacobian matrix of the footprint with respect to `y`: of the point where the light that
    /// is refracted towards `y` crosses the plane `z = 0` undisturbed, which is what measures flux.
    /// For light along the axis it is the lens point's.
    ///
    /// The crossing of a plane along the receiver is `y - tilt D - l e` with `e = s - tilt c`, so
    /// that its jacobian is `A' = I - e (x) dl/dy - l kappa E H`, `E = de/ds`, and that of the
    /// footprint `M A'`.
    #[inline(always)]
    pub(super) fn footprint_jacobian(&self, ray: &Ray, jet: &Jet, label: Option<&Label>) -> DMat2 {
        let crossing = self.of_block(ray, self.crossing_jacobian(ray, jet));
        label.map_or(crossing, |label| label.matrix() * crossing)
    }

    /// How the label of a ray follows the point where it leaves, if the light is not parallel.
    #[inline(always)]
    pub(super) fn label(&self, ray: &Ray) -> Option<Label> {
        let (light, of) = (self.curved.as_ref()?, ray.curved.as_ref()?);
        light.congruence.label(&of.arrival)
    }

    /// `M` times a jacobian.
    #[inline(always)]
    fn of_block(&self, ray: &Ray, jacobian: DMat2) -> DMat2 {
        if self.receiver.is_turned() { ray.arrived.crossing * jacobian } else { jacobian }
    }

    /// `A'` for parallel light along the local `N`.
    #[inline(always)]
    fn crossing_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        let h = bend(ray, jet);
        let g = self.length_gradient(ray, &h);
        let (e, de) = self.footprint_direction(ray);
        outer(-e, g) + DMat2::IDENTITY - de * h * (ray.length * self.kappa)
    }

    #[inline(always)]
    fn footprint_direction(&self, ray: &Ray) -> (DVec2, DMat2) {
        let tilt = ray.arrived.tilt;
        (ray.s - tilt * ray.c, outer(tilt, ray.s / ray.c) + DMat2::IDENTITY)
    }

    /// Derivatives of `sum_ij w_ij A_ij`, `A` the footprint's jacobian, with respect to
    /// `u, u_x, u_y, u_xx, u_xy, u_yy`.
    #[inline(always)]
    pub(super) fn footprint_variation(&self, ray: &Ray, jet: &Jet, label: Option<&Label>, w: DMat2) -> [f64; 6] {
        match (&self.curved, &ray.curved, label) {
            (Some(light), Some(of), Some(label)) => self.footprint_variation_from(light, of, (ray, jet), label, w),
            _ if self.receiver.is_turned() => self.crossing_variation(ray, jet, ray.arrived.crossing.transpose() * w),
            _ => self.crossing_variation(ray, jet, w),
        }
    }

    /// The same for `sum_ij w_ij A'_ij` with the `A'` of parallel light along the local `N`, as if
    /// that stayed.
    #[inline(always)]
    fn crossing_variation(&self, ray: &Ray, jet: &Jet, w: DMat2) -> [f64; 6] {
        let Ray { s, c, length, q, arrived: Arrived { tangential: n, axial, tilt, .. }, .. } = *ray;
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

    /// Derivatives of the lens point's component along the unit vector `along` with respect to `u,
    /// u_x, u_y`.
    pub(super) fn lens_point_variation(&self, ray: &Ray, along: DVec2) -> [f64; 3] {
        let axes = self.receiver.axes();
        let row = DVec2::new(axes.x_axis.truncate().dot(along), axes.y_axis.truncate().dot(along));
        let across = axes.z_axis.truncate().dot(along);
        let part = self.direction(ray.s, ray.c).truncate().dot(along);
        let of_slope = self.dl_ds(ray) * -part - row * ray.length + ray.s * (across * ray.length / ray.c);
        [part * self.kappa / ray.q, self.kappa * of_slope.x, self.kappa * of_slope.y]
    }

    /// The height over `x` of the face that sends all of its light to `y` with this path: the
    /// Cartesian oval through `x`.
    ///
    /// From `(q' - N_z h)^2 = |x - Y_t|^2 + (Y_z - h)^2` with `q' = b - N_t . x`, solved without
    /// cancellation. Not finite where the oval does not reach over `x`.
    #[inline(always)]
    pub(super) fn oval_height(&self, x: DVec2, y: DVec2, u: f64) -> f64 {
        if let Some(light) = &self.curved {
            return self.oval_height_from(light, x, y, u);
        }
        let to = self.receiver.point(y);
        let from_here = to.truncate() - x;
        // Differences from the flat face's path keep the digits: q' = q0 + (q' - q0) with q0 =
        // flat_z Y_z.
        let q0 = self.flat.z * to.z;
        let rest = self.incident.truncate().dot(from_here) + self.kappa * u;
        let path = q0 + rest;
        let constant =
            rest * (2.0 * q0 + rest) - from_here.length_squared() - to.z * to.z * (1.0 - self.flat.z * self.flat.z);
        let half = self.incident.z * path - to.z;
        let root = (half * half - (self.incident.z * self.incident.z - 1.0) * constant).sqrt();
        constant / (half + half.signum() * root)
    }

    /// The gradient with respect to `y` of the height of the oval over `x`, for an `x` that is near
    /// the point where the `ray` to `y` leaves: that of `W(X) + |Y - X| - b(y) = 0`, with `grad W`
    /// taken at that point.
    #[inline(always)]
    pub(super) fn oval_gradient(&self, x: DVec2, y: DVec2, height_mm: f64, ray: &Ray) -> DVec2 {
        let direction = (self.receiver.point(y) - x.extend(height_mm)).normalize();
        let incident = self.direction(ray.arrived.tangential, ray.arrived.axial);
        (self.along(direction) - ray.s) / (direction.z - incident.z)
    }

    /// Of two ovals over one point, whether the face is formed by the first: the higher one of
    /// glass, the lower one of a mirror.
    #[inline(always)]
    pub(super) fn forms_face(&self, height: f64, other: f64) -> bool {
        if self.kappa > 0.0 { height > other } else { height < other }
    }
}

impl Map for OpticalPath<'_> {
    type Ray = Ray;
    type Label = Option<Label>;

    #[inline(always)]
    fn ray(&self, y: DVec2, u: f64, slope: DVec2, _: Option<&Ray>) -> Option<Ray> {
        self.ray(y, u, slope)
    }

    #[inline(always)]
    fn point(&self, y: DVec2, ray: &Ray) -> DVec2 {
        self.lens_point(y, ray)
    }

    fn point_variation(&self, ray: &Ray, along: DVec2) -> [f64; 3] {
        self.lens_point_variation(ray, along)
    }

    #[inline(always)]
    fn label(&self, ray: &Ray) -> Option<Label> {
        self.label(ray)
    }

    #[inline(always)]
    fn jacobian(&self, ray: &Ray, jet: &Jet, label: &Option<Label>) -> DMat2 {
        self.footprint_jacobian(ray, jet, label.as_ref())
    }

    /// The light before is even in the coordinates of the footprint, and what is wanted is told for
    /// every node.
    #[inline(always)]
    fn gain(&self, _: &Ray, _: &Option<Label>) -> f64 {
        1.0
    }

    #[inline(always)]
    fn variation(&self, ray: &Ray, jet: &Jet, label: &Option<Label>, w: DMat2, _: f64) -> [f64; 6] {
        self.footprint_variation(ray, jet, label.as_ref(), w)
    }

    #[inline(always)]
    fn height(&self, y: DVec2, ray: &Ray) -> (f64, f64) {
        self.height(y, ray)
    }

    #[inline(always)]
    fn area(&self, ray: &Ray, jet: &Jet, light: f64) -> f64 {
        self.lens_area(ray, jet, light)
    }

    fn distance_mm(&self) -> f64 {
        self.receiver.distance_mm()
    }
}

impl Face for OpticalPath<'_> {
    #[inline(always)]
    fn point_jacobian(&self, ray: &Ray, jet: &Jet) -> DMat2 {
        self.lens_jacobian(ray, jet)
    }

    #[inline(always)]
    fn oval_height(&self, x: DVec2, y: DVec2, u: f64, _: Option<&Ray>) -> f64 {
        self.oval_height(x, y, u)
    }

    #[inline(always)]
    fn oval_gradient(&self, x: DVec2, y: DVec2, height_mm: f64, ray: &Ray) -> DVec2 {
        self.oval_gradient(x, y, height_mm, ray)
    }

    #[inline(always)]
    fn forms_face(&self, height: f64, other: f64) -> bool {
        self.forms_face(height, other)
    }
}

#[cfg(test)]
mod tests;
