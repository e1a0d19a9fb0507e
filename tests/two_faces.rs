//! Blocks with two free faces through their file: what the verifier finds that they draw, which shares
//! nothing with the solver.

mod common;

use common::measured::within_tenth_of;
use glam::DVec2;
use glasswarp::{
    bench::{Bench, ExitFace, Receiver},
    export::{Design, export},
    grid::{Extent, Field},
    irradiance::{TargetIrradiance, to_picture_order},
    solid::{Shape, Solid, Stock},
    solver::{FreeFaces, Problem, Silent, Solver},
    transport::TwoFaces,
};
use glasswarp_verify::{Block, Scene, Tracer, Window, beams, load};

const BLOCK: Extent = Extent::new(80.0, 60.0);
const IOR: f64 = 1.49;
const DISTANCES_MM: [f64; 2] = [25.0, 180.0];
const THICKNESS_MM: f64 = 50.0;
const PIXELS: (usize, usize) = (64, 48);

/// Letters of a picture as seen from the block: F, and one that is no mirror image of it.
fn letter(strokes: &[[f64; 4]]) -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(PIXELS.0, PIXELS.1, |i, j| {
        let at = DVec2::new((i as f64 + 0.5) / PIXELS.0 as f64, (j as f64 + 0.5) / PIXELS.1 as f64);
        let within =
            |[left, low, right, high]: &[f64; 4]| (*left..*right).contains(&at.x) && (*low..*high).contains(&at.y);
        if strokes.iter().any(within) { 1.6 } else { 0.6 }
    }))
    .unwrap()
}

#[test]
fn the_exported_block_draws_both_pictures_in_every_format() {
    let first = letter(&[[0.3, 0.2, 0.42, 0.8], [0.3, 0.68, 0.7, 0.8], [0.3, 0.46, 0.6, 0.56]]);
    let second = letter(&[[0.6, 0.2, 0.7, 0.8], [0.3, 0.2, 0.7, 0.3]]);
    let bench = Bench::new(BLOCK, DISTANCES_MM[0], ExitFace::Refracts { ior: IOR }).unwrap();
    let problem = Problem::new(&bench, &first)
        .and_target(&second, Receiver::new(DISTANCES_MM[1], BLOCK))
        .unwrap()
        .with_free_faces(FreeFaces::EntryAndExit { thickness_mm: THICKNESS_MM });
    let solution = TwoFaces::default().solve(&problem, (257, 193), &Silent).unwrap();
    let entry = solution.entry.unwrap();
    assert!((entry.thickness_mm - THICKNESS_MM).abs() < 0.1, "{}", entry.thickness_mm);
    let stock = Stock::of_thickness(solution.exit.range_mm().1 + entry.thickness_mm - entry.surface.range_mm().0);
    let solid = Solid::between(&solution.exit, &entry.surface, stock, Shape::default()).unwrap();
    assert!((solid.entry_z_mm() + entry.thickness_mm).abs() < 1e-5, "{}", solid.entry_z_mm());
    let folder = tempfile::tempdir().unwrap();
    for (extension, measured) in [
        ("stl", [0.00100, 0.00549]),
        ("step", [0.00103, 0.00546]),
        ("glb", [0.00101, 0.00549]),
        ("3mf", [0.00101, 0.00549]),
    ] {
        let path = folder.path().join(format!("block.{extension}"));
        let design = Design { name: "two".into(), exit_face: bench.exit_face(), distance_mm: DISTANCES_MM[0] };
        export(&path, &solid, &design).unwrap();
        let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
        for (k, target) in [&first, &second].into_iter().enumerate() {
            let window = Window {
                size_mm: DVec2::new(BLOCK.width_mm, BLOCK.height_mm),
                centre_mm: DVec2::ZERO,
                nx: PIXELS.0,
                ny: PIXELS.1,
            };
            let tracer = Tracer::for_block(&block, &Scene::new(IOR, DISTANCES_MM[k], window)).unwrap();
            let seen = beams(&tracer, 1024, 768).image;
            let wanted = to_picture_order(target.cells());
            let mean = seen.mean();
            let of_pixels = seen.values.iter().zip(wanted.as_slice());
            let squares: f64 = of_pixels.map(|(seen, wanted)| (seen / mean - wanted).powi(2)).sum();
            let error = (squares / wanted.as_slice().len() as f64).sqrt();
            within_tenth_of(measured[k], error, format_args!("{extension}, picture {}", k + 1));
        }
    }
}
