//! What the surface really draws, measured without noise: the border of every pixel, or of every
//! quad of a mesh that is given, is followed back through the displaced surface to the block, where
//! the area that it encloses is the flux it gets (equations 1 to 3 of the paper).
//!
//! The splat of [`forward`](crate::forward) answers for any surface, folded ones included, and
//! needs many beams for each pixel before its own noise is below the error that is left to correct.
//! A warp is known to be nearly right and nearly one-to-one, so that Newton's method on its own
//! vertices is both exact and some twenty times cheaper.

use super::mesh::{ReceiverMesh, WarpMesh};
use crate::{
    bench::Bench,
    grid::{Field, bilinear_resample},
    optics::Interface,
    surface::SurfaceSpline,
};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// Newton steps at most; from the vertices of a warp two are usual.
const NEWTON_STEPS: usize = 8;
/// A point is found when it lands this near to where it should, in pixels.
const TOLERANCE: f64 = 1e-4;

/// Flux through `cells` equal parts of the mesh on the receiver, mean 1 if all of the block's light
/// arrives (of a window: its irradiance); not a number where the border of a cell could not be
/// followed (at folds).
pub(crate) fn flux(
    spline: &SurfaceSpline,
    (mesh, receiver): (&WarpMesh, &ReceiverMesh),
    bench: &Bench,
    cells: (usize, usize),
) -> Field<f64> {
    let (mx, my) = cells;
    // Corners and midpoints of the sides of all pixels.
    let (nx, ny) = (2 * mx + 1, 2 * my + 1);
    let start = [0, 1].map(|axis| bilinear_resample(&mesh.coordinate(axis), nx, ny));
    let pixel = bench.window().as_vec() / DVec2::new(mx as f64, my as f64);
    let tolerance = TOLERANCE * pixel.min_element();
    let mut points = vec![DVec2::NAN; nx * ny];
    points.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, point) in row.iter_mut().enumerate() {
            if (i & 1) + (j & 1) < 2 {
                let wanted = receiver.vertex(i, j, nx, ny);
                let sense = if receiver.is_front(i, j, nx, ny) { 1.0 } else { -1.0 };
                let begin = DVec2::new(start[0][(i, j)], start[1][(i, j)]);
                *point = origin_of((wanted, sense), begin, spline, bench, tolerance).unwrap_or(DVec2::NAN);
            }
        }
    });
    let points = Field::from_vec(nx, ny, points);
    let even = bench.block().area_mm2() / (mx * my) as f64;
    let mut flux = vec![0.0; mx * my];
    flux.par_chunks_mut(mx).enumerate().for_each(|(j, row)| {
        for (i, flux) in row.iter_mut().enumerate() {
            let ring = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
                .map(|(di, dj)| points[(2 * i + di, 2 * j + dj)]);
            let octagon = 0.5 * (0..8).map(|k| ring[k].perp_dot(ring[(k + 1) % 8])).sum::<f64>();
            let quad = 0.5 * (ring[4] - ring[0]).perp_dot(ring[6] - ring[2]);
            // The error of a chord is proportional to its length cubed, so that two halves have a
            // quarter of it.
            *flux = (4.0 * octagon - quad) / (3.0 * even);
        }
    });
    Field::from_vec(mx, my, flux)
}

/// The point of the block whose light lands on `wanted`, turned over if `sense` is negative, or the
/// nearest one on the border of the block.
fn origin_of(
    (wanted, sense): (DVec2, f64),
    begin: DVec2,
    spline: &SurfaceSpline,
    bench: &Bench,
    tolerance: f64,
) -> Option<DVec2> {
    let (low, high) = (bench.block().lower(), -bench.block().lower());
    let interface = Interface::of(bench);
    let tangent = |slope: DVec2| {
        let exitant = interface.exitant(slope)?;
        Some(exitant.truncate() / exitant.z)
    };
    let mut at = begin.clamp(low, high);
    for _ in 0..NEWTON_STEPS {
        let surface = spline.sample(at);
        let way = bench.distance_mm() - surface.height_mm;
        let here = tangent(surface.slope)?;
        let residual = wanted - (at + way * here);
        if residual.abs().max_element() <= tolerance {
            return Some(at);
        }
        // How the direction of the ray answers to the slopes.
        let step = 1e-5;
        let answer = DMat2::from_cols(
            (tangent(surface.slope + DVec2::X * step)? - here) / step,
            (tangent(surface.slope + DVec2::Y * step)? - here) / step,
        );
        let [xx, xy, yy] = surface.curvature;
        let curvature = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy));
        let lever = DMat2::from_cols(here * surface.slope.x, here * surface.slope.y);
        let jacobian = DMat2::IDENTITY + way * (answer * curvature) - lever;
        if sense * jacobian.determinant() <= 0.0 {
            return None;
        }
        let next = (at + jacobian.inverse() * residual).clamp(low, high);
        let moved = (next - at).abs().max_element();
        at = next;
        // On the border of the block the light may simply not reach further.
        let on_border = at.cmpeq(low).any() || at.cmpeq(high).any();
        if on_border && moved <= tolerance {
            return Some(at);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{
        bench::ExitFace,
        forward::{self, Geometry},
        grid::Extent,
        surface::HeightField,
    };

    const BLOCK: Extent = Extent::new(60.0, 40.0);

    #[test]
    fn it_agrees_with_beams_cast_through_the_same_surface() {
        let shape = |p: DVec2| 0.4 * (0.11 * p.x).cos() * (0.13 * p.y).cos() + 2e-3 * p.length_squared();
        // A mirror turns light the other way than glass, by (c = 1/2) / (c = 2) of the slope: both
        // spread it beyond the window.
        for (face, sign, distance) in [(ExitFace::Refracts { ior: 1.5 }, 1.0, 150.0), (ExitFace::Reflects, -1.0, 38.0)]
        {
            let heights = Field::from_fn(121, 81, |i, j| sign * shape(BLOCK.node(i, j, 121, 81)));
            let spline = SurfaceSpline::through(&HeightField::new(BLOCK, heights));
            let bench = Bench::new(BLOCK, distance, face).unwrap();
            let cells = (24, 16);
            let beams = forward::irradiance(&spline, &bench, Geometry::Displaced, (1200, 800), cells).irradiance;
            let mesh = WarpMesh::regular(BLOCK, (24, 16));
            let own = flux(&spline, (&mesh, &ReceiverMesh::window(&bench)), &bench, cells);
            let (low, high) = beams.min_max();
            assert!(high - low > 0.3, "{face:?}: the surface must do something: {low} to {high}");
            for (a, b) in own.as_slice().iter().zip(beams.as_slice()) {
                at_worst(6e-5, (a - b).abs(), format_args!("{face:?}: {a} against {b}"));
            }
        }
    }

    #[test]
    fn a_fold_is_no_number() {
        let heights = Field::from_fn(61, 41, |i, j| 0.4 * (1.2 * BLOCK.node(i, j, 61, 41).x).cos());
        let spline = SurfaceSpline::through(&HeightField::new(BLOCK, heights));
        let bench = Bench::new(BLOCK, 150.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        let mesh = WarpMesh::regular(BLOCK, (24, 16));
        let own = flux(&spline, (&mesh, &ReceiverMesh::window(&bench)), &bench, (24, 16));
        assert!(own.as_slice().iter().any(|v| v.is_nan()));
    }
}
