//! Rays of anybody's own through any solid, without a bench.

use super::{
    path::{RayEnd, RayExit},
    solid::SolidTracer,
};
use crate::{
    mesh::Mesh,
    scene::{Fresnel, Scene, SceneError, Surface, Window},
};
use glam::{DVec2, DVec3};

/// Follows rays from any place, in any direction, through a closed solid of flat facets.
///
/// ```
/// use glam::DVec3;
/// use glasswarp_verify::{Fresnel, Mesh, RayEnd, RayTracer};
///
/// // A plate of glass shifts an oblique ray, and does not turn it.
/// let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), 0.1 * f64::from(k >> 2));
/// let squares = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
/// let triangles = squares.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
/// let plate = Mesh { vertices: (0..8).map(corner).collect(), triangles, ..Mesh::default() };
/// let oblique = DVec3::new(0.6, 0.0, 0.8);
/// let exit = RayTracer::new(&plate, 1.5, Fresnel::Off)?.follow(DVec3::new(0.0, 0.5, -0.5), oblique);
/// assert_eq!((exit.how, exit.interfaces), (RayEnd::Left, 2));
/// assert!(exit.direction.distance(oblique) < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct RayTracer {
    solid: SolidTracer,
}

/// Rays from further away begin this far before the solid's bounding box, mm: single precision
/// finds their way from there.
const BEFORE_MM: f64 = 1.0;

impl RayTracer {
    /// Prepares a [sound](crate::solid::check) mesh, whose triangles face outwards, of refractive
    /// index `ior`.
    ///
    /// # Errors
    /// An index out of range.
    pub fn new(mesh: &Mesh, ior: f64, fresnel: Fresnel) -> Result<Self, SceneError> {
        let (lower, upper) = mesh.bounds();
        let size_mm = (upper - lower).truncate().max(DVec2::splat(1.0));
        let window = Window { size_mm, centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
        let scene = Scene { surface: Surface::Facets, fresnel, ..Scene::new(ior, upper.z + 1.0, window) };
        scene.validate(&[lower, upper])?;
        Ok(Self { solid: SolidTracer::new(mesh, &scene)? })
    }

    /// Follows a ray, refracted wherever that is possible and else reflected, to where it leaves
    /// the solid for good. It may begin in the glass. `direction` need not be of length 1; one
    /// without a length, or a place that is not finite, ends as [`RayEnd::Lost`].
    pub fn follow(&self, origin_mm: DVec3, direction: DVec3) -> RayExit {
        // By its greatest component first, since the square of a length can underflow.
        let along = (direction / direction.abs().max_element()).normalize_or_zero();
        let beginning = |how| RayExit { how, point_mm: origin_mm, direction: along, transmittance: 1.0, interfaces: 0 };
        if along == DVec3::ZERO || !origin_mm.is_finite() {
            return beginning(RayEnd::Lost);
        }
        let Some(t) = self.meets_box(origin_mm, along) else { return beginning(RayEnd::Missed) };
        match self.solid.ray(origin_mm + t * along, along) {
            RayExit { how: RayEnd::Missed, .. } => beginning(RayEnd::Missed),
            exit => exit,
        }
    }

    /// From where on a ray has to be followed: 0, or a little before the bounding box. None if it
    /// passes by.
    fn meets_box(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (lower, upper) = self.solid.bounds();
        let inverse = direction.recip();
        // Within no slab, a ray along it has no crossing: its infinities sort themselves out.
        let (one, other) = ((lower - origin) * inverse, (upper - origin) * inverse);
        let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if origin[axis] < lower[axis] || origin[axis] > upper[axis] {
                    return None;
                }
                continue;
            }
            enters = enters.max(one[axis].min(other[axis]));
            leaves = leaves.min(one[axis].max(other[axis]));
        }
        let margin = 1e-9 * (1.0 + enters.abs());
        (leaves >= (enters - margin).max(0.0)).then(|| (enters - BEFORE_MM).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::mix;

    /// A sphere of radius 1 mm by latitude and longitude.
    fn sphere(rings: u32) -> Mesh {
        let (around, count) = (2 * rings, 2 * rings * (rings - 1));
        let point = |ring: u32, k: u32| {
            let theta = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let phi = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), -theta.cos())
        };
        let mut vertices: Vec<DVec3> = (1..rings).flat_map(|ring| (0..around).map(move |k| point(ring, k))).collect();
        vertices.extend([-DVec3::Z, DVec3::Z]);
        let at = |ring: u32, k: u32| (ring - 1) * around + k % around;
        let mut triangles = Vec::new();
        for k in 0..around {
            triangles.push([count, at(1, k + 1), at(1, k)]);
            triangles.push([count + 1, at(rings - 1, k), at(rings - 1, k + 1)]);
            for ring in 1..rings - 1 {
                let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Mesh { vertices, triangles, ..Mesh::default() }
    }

    /// A number between -1 and 1.
    fn number(k: u64) -> f64 {
        (mix(k) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn point(k: u64) -> DVec3 {
        DVec3::new(number(3 * k), number(3 * k + 1), number(3 * k + 2))
    }

    #[test]
    fn the_sphere_is_sound() {
        assert!(crate::solid::check(&sphere(12)).is_sound());
    }

    #[test]
    fn light_goes_back_the_way_that_it_came_from_any_side() {
        let tracer = RayTracer::new(&sphere(12), 1.5, Fresnel::Off).unwrap();
        let mut met = 0;
        for k in 0..2000 {
            let origin = 50.0 * point(2 * k).normalize();
            let direction = (0.9 * point(2 * k + 1) - origin).normalize();
            let there = tracer.follow(origin, direction);
            if there.how != RayEnd::Left {
                assert!(matches!(there.how, RayEnd::Missed | RayEnd::Trapped), "{there:?}");
                continue;
            }
            met += 1;
            let back = tracer.follow(there.point_mm + 20.0 * there.direction, -there.direction);
            assert_eq!((back.how, back.interfaces), (RayEnd::Left, there.interfaces), "{there:?} {back:?}");
            // f64, over 50 mm and a few interfaces.
            assert!(back.direction.distance(-direction) < 1e-9, "{there:?} {back:?}");
            let aside = (back.point_mm - origin).reject_from_normalized(direction);
            assert!(aside.length() < 1e-7, "{there:?} {back:?}");
        }
        assert!(met > 1000, "{met}");
    }

    #[test]
    fn light_may_begin_in_the_glass_and_far_away() {
        let tracer = RayTracer::new(&sphere(24), 1.5, Fresnel::On).unwrap();
        for k in 0..500 {
            let exit = tracer.follow(0.05 * point(k), point(k + 500));
            assert_eq!((exit.how, exit.interfaces), (RayEnd::Left, 1), "{exit:?}");
            // Nearly straight through: (n - 1)^2 / (n + 1)^2 is reflected.
            assert!((exit.transmittance - 0.96).abs() < 5e-3, "{exit:?}");
            let far = tracer.follow(-1e7 * point(k).normalize(), point(k));
            assert_eq!(far.how, RayEnd::Left, "{far:?}");
        }
        let missed = tracer.follow(DVec3::new(3.0, 0.0, -9.0), DVec3::Z);
        assert_eq!((missed.how, missed.point_mm), (RayEnd::Missed, DVec3::new(3.0, 0.0, -9.0)));
        assert_eq!(tracer.follow(DVec3::ZERO, DVec3::ZERO).how, RayEnd::Lost);
        let short = tracer.follow(DVec3::ZERO, 1e-160 * DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(short.how, RayEnd::Left);
        assert!((short.direction.length() - 1.0).abs() < 1e-14, "{short:?}");
    }
}
