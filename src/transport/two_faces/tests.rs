//! The map against differences of itself, whole solutions by the solver's own light, and refusals.

use super::{
    exit::{Exit, Spread},
    film::Film,
    outgoing::Outgoing,
};
use crate::{
    bench::{Bench, ExitFace, Receiver},
    forward::two_reliefs::{TwoReliefs, View},
    grid::{Extent, Field, Outline},
    irradiance::TargetIrradiance,
    measured::within_tenth_of,
    solver::{FreeFaces, Problem, Silent, Solution, SolveError, Solver},
    surface::SurfaceSpline,
    transport::{
        TwoFaces,
        map::Map,
        spline::{BorderSlopes, PathSpline, ReceiverGrid},
    },
};
use glam::{DMat2, DVec2, DVec3};

const BLOCK: Extent = Extent::new(100.0, 80.0);
const IOR: f64 = 1.5;

/// A picture with smooth parts, an edge and a dark corner, that no symmetry maps onto itself.
fn picture(n: usize, turned: bool) -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(n, n, |i, j| {
        let (i, j) = if turned { (j, n - 1 - i) } else { (i, j) };
        let (x, y) = ((i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64);
        let wave = 1.0 + 0.3 * (17.0 * x + 6.0 * y).sin();
        if x > 0.6 && y < 0.3 && y > 0.1 && x < 0.8 { 0.6 } else { wave }
    }))
    .unwrap()
}

fn even() -> TargetIrradiance {
    TargetIrradiance::new(Field::filled(32, 32, 1.0)).unwrap()
}

fn solve(
    targets: [&TargetIrradiance; 2],
    windows: [Extent; 2],
    distances_mm: [f64; 2],
    thickness_mm: f64,
    nodes: (usize, usize),
) -> Result<Solution, SolveError> {
    let bench = Bench::new(BLOCK, distances_mm[0], ExitFace::Refracts { ior: IOR })
        .unwrap()
        .with_window(windows[0], DVec2::ZERO)
        .unwrap();
    let problem = Problem::new(&bench, targets[0])
        .and_target(targets[1], Receiver::new(distances_mm[1], windows[1]))
        .unwrap()
        .with_free_faces(FreeFaces::EntryAndExit { thickness_mm });
    TwoFaces::default().solve(&problem, nodes, &Silent)
}

/// Relative errors of both pictures by many beams.
fn errors(
    solution: &Solution,
    targets: [&TargetIrradiance; 2],
    windows: [Extent; 2],
    distances_mm: [f64; 2],
) -> [f64; 2] {
    let entry = solution.entry.as_ref().unwrap();
    let faces = [&entry.surface, &solution.exit].map(SurfaceSpline::through);
    let glass = TwoReliefs { entry: &faces[0], exit: &faces[1], thickness_mm: entry.thickness_mm, ior: IOR };
    let views = [0, 1].map(|k| View {
        distance_mm: distances_mm[k],
        window: windows[k],
        cells: (targets[k].cells().nx(), targets[k].cells().ny()),
    });
    let seen = glass.irradiance(views, (960, 768));
    [0, 1].map(|k| {
        let (seen, wanted) = (&seen[k].irradiance, targets[k].cells());
        let mean = seen.mean();
        let sum: f64 = seen.as_slice().iter().zip(wanted.as_slice()).map(|(s, w)| (s / mean - w).powi(2)).sum();
        (sum / wanted.as_slice().len() as f64).sqrt()
    })
}

/// A spline through a smooth function.
fn smooth(grid: ReceiverGrid, height: f64) -> PathSpline {
    let at = |p: DVec2| height * ((0.05 * p.x + 0.3).sin() * (0.04 * p.y - 0.2).cos() + 2e-4 * p.x * p.y);
    let (nx, ny) = grid.nodes();
    let slope = |p: DVec2| {
        let d = |step: DVec2| (at(p + step) - at(p - step)) / (2.0 * step.length());
        DVec2::new(d(DVec2::X * 1e-4), d(DVec2::Y * 1e-4))
    };
    let slopes = BorderSlopes::of((nx, ny), |i, j| slope(grid.node(i, j)));
    PathSpline::through(grid, &Field::from_fn(nx, ny, |i, j| at(grid.node(i, j))), &slopes)
}

#[test]
fn the_map_of_the_exit_face_is_the_derivative_of_its_entry_points_and_keeps_light() {
    let grid = ReceiverGrid::across(BLOCK, (100, 80));
    let phase = smooth(grid, 2.0);
    let light = Field::from_fn(101, 81, |i, j| 1.0 + 0.3 * (0.1 * i as f64).sin() * (0.07 * j as f64).cos());
    let film = Film { grid, light };
    let outgoing = Outgoing { phase: &phase, first: &film, distance_mm: 30.0 };
    let spread = Spread { beta: DVec2::new(3e-3, -2e-3), share: 0.8 };
    let map = Exit { outgoing, ior: IOR, constant_mm: 50.0, spread };
    let face = smooth(ReceiverGrid::across(Extent::new(90.0, 70.0), (90, 70)), 3.0);
    let ray = |xi: DVec2| {
        let jet = face.jet(face.grid.position(xi));
        (map.ray(xi, jet.value, jet.slope, None).unwrap(), jet)
    };
    let (mut worst, mut worst_of_light) = (0.0_f64, 0.0_f64);
    for k in 0..60 {
        let xi = DVec2::new(f64::from(k * 7 % 60) - 30.0 + 0.31, f64::from(k) * 0.9 - 27.0);
        let (at, jet) = ray(xi);
        let label = map.label(&at);
        let step = 1e-3;
        let by = |f: &dyn Fn(DVec2) -> DVec2| {
            let along = |d: DVec2| (f(xi + d * step) - f(xi - d * step)) / (2.0 * step);
            DMat2::from_cols(along(DVec2::X), along(DVec2::Y))
        };
        let entry = by(&|xi| map.point(xi, &ray(xi).0));
        worst =
            worst.max((map.jacobian(&at, &jet, &label) - entry).abs().to_cols_array().into_iter().fold(0.0, f64::max));
        let landing = by(&|xi| map.landing(&ray(xi).0));
        let wanted = 0.8 * film.at(map.landing(&at)) * landing.determinant();
        worst_of_light = worst_of_light.max((map.gain(&at, &label) / wanted - 1.0).abs());
    }
    within_tenth_of(1.69e-7, worst, "jacobian");
    within_tenth_of(1.29e-6, worst_of_light, "light");
}

#[test]
fn two_even_pictures_of_the_size_of_the_block_need_no_relief() {
    let even = even();
    let solution = solve([&even, &even], [BLOCK; 2], [30.0, 200.0], 40.0, (33, 27)).unwrap();
    let entry = solution.entry.unwrap();
    assert!(solution.exit.relief_mm() < 1e-9 && entry.surface.relief_mm() < 1e-9);
    assert!((entry.thickness_mm - 40.0).abs() < 1e-9, "{}", entry.thickness_mm);
}

#[test]
fn two_pictures_are_drawn() {
    let targets = [&picture(48, false), &picture(48, true)];
    let (windows, distances) = ([BLOCK; 2], [30.0, 230.0]);
    let solution = solve(targets, windows, distances, 60.0, (193, 155)).unwrap();
    let [first, second] = errors(&solution, targets, windows, distances);
    within_tenth_of(3.46e-4, first, "first");
    within_tenth_of(5.61e-4, second, "second");
}

#[test]
fn windows_of_different_size_are_filled() {
    let targets = [&picture(48, false), &picture(48, true)];
    let (windows, distances) = ([Extent::new(90.0, 72.0), Extent::new(130.0, 100.0)], [45.0, 245.0]);
    let solution = solve(targets, windows, distances, 80.0, (193, 155)).unwrap();
    let [first, second] = errors(&solution, targets, windows, distances);
    within_tenth_of(5.02e-4, first, "first");
    within_tenth_of(8.74e-4, second, "second");
}

#[test]
fn a_solution_does_not_depend_on_the_number_of_threads() {
    let targets = [&picture(24, false), &picture(24, true)];
    let solved = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(targets, [BLOCK; 2], [30.0, 230.0], 60.0, (65, 53))).unwrap()
    };
    let [one, three] = [1, 3].map(solved);
    assert_eq!(one.exit, three.exit);
    assert_eq!(one.entry, three.entry);
    assert_eq!(one.light, three.light);
}

#[test]
fn what_cannot_be_is_refused_with_what_would_make_it_possible() {
    let targets = [&picture(32, false), &picture(32, true)];
    let said = |windows, distances, thickness| {
        solve(targets, windows, distances, thickness, (65, 65)).map(drop).unwrap_err().to_string()
    };
    for (windows, distances, thickness, words) in [
        ([BLOCK; 2], [200.0, 30.0], 60.0, "give the nearer one first"),
        ([BLOCK; 2], [30.0, 200.0], -1.0, "its thickness must lie between"),
        ([BLOCK; 2], [30.0, 200.0], 2.0, "too thin to carry"),
        ([BLOCK; 2], [30.0, 40.0], 60.0, "would gather before the first receiver"),
        ([Extent::new(120.0, 80.0), BLOCK], [30.0, 200.0], 60.0, "more than the block"),
    ] {
        let said = said(windows, distances, thickness);
        assert!(said.contains(words), "{said}");
    }
    let (even, glass) = (even(), ExitFace::Refracts { ior: IOR });
    let bench = Bench::new(BLOCK, 30.0, glass).unwrap();
    let refused = |bench: &Bench| {
        let problem = Problem::new(bench, &even)
            .and_target(&even, Receiver::new(200.0, BLOCK))
            .unwrap()
            .with_free_faces(FreeFaces::EntryAndExit { thickness_mm: 40.0 });
        TwoFaces::default().solve(&problem, (33, 33), &Silent).map(drop).unwrap_err().to_string()
    };
    let tilted = bench.clone().with_light_in_air(DVec3::new(0.2, 0.0, 1.0)).unwrap();
    let disc = bench.clone().with_outline(Outline::Circle).unwrap();
    let aside = bench.with_window(BLOCK, DVec2::X).unwrap();
    let mirror = Bench::new(BLOCK, 30.0, ExitFace::Reflects).unwrap();
    for (bench, words) in [
        (tilted, "even light along the axis only"),
        (disc, "rectangular blocks only"),
        (aside, "with their windows on it only"),
        (mirror, "blocks of glass only"),
    ] {
        let said = refused(&bench);
        assert!(said.contains(words), "{said}");
    }
}
