//! Which point of the receiver mesh each node of a regular grid on the block belongs to.

use super::mesh::WarpMesh;
use crate::{
    grid::{Extent, Field},
    surface::{HeightField, SurfaceSpline},
};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// For every node of a regular grid on the block its place in the mesh, in quads from the lower
/// left vertex, and how many nodes no triangle covered.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) quads: Field<DVec2>,
    pub(crate) missed: usize,
}

/// Rows of nodes that one task fills.
const BAND: usize = 16;
/// Barycentric coordinates may fall below 0 by this much, so that rounding opens no gap between
/// triangles.
const SLACK: f64 = 1e-9;

/// Inverts the warp piecewise linearly: every quad ABCD is split into the triangles ABC and ACD, in
/// which the place is the barycentric interpolation of those of the corners.
///
/// Nodes that no upright triangle covers (at folds) take the place of their neighbour in the row.
pub(crate) fn locate(mesh: &WarpMesh, block: Extent, nodes: (usize, usize)) -> Places {
    let (nx, ny) = nodes;
    let (mx, my) = (mesh.vertices().0 - 1, mesh.vertices().1 - 1);
    let spacing = block.node_spacing(nx, ny);
    // In units of nodes from here on.
    let at = |i: usize, j: usize| (mesh.vertex(i, j) - block.lower()) / spacing;
    let spans: Vec<(f64, f64)> = (0..my)
        .into_par_iter()
        .map(|j| {
            (0..=mx).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), i| {
                let (a, b) = (at(i, j).y, at(i, j + 1).y);
                (low.min(a.min(b)), high.max(a.max(b)))
            })
        })
        .collect();
    let mut data = vec![DVec2::NAN; nx * ny];
    let missed: Vec<usize> = data
        .par_chunks_mut(nx * BAND)
        .enumerate()
        .map(|(band, places)| {
            let (begin, rows) = (band * BAND, places.len() / nx);
            let (low, high) = (begin as f64 - 0.5, (begin + rows) as f64 - 0.5);
            for (j, _) in spans.iter().enumerate().filter(|(_, span)| span.0 <= high && span.1 >= low) {
                for i in 0..mx {
                    let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    let least = corners.iter().fold(DVec2::INFINITY, |m, c| m.min(*c));
                    let greatest = corners.iter().fold(DVec2::NEG_INFINITY, |m, c| m.max(*c));
                    let range = |least: f64, greatest: f64, from: usize, to: usize| {
                        let first = ((least - SLACK).ceil().max(0.0) as usize).max(from);
                        (first, (((greatest + SLACK).floor() + 1.0).max(0.0) as usize).min(to))
                    };
                    let (row_begin, row_end) = range(least.y, greatest.y, begin, begin + rows);
                    let (column_begin, column_end) = range(least.x, greatest.x, 0, nx);
                    for row in row_begin..row_end {
                        for column in column_begin..column_end {
                            let node = DVec2::new(column as f64, row as f64);
                            if let Some(inside) = place_in_quad(node, corners) {
                                places[(row - begin) * nx + column] = DVec2::new(i as f64, j as f64) + inside;
                            }
                        }
                    }
                }
            }
            places.chunks_mut(nx).map(fill_gaps).sum()
        })
        .collect();
    Places { quads: Field::from_vec(nx, ny, data), missed: missed.iter().sum() }
}

/// Place of `p` in a quad as (s, t) from A; `None` outside of both triangles, or where they are
/// inverted.
fn place_in_quad(p: DVec2, [a, b, c, d]: [DVec2; 4]) -> Option<DVec2> {
    let barycentric = |q: DVec2, r: DVec2| {
        let area = (q - a).perp_dot(r - a);
        let (v, w) = ((p - a).perp_dot(r - a) / area, (q - a).perp_dot(p - a) / area);
        (area > 0.0 && v >= -SLACK && w >= -SLACK && v + w <= 1.0 + SLACK).then_some((v, w))
    };
    // ABC: A at (0, 0), B at (1, 0), C at (1, 1). ACD: D at (0, 1).
    let place = barycentric(b, c)
        .map(|(v, w)| DVec2::new(v + w, w))
        .or_else(|| barycentric(c, d).map(|(v, w)| DVec2::new(v, v + w)))?;
    Some(place.clamp(DVec2::ZERO, DVec2::ONE))
}

/// Copies the neighbour to the left, or else to the right; returns how many were missing.
fn fill_gaps(row: &mut [DVec2]) -> usize {
    let missing = row.iter().filter(|p| p.is_nan()).count();
    if missing > 0 {
        for i in 1..row.len() {
            if row[i].is_nan() {
                row[i] = row[i - 1];
            }
        }
        for i in (0..row.len() - 1).rev() {
            if row[i].is_nan() {
                row[i] = row[i + 1];
            }
        }
    }
    missing
}

/// Newton steps of [`refine`] at most; from the piecewise linear start three are usual.
const NEWTON_STEPS: usize = 12;
/// A step this short, in quads, was the last.
const LAST_STEP: f64 = 1e-4;

/// Replaces the piecewise linear inverse by that of the bicubic spline through the vertices.
///
/// Returns for how many nodes Newton's method found no solution; they keep the linear one.
pub(crate) fn refine(places: &mut Places, mesh: &WarpMesh, block: Extent) -> usize {
    let (mx, my) = (mesh.vertices().0 - 1, mesh.vertices().1 - 1);
    let (nx, ny) = (places.quads.nx(), places.quads.ny());
    // One spline for each coordinate, over the mesh's own coordinates in quads.
    let over = Extent::new(mx as f64, my as f64);
    let splines = [0, 1].map(|axis| {
        let field = mesh.coordinate(axis);
        let mean = field.mean();
        (mean, SurfaceSpline::through(&HeightField::new(over, field)))
    });
    let size = DVec2::new(mx as f64, my as f64);
    let failed: Vec<usize> = places
        .quads
        .as_mut_slice()
        .par_chunks_mut(nx)
        .enumerate()
        .map(|(j, row)| {
            let mut failed = 0;
            for (i, place) in row.iter_mut().enumerate() {
                let wanted = block.node(i, j, nx, ny);
                let mut at = *place;
                let mut solved = false;
                for _ in 0..NEWTON_STEPS {
                    let [x, y] = splines.each_ref().map(|(mean, spline)| (mean, spline.sample(at + over.lower())));
                    let residual = wanted - DVec2::new(x.0 + x.1.height_mm, y.0 + y.1.height_mm);
                    let jacobian =
                        DMat2::from_cols(DVec2::new(x.1.slope.x, y.1.slope.x), DVec2::new(x.1.slope.y, y.1.slope.y));
                    if jacobian.determinant() <= 0.0 {
                        break;
                    }
                    let step = jacobian.inverse() * residual;
                    at = (at + step.clamp_length_max(1.0)).clamp(DVec2::ZERO, size);
                    // Convergence is quadratic: the next step would be the square of this one.
                    if step.abs().max_element() <= LAST_STEP {
                        solved = true;
                        break;
                    }
                }
                // Another branch, many quads away, is no solution: the surface would tear.
                if solved && (at - *place).abs().max_element() < 2.0 {
                    *place = at;
                } else {
                    failed += 1;
                }
            }
            failed
        })
        .collect();
    failed.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: Extent = Extent::new(50.0, 40.0);

    fn smooth_mesh(mx: usize, my: usize) -> WarpMesh {
        let mut mesh = WarpMesh::regular(BLOCK, (mx, my));
        let n = (mx + 1) * (my + 1);
        for k in 0..n {
            let p = DVec2::new(mesh.coordinates[k], mesh.coordinates[n + k]);
            let q = warp(p);
            (mesh.coordinates[k], mesh.coordinates[n + k]) = (q.x, q.y);
        }
        mesh
    }

    /// Keeps every border on itself.
    fn warp(p: DVec2) -> DVec2 {
        let q = p / BLOCK.as_vec() + 0.5;
        let bump = |t: f64| (std::f64::consts::PI * t).sin();
        p + DVec2::new(3.0 * bump(q.x) * (2.0 * q.y).cos(), 2.0 * bump(q.y) * (3.0 * q.x).sin())
    }

    fn worst_miss(mesh: &WarpMesh, places: &Places) -> f64 {
        let (nx, ny) = (places.quads.nx(), places.quads.ny());
        let quads = DVec2::new((mesh.vertices().0 - 1) as f64, (mesh.vertices().1 - 1) as f64);
        let mut worst = 0.0_f64;
        for j in 0..ny {
            for i in 0..nx {
                let receiver = places.quads[(i, j)] / quads * BLOCK.as_vec() + BLOCK.lower();
                worst = worst.max((warp(receiver) - BLOCK.node(i, j, nx, ny)).length());
            }
        }
        worst
    }

    #[test]
    fn every_node_finds_its_place_with_the_order_of_the_interpolation() {
        let miss = |m: usize| {
            let mesh = smooth_mesh(m, m);
            let mut places = locate(&mesh, BLOCK, (131, 97));
            assert_eq!(places.missed, 0);
            let linear = worst_miss(&mesh, &places);
            assert_eq!(refine(&mut places, &mesh, BLOCK), 0);
            (linear, worst_miss(&mesh, &places))
        };
        let (coarse, fine) = (miss(20), miss(40));
        assert!(coarse.0 / fine.0 > 3.0, "linear: {} to {}", coarse.0, fine.0);
        assert!(coarse.1 / fine.1 > 10.0, "bicubic: {} to {}", coarse.1, fine.1);
        assert!(fine.1 < 1e-3 * fine.0.max(0.05));
    }

    #[test]
    fn border_nodes_stay_on_the_border_of_the_picture() {
        let mesh = smooth_mesh(24, 18);
        let mut places = locate(&mesh, BLOCK, (33, 29));
        refine(&mut places, &mesh, BLOCK);
        for j in 0..29 {
            assert!(places.quads[(0, j)].x.abs() < 1e-9 && (places.quads[(32, j)].x - 24.0).abs() < 1e-9);
        }
        for i in 0..33 {
            assert!(places.quads[(i, 0)].y.abs() < 1e-9 && (places.quads[(i, 28)].y - 18.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_fold_is_counted_not_torn_open() {
        let mut mesh = smooth_mesh(12, 12);
        for row in 3..6 {
            mesh.coordinates.swap(row * 13 + 5, row * 13 + 6);
        }
        let mut places = locate(&mesh, BLOCK, (60, 50));
        let failed = refine(&mut places, &mesh, BLOCK);
        assert!(failed > 0);
        assert!(places.quads.as_slice().iter().all(|p| p.is_finite()));
    }
}
