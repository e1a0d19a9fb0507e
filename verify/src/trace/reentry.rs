//! A cheap proof that light which has left a solid does not enter it again.

use crate::mesh::Mesh;
use glam::DVec3;

/// Planes that are kept; what lies in others counts by its height alone.
const MOST_PLANES: usize = 16;
/// A ray this far in front of a plane is still behind it, mm.
const MARGIN_MM: f64 = 1e-9;

/// Which rays surely meet no triangle from outside.
///
/// A ray within 45 degrees of +z runs with the normal of every triangle whose normal is within 45
/// degrees of +z, and so cannot enter there. All others are in a few planes, as walls are, behind
/// which the ray has to begin, or end lower than it does.
#[derive(Debug)]
pub(super) struct ReentryTest {
    /// Outward normals, and where along them the planes are, mm.
    planes: Vec<(DVec3, f64)>,
    /// Greatest height of the triangles in no such plane, mm.
    top_mm: f64,
}

impl ReentryTest {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut reentry = Self { planes: Vec::new(), top_mm: f64::NEG_INFINITY };
        for k in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(k);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.z > 1.001 * normal.truncate().length() {
                continue;
            }
            // Behind a plane through or before all corners, a ray is behind the triangle, if it
            // faces the same way.
            let in_plane = |&(n, at): &(DVec3, f64)| normal.distance_squared(n) == 0.0 && a.dot(n) == at;
            if reentry.planes.iter().any(in_plane) {
                continue;
            }
            if reentry.planes.len() < MOST_PLANES {
                reentry.planes.push((normal, a.dot(normal)));
            } else {
                reentry.top_mm = reentry.top_mm.max(a.z.max(b.z).max(c.z));
            }
        }
        reentry
    }

    /// Whether this ray, which is outside of the solid, surely does not enter it.
    #[inline]
    pub(super) fn rules_out(&self, origin: DVec3, d: DVec3) -> bool {
        d.z > 0.0
            && d.z * d.z >= d.x * d.x + d.y * d.y
            && origin.z >= self.top_mm
            && self.planes.iter().all(|&(n, at)| origin.dot(n) <= at + MARGIN_MM)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roof of slope 1/2 over a unit square box, ridge along y.
    fn house() -> Mesh {
        let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let vertices = vec![
            v(0.0, 0.0, 0.0),
            v(1.0, 0.0, 0.0),
            v(1.0, 1.0, 0.0),
            v(0.0, 1.0, 0.0),
            v(0.0, 0.0, 1.0),
            v(1.0, 0.0, 1.0),
            v(1.0, 1.0, 1.0),
            v(0.0, 1.0, 1.0),
            v(0.5, 0.0, 1.25),
            v(0.5, 1.0, 1.25),
        ];
        let polygons: [&[u32]; 7] = [
            &[0, 3, 2, 1],
            &[0, 1, 5, 8, 4],
            &[1, 2, 6, 5],
            &[2, 3, 7, 9, 6],
            &[3, 0, 4, 7],
            &[5, 6, 9, 8],
            &[4, 8, 9, 7],
        ];
        let fan = |p: &&[u32]| (1..p.len() - 1).map(|k| [p[0], p[k], p[k + 1]]).collect::<Vec<_>>();
        Mesh { vertices, triangles: polygons.iter().flat_map(fan).collect(), ..Mesh::default() }
    }

    #[test]
    fn light_that_leaves_a_roof_passes_and_light_at_a_wall_does_not() {
        let reentry = ReentryTest::new(&house());
        assert!(reentry.planes.len() == 5 && reentry.top_mm == f64::NEG_INFINITY, "{reentry:?}");
        let passes = |from, to| reentry.rules_out(from, to);
        let roof = DVec3::new(0.25, 0.5, 1.125);
        for aside in [-0.7, 0.0, 0.7] {
            assert!(passes(roof, DVec3::new(aside, 0.0, 1.0).normalize()), "{aside}");
        }
        assert!(!passes(roof, DVec3::new(1.5, 0.0, 1.0).normalize()), "too flat for the proof");
        assert!(!passes(roof, DVec3::new(0.1, 0.0, -1.0).normalize()), "downwards");
        assert!(!passes(DVec3::new(-0.5, 0.5, 0.0), DVec3::new(0.7, 0.0, 1.0).normalize()), "meets the wall");
    }
}
