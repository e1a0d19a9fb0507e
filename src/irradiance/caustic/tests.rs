use super::*;
use crate::{bench::ExitFace, grid::Extent, measured::at_worst};
use std::{fmt::Write as _, path::Path};

const SIZE: (usize, usize) = (7, 6);

fn bench() -> Bench {
    Bench::new(Extent::new(60.0, 50.0), 150.0, ExitFace::Reflects).unwrap()
}

/// A bent grid without symmetry.
fn bent(i: usize, j: usize) -> DVec2 {
    let p = DVec2::new(i as f64, j as f64);
    DVec2::new(7.0 * p.x - 20.0 + 0.4 * p.y, 6.0 * p.y - 16.0 + 0.3 * p.x * p.x)
}

/// An OBJ of a grid whose faces are listed in disorder, turned and wound at random, but for the
/// first.
fn obj(at: impl Fn(usize, usize) -> DVec2) -> String {
    let mut text = String::from("# a mesh\no mesh\n");
    let (nx, ny) = SIZE;
    for k in 0..nx * ny {
        let p = at(k % nx, k / nx);
        writeln!(text, "v {} {} 12.5", p.x, p.y).unwrap();
    }
    let faces: Vec<(usize, usize)> = (0..(nx - 1) * (ny - 1)).map(|k| (k % (nx - 1), k / (nx - 1))).collect();
    // 7 has no common factor with 30.
    for k in 0..faces.len() {
        let (i, j) = faces[7 * k % faces.len()];
        let mut quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        if k > 0 {
            quad.rotate_left(k % 4);
            if k % 3 == 0 {
                quad.reverse();
            }
        }
        let names = quad.map(|(i, j)| (1 + j * nx + i).to_string());
        writeln!(text, "f {}", names.join(" ")).unwrap();
    }
    text
}

fn open(text: &str) -> Result<CausticMesh, CausticMeshError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mesh.obj");
    std::fs::write(&path, text).unwrap();
    let mesh = CausticMesh::open(&path);
    assert_eq!(CausticMesh::read(text.as_bytes()).ok(), mesh.as_ref().ok().cloned());
    mesh
}

#[test]
fn rows_and_columns_are_found_whatever_the_order_of_the_faces() {
    let mesh = open(&obj(bent)).unwrap();
    assert_eq!(mesh.size(), SIZE);
    for j in 0..SIZE.1 {
        for i in 0..SIZE.0 {
            // The file has so many digits.
            at_worst(8.5e-7, (mesh.vertices()[(i, j)] - bent(i, j)).length(), format_args!("({i}, {j})"));
        }
    }
    assert_eq!(mesh.sides(), (30, 0));
    // Vertices in the same place are not the same vertex.
    let folded = |i: usize, j: usize| DVec2::new((i as f64 - 3.0).abs(), j as f64);
    assert_eq!(open(&obj(folded)).unwrap().sides(), (15, 15));
}

#[test]
fn the_spline_through_the_vertices_is_smooth_and_exact() {
    let mesh = open(&obj(bent)).unwrap();
    let (at, by_place) = mesh.at(DVec2::new(0.37, 0.81));
    let (i, j) = (0.37 * 6.0, 0.81 * 5.0);
    let expected = DVec2::new(7.0 * i - 20.0 + 0.4 * j, 6.0 * j - 16.0 + 0.3 * i * i);
    at_worst(2.9e-7, (at - expected).length(), format_args!("{at} {expected}"));
    at_worst(1.63e-6, (by_place.x_axis - DVec2::new(42.0, 0.6 * i * 6.0)).length(), "along rows");
    at_worst(5.8e-7, (by_place.y_axis - DVec2::new(2.0, 30.0)).length(), "along columns");
}

#[test]
fn what_is_no_grid_is_refused_by_name() {
    let refused = |text: &str| open(text).unwrap_err().to_string();
    let good = obj(bent);
    let without = |n: usize| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines.remove(lines.len() - n);
        lines.join("\n")
    };
    assert!(refused(&without(1)).contains("no grid"), "{}", refused(&without(1)));
    assert!(refused(&good.replacen("f 1 2 9 8\n", "f 1 2 9\n", 1)).contains("3 corners"));
    assert!(refused(&good.replacen("f 1 2 9 8\n", "f 2 9 8 1\n", 1)).contains("no corner of the mesh"));
    assert!(
        refused(&format!("{good}f 1 2 9 8\n")).contains("more than two")
            || refused(&format!("{good}f 1 2 9 8\n")).contains("no grid")
    );
    assert!(refused(&format!("{good}f 1 1 9 8\n")).contains("same vertex twice"));
    assert!(refused(&good.replacen(" 12.5", " 13.5", 1)).contains("same finite z"));
    assert!(refused(&format!("{good}o other\nf 1 2 9 8\n")).contains("several objects"));
    assert!(refused("o nothing\nv 0 0 0\n").contains("no faces"));
    assert!(refused("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").contains("2 x 2 vertices"));
    assert!(matches!(open("f 1 2 3 99\n").unwrap_err(), CausticMeshError::Read { .. } | CausticMeshError::Empty));
    assert!(matches!(CausticMesh::open(Path::new("/nowhere.obj")).unwrap_err(), CausticMeshError::Read { .. }));
    // A ring: the last column is the first.
    let (nx, ny) = (8, 6);
    let mut ring = String::new();
    for k in 0..nx * ny {
        let p = (10.0 + f64::from(k / nx)) * DVec2::from_angle(f64::from(k % nx));
        writeln!(ring, "v {} {} 0", p.x, p.y).unwrap();
    }
    for k in 0..nx * (ny - 1) {
        let (i, j) = (k % nx, k / nx);
        let next = (i + 1) % nx;
        let names = [(i, j), (next, j), (next, j + 1), (i, j + 1)].map(|(i, j)| (1 + j * nx + i).to_string());
        writeln!(ring, "f {}", names.join(" ")).unwrap();
    }
    assert!(matches!(open(&ring).unwrap_err(), CausticMeshError::NotAGrid { .. }));
}

#[test]
fn a_mesh_beyond_the_picture_is_refused_with_the_distance() {
    let mesh =
        CausticMesh::new(Field::from_fn(7, 6, |i, j| 10.0 * (DVec2::new(i as f64, j as f64) - DVec2::new(3.0, 2.5))));
    let error = mesh.unwrap().check(&bench().with_window(Extent::new(56.0, 50.0), DVec2::ZERO).unwrap()).unwrap_err();
    assert!(matches!(error, CausticMeshError::BeyondWindow { by_mm, .. } if (by_mm - 2.0).abs() < 1e-9), "{error}");
}

#[test]
fn layers_share_the_light_of_the_picture_and_add_up_to_it() {
    let bench = bench();
    let light = |i: usize, j: usize| 0.5 + ((3 * i + 7 * j) % 11) as f64;
    let target = TargetIrradiance::new(Field::from_fn(30, 25, light)).unwrap();
    // The window, plain: every pixel is covered once.
    let plain = CausticMesh::new(Field::from_fn(7, 6, |i, j| {
        DVec2::new(60.0 * (i as f64 / 6.0 - 0.5), 50.0 * (j as f64 / 5.0 - 0.5))
    }))
    .unwrap();
    let covered = plain.covered(&target, &bench).unwrap();
    let flux = plain.flux(&target, &bench, (30, 25));
    for (k, wanted) in target.cells().as_slice().iter().enumerate() {
        assert!((covered.cells().as_slice()[k] - wanted).abs() < 1e-12);
        assert!((flux.as_slice()[k] - wanted).abs() < 1e-12);
    }
    // The right half of the picture, three times over: there and back and there again.
    let folded = CausticMesh::new(Field::from_fn(61, 6, |i, j| {
        let t = i as f64 / 60.0;
        DVec2::new(29.9 * (0.5 - 0.5 * (3.0 * std::f64::consts::PI * t).cos()), 50.0 * (j as f64 / 5.0 - 0.5))
    }))
    .unwrap();
    let covered = folded.covered(&target, &bench).unwrap();
    assert_eq!(covered.cells()[(14, 3)], 0.0);
    assert!((covered.cells()[(20, 3)] / covered.cells()[(25, 8)] - light(20, 3) / light(25, 8)).abs() < 1e-12);
    let flux = folded.flux(&target, &bench, (90, 25));
    // Each third has the light of the half.
    let third = |k: usize| (30 * k..30 * (k + 1)).map(|i| (0..25).map(|j| flux[(i, j)]).sum::<f64>()).sum::<f64>();
    for k in 0..3 {
        at_worst(5.8e-7, (third(k) / (30.0 * 25.0) - 1.0).abs(), format_args!("third {k}"));
    }
}
