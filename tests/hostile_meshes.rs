//! Meshes that are sound files and odd solids: finding out what each is, and looking through it if
//! it is a block, takes time in proportion to its size.

use cpu_time::ProcessTime;
use glam::{DVec2, DVec3};
use glasswarp_verify::{BlockError, Mesh, PlacedBlock, Scene, Surface, Tracer, Window, beams};
use std::{f64::consts::TAU, time::Duration};

/// A solid between two rows of points that go round, closed by fans.
fn drum(points: &[DVec3], below: impl Fn(DVec3) -> DVec3) -> Mesh {
    let n = points.len() as u32;
    let mut vertices = points.to_vec();
    vertices.extend(points.iter().map(|&p| below(p)));
    let middle = points.iter().sum::<DVec3>() / f64::from(n);
    vertices.extend([middle, below(middle)]);
    let mut triangles = Vec::new();
    for k in 0..n {
        let next = (k + 1) % n;
        triangles.extend([[2 * n, k, next], [2 * n + 1, n + next, n + k], [k, n + k, n + next], [k, n + next, next]]);
    }
    Mesh { vertices, triangles, ..Mesh::default() }
}

fn round(n: usize) -> Vec<DVec3> {
    (0..n).map(|k| DVec2::from_angle(TAU * k as f64 / n as f64).extend(0.0) * 10.0).collect()
}

/// A grid of so few nodes across and so many along, with walls and a floor.
fn ribbon(across: usize, along: usize) -> Mesh {
    let place = |i: usize, j: usize| DVec2::new(i as f64, j as f64) * 0.3;
    let mut vertices: Vec<DVec3> =
        (0..across * along).map(|k| place(k % across, k / across).extend(0.01 * (k as f64).sin())).collect();
    let node = |i: usize, j: usize| (j * across + i) as u32;
    let mut triangles = Vec::new();
    for j in 0..along - 1 {
        for i in 0..across - 1 {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut border: Vec<u32> = (0..across - 1).map(|i| node(i, 0)).collect();
    border.extend((0..along - 1).map(|j| node(across - 1, j)));
    border.extend((1..across).rev().map(|i| node(i, along - 1)));
    border.extend((1..along).rev().map(|j| node(0, j)));
    let first = vertices.len() as u32;
    let floor: Vec<DVec3> = border.iter().map(|&v| vertices[v as usize].truncate().extend(-2.0)).collect();
    vertices.extend(floor);
    let n = border.len() as u32;
    let centre = vertices.len() as u32;
    vertices.push((0.5 * place(across - 1, along - 1)).extend(-2.0));
    for k in 0..n {
        let (below, next) = (first + k, first + (k + 1) % n);
        let (above, after) = (border[k as usize], border[((k + 1) % n) as usize]);
        triangles.extend([[below, next, after], [below, after, above], [centre, next, below]]);
    }
    Mesh { vertices, triangles, ..Mesh::default() }
}

/// What becomes of a mesh, and the least time of three.
fn time(mesh: &Mesh) -> (String, Duration) {
    let window = Window { size_mm: DVec2::splat(20.0), centre_mm: DVec2::ZERO, nx: 16, ny: 16 };
    let scene = Scene::new(1.5, 250.0, window);
    let mut least = (String::new(), Duration::MAX);
    for _ in 0..3 {
        let mesh = mesh.clone();
        let start = ProcessTime::now();
        let (what, tracer) = match PlacedBlock::find(mesh, None) {
            Ok(placed) => ("a block".into(), Tracer::for_block(&placed.block, &scene).ok()),
            Err(other) => match &other.1 {
                BlockError::Unsound(report) => (report.to_string(), None),
                why => (why.to_string(), None),
            },
        };
        if let Some(tracer) = tracer {
            beams(&tracer, 16, 16);
        }
        if start.elapsed() < least.1 {
            least = (what, start.elapsed());
        }
    }
    least
}

/// A search structure over boxes that grow along their order, and light through all of it.
#[test]
fn fans_are_traced_as_solids_in_a_time_in_proportion_to_their_size() {
    let window = Window { size_mm: DVec2::splat(20.0), centre_mm: DVec2::ZERO, nx: 16, ny: 16 };
    let scene = Scene { surface: Surface::Facets, ..Scene::new(1.5, 250.0, window) };
    let time = |n: usize| {
        let mesh = drum(&round(n), |p| p - DVec3::Z);
        let once = || {
            let start = ProcessTime::now();
            let tracer = Tracer::for_solid(&mesh, &scene).unwrap();
            let built = start.elapsed();
            assert_eq!(beams(&tracer, 16, 16).flux.lost, 0.0);
            [built, start.elapsed() - built]
        };
        let times = [once(), once(), once()];
        [0, 1].map(|k| times.iter().map(|time| time[k]).min().unwrap_or_default())
    };
    let (small, large) = (time(8_000), time(64_000));
    eprintln!("two fans as a solid, built and traced: {small:?}, eight times as large {large:?}");
    // As below. A structure that joins one pair at a time takes thirty times as long to build.
    for (small, large) in small.into_iter().zip(large) {
        assert!(large < 12 * small + Duration::from_millis(100), "{small:?} and {large:?}");
    }
}

#[test]
fn odd_meshes_take_time_in_proportion_to_their_size() {
    type Make = fn(usize) -> Mesh;
    let makes: [(&str, Make, &str); 8] = [
        ("a ribbon", |n| ribbon(4, n), "a block"),
        ("two fans", |n| drum(&round(n), |p| p - DVec3::Z), "entry face"),
        ("needles", |n| drum(&round(n), |p| p - 1e-6 * DVec3::Z), ""),
        (
            "stairs along a diagonal",
            |n| {
                let step = |k: usize| DVec3::new(k as f64, k as f64 + 0.5 * (k % 2) as f64, 0.1 * (k % 3) as f64);
                let mut points: Vec<DVec3> = (0..n / 2).map(step).collect();
                points.extend((0..n / 2).rev().map(|k| step(k) + DVec3::new(-1.0, 1.0, 0.0)));
                drum(&points, |p| p.truncate().extend(-3.0))
            },
            "",
        ),
        (
            "every triangle twice",
            |n| {
                let mesh = drum(&round(n), |p| p - DVec3::Z);
                Mesh { triangles: mesh.triangles.repeat(2), ..mesh }
            },
            "",
        ),
        (
            "triangles of no area",
            |n| {
                let mut mesh = drum(&round(n), |p| p - DVec3::Z);
                mesh.vertices.iter_mut().for_each(|v| v.y = 0.0);
                mesh
            },
            "without area",
        ),
        (
            "loose triangles in a plane",
            |n| {
                let vertices = (0..3 * n).map(|k| DVec3::new((k as f64).sin(), (k as f64).cos(), 0.0)).collect();
                Mesh {
                    vertices,
                    triangles: (0..n as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
                    ..Mesh::default()
                }
            },
            "open edges",
        ),
        (
            "not a number",
            |n| {
                let mut mesh = drum(&round(n), |p| p - DVec3::Z);
                mesh.vertices[0] = DVec3::NAN;
                mesh
            },
            "",
        ),
    ];
    for (name, make, words) in makes {
        let ((what, small), (_, large)) = (time(&make(4_000)), time(&make(32_000)));
        assert!(what.contains(words), "{name}: {what}");
        eprintln!("{name}: {small:?}, eight times as large {large:?} ({what})");
        // Eight times, half as much again for caches and sorting, and what a busy machine adds.
        assert!(large < 12 * small + Duration::from_millis(100), "{name}: {small:?} and {large:?}");
    }
}
