//! Triangles in their search structure.

use super::accel::{Accelerator, Crossing, SearchRay, crossing, passes_beside};
use crate::mesh::Mesh;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashSet;

/// Triangles, two neighbours at a time, in the order of their search structure.
#[derive(Debug)]
pub(super) struct Facets {
    accelerator: Option<Accelerator>,
    quads: Quads,
    /// Number of the first triangle of every slot; the second one's is the next.
    numbers: Vec<u32>,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Its number in the mesh.
    pub(super) triangle: u32,
    pub(super) place: Place,
    pub(super) crossing: Crossing,
}

/// Where a triangle is kept.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    Rectangle,
    Floor(u32),
    Rest(u32),
}

/// Corners a, b, c, d of two triangles (a, b, c) and (a, c, d); of one alone d = c, which no ray
/// meets. Fetching them from memory is the most that a ray costs, so they are kept as small as is
/// exact.
#[derive(Debug)]
enum Quads {
    /// Every coordinate is a number of single precision, as in STL.
    Single(Vec<[Vec3; 4]>),
    Double(Vec<[DVec3; 4]>),
}

impl Quads {
    fn new(mesh: &Mesh, quads: Vec<[u32; 4]>) -> Self {
        let corners = |quad: &[u32; 4]| quad.map(|v| mesh.vertices[v as usize]);
        if mesh.vertices.par_iter().all(|v| v.as_vec3().as_dvec3() == *v) {
            Self::Single(quads.par_iter().map(|quad| corners(quad).map(DVec3::as_vec3)).collect())
        } else {
            Self::Double(quads.par_iter().map(corners).collect())
        }
    }

    #[inline]
    fn at(&self, slot: usize) -> [DVec3; 4] {
        match self {
            Self::Single(quads) => quads[slot].map(Vec3::as_dvec3),
            Self::Double(quads) => quads[slot],
        }
    }
}

/// The first or second triangle of a quad.
#[inline]
fn half<T: Copy>([a, b, c, d]: [T; 4], second: bool) -> [T; 3] {
    if second { [a, c, d] } else { [a, b, c] }
}

impl Facets {
    /// `triangles` of a mesh, by ascending number. Corners keep their order if `turns` says so;
    /// else triangles may be turned.
    pub(super) fn new(mesh: &Mesh, triangles: &[u32], turns: Turns, reach_mm: f64) -> Self {
        let mut quads = Vec::with_capacity(triangles.len());
        let mut k = 0;
        while k < triangles.len() {
            let first = triangles[k];
            let next = triangles.get(k + 1).filter(|&&next| turns == Turns::Free && next == first + 1);
            let pair = next.and_then(|&next| joined(mesh.triangles[first as usize], mesh.triangles[next as usize]));
            let [a, b, c] = mesh.triangles[first as usize];
            quads.push((first, pair.unwrap_or([a, b, c, c])));
            k += 1 + usize::from(pair.is_some());
        }
        if quads.is_empty() {
            return Self { accelerator: None, quads: Quads::Double(Vec::new()), numbers: Vec::new() };
        }
        let accelerator = Accelerator::build(quads.len(), reach_mm, |k| {
            let [a, b, c, d] = quads[k].1.map(|v| mesh.vertices[v as usize]);
            (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
        });
        let sorted = |k: &u32| quads[*k as usize];
        let numbers = accelerator.order().par_iter().map(|k| sorted(k).0).collect();
        let sorted = accelerator.order().par_iter().map(|k| sorted(k).1).collect();
        Self { accelerator: Some(accelerator), quads: Quads::new(mesh, sorted), numbers }
    }

    /// The corners of the triangle at a [`Place`].
    #[inline]
    pub(super) fn triangle(&self, at: u32) -> [DVec3; 3] {
        half(self.quads.at(at as usize / 2), at % 2 == 1)
    }

    /// The nearest crossing beyond `least_t` that runs with the outward normal or against it,
    /// unless `best` is nearer.
    #[inline]
    pub(super) fn nearest(
        &self,
        ray: &SearchRay,
        outwards: bool,
        least_t: f64,
        best: Option<Found>,
        place: impl Fn(u32) -> Place,
    ) -> Option<Found> {
        let Some(accelerator) = &self.accelerator else { return best };
        let mut nearest = best;
        accelerator.visit(ray, |slot| {
            let corners = self.quads.at(slot).map(|p| ray.sheared(p));
            if passes_beside(&corners) {
                return None;
            }
            let mut met = None;
            for second in [false, true] {
                let Some(crossing) = crossing(half(corners, second)) else { continue };
                if crossing.outwards != outwards || crossing.t <= least_t {
                    continue;
                }
                let triangle = self.numbers[slot] + u32::from(second);
                if nearest.is_none_or(|n| (crossing.t, triangle) < (n.crossing.t, n.triangle)) {
                    let at = 2 * slot as u32 + u32::from(second);
                    nearest = Some(Found { triangle, place: place(at), crossing });
                    met = Some(crossing.t);
                }
            }
            met
        });
        nearest
    }
}

/// Whether the corners of a triangle may be told in another order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turns {
    /// From any corner on.
    Free,
    /// As the mesh has them: something else is kept by corner.
    Fixed,
}

/// The quad that two triangles are which share an edge.
fn joined(first: [u32; 3], second: [u32; 3]) -> Option<[u32; 4]> {
    (0..3).find_map(|i| {
        let (c, a, b) = (first[i], first[(i + 1) % 3], first[(i + 2) % 3]);
        let j = (0..3).find(|&j| second[j] == a && second[(j + 1) % 3] == c)?;
        Some([a, b, c, second[(j + 2) % 3]])
    })
}

/// The rectangle that these triangles of one plane fill, facing down, if they do.
pub(super) fn rectangle(mesh: &Mesh, triangles: &[u32]) -> Option<[DVec3; 3]> {
    let all = |of: fn(DVec3, DVec3) -> DVec3| triangles.iter().flat_map(|&k| mesh.corners(k as usize)).reduce(of);
    let (lo, hi) = (all(DVec3::min)?, all(DVec3::max)?);
    let edges = |k: u32| {
        let [a, b, c] = mesh.triangles[k as usize];
        [(a, b), (b, c), (c, a)]
    };
    let known: HashSet<(u32, u32)> = triangles.iter().flat_map(|&k| edges(k)).collect();
    let position = |v: u32| mesh.vertices[v as usize];
    let on_side = |&(a, b): &(u32, u32)| {
        let (a, b) = (position(a), position(b));
        (a.x == b.x && (a.x == lo.x || a.x == hi.x)) || (a.y == b.y && (a.y == lo.y || a.y == hi.y))
    };
    // With a border on the rectangle's sides only, they go round every point inside equally often:
    // once, by their area.
    let bordered = known.iter().filter(|&&(a, b)| !known.contains(&(b, a))).all(on_side);
    let area: f64 = triangles
        .iter()
        .map(|&k| {
            let [a, b, c] = mesh.corners(k as usize);
            -0.5 * (b - a).cross(c - a).z
        })
        .sum();
    let whole = (hi.x - lo.x) * (hi.y - lo.y);
    (bordered && whole > 0.0 && (area / whole - 1.0).abs() < 1e-6).then(|| [lo, DVec3::new(lo.x, hi.y, lo.z), hi])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_joined_along_their_edge_and_keep_their_orientation() {
        // Both turned in all ways.
        for i in 0..3 {
            for j in 0..3 {
                let (mut first, mut second) = ([1, 2, 3], [1, 3, 4]);
                first.rotate_left(i);
                second.rotate_left(j);
                assert_eq!(joined(first, second), Some([1, 2, 3, 4]));
            }
        }
        assert_eq!(joined([1, 2, 3], [1, 4, 5]), None, "only a corner");
        assert_eq!(joined([1, 2, 3], [3, 1, 4]), None, "of opposite orientation");
    }

    #[test]
    fn a_rectangle_is_known_however_it_is_cut_and_others_are_not() {
        let v = |x: f64, y: f64| DVec3::new(x, y, -3.0);
        let vertices = vec![v(0.0, 0.0), v(4.0, 0.0), v(4.0, 2.0), v(0.0, 2.0), v(1.5, 0.5), v(2.0, 0.0)];
        let facing_down = |t: &[[u32; 3]]| Mesh {
            vertices: vertices.clone(),
            triangles: t.iter().map(|&[a, b, c]| [a, c, b]).collect(),
            ..Mesh::default()
        };
        let of = |mesh: &Mesh| rectangle(mesh, &(0..mesh.triangles.len() as u32).collect::<Vec<_>>());
        let whole = Some([v(0.0, 0.0), v(0.0, 2.0), v(4.0, 2.0)]);
        assert_eq!(of(&facing_down(&[[0, 1, 2], [0, 2, 3]])), whole);
        assert_eq!(of(&facing_down(&[[0, 5, 4], [5, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])), whole);
        assert_eq!(of(&facing_down(&[[0, 1, 2]])), None, "half of it");
        assert_eq!(of(&facing_down(&[[0, 5, 4], [5, 1, 4], [1, 2, 4], [2, 3, 4]])), None, "a piece is missing");
        assert_eq!(of(&facing_down(&[[0, 2, 1], [0, 3, 2]])), None, "facing up");
        assert_eq!(of(&facing_down(&[])), None);
    }
}
