//! Cutting plane areas into triangles: constrained Delaunay triangulation, which uses every vertex
//! of a border.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

/// Triangles of a plane face between its loops, the outer one first and anticlockwise around the
/// outward normal. `None` if it has no area, or loops that cross.
pub(super) fn triangles(vertices: &[DVec3], loops: &[Vec<u32>]) -> Option<Vec<[u32; 3]>> {
    let outer = loops.first()?;
    let at = |v: u32| vertices[v as usize];
    let origin = at(outer[0]);
    // Newell's normal: twice the area.
    let normal: DVec3 =
        (0..outer.len()).map(|k| (at(outer[k]) - origin).cross(at(outer[(k + 1) % outer.len()]) - origin)).sum();
    let normal = normal.try_normalize()?;
    let along = normal.any_orthonormal_vector();
    let up = normal.cross(along);
    let flat = |v: u32| DVec2::new((at(v) - origin).dot(along), (at(v) - origin).dot(up));
    between(loops, flat)
}

/// Triangles between loops of vertices at these places, anticlockwise. `None` as of [`cut`].
pub(super) fn between(loops: &[Vec<u32>], flat: impl Fn(u32) -> DVec2) -> Option<Vec<[u32; 3]>> {
    let all: Vec<u32> = loops.concat();
    let points: Vec<DVec2> = all.iter().map(|&v| flat(v)).collect();
    let mut edges = Vec::with_capacity(all.len());
    let mut start = 0;
    for around in loops {
        edges.extend((0..around.len()).map(|k| [start + k, start + (k + 1) % around.len()]));
        start += around.len();
    }
    Some(cut(&points, edges)?.into_iter().map(|triangle| triangle.map(|k| all[k])).collect())
}

/// Triangles, anticlockwise, of the area that one comes into from outside through an odd number of
/// these edges. `None` if there is none, if edges cross, or if points coincide.
pub(super) fn cut(points: &[DVec2], edges: Vec<[usize; 2]>) -> Option<Vec<[usize; 3]>> {
    let places = points.iter().map(|p| mitigate_underflow(Point2::new(p.x, p.y))).collect();
    let mut crossings = 0;
    let cut =
        ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(places, edges, |_| crossings += 1).ok()?;
    if crossings > 0 || cut.num_vertices() != points.len() {
        return None;
    }
    // From face to face, beginning beyond the hull.
    let outside = cut.outer_face().fix();
    let mut within: Vec<Option<bool>> = vec![None; cut.num_all_faces()];
    within[outside.index()] = Some(false);
    let mut next: Vec<_> = cut.convex_hull().map(|edge| (edge.rev().face().fix(), edge.is_constraint_edge())).collect();
    let mut triangles = Vec::new();
    while let Some((face, is_within)) = next.pop() {
        if within[face.index()].is_some() {
            continue;
        }
        within[face.index()] = Some(is_within);
        let Some(face) = cut.face(face).as_inner() else { continue };
        if is_within {
            triangles.push(face.vertices().map(|vertex| vertex.fix().index()));
        }
        let neighbours = face.adjacent_edges();
        next.extend(neighbours.map(|edge| (edge.rev().face().fix(), is_within != edge.is_constraint_edge())));
    }
    (!triangles.is_empty()).then_some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(vertices: &[DVec3], loops: &[Vec<u32>], normal: DVec3) -> (usize, f64) {
        let cut = triangles(vertices, loops).unwrap();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).dot(normal);
            assert!(area > 0.0, "{t:?} has the area {area}");
            area
        };
        (cut.len(), cut.iter().map(area).sum())
    }

    #[test]
    fn a_wall_under_a_curve_uses_every_vertex_even_on_a_straight_border() {
        for height in
            [|_: f64| 2.0, |x: f64| 2.0 + (9.0 * x).sin(), |x: f64| 0.1 + 3.0 * x * x, |x: f64| 3.1 - 3.0 * x * x]
        {
            let n = 60u32;
            let mut vertices = vec![DVec3::new(0.0, 5.0, 0.0), DVec3::new(1.0, 5.0, 0.0)];
            let x = |k: u32| f64::from(k) / f64::from(n);
            vertices.extend((0..=n).map(|k| DVec3::new(x(k), 5.0, height(x(k)))));
            // Seen from -y, left to right, and back along the top.
            let mut around = vec![0, 1];
            around.extend((2..n + 3).rev());
            let (count, area) = areas(&vertices, &[around], DVec3::NEG_Y);
            let wanted: f64 = (0..n).map(|k| 0.5 * (height(x(k)) + height(x(k + 1))) / f64::from(n)).sum();
            assert_eq!(count, n as usize + 1);
            assert!((area - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn loops_that_cross_or_coincide_and_lines_are_refused() {
        let at = |places: &[(f64, f64)]| places.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect::<Vec<_>>();
        let bow = at(&[(0., 0.), (2., 2.), (2., 0.), (0., 3.)]);
        assert!(triangles(&bow, &[vec![0, 1, 2, 3]]).is_none());
        let twice = at(&[(0., 0.), (2., 0.), (2., 2.), (2., 2.)]);
        assert!(triangles(&twice, &[vec![0, 1, 2, 3]]).is_none());
        let line = at(&[(0., 0.), (1., 1.), (2., 2.)]);
        assert!(triangles(&line, &[vec![0, 1, 2]]).is_none());
        let far = at(&[(0., 0.), (1e300, 0.), (0., f64::NAN)]);
        assert!(triangles(&far, &[vec![0, 1, 2]]).is_none());
    }

    #[test]
    fn a_plane_with_a_hole_is_cut() {
        let square = |r: f64| [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| DVec3::new(x, y, 1.0));
        let vertices = [square(2.0), square(1.0)].concat();
        assert_eq!(areas(&vertices, &[vec![0, 1, 2, 3], vec![7, 6, 5, 4]], DVec3::Z), (8, 12.0));
    }
}
