//! Backward caustics (section 2.2 of the paper): from the directions of light to the normal of the
//! face between them.
//!
//! Directions are unit vectors that point *away* from the face: the incident direction `a` is the
//! reverse of the light's own, the exitant direction `b` is the light's own. With `eta = n_b / n_a`
//! Snell's law reads `a - (a.n) n = -eta (b - (b.n) n)`, so that `a + eta b` is collinear with the
//! normal, for refraction and, with `eta = 1`, for reflection alike.

use crate::bench::{Bench, ExitFace};
use glam::{DVec2, DVec3};

/// Light that no height field can send where it is wanted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OpticsError {
    /// Beyond the critical angle: the light would stay inside the block.
    #[error(
        "total internal reflection at x = {:.2} mm, y = {:.2} mm: a deflection of {deflection_deg:.1} degrees is wanted, less than {limit_deg:.1} degrees are possible",
        at_mm.x, at_mm.y
    )]
    TotalInternalReflection {
        /// Point of the face, mm.
        at_mm: DVec2,
        /// Angle between the light before and after the face, degrees.
        deflection_deg: f64,
        /// Greatest possible angle, degrees.
        limit_deg: f64,
    },
    /// The face would have to be vertical or hang over.
    #[error("the face would hang over at x = {:.2} mm, y = {:.2} mm", at_mm.x, at_mm.y)]
    Overhang {
        /// Point of the face, mm.
        at_mm: DVec2,
    },
}

/// Unit normal, on the `+z` side, of a face that turns light arriving from `incident` into
/// `exitant`.
///
/// Both are unit vectors that point away from the face. The result has a meaning only where
/// [`Interface::check`] finds nothing wrong.
pub fn normal(incident: DVec3, exitant: DVec3, eta: f64) -> DVec3 {
    let n = (incident + eta * exitant).normalize_or(DVec3::Z);
    if n.z < 0.0 { -n } else { n }
}

/// Slopes `(dz/dx, dz/dy)` of a face with the given normal, which need not be normalised (4a, 4b).
pub fn slopes_of_normal(normal: DVec3) -> DVec2 {
    -normal.truncate() / normal.z
}

/// Unit normal of a face with the given slopes, on the `+z` side.
pub fn normal_of_slopes(slopes: DVec2) -> DVec3 {
    DVec3::new(-slopes.x, -slopes.y, 1.0).normalize()
}

/// Unit vector of light along `light` behind a face with the unit normal `n` on its far side, `ratio` the
/// index before it over that behind; `None` if it is totally reflected.
#[inline(always)]
pub(crate) fn refracted(light: DVec3, n: DVec3, ratio: f64) -> Option<DVec3> {
    let cos_theta_i = light.dot(n);
    let cos2_theta_t = 1.0 - ratio * ratio * (1.0 - cos_theta_i * cos_theta_i);
    (cos2_theta_t >= 0.0).then(|| ratio * light + (cos2_theta_t.sqrt() - ratio * cos_theta_i) * n)
}

/// The structured face of a bench as light sees it: the constants of (8a, 8b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    incident: DVec3,
    face: ExitFace,
}

impl Interface {
    /// The face of this bench in its parallel light; in the light of a point source, as that
    /// arrives at the middle of the face.
    pub fn of(bench: &Bench) -> Self {
        Self::new(bench.exit_face(), bench.light_direction())
    }

    /// A face in light that travels along the unit vector `light`.
    pub fn new(face: ExitFace, light: DVec3) -> Self {
        Self { incident: -light, face }
    }

    /// Unit vector from the face towards where the light comes from.
    pub fn incident(&self) -> DVec3 {
        self.incident
    }

    /// Quotient of refractive indices `n_b / n_a`.
    pub fn eta(&self) -> f64 {
        self.face.eta()
    }

    /// Slopes of the face that send the light along `to_receiver`, a vector of any length (8a, 8b).
    pub fn slopes(&self, to_receiver: DVec3) -> DVec2 {
        slopes_of_normal(to_receiver.length() * self.incident + self.eta() * to_receiver)
    }

    /// Unit vector along which light leaves a face with the given slopes; `None` if it is totally
    /// reflected inside.
    pub fn exitant(&self, slopes: DVec2) -> Option<DVec3> {
        let n = normal_of_slopes(slopes);
        let light = -self.incident;
        match self.face {
            ExitFace::Reflects => Some(light - 2.0 * light.dot(n) * n),
            ExitFace::Refracts { ior } => refracted(light, n, ior),
        }
    }

    /// Greatest angle, radians, by which the face can turn the light: 90 degrees less the critical
    /// angle for glass (the paper's footnote 1), 180 degrees for a mirror.
    pub fn greatest_deflection(&self) -> f64 {
        match self.face {
            ExitFace::Refracts { .. } => self.eta().acos(),
            ExitFace::Reflects => std::f64::consts::PI,
        }
    }

    /// Whether a height field can send the light along `to_receiver`, a vector of any length, from
    /// the point `at_mm`.
    ///
    /// # Errors
    /// Total internal reflection, or a face that would hang over.
    pub fn check(&self, to_receiver: DVec3, at_mm: DVec2) -> Result<(), OpticsError> {
        let length = to_receiver.length();
        let cosine = self.incident.dot(to_receiver) / length;
        let n_z = self.incident.z * length + self.eta() * to_receiver.z;
        match self.face {
            ExitFace::Refracts { .. } if cosine.is_nan() || cosine >= -self.eta() => {
                Err(OpticsError::TotalInternalReflection {
                    at_mm,
                    deflection_deg: (-cosine).clamp(-1.0, 1.0).acos().to_degrees(),
                    limit_deg: self.greatest_deflection().to_degrees(),
                })
            }
            ExitFace::Refracts { .. } if n_z >= 0.0 => Err(OpticsError::Overhang { at_mm }),
            ExitFace::Reflects if n_z.is_nan() || n_z <= 0.0 => Err(OpticsError::Overhang { at_mm }),
            _ => Ok(()),
        }
    }

    /// How strongly the slope answers to a shift of the point where the ray starts, 1/mm: the
    /// geometric mean of the two singular values of the derivative of (8a, 8b) with respect to `u`.
    ///
    /// For perpendicular light and a ray along the axis this is `c / D`, with `c = eta / (1 - eta)`
    /// for glass and 1/2 for a mirror.
    pub fn slope_gain(&self, to_receiver: DVec3) -> f64 {
        let (i, eta, length) = (self.incident, self.eta(), to_receiver.length());
        let n = length * i + eta * to_receiver;
        let along = i.truncate() - i.z * n.truncate() / n.z;
        // The derivative is -(along (o/|o|)^T + eta I) / n_z.
        let determinant = eta * (eta + along.dot(to_receiver.truncate()) / length) / (n.z * n.z);
        determinant.abs().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Extent;

    fn interface(face: ExitFace, tilt: DVec2) -> Interface {
        let bench = Bench::new(Extent::new(100.0, 100.0), 250.0, face).unwrap();
        let axis = bench.light_direction();
        Interface::of(&bench.with_light_direction(axis + tilt.extend(0.0)).unwrap())
    }

    fn faces() -> Vec<Interface> {
        let kinds = [ExitFace::Refracts { ior: 1.5 }, ExitFace::Refracts { ior: 1.1 }, ExitFace::Reflects];
        let tilts = [DVec2::ZERO, DVec2::new(0.17, 0.05)];
        kinds.iter().flat_map(|&face| tilts.map(|tilt| interface(face, tilt))).collect()
    }

    #[test]
    fn slopes_are_the_inverse_of_refraction_and_reflection() {
        for face in faces() {
            let mut hits = 0;
            for k in 0..400 {
                let (p, q) = (f64::from(k % 20) / 10.0 - 0.95, f64::from(k / 20) / 10.0 - 0.95);
                let slopes = 0.6 * DVec2::new(p, q);
                let Some(exitant) = face.exitant(slopes) else { continue };
                if exitant.z < 1e-3 {
                    continue;
                }
                assert!((exitant.length() - 1.0).abs() < 1e-12);
                assert_eq!(face.check(7.0 * exitant, DVec2::ZERO), Ok(()), "{face:?} {slopes}");
                // Near grazing exit the inverse is as ill-conditioned as a square root at 0.
                assert!((face.slopes(7.0 * exitant) - slopes).length() < 1e-9, "{face:?} {slopes}");
                let n = normal(face.incident(), exitant, face.eta());
                assert!((n - normal_of_slopes(slopes)).length() < 1e-9);
                hits += 1;
            }
            assert!(hits > 200, "{face:?}: {hits}");
        }
    }

    #[test]
    fn total_internal_reflection_begins_at_the_critical_angle() {
        let face = interface(ExitFace::Refracts { ior: 1.5 }, DVec2::ZERO);
        // Perpendicular light meets the face at the angle of its slope; critical: sin = 1/1.5.
        let critical = (1.0_f64 / 1.5).asin();
        let slope = |angle: f64| DVec2::new(angle.tan(), 0.0);
        assert!(face.exitant(slope(critical - 1e-9)).is_some());
        assert!(face.exitant(slope(critical + 1e-9)).is_none());
        // The ray then grazes the face, turned by 90 degrees less the critical angle.
        let limit = std::f64::consts::FRAC_PI_2 - critical;
        assert!((face.greatest_deflection() - limit).abs() < 1e-12);
        let ray = |angle: f64| DVec3::new(angle.sin(), 0.0, angle.cos());
        let at = DVec2::new(3.0, -4.0);
        assert!(face.check(ray(limit - 1e-9), at).is_ok());
        let error = face.check(ray(limit + 1e-9), at).unwrap_err();
        let OpticsError::TotalInternalReflection { at_mm, deflection_deg, limit_deg } = error else {
            panic!("{error}")
        };
        assert_eq!(at_mm, at);
        assert!(deflection_deg >= limit_deg && (limit_deg - limit.to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn the_gain_of_slopes_is_the_derivative_of_the_slopes() {
        for face in faces() {
            let ray = DVec3::new(12.0, -7.0, 90.0);
            let step = 1e-4;
            let column = |d: DVec2| {
                let shift = step * d.extend(0.0);
                (face.slopes(ray - shift) - face.slopes(ray + shift)) / (2.0 * step)
            };
            let (dx, dy) = (column(DVec2::X), column(DVec2::Y));
            let expected = dx.perp_dot(dy).abs().sqrt();
            assert!((face.slope_gain(ray) / expected - 1.0).abs() < 1e-9, "{face:?}");
        }
        let gain = |face| interface(face, DVec2::ZERO).slope_gain(DVec3::new(0.0, 0.0, 250.0)) * 250.0;
        assert!((gain(ExitFace::Refracts { ior: 1.5 }) - 2.0).abs() < 1e-12);
        assert!((gain(ExitFace::Reflects) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_mirror_cannot_send_light_straight_back_down_its_own_face() {
        let face = interface(ExitFace::Reflects, DVec2::ZERO);
        assert!(face.check(DVec3::new(0.0, 0.0, -5.0), DVec2::ZERO).is_err());
        assert!(face.check(DVec3::NAN, DVec2::ZERO).is_err());
    }
}
