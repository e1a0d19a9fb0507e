//! What every solver of the inverse problem must do, whichever way it goes about it.

#[path = "common/measured.rs"]
mod measured;

use glam::DVec2;
use glasswarp::{
    bench::{Bench, ExitFace},
    export::{Design, write_stl},
    forward::{Geometry, irradiance, photon_mesh},
    grid::{Extent, Field},
    irradiance::{Picture, TargetIrradiance, Transfer, to_picture_order},
    pipeline,
    solid::{Solid, Stock},
    solver::{Problem, Silent, Solution, Solver},
    surface::SurfaceSpline,
    transport::Transport,
    warp::{Warping, WarpingPaper},
};
use glasswarp_verify::{Block, Image, Scene, Tracer, Window, beams, load, metrics};
use measured::{at_worst, within_tenth_of};
use std::path::Path;

/// A solver, and what was measured of the sample picture that it draws.
struct Candidate {
    name: &'static str,
    solver: Box<dyn Solver + Sync>,
    /// Relative RMS error.
    error: f64,
    /// Share of the light that misses the window.
    outside: f64,
    /// How far the border of the block lands beside that of the window at most, mm.
    border_mm: f64,
    /// What the correlation of its light with the picture lacks of 1; the most of pictures of other
    /// shapes.
    unlike: (f64, f64),
}

fn candidates() -> [Candidate; 3] {
    [
        Candidate {
            name: "transport",
            solver: Box::new(Transport::default()),
            error: 0.0048,
            outside: 9.9e-5,
            border_mm: 0.0447,
            unlike: (3.68e-5, 2.66e-4),
        },
        Candidate {
            name: "warping",
            solver: Box::new(Warping::default()),
            error: 0.022,
            outside: 0.00165,
            border_mm: 0.347,
            unlike: (1.011e-3, 1.04e-3),
        },
        Candidate {
            name: "warping-paper",
            solver: Box::new(WarpingPaper::default()),
            error: 0.0846,
            outside: 7.7e-5,
            border_mm: 0.0237,
            unlike: (7.55e-3, 7.17e-3),
        },
    ]
}

const NODES: (usize, usize) = (129, 129);
const CELLS: usize = 64;

/// The letter F: no mirror image or rotation of it looks the same.
fn target() -> TargetIrradiance {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/letter-f/target.png");
    let picture = Picture::open(&path, Some(Transfer::Linear)).unwrap();
    TargetIrradiance::from_picture(&picture, 0.2).unwrap().resampled(CELLS, CELLS)
}

fn bench() -> Bench {
    Bench::new(Extent::new(100.0, 100.0), 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap()
}

fn solve(candidate: &Candidate) -> Solution {
    candidate.solver.solve(&Problem::new(&bench(), &target()), NODES, &Silent).unwrap()
}

fn for_every_solver(check: impl Fn(&Candidate, &Solution)) {
    for candidate in candidates() {
        check(&candidate, &solve(&candidate));
    }
}

fn correlation(a: &Field<f64>, b: &Field<f64>) -> f64 {
    let (ma, mb) = (a.mean(), b.mean());
    let sum = |f: &dyn Fn(f64, f64) -> f64| {
        a.as_slice().iter().zip(b.as_slice()).map(|(&a, &b)| f(a - ma, b - mb)).sum::<f64>()
    };
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

#[test]
fn all_light_arrives_in_the_window_and_none_is_trapped() {
    for_every_solver(|candidate, solution| {
        let spline = SurfaceSpline::through(&solution.exit);
        let caustic = irradiance(&spline, &bench(), Geometry::Displaced, (512, 512), (CELLS, CELLS));
        within_tenth_of(candidate.outside, caustic.outside, format_args!("{}: light that misses", candidate.name));
        assert_eq!(caustic.reflected, 0.0, "{}", candidate.name);
    });
}

#[test]
fn the_border_of_the_block_lands_on_the_border_of_the_window() {
    for_every_solver(|candidate, solution| {
        let mesh = photon_mesh(&SurfaceSpline::through(&solution.exit), &bench(), Geometry::Displaced, 129, 129);
        let worst = (0..129)
            .flat_map(|k| {
                [mesh[(0, k)].x + 50.0, mesh[(128, k)].x - 50.0, mesh[(k, 0)].y + 50.0, mesh[(k, 128)].y - 50.0]
            })
            .fold(0.0_f64, |worst, miss| worst.max(miss.abs()));
        within_tenth_of(candidate.border_mm, worst, format_args!("{}: the border misses by, mm", candidate.name));
    });
}

#[test]
fn the_picture_stands_upright_and_is_not_mirrored() {
    let target = target();
    for_every_solver(|candidate, solution| {
        let spline = SurfaceSpline::through(&solution.exit);
        let light = irradiance(&spline, &bench(), Geometry::Displaced, (512, 512), (CELLS, CELLS)).irradiance;
        let upright = correlation(&light, target.cells());
        within_tenth_of(candidate.unlike.0, 1.0 - upright, format_args!("{}: correlation", candidate.name));
        let last = CELLS - 1;
        for turned in [
            Field::from_fn(CELLS, CELLS, |i, j| light[(last - i, j)]),
            Field::from_fn(CELLS, CELLS, |i, j| light[(i, last - j)]),
            Field::from_fn(CELLS, CELLS, |i, j| light[(j, i)]),
            to_picture_order(&light),
        ] {
            let other = correlation(&turned, target.cells());
            assert!(other < upright - 0.2, "{}: {other} against {upright}", candidate.name);
        }
    });
}

#[test]
fn the_exported_block_draws_the_picture_by_the_verifiers_judgement() {
    let folder = tempfile::tempdir().unwrap();
    for_every_solver(|candidate, solution| {
        let solid = Solid::new(&solution.exit, Stock::thinnest_sheet()).unwrap();
        let path = folder.path().join("block.stl");
        let design = Design { name: "f".into(), exit_face: bench().exit_face(), distance_mm: 250.0 };
        write_stl(&mut std::fs::File::create(&path).unwrap(), &solid, &design).unwrap();
        let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
        let pixels = CELLS;
        let window = Window { size_mm: DVec2::splat(100.0), centre_mm: DVec2::ZERO, nx: pixels, ny: pixels };
        let tracer = Tracer::for_block(&block, &Scene::new(1.5, 250.0, window)).unwrap();
        let wanted = to_picture_order(target().resampled(pixels, pixels).cells());
        let wanted = Image::new(pixels, pixels, wanted.into_vec());
        let seen = metrics::compare(&beams(&tracer, 512, 512).image, &wanted).unwrap();
        within_tenth_of(candidate.error, seen.rel_rms, candidate.name);
    });
}

#[test]
fn results_are_the_same_bits_on_any_number_of_threads() {
    for candidate in candidates() {
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| solve(&candidate).exit)
        };
        assert!(on(1) == on(3), "{}", candidate.name);
    }
}

#[test]
fn no_beam_is_folded_where_the_solver_does_not_say_so() {
    for_every_solver(|candidate, solution| {
        let mesh = photon_mesh(&SurfaceSpline::through(&solution.exit), &bench(), Geometry::Displaced, 257, 257);
        let mut folded = 0;
        for j in 0..256 {
            for i in 0..256 {
                let (a, b, c, d) = (mesh[(i, j)], mesh[(i + 1, j)], mesh[(i + 1, j + 1)], mesh[(i, j + 1)]);
                folded += usize::from((c - a).perp_dot(d - b) <= 0.0);
            }
        }
        assert!(folded == 0 || !solution.summary.warnings.is_empty(), "{}: {folded} beams", candidate.name);
    });
}

#[test]
fn every_level_is_accounted_for() {
    for_every_solver(|candidate, solution| {
        let summary = &solution.summary;
        assert!(!summary.levels.is_empty(), "{}", candidate.name);
        for level in &summary.levels {
            assert!(level.nx >= 2 && level.ny >= 2 && !level.stage.is_empty());
            assert!(level.iterations.iter().all(|i| i.objective.is_finite() && i.evaluations > 0), "{}", level.stage);
        }
    });
}

#[test]
fn pictures_of_odd_sizes_and_any_aspect_make_blocks() {
    for candidate in candidates() {
        for (nx, ny) in [(4, 4), (31, 7), (17, 61)] {
            let values = Field::from_fn(nx, ny, |i, j| 0.5 + 0.3 * ((i * 3 + j * 5) as f64).sin());
            let target = TargetIrradiance::from_picture(&Picture::from_values(values).unwrap(), 0.2).unwrap();
            let block = Extent::new(80.0, 80.0 * ny as f64 / nx as f64);
            let bench = Bench::new(block, 600.0, ExitFace::Refracts { ior: 1.49 }).unwrap();
            let nodes = pipeline::node_grid(block, 65).unwrap();
            let made = pipeline::design(
                &Problem::new(&bench, &target),
                nodes,
                candidate.solver.as_ref(),
                &Stock::thinnest_sheet().into(),
                &Silent,
            );
            let made = made.unwrap_or_else(|error| panic!("{} on {nx} x {ny}: {error}", candidate.name));
            let spline = SurfaceSpline::through(&made.surface);
            let light = irradiance(&spline, &bench, Geometry::Displaced, (nx * 32, ny * 32), (nx, ny)).irradiance;
            let likeness = correlation(&light, target.cells());
            at_worst(candidate.unlike.1, 1.0 - likeness, format_args!("{} on {nx} x {ny}", candidate.name));
        }
    }
}
