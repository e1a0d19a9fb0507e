//! Rays through any closed solid.

use crate::{arrays, fault, work};
use glasswarp::{failure::Failure, glam::DVec3};
use glasswarp_verify::{Fresnel, Mesh, RayEnd, RayTracer, solid};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

type Exits<'py> = (
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
);

/// Rays that one thread follows in a row.
const CHUNK: usize = 1 << 12;

/// What rays of one chunk become, at their places in the arrays.
struct Slots<'a> {
    how: &'a mut [u8],
    points: &'a mut [f64],
    directions: &'a mut [f64],
    transmittance: &'a mut [f64],
    interfaces: &'a mut [u32],
}

/// Follows rays: origins and directions, three numbers each, through vertices (mm) and triangles
/// that face outwards. Returns how each ends (0 left, 1 missed, 2 trapped, 3 lost), where and whither
/// it leaves, what part of its power is left, and how many interfaces it met.
#[pyfunction]
pub(crate) fn trace<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
    rays: PyReadonlyArray2<'py, f64>,
    ior: f64,
    fresnel: bool,
) -> PyResult<Exits<'py>> {
    let count = rays.shape()[0];
    let mesh = Mesh {
        vertices: vertices.as_slice()?.chunks_exact(3).map(DVec3::from_slice).collect(),
        triangles: triangles.as_slice()?.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        ..Mesh::default()
    };
    let rays = rays.as_slice()?;
    let traced = work::done_within(py, |watch| -> Result<_, Failure> {
        let vertices = mesh.vertices.len();
        if let Some(&none) = mesh.triangles.iter().flatten().find(|&&vertex| vertex as usize >= vertices) {
            return Err(Failure::Usage(format!("a triangle names the vertex {none}, and there are {vertices}")));
        }
        if let Some(at) = mesh.vertices.iter().position(|vertex| !vertex.is_finite()) {
            return Err(Failure::Usage(format!("vertex {at} is not finite")));
        }
        let soundness = solid::check(&mesh);
        if !soundness.is_sound() {
            let what = format!("these triangles are no closed solid that faces outwards: {soundness}");
            return Err(Failure::InvalidMesh { what, source: None });
        }
        let tracer = RayTracer::new(&mesh, ior, if fresnel { Fresnel::On } else { Fresnel::Off });
        let tracer = tracer.map_err(Failure::refused)?;
        let (mut how, mut interfaces, mut transmittance) = (vec![0; count], vec![0; count], vec![0.0; count]);
        let (mut points, mut directions) = (vec![0.0; 3 * count], vec![0.0; 3 * count]);
        let slots = how
            .par_chunks_mut(CHUNK)
            .zip(points.par_chunks_mut(3 * CHUNK))
            .zip(directions.par_chunks_mut(3 * CHUNK))
            .zip(transmittance.par_chunks_mut(CHUNK).zip(interfaces.par_chunks_mut(CHUNK)))
            .map(|(((how, points), directions), (transmittance, interfaces))| Slots {
                how,
                points,
                directions,
                transmittance,
                interfaces,
            });
        slots.zip(rays.par_chunks(6 * CHUNK)).try_for_each(|(slots, rays)| {
            for (k, ray) in rays.chunks_exact(6).enumerate() {
                let exit = tracer.follow(DVec3::from_slice(&ray[..3]), DVec3::from_slice(&ray[3..]));
                slots.how[k] = match exit.how {
                    RayEnd::Left => 0,
                    RayEnd::Missed => 1,
                    RayEnd::Trapped => 2,
                    RayEnd::Lost => 3,
                };
                exit.point_mm.write_to_slice(&mut slots.points[3 * k..]);
                exit.direction.write_to_slice(&mut slots.directions[3 * k..]);
                (slots.transmittance[k], slots.interfaces[k]) = (exit.transmittance, exit.interfaces);
            }
            watch.goes_on().then_some(())
        });
        Ok((how, points, directions, transmittance, interfaces))
    })?;
    let (how, points, directions, transmittance, interfaces) = traced.map_err(|failure| fault::raised(py, &failure))?;
    Ok((
        PyArray1::from_vec(py, how),
        arrays::taken(py, (3, count), points)?,
        arrays::taken(py, (3, count), directions)?,
        PyArray1::from_vec(py, transmittance),
        PyArray1::from_vec(py, interfaces),
    ))
}
