//! Finding where a ray meets triangles, without losing any ray between two of them.
//!
//! A compressed wide BVH in f32 proposes candidates; whether and where a ray meets a candidate is
//! decided in f64 by the test of Woop, Benthin and Wald (Watertight Ray/Triangle Intersection, JCGT
//! 2013). Two triangles that share an edge compute the *same* edge function for it, with exactly
//! opposite signs, so a ray can pass neither between them nor through a common vertex. The boxes
//! are padded by more than f32 can err, so no candidate is missed either.

mod cluster;

use glam::{DVec2, DVec3, UVec2, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::reinsertion::ReinsertionOptimizer,
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh},
    ray::Ray,
    traverse,
};
use rayon::prelude::*;

/// Part of the nodes that are moved to better places once the hierarchy stands: builds two million triangles in about a second on two
/// cores; better hierarchies cost more than they save.
const REINSERTED: f32 = 0.01;
/// Primitives in a leaf, at most.
const LEAF: u32 = 3;

/// A ray prepared for the watertight test: space is sheared and scaled so that it runs along +z
/// from the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchRay {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
    axis: Axis,
    /// Shear along x and y, scale along z.
    shear: DVec3,
    /// -1 for a ray against its axis: mirrors x, so that orientation is kept where z is turned
    /// round.
    mirror: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// Cyclic permutation that brings this axis to z. Cyclic, so that orientation is kept.
    #[inline]
    fn to_z(self, v: DVec3) -> DVec3 {
        match self {
            Self::X => DVec3::new(v.y, v.z, v.x),
            Self::Y => DVec3::new(v.z, v.x, v.y),
            Self::Z => v,
        }
    }
}

impl SearchRay {
    #[inline]
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let a = direction.abs();
        let axis = if a.z >= a.x && a.z >= a.y {
            Axis::Z
        } else if a.x >= a.y {
            Axis::X
        } else {
            Axis::Y
        };
        let d = axis.to_z(direction);
        Self { origin, direction, axis, shear: DVec3::new(d.x / d.z, d.y / d.z, 1.0 / d.z), mirror: 1f64.copysign(d.z) }
    }

    /// The point at distance `t`, mm.
    #[inline]
    pub(crate) fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// A vertex in the sheared space: position across the ray and distance along it.
    #[inline]
    pub(crate) fn sheared(&self, vertex: DVec3) -> (DVec2, f64) {
        let v = self.axis.to_z(vertex - self.origin);
        (DVec2::new(self.mirror * (v.x - self.shear.x * v.z), v.y - self.shear.y * v.z), self.shear.z * v.z)
    }
}

/// A point of a triangle that a ray passes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Distance along the ray, in units of its direction.
    pub(crate) t: f64,
    /// Barycentric weights of the three corners.
    pub(crate) weights: DVec3,
    /// Whether the ray runs with the outward normal (counter-clockwise corners): it leaves the
    /// solid.
    pub(crate) outwards: bool,
}

/// Twice the signed area of the triangle (0, a, b). Exactly antisymmetric in floating point.
#[inline]
pub(crate) fn edge(a: DVec2, b: DVec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Whether a ray passes beside everything between these corners, sheared so that it is the origin:
/// most candidates are told off so.
#[inline(always)]
pub(crate) fn passes_beside(corners: &[(DVec2, f64); 4]) -> bool {
    let lo = corners[0].0.min(corners[1].0).min(corners[2].0).min(corners[3].0);
    let hi = corners[0].0.max(corners[1].0).max(corners[2].0).max(corners[3].0);
    lo.cmpgt(DVec2::ZERO).any() || hi.cmplt(DVec2::ZERO).any()
}

/// Where a ray passes through a triangle, given its corners in the ray's sheared space. The border
/// counts as inside.
#[inline]
pub(crate) fn crossing(corners: [(DVec2, f64); 3]) -> Option<Crossing> {
    let [(a, za), (b, zb), (c, zc)] = corners;
    let w = DVec3::new(edge(b, c), edge(c, a), edge(a, b));
    let all_positive = w.x >= 0.0 && w.y >= 0.0 && w.z >= 0.0;
    if !(all_positive || (w.x <= 0.0 && w.y <= 0.0 && w.z <= 0.0)) {
        return None;
    }
    let sum = w.x + w.y + w.z;
    if sum == 0.0 {
        return None; // Seen edge-on: its neighbours cover the ray.
    }
    let weights = w / sum;
    // Along the ray the area is positive when the corners turn counter-clockwise as seen against
    // +z, that is from where the ray goes to: then the outward normal points along the ray.
    Some(Crossing { t: weights.x * za + weights.y * zb + weights.z * zc, weights, outwards: sum > 0.0 })
}

/// A bounding volume hierarchy over numbered primitives.
#[derive(Debug)]
pub(crate) struct Accelerator {
    bvh: CwBvh,
    /// How far rays start before their origin in the f32 traversal, which is blind very close to
    /// the start, mm.
    back_mm: f64,
}

impl Accelerator {
    /// Builds the hierarchy from the boxes (least and greatest corner, mm) of primitives
    /// `0..count`.
    ///
    /// `reach_mm` bounds the coordinates of every ray origin; origins should stay near the
    /// primitives.
    pub(crate) fn build(count: usize, reach_mm: f64, bounds: impl Fn(usize) -> (DVec3, DVec3) + Sync) -> Self {
        // An f32 slab test errs by a few units in the last place (2^-24) of the largest coordinate
        // difference.
        let padding = 16.0 * f64::from(f32::EPSILON) * reach_mm;
        let boxes: Vec<Aabb> = (0..count)
            .into_par_iter()
            .map(|k| {
                let (lo, hi) = bounds(k);
                let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
                Aabb::new(single(lo - padding), single(hi + padding))
            })
            .collect();
        let mut tree = cluster::tree(&boxes);
        ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
        let bvh = bvh2_to_cwbvh(&tree, LEAF, true, false);
        Self { bvh, back_mm: 0.01 + 64.0 * padding }
    }

    /// The primitive in every slot. Neighbours in space have slots near each other: what a test
    /// needs should lie in this order.
    pub(crate) fn order(&self) -> &[u32] {
        &self.bvh.primitive_indices
    }

    /// Visits candidate slots along the ray; `test` returns the distance of a hit. Ends with all
    /// visited that could hold a hit as near as the nearest found: what is found does not depend on
    /// the order of visits, provided that `test` keeps the nearest and breaks ties by the
    /// primitive's number.
    #[inline]
    pub(crate) fn visit(&self, ray: &SearchRay, mut test: impl FnMut(usize) -> Option<f64>) {
        let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
        let back = self.back_mm;
        let mut search = Ray::new_inf(single(ray.origin - back * ray.direction), single(ray.direction));
        let mut state = self.bvh.new_traversal(search.direction);
        let mut node;
        traverse!(self.bvh, node, state, node.intersect_ray(&search, state.oct_inv4), {
            if let Some(t) = test(state.primitive_id as usize) {
                // Rounded up, so that a tie in f64 is never cut off in f32.
                search.tmax = search.tmax.min(((t + back) * (1.0 + 1e-6)) as f32);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edge_functions_are_exactly_antisymmetric() {
        let mut x = 0.1f64;
        for _ in 0..1000 {
            x = (3.7 * x * (1.0 - x)).abs();
            let (a, b) = (DVec2::new(x, 1.0 - x * x), DVec2::new(x.sin(), x.sqrt() / 3.0));
            assert_eq!(edge(a, b).to_bits(), (-edge(b, a)).to_bits());
        }
    }

    #[test]
    fn crossing_gives_distance_weights_and_side_for_any_axis() {
        let triangle = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 0.0, 1.0)];
        for direction in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, 3.0).normalize()] {
            for sign in [1.0, -1.0] {
                let point = DVec3::new(0.2, 0.3, 0.5);
                let ray = SearchRay::new(point - 2.5 * sign * direction, sign * direction);
                let hit = crossing(triangle.map(|v| ray.sheared(v))).expect("aimed at the inside");
                assert!((hit.t - 2.5).abs() < 1e-14);
                assert!((hit.weights - point).length() < 1e-14, "{:?}", hit.weights);
                assert_eq!(hit.outwards, sign > 0.0, "the normal (1, 1, 1) is outwards");
            }
        }
    }
}
