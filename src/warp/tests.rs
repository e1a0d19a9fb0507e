//! Whole solves at a small size, judged by beams cast through the result.

use super::{Warping, WarpingOptions, WarpingPaper, WarpingPaperOptions};
use crate::measured::{at_worst, within_tenth_of};
use crate::{
    bench::{Bench, ExitFace},
    forward::{Geometry, irradiance},
    grid::{Extent, Field},
    irradiance::TargetIrradiance,
    light::Intensity,
    optim::Termination,
    solver::{Event, Problem, Progress, Silent, Solution, SolveError, Solver},
    surface::SurfaceSpline,
};
use glam::{DVec2, DVec3};
use std::{cell::RefCell, ops::ControlFlow};

const BLOCK: Extent = Extent::new(60.0, 45.0);
const PIXELS: (usize, usize) = (48, 36);
const NODES: (usize, usize) = (97, 73);
const GLASS: ExitFace = ExitFace::Refracts { ior: 1.5 };

/// Without any symmetry, so that a flip cannot hide.
fn target((nx, ny): (usize, usize)) -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(nx, ny, |i, j| {
        let p = DVec2::new((i as f64 + 0.5) / nx as f64, (j as f64 + 0.5) / ny as f64);
        let spot = |x: f64, y: f64, width: f64| (-((p - DVec2::new(x, y)).length() / width).powi(2)).exp();
        0.4 + 1.5 * spot(0.3, 0.25, 0.2) + 0.8 * spot(0.75, 0.6, 0.15) + 0.3 * (9.0 * p.x + 4.0 * p.y).sin().powi(2)
    }))
    .unwrap()
}

fn bench(face: ExitFace) -> Bench {
    Bench::new(BLOCK, 150.0, face).unwrap()
}

fn error(solution: &Solution, target: &TargetIrradiance, bench: &Bench, geometry: Geometry) -> f64 {
    let wanted = target.cells();
    let cells = (wanted.nx(), wanted.ny());
    let spline = SurfaceSpline::through(&solution.exit);
    let drawn = irradiance(&spline, bench, geometry, (24 * cells.0, 24 * cells.1), cells).irradiance;
    Field::from_fn(cells.0, cells.1, |i, j| (drawn[(i, j)] - wanted[(i, j)]).powi(2)).mean().sqrt()
}

#[test]
fn the_displaced_surface_draws_the_target_for_glass_and_mirror_and_any_window() {
    for face in [GLASS, ExitFace::Reflects] {
        let own = bench(face);
        let other = own.clone().with_window(Extent::new(75.0, 40.0), DVec2::new(8.0, -5.0)).unwrap();
        for bench in [own, other] {
            let target = target(PIXELS);
            let solution = Warping::default().solve(&Problem::new(&bench, &target), NODES, &Silent).unwrap();
            let error = error(&solution, &target, &bench, Geometry::Displaced);
            at_worst(1.51e-4, error, format_args!("{face:?}, window {:?}", bench.window()));
            assert!(solution.exit.heights_mm().mean().abs() < 1e-12);
        }
    }
}

#[test]
fn the_paper_draws_its_target_on_the_plane_and_loses_by_displacement() {
    let (target, bench) = (target(PIXELS), bench(GLASS));
    let solution = WarpingPaper::default().solve(&Problem::new(&bench, &target), NODES, &Silent).unwrap();
    let plane = error(&solution, &target, &bench, Geometry::NormalMappedPlane);
    let displaced = error(&solution, &target, &bench, Geometry::Displaced);
    within_tenth_of(0.0044, plane, "on the plane");
    assert!(displaced > 1.3 * plane, "the paper's assumption has a price: {plane} on the plane, {displaced} displaced");
}

#[test]
fn the_paper_takes_tilted_light_and_the_improved_mode_says_that_it_does_not() {
    let target = target(PIXELS);
    for face in [GLASS, ExitFace::Reflects] {
        let straight = bench(face);
        let bench =
            straight.clone().with_light_direction(straight.light_direction() + DVec3::new(0.08, -0.05, 0.0)).unwrap();
        let solution = WarpingPaper::default().solve(&Problem::new(&bench, &target), NODES, &Silent).unwrap();
        let plane = error(&solution, &target, &bench, Geometry::NormalMappedPlane);
        at_worst(0.0055, plane, format_args!("{face:?}: {plane}"));
        let refused = Warping::default().solve(&Problem::new(&bench, &target), NODES, &Silent).unwrap_err();
        assert!(matches!(refused, SolveError::Unsupported { solver: "warping", .. }), "{refused}");
    }
}

#[test]
fn both_modes_say_that_they_do_not_take_a_point_source() {
    let target = target(PIXELS);
    let source = DVec3::new(0.0, 0.0, -300.0);
    let bench = bench(GLASS).with_point_source(source, 10.0, Intensity::Isotropic).unwrap();
    for solver in [&Warping::default() as &dyn Solver, &WarpingPaper::default()] {
        let refused = solver.solve(&Problem::new(&bench, &target), NODES, &Silent).unwrap_err();
        assert!(matches!(&refused, SolveError::Unsupported { what, .. } if what.contains("point source")), "{refused}");
    }
}

#[test]
fn neither_the_number_of_threads_nor_the_run_changes_a_bit() {
    let (target, bench) = (target(PIXELS), bench(GLASS));
    let options = WarpingOptions { coarse_iterations: 60, ..WarpingOptions::default() };
    let one = in_pool(1, &target, &bench, options);
    assert_eq!(one, in_pool(3, &target, &bench, options));
}

fn in_pool(
    threads: usize,
    target: &TargetIrradiance,
    bench: &Bench,
    options: WarpingOptions,
) -> Vec<crate::surface::HeightField> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let improved = Warping::new(options).unwrap().solve(&Problem::new(bench, target), NODES, &Silent).unwrap();
        let paper = WarpingPaper::default().solve(&Problem::new(bench, target), NODES, &Silent).unwrap();
        vec![improved.exit, paper.exit]
    })
}

#[test]
fn any_size_of_picture_and_grid_gives_a_surface() {
    let options = WarpingOptions { coarse_iterations: 20, ..WarpingOptions::default() };
    let paper = WarpingPaperOptions { iterations_per_level: 20, ..WarpingPaperOptions::default() };
    for (pixels, nodes) in [((4, 4), (5, 5)), ((31, 17), (40, 23)), ((200, 9), (33, 12)), ((5, 90), (6, 64))] {
        let solvers: [&dyn Solver; 2] = [&Warping::new(options).unwrap(), &WarpingPaper::new(paper).unwrap()];
        for solver in solvers {
            let solution = solver.solve(&Problem::new(&bench(GLASS), &target(pixels)), nodes, &Silent).unwrap();
            let heights = solution.exit.heights_mm();
            assert_eq!((heights.nx(), heights.ny()), nodes);
            assert!(heights.as_slice().iter().all(|h| h.is_finite()));
        }
    }
}

#[test]
fn impossible_light_is_refused_with_its_place_and_limit() {
    let solvers: [&dyn Solver; 2] = [&Warping::default(), &WarpingPaper::default()];
    for solver in solvers {
        let far = bench(GLASS).with_window(BLOCK, DVec2::new(400.0, 0.0)).unwrap();
        let error = solver.solve(&Problem::new(&far, &target(PIXELS)), NODES, &Silent).unwrap_err();
        let SolveError::TotalInternalReflection { deflection_deg, limit_deg, .. } = error else { panic!("{error}") };
        assert!(deflection_deg > limit_deg && (limit_deg - 48.19).abs() < 0.01);

        let mut black = Field::filled(48, 36, 1.0);
        black[(5, 7)] = 0.0;
        let black = TargetIrradiance::new(black).unwrap();
        let error = solver.solve(&Problem::new(&bench(GLASS), &black), (49, 37), &Silent).unwrap_err();
        assert_eq!(error, SolveError::TooDark { least: 0.0, limit: super::LEAST_TARGET });

        let error = solver.solve(&Problem::new(&bench(GLASS), &target(PIXELS)), (4, 73), &Silent).unwrap_err();
        assert!(matches!(error, SolveError::Nodes { .. }), "{error}");
    }
    // A mirror bends by any angle, so that here the surface itself comes to the receiver.
    let short = Bench::new(BLOCK, 5.0, ExitFace::Reflects).unwrap();
    let short = short.with_window(Extent::new(300.0, 225.0), DVec2::ZERO).unwrap();
    let error = Warping::default().solve(&Problem::new(&short, &target(PIXELS)), NODES, &Silent).unwrap_err();
    assert!(matches!(error, SolveError::ReachesReceiver { distance_mm: 5.0, .. }), "{error}");
}

#[test]
fn options_out_of_range_are_refused() {
    let none = WarpingOptions { coarse_iterations: 0, ..WarpingOptions::default() };
    assert_eq!(Warping::new(none).unwrap_err().name, "coarse_iterations");
    let rounds = WarpingOptions { closed_loop_rounds: 9, ..WarpingOptions::default() };
    assert_eq!(Warping::new(rounds).unwrap_err().greatest, 5.0);
    let lambda = WarpingPaperOptions { lambda: Some(-1.0), ..WarpingPaperOptions::default() };
    assert_eq!(WarpingPaper::new(lambda).unwrap_err().name, "lambda");
}

/// Remembers what it is told.
#[derive(Default)]
struct Watch(RefCell<Vec<(String, usize, usize)>>);

impl Progress for Watch {
    fn report(&self, event: Event<'_>) -> ControlFlow<()> {
        let mut told = self.0.borrow_mut();
        match event {
            Event::Stage { name, steps } => told.push((name.to_owned(), steps, 0)),
            Event::Step { done } => told.last_mut().unwrap().2 = done,
            Event::Iteration => {}
        }
        ControlFlow::Continue(())
    }
}

#[test]
fn the_summary_holds_every_level_and_progress_is_told_of_each() {
    let watch = Watch::default();
    let options = WarpingOptions { fine_iterations: Some(3), coarse_iterations: 400, ..WarpingOptions::default() };
    let solution = Warping::new(options)
        .unwrap()
        .solve(&Problem::new(&bench(GLASS), &target((120, 90))), (121, 91), &watch)
        .unwrap();
    let levels = &solution.summary.levels;
    let seen = watch.0.into_inner();
    assert_eq!(levels.len(), seen.len());
    assert!(seen.iter().all(|(_, steps, done)| steps == done));
    let count = |stage: &str| levels.iter().filter(|l| l.stage.starts_with(stage)).count();
    assert_eq!((count("pyramid"), count("height-aware pass")), (6, 2));
    assert!(count("closed loop") >= 1);
    assert_eq!((levels[5].nx, levels[5].ny, levels[5].iterations.len()), (121, 91, 3));
    assert_eq!(levels[5].termination, Termination::IterationLimit);
    for level in levels {
        assert!(level.iterations.windows(2).all(|w| w[1].objective <= w[0].objective), "{}", level.stage);
    }
    assert!(solution.summary.warnings.iter().any(|w| w.contains("iteration limit")), "{:?}", solution.summary.warnings);
}
