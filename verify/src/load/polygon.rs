//! Cutting the polygons of a file into triangles.

use super::{
    assemble::{Assembler, Points},
    error::LoadError,
    plane,
};
use glam::DVec3;

/// Adds a polygon of points that are told by their numbers, with the numbers of its corners'
/// normals if there are any.
pub(super) fn add(
    assembler: &mut Assembler,
    points: &mut Points,
    corners: &[usize],
    normals: Option<&[usize]>,
    nothing: impl Fn(usize) -> LoadError,
) -> Result<(), LoadError> {
    if let Some(&k) = corners.iter().find(|&&k| k >= points.len()) {
        return Err(nothing(k));
    }
    let cut = match corners.len() {
        3 => vec![[0, 1, 2]],
        _ => triangles(&corners.iter().map(|&k| points.positions[k]).collect::<Vec<_>>()),
    };
    for triangle in cut {
        assembler.numbered(points, triangle.map(|k| corners[k]), &nothing)?;
        if let Some(normals) = normals {
            assembler.normal_corners.push(triangle.map(|k| normals[k] as u32));
        }
    }
    Ok(())
}

/// Triangles of a polygon whose corners stand at these places, by the numbers of its corners; going
/// round as it does.
///
/// Four corners are cut along a diagonal that leaves two triangles of some area. More are cut by
/// Delaunay's rule in their plane, which knows corners in a row on a side, and dents; a fan does
/// not. What does not lie in a plane, or crosses itself, becomes a fan.
fn triangles(places: &[DVec3]) -> Vec<[usize; 3]> {
    let area = |[a, b, c]: [usize; 3]| (places[b] - places[a]).cross(places[c] - places[a]).length_squared();
    match places.len() {
        0..=2 => Vec::new(),
        4 => {
            let (fan, other) = ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]);
            let flat = |cut: [[usize; 3]; 2]| cut.iter().any(|&triangle| area(triangle) == 0.0);
            if flat(fan) && !flat(other) { other } else { fan }.to_vec()
        }
        n => {
            let around: Vec<u32> = (0..n as u32).collect();
            match plane::triangles(places, &[around]) {
                Some(cut) if cut.len() == n - 2 => cut.into_iter().map(|t| t.map(|v| v as usize)).collect(),
                _ => (2..n).map(|k| [0, k - 1, k]).collect(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn area(places: &[DVec3]) -> (usize, f64) {
        let twice = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| places[k]);
            (b - a).cross(c - a).z
        };
        let cut = triangles(places);
        assert!(cut.iter().all(|t| twice(t) > 0.0), "{cut:?}");
        (cut.len(), cut.iter().map(|t| 0.5 * twice(t)).sum())
    }

    #[test]
    fn corners_in_a_row_and_dents_are_cut_into_triangles_of_some_area() {
        let at = |x: f64, y: f64| DVec3::new(x, y, 3.0);
        assert_eq!(area(&[at(0., 0.), at(1., 0.), at(2., 0.), at(0., 2.)]), (2, 2.0));
        assert_eq!(area(&[at(0., 0.), at(2., 0.), at(2., 2.), at(1., 1.), at(0., 2.)]), (3, 3.0));
        let side = |k: usize| match (k / 10, (k % 10) as f64) {
            (0, s) => at(s, 0.0),
            (1, s) => at(10.0, s),
            (2, s) => at(10.0 - s, 10.0),
            (_, s) => at(0.0, 10.0 - s),
        };
        assert_eq!(area(&(0..40).map(side).collect::<Vec<_>>()), (38, 100.0));
        let disc: Vec<DVec3> = (0..50).map(|k| f64::from(k) / 50.0 * TAU).map(|a| at(a.cos(), a.sin())).collect();
        assert_eq!(area(&disc).0, 48);
    }

    #[test]
    fn a_polygon_out_of_any_plane_is_a_fan() {
        let crossing = [(0., 0.), (2., 2.), (2., 0.), (0., 2.), (-1., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(triangles(&crossing), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        assert_eq!(triangles(&[DVec3::NAN; 5]).len(), 3);
    }
}
