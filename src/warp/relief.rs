//! Heights that belong to a warp: on the mesh, to tell the next pass how far each vertex is from
//! the receiver, and on the regular grid of the block, as the result.

use super::{
    limits::NAME,
    locate::Places,
    mesh::{ReceiverMesh, WarpMesh},
};
use crate::{
    bench::Bench,
    grid::{Extent, Field},
    optics::{Interface, OpticsError},
    solver::SolveError,
    surface::{EdgeRule, HeightField, SurfaceSpline, heights_of_slopes, least_squares},
};
use glam::DVec2;
use rayon::prelude::*;

/// The surface must stay below this part of the way to the receiver.
const GREATEST_RISE: f64 = 0.9;
/// Sweeps of slopes and heights; each shrinks the error by about relief / distance.
const SWEEPS: usize = 3;

/// An optics error in the terms of a solver.
pub(crate) fn refused(error: OpticsError) -> SolveError {
    match error {
        OpticsError::TotalInternalReflection { at_mm, deflection_deg, limit_deg } => {
            SolveError::TotalInternalReflection { at_mm, deflection_deg, limit_deg }
        }
        OpticsError::Overhang { at_mm } => SolveError::Overhang { solver: NAME, at_mm },
    }
}

/// Whether light can go from every vertex to its place on the receiver.
///
/// # Errors
/// The first vertex from which it cannot.
pub(crate) fn check_rays(
    mesh: &WarpMesh,
    receiver: &ReceiverMesh,
    depth_mm: &Field<f64>,
    bench: &Bench,
) -> Result<(), SolveError> {
    let (nx, ny) = mesh.vertices();
    let interface = Interface::of(bench);
    let first = (0..ny).into_par_iter().find_map_first(|j| {
        (0..nx).find_map(|i| {
            let u = mesh.vertex(i, j);
            let ray = (receiver.vertex(i, j, nx, ny) - u).extend(depth_mm[(i, j)]);
            interface.check(ray, u).err()
        })
    });
    first.map_or(Ok(()), |error| Err(refused(error)))
}

/// Heights of the vertices, mm, by least squares over the edges of the mesh, mean 0 over the area
/// of the block.
///
/// `start` holds heights to begin with. Slopes are those of rays that leave the vertex at its
/// height.
///
/// # Errors
/// A surface that reaches the receiver.
pub(crate) fn mesh_heights(
    mesh: &WarpMesh,
    receiver: &ReceiverMesh,
    bench: &Bench,
    start: &Field<f64>,
) -> Result<Field<f64>, SolveError> {
    let (nx, ny) = mesh.vertices();
    let interface = Interface::of(bench);
    let areas = mesh.areas_mm2();
    let landings = receiver.vertices(nx, ny);
    let mut heights = start.clone();
    for _ in 0..SWEEPS {
        let mut slopes = vec![DVec2::ZERO; nx * ny];
        slopes.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            for (i, slope) in row.iter_mut().enumerate() {
                let shift = landings[(i, j)] - mesh.vertex(i, j);
                *slope = interface.slopes(shift.extend(bench.distance_mm() - heights[(i, j)]));
            }
        });
        let slopes = Field::from_vec(nx, ny, slopes);
        let rise = |a: (usize, usize), b: (usize, usize)| {
            0.5 * (slopes[a] + slopes[b]).dot(mesh.vertex(b.0, b.1) - mesh.vertex(a.0, a.1))
        };
        heights = least_squares((nx, ny), DVec2::ONE, |i, j| rise((i, j), (i + 1, j)), |i, j| rise((i, j), (i, j + 1)));
        let moments: Vec<f64> = (0..ny - 1)
            .into_par_iter()
            .map(|j| {
                let (low, high) = (heights.row(j), heights.row(j + 1));
                let moment = |(i, area): (usize, &f64)| 0.25 * area * (low[i] + low[i + 1] + high[i] + high[i + 1]);
                areas.row(j).iter().enumerate().map(moment).sum()
            })
            .collect();
        let mean = moments.iter().sum::<f64>() / bench.block().area_mm2();
        heights.as_mut_slice().iter_mut().for_each(|h| *h -= mean);
        check_rise(&heights, bench)?;
    }
    Ok(heights)
}

fn check_rise(heights: &Field<f64>, bench: &Bench) -> Result<(), SolveError> {
    let (distance_mm, (_, height_mm)) = (bench.distance_mm(), heights.min_max());
    if height_mm.is_nan() || height_mm > GREATEST_RISE * distance_mm {
        return Err(SolveError::ReachesReceiver { height_mm, distance_mm });
    }
    Ok(())
}

/// The surface whose nodes send their light to the given places of the receiver, for rays that
/// leave the true surface.
///
/// `heights` are those of the mesh's vertices, to start from.
///
/// # Errors
/// Light that cannot be bent that far, or a surface that reaches the receiver.
pub(crate) fn displaced_surface(
    places: &Places,
    receiver: &ReceiverMesh,
    heights: &Field<f64>,
    bench: &Bench,
    rule: EdgeRule,
) -> Result<HeightField, SolveError> {
    let (nx, ny) = (places.quads.nx(), places.quads.ny());
    let block = bench.block();
    let quads = (heights.nx() - 1, heights.ny() - 1);
    let landings = places.quads.map(|place| receiver.at(*place, quads));
    let interface = Interface::of(bench);
    let mut surface = HeightField::new(block, places.quads.map(|p| bilinear(heights, *p)));
    let mut slopes = Field::filled(nx, ny, DVec2::ZERO);
    for _ in 0..SWEEPS {
        let z = surface.heights_mm();
        slopes
            .as_mut_slice()
            .par_chunks_mut(nx)
            .enumerate()
            .try_for_each(|(j, row)| {
                for (i, slope) in row.iter_mut().enumerate() {
                    let from = block.node(i, j, nx, ny);
                    let ray = (landings[(i, j)] - from).extend(bench.distance_mm() - z[(i, j)]);
                    interface.check(ray, from)?;
                    *slope = interface.slopes(ray);
                }
                Ok(())
            })
            .map_err(refused)?;
        surface = heights_of_slopes(&slopes, block, rule);
        check_rise(surface.heights_mm(), bench)?;
    }
    Ok(surface)
}

/// How far, root mean square over the nodes, the light of a surface lands from its places on the
/// receiver mesh, mm: what of a mesh no height field can draw.
pub(crate) fn landing_error_mm(
    surface: &HeightField,
    places: &Places,
    receiver: &ReceiverMesh,
    quads: (usize, usize),
    bench: &Bench,
) -> f64 {
    let slopes = SurfaceSpline::through(surface).node_slopes();
    let (nx, ny) = (slopes.nx(), slopes.ny());
    let interface = Interface::of(bench);
    let off = Field::from_fn(nx, ny, |i, j| {
        let from = bench.block().node(i, j, nx, ny).extend(surface.heights_mm()[(i, j)]);
        let landing = interface.exitant(slopes[(i, j)]).map(|out| bench.receiver().landing(from, out));
        landing.map_or(f64::NAN, |at| (at - receiver.at(places.quads[(i, j)], quads)).length_squared())
    });
    off.mean().sqrt()
}

fn bilinear(field: &Field<f64>, at: DVec2) -> f64 {
    let cell = |v: f64, n: usize| (v as usize).min(n - 2);
    let (i, j) = (cell(at.x, field.nx()), cell(at.y, field.ny()));
    let (s, t) = (at.x - i as f64, at.y - j as f64);
    let row = |j: usize| (1.0 - s) * field[(i, j)] + s * field[(i + 1, j)];
    (1.0 - t) * row(j) + t * row(j + 1)
}

/// The surface of the paper: outgoing directions at the vertices, on the plane, interpolated
/// barycentrically to the nodes, turned into slopes there.
///
/// # Errors
/// Light that cannot be bent that far.
pub(crate) fn normal_mapped_surface(
    places: &Places,
    (mesh, receiver): (&WarpMesh, &ReceiverMesh),
    bench: &Bench,
    rule: EdgeRule,
) -> Result<HeightField, SolveError> {
    let (nx, ny) = (places.quads.nx(), places.quads.ny());
    let (vx, vy) = mesh.vertices();
    let block: Extent = bench.block();
    let interface = Interface::of(bench);
    let landings = receiver.vertices(vx, vy);
    let direction = |i: usize, j: usize| (landings[(i, j)] - mesh.vertex(i, j)).extend(bench.distance_mm()).normalize();
    let mut slopes = vec![DVec2::ZERO; nx * ny];
    slopes
        .par_chunks_mut(nx)
        .enumerate()
        .try_for_each(|(row_index, row)| {
            for (column, slope) in row.iter_mut().enumerate() {
                let place = places.quads[(column, row_index)];
                let (i, j) = ((place.x as usize).min(vx - 2), (place.y as usize).min(vy - 2));
                let (s, t) = (place.x - i as f64, place.y - j as f64);
                // In the triangles ABC (s >= t) and ACD of a quad.
                let third = if s >= t { direction(i + 1, j) } else { direction(i, j + 1) };
                let (greater, less) = (s.max(t), s.min(t));
                let ray = (1.0 - greater) * direction(i, j) + (greater - less) * third + less * direction(i + 1, j + 1);
                interface.check(ray, block.node(column, row_index, nx, ny))?;
                *slope = interface.slopes(ray);
            }
            Ok(())
        })
        .map_err(refused)?;
    Ok(heights_of_slopes(&Field::from_vec(nx, ny, slopes), block, rule))
}
