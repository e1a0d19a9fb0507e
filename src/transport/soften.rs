//! The manufacturable face: no beam folded over, and no curvature that a tool of the wanted radius
//! cannot follow.
//!
//! Nodes that break either rule, and to a lesser degree their surroundings, diffuse until none
//! does. Elsewhere the face stays as it is, so that the closed loop can correct for what the
//! softened creases take from their surroundings.

use crate::{
    bench::Bench,
    forward::{Geometry, photon_mesh},
    grid::Field,
    surface::{HeightField, SurfaceSpline},
};
use rayon::prelude::*;

/// Most rounds of diffusion; a crease widens with the root of their number.
const PASSES: usize = 120;
/// Steps of diffusion in a round.
const STEPS: usize = 4;
/// How far around a broken node the face diffuses, in nodes.
const REACH: usize = 3;

/// A softened face, and how many of its nodes still break a rule.
#[derive(Debug)]
pub(super) struct Softened {
    pub(super) surface: HeightField,
    pub(super) violations: usize,
}

/// Softens a face until every radius of curvature at its nodes is at least `radius_mm` and none of
/// the beams between half-node steps is folded.
pub(super) fn soften(mut surface: HeightField, bench: &Bench, radius_mm: f64) -> Softened {
    for _ in 0..PASSES {
        let mask = violations(&surface, bench, radius_mm);
        let count = mask.as_slice().iter().filter(|&&v| v).count();
        if count == 0 {
            return Softened { surface, violations: 0 };
        }
        let rates = rates(&mask);
        for _ in 0..STEPS {
            surface = diffuse(&surface, &rates);
        }
    }
    let violations = count(&surface, bench, radius_mm);
    Softened { surface, violations }
}

/// Nodes that break a rule.
pub(super) fn count(surface: &HeightField, bench: &Bench, radius_mm: f64) -> usize {
    violations(surface, bench, radius_mm).as_slice().iter().filter(|&&v| v).count()
}

/// Nodes where the spline bends too much, or a half-node beam next to them is folded.
fn violations(surface: &HeightField, bench: &Bench, radius_mm: f64) -> Field<bool> {
    let heights = surface.heights_mm();
    let (nx, ny) = (heights.nx(), heights.ny());
    let spline = SurfaceSpline::through(surface);
    let mesh = photon_mesh(&spline, bench, Geometry::Displaced, 2 * nx - 1, 2 * ny - 1);
    let folded = |i: usize, j: usize| {
        let at = |di: usize, dj: usize| mesh[(i + di, j + dj)];
        let (a, b, c, d) = (at(0, 0), at(1, 0), at(1, 1), at(0, 1));
        // Also where a corner is not a number.
        [(b - a).perp_dot(c - a), (c - a).perp_dot(d - a)].iter().any(|area| area.is_nan() || *area < 0.0)
    };
    let outline = surface.contour();
    // Light ends at the outline: what continues the face beyond it may fold.
    let lit = |i: usize, j: usize| {
        let corner = |di: usize, dj: usize| surface.extent().node(i + di, j + dj, 2 * nx - 1, 2 * ny - 1);
        [(0, 0), (1, 0), (1, 1), (0, 1)].into_iter().all(|(di, dj)| outline.contains(corner(di, dj)))
    };
    let mut mask = vec![false; nx * ny];
    mask.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, broken) in row.iter_mut().enumerate() {
            let at = surface.extent().node(i, j, nx, ny);
            if !outline.contains(at) {
                continue;
            }
            let [xx, xy, yy] = spline.sample(at).curvature;
            // The larger eigenvalue of the Hessian bounds every normal curvature.
            let bend = (0.5 * (xx + yy)).abs() + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
            let beams = |k: usize, n: usize| (2 * k).saturating_sub(1)..=(2 * k).min(2 * n - 3);
            *broken = bend * radius_mm > 1.0
                || beams(j, ny).any(|beam_j| beams(i, nx).any(|beam_i| lit(beam_i, beam_j) && folded(beam_i, beam_j)));
        }
    });
    Field::from_vec(nx, ny, mask)
}

/// How fast every node diffuses: fully within reach of a marked one, and less and less further
/// away, since a sharp border of the softened part would be a new crease.
fn rates(mask: &Field<bool>) -> Field<f64> {
    let (nx, ny) = (mask.nx(), mask.ny());
    let mut rates = mask.map(|&broken| if broken { 1.0 } else { 0.0 });
    let near = |k: usize, n: usize| k.saturating_sub(REACH)..(k + REACH + 1).min(n);
    for blur in [false, true, true] {
        let join = |values: &mut dyn Iterator<Item = f64>| {
            let (count, sum, most) = values.fold((0.0, 0.0, 0.0_f64), |(n, s, m), v| (n + 1.0, s + v, m.max(v)));
            if blur { sum / count } else { most }
        };
        let mut along_x = vec![0.0; nx * ny];
        along_x.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
            let row = rates.row(j);
            out.iter_mut().enumerate().for_each(|(i, out)| *out = join(&mut row[near(i, nx)].iter().copied()));
        });
        rates.as_mut_slice().par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
            out.iter_mut().enumerate().for_each(|(i, out)| *out = join(&mut near(j, ny).map(|j| along_x[j * nx + i])));
        });
    }
    rates
}

/// One step of diffusion.
fn diffuse(surface: &HeightField, rates: &Field<f64>) -> HeightField {
    let heights = surface.heights_mm();
    let (nx, ny) = (heights.nx(), heights.ny());
    let mut data = heights.as_slice().to_vec();
    data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, z) in row.iter_mut().enumerate().filter(|&(i, _)| rates[(i, j)] > 0.0) {
            // At the border the bend of its neighbour is taken away from the other side.
            let (ci, cj) = (i.clamp(1, nx - 2), j.clamp(1, ny - 2));
            let bend_x = heights[(ci - 1, j)] - 2.0 * heights[(ci, j)] + heights[(ci + 1, j)];
            let bend_y = heights[(i, cj - 1)] - 2.0 * heights[(i, cj)] + heights[(i, cj + 1)];
            *z += RATE
                * rates[(i, j)]
                * (if ci == i { bend_x } else { -bend_x } + if cj == j { bend_y } else { -bend_y });
        }
    });
    surface.with_heights(Field::from_vec(nx, ny, data))
}

/// Takes away the shortest wave in one step.
const RATE: f64 = 0.125;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bench::ExitFace, grid::Extent};

    #[test]
    fn a_crease_becomes_a_fillet_and_the_rest_stays() {
        let extent = Extent::new(20.0, 20.0);
        let bench = Bench::new(extent, 40.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let crease = HeightField::new(
            extent,
            Field::from_fn(81, 81, |i, j| 0.1 * extent.node(i, j, 81, 81).dot(glam::DVec2::new(0.8, 0.6)).abs()),
        );
        let broken = |surface: &HeightField| violations(surface, &bench, 4.0).as_slice().iter().filter(|&&v| v).count();
        assert!(broken(&crease) > 80);
        let softened = soften(crease.clone(), &bench, 4.0);
        assert_eq!((softened.violations, broken(&softened.surface)), (0, 0));
        let change = |i: usize, j: usize| {
            let at = |surface: &HeightField, i, j| surface.heights_mm()[(i, j)];
            // Against a corner far away, since the mean moves.
            (at(&softened.surface, i, j) - at(&softened.surface, 80, 80)) - (at(&crease, i, j) - at(&crease, 80, 80))
        };
        assert!(change(60, 60).abs() < 1e-12 && change(10, 20).abs() < 1e-12);
        assert!(change(40, 40) > 0.0);
    }

    #[test]
    fn a_smooth_face_stays_to_the_bit() {
        let extent = Extent::new(20.0, 20.0);
        let bench = Bench::new(extent, 100.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let smooth =
            HeightField::new(extent, Field::from_fn(21, 21, |i, j| 1e-3 * extent.node(i, j, 21, 21).length_squared()));
        assert_eq!(soften(smooth.clone(), &bench, 10.0).surface, smooth);
    }
}
