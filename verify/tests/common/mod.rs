//! Solids for tests, made here because the verifier must not depend on what makes blocks.
#![allow(dead_code, reason = "every test binary uses its own part")]

use glam::{DVec2, DVec3};
use glasswarp_verify::{Block, Mesh, Optics, Scene, Surface, Tracer, Window};

/// A closed block: a height field over a regular grid, vertical walls, a fan of triangles as entry
/// face.
pub(crate) fn block(nx: usize, ny: usize, size: DVec2, entry_z: f64, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let border = face(&mut mesh, (nx, ny), size, height);
    let below: Vec<u32> = border
        .iter()
        .map(|&v| {
            mesh.vertices.push(mesh.vertices[v as usize].truncate().extend(entry_z));
            mesh.vertices.len() as u32 - 1
        })
        .collect();
    let centre = mesh.vertices.len() as u32;
    mesh.vertices.push(DVec3::new(0.0, 0.0, entry_z));
    for k in 0..border.len() {
        let next = (k + 1) % border.len();
        let (a, b, c, d) = (border[k], border[next], below[next], below[k]);
        mesh.triangles.extend([[a, d, c], [a, c, b], [centre, c, d]]);
    }
    mesh
}

/// A closed block between two height fields over the same grid.
pub(crate) fn lens(
    (nx, ny): (usize, usize),
    size: DVec2,
    entry: impl Fn(f64, f64) -> f64,
    exit: impl Fn(f64, f64) -> f64,
) -> Mesh {
    let mut mesh = Mesh::default();
    let below = face(&mut mesh, (nx, ny), size, entry);
    mesh.triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    let border = face(&mut mesh, (nx, ny), size, exit);
    for k in 0..border.len() {
        let next = (k + 1) % border.len();
        let (a, b, c, d) = (border[k], border[next], below[next], below[k]);
        mesh.triangles.extend([[a, d, c], [a, c, b]]);
    }
    mesh
}

/// Adds a height field that faces up; returns its border, counter-clockwise from above.
fn face(mesh: &mut Mesh, (nx, ny): (usize, usize), size: DVec2, height: impl Fn(f64, f64) -> f64) -> Vec<u32> {
    let first = mesh.vertices.len() as u32;
    let along = |k: usize, n: usize, size: f64| size * (2.0 * k as f64 - (n - 1) as f64) / (2.0 * (n - 1) as f64);
    for j in 0..ny {
        for i in 0..nx {
            let (x, y) = (along(i, nx, size.x), along(j, ny, size.y));
            mesh.vertices.push(DVec3::new(x, y, height(x, y)));
        }
    }
    let at = |i: usize, j: usize| first + (j * nx + i) as u32;
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            // Both cuts appear.
            if (i + j) % 3 == 0 {
                mesh.triangles.extend([[a, b, d], [b, c, d]]);
            } else {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let mut border: Vec<u32> = (0..nx).map(|i| at(i, 0)).collect();
    border.extend((1..ny).map(|j| at(nx - 1, j)));
    border.extend((0..nx - 1).rev().map(|i| at(i, ny - 1)));
    border.extend((1..ny - 1).rev().map(|j| at(0, j)));
    border
}

/// Binary STL in single precision.
pub(crate) fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for k in 0..mesh.triangles.len() {
        bytes.extend([0; 12]);
        for corner in mesh.corners(k) {
            corner.to_array().iter().for_each(|&c| bytes.extend((c as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// A bench whose window is `size` with pixels about as wide as high.
pub(crate) fn scene(size: DVec2, pixels: usize, distance_mm: f64) -> Scene {
    let ny = (pixels as f64 * size.y / size.x).round() as usize;
    Scene::new(1.5, distance_mm, Window { size_mm: size, centre_mm: DVec2::ZERO, nx: pixels, ny })
}

/// A relief as a picture would give it: smooth, without symmetry, no folds at 250 mm.
pub(crate) fn relief(x: f64, y: f64) -> f64 {
    let wave = |a: f64, b: f64, phase: f64, depth: f64| depth * (a * x + b * y + phase).sin();
    wave(0.06, 0.03, 0.3, 0.6)
        + wave(-0.11, 0.13, 1.1, 0.08)
        + wave(0.21, 0.17, 2.0, 0.02)
        + wave(-0.4, 0.33, 0.7, 0.004)
}

/// The same solid through every model and, unless it is a mirror, both tracers.
pub(crate) fn every_tracer(mesh: &Mesh, scene: &Scene) -> Vec<(String, Tracer)> {
    let block = Block::from_mesh(mesh).unwrap();
    let mut tracers = Vec::new();
    for surface in [Surface::Spline, Surface::Smooth, Surface::Facets] {
        let scene = Scene { surface, ..scene.clone() };
        tracers.push((format!("block, {surface:?}"), Tracer::for_block(&block, &scene).unwrap()));
    }
    if scene.optics != Optics::Reflects {
        let scene = Scene { surface: Surface::Facets, ..scene.clone() };
        tracers.push(("full solid".into(), Tracer::for_solid(mesh, &scene).unwrap()));
    }
    tracers
}
