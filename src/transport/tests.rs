//! The solver as a whole: manufactured solutions, every kind of bench, every shape of picture.

use super::{
    equation::Equation,
    map::Jet,
    newton::{Criterion, Newton},
    spline::{BorderSlopes, PathSpline, ReceiverGrid},
    *,
};
use crate::measured::{at_worst, within_tenth_of};
use crate::{
    bench::{Bench, ExitFace},
    forward::{Geometry, irradiance},
    grid::{Extent, Field, Outline},
    irradiance::TargetIrradiance,
    light::{FaceShape, Intensity, KnownFace, Light, Profile},
    optim::Termination,
    solver::Silent,
    surface::SurfaceSpline,
};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

const GLASS: ExitFace = ExitFace::Refracts { ior: 1.5 };

fn bench(width: f64, height: f64, distance: f64, face: ExitFace) -> Bench {
    Bench::new(Extent::new(width, height), distance, face).unwrap()
}

/// A picture with smooth parts, an edge and a dark corner, that no symmetry maps onto itself.
fn picture(nx: usize, ny: usize, dark: f64) -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(nx, ny, |i, j| {
        let (x, y) = ((i as f64 + 0.5) / nx as f64, (j as f64 + 0.5) / ny as f64);
        let wave = 0.5 + 0.3 * (5.0 * x + 2.0 * y).sin();
        if x > 0.6 && y < 0.4 { dark } else { wave + dark }
    }))
    .unwrap()
}

/// Relative root mean square error of the light of a solution, traced with many beams.
fn error(solution: &Solution, target: &TargetIrradiance, bench: &Bench) -> f64 {
    let cells = target.cells();
    let (nx, ny) = (solution.exit.heights_mm().nx() - 1, solution.exit.heights_mm().ny() - 1);
    let spline = SurfaceSpline::through(&solution.exit);
    let seen = irradiance(&spline, bench, Geometry::Displaced, (4 * nx, 4 * ny), (cells.nx(), cells.ny())).irradiance;
    let mean = seen.mean();
    let sum: f64 = seen.as_slice().iter().zip(cells.as_slice()).map(|(s, w)| (s / mean - w).powi(2)).sum();
    (sum / cells.as_slice().len() as f64).sqrt()
}

fn lit(bench: Bench, position_mm: DVec3) -> Bench {
    bench.with_point_source(position_mm, 30.0, Intensity::Isotropic).unwrap()
}

/// A point source over the axis, and the window onto which a flat face maps the lens: a mirror
/// does, and glass without thickness.
fn projected(bench: Bench) -> Bench {
    let (far, thickness) = (70.0, Bench::THICKNESS_LIMITS_MM.0);
    let z = if bench.exit_face() == GLASS { -far - thickness } else { far };
    let reach = if bench.exit_face() == GLASS { far + thickness / 1.5 } else { far };
    let window = bench.block().as_vec() * ((reach + bench.distance_mm()) / reach);
    let bench = bench.with_window(Extent::new(window.x, window.y), DVec2::ZERO).unwrap();
    bench.with_point_source(DVec3::new(0.0, 0.0, z), thickness, Intensity::Isotropic).unwrap()
}

/// An unknown without slope on the border, and so a map of the window onto an equal lens. In the
/// light of a point source, one that is 0 there, so that the border is mapped as by a flat face.
fn manufactured(bench: &Bench, y: DVec2) -> Jet {
    if let Light::Point { .. } = bench.light() {
        let k = TAU / bench.window().as_vec();
        let p = k * (y - bench.window().lower());
        // sin^2 along x, times (2 pi + p) along y.
        let ramp = TAU + p.y;
        let (x, x_1, x_2) = (0.5 - 0.5 * p.x.cos(), 0.5 * p.x.sin(), 0.5 * p.x.cos());
        let (s, s_1, s_2) = (0.5 - 0.5 * p.y.cos(), 0.5 * p.y.sin(), 0.5 * p.y.cos());
        let (v, v_1, v_2) = (s * ramp, s_1 * ramp + s, s_2 * ramp + 2.0 * s_1);
        let a = if bench.exit_face() == GLASS { 0.05 } else { 0.0125 };
        return Jet {
            value: a * x * v,
            slope: a * k * DVec2::new(x_1 * v, x * v_1),
            curvature: [a * k.x * k.x * x_2 * v, a * k.x * k.y * x_1 * v_1, a * k.y * k.y * x * v_2],
        };
    }
    let k = TAU / bench.window().as_vec();
    // The bend of the map is that of kappa u: a mirror needs a quarter of what glass does.
    let scale = if bench.exit_face() == GLASS { 1.0 } else { 0.25 };
    let (a, b) = (0.1 * scale, -0.01 * scale);
    let p = k * (y - bench.window().lower());
    let (sx, cx) = p.x.sin_cos();
    let (sy, cy) = (0.5 * p.y).sin_cos();
    let ky = 0.5 * k.y;
    Jet {
        value: a * cx * cy + b * (2.0 * p.y).cos(),
        slope: DVec2::new(-a * k.x * sx * cy, -a * ky * cx * sy - 2.0 * b * k.y * (2.0 * p.y).sin()),
        curvature: [
            -a * k.x * k.x * cx * cy,
            a * k.x * ky * sx * sy,
            -a * ky * ky * cx * cy - 4.0 * b * k.y * k.y * (2.0 * p.y).cos(),
        ],
    }
}

/// The light of the manufactured unknown, exactly, and its mean height.
fn manufactured_light(bench: &Bench, grid: ReceiverGrid) -> (Field<f64>, f64) {
    let (nx, ny) = grid.nodes();
    let blank = Field::filled(nx, ny, 1.0);
    let path = Equation::new(bench, grid, &blank).map;
    let ray = |i, j| {
        let jet = manufactured(bench, grid.node(i, j));
        (path.ray(grid.node(i, j), jet.value, jet.slope).unwrap(), jet)
    };
    let stretch = bench.window().area_mm2() / bench.block().area_mm2();
    let light = Field::from_fn(nx, ny, |i, j| {
        let (ray, jet) = ray(i, j);
        path.footprint_jacobian(&ray, &jet, path.label(&ray).as_ref()).determinant() * stretch
    });
    let (mut height, mut weight) = (0.0, 0.0);
    for j in 0..ny {
        for i in 0..nx {
            let w = equation::trapezoid(i, nx) * equation::trapezoid(j, ny) * light[(i, j)];
            height += w * path.height(grid.node(i, j), &ray(i, j).0).0;
            weight += w;
        }
    }
    (light, height / weight)
}

#[test]
fn a_manufactured_solution_is_met_with_the_second_order() {
    let straight = [GLASS, ExitFace::Reflects].map(|face| bench(20.0, 16.0, 90.0, face));
    for bench in straight.clone().into_iter().chain(straight.map(projected)) {
        let worst = |cells: (usize, usize)| {
            let grid = ReceiverGrid::new(&bench, cells);
            let (light, height_mm) = manufactured_light(&bench, grid);
            let equation = Equation::new(&bench, grid, &light);
            let mut state = start::plain(&bench, grid);
            let mut newton = Newton::new(&state);
            newton.height_mm = height_mm;
            let criterion = Criterion { rms: 1e-8, steps: 40, forcing: 1e-2 };
            let outcome = newton.run(&equation, &mut state, criterion, &Silent).unwrap();
            assert_eq!(outcome.termination, Termination::Converged, "{outcome:?}");
            at_worst(2.1e-4, state.mu.abs(), "mu");
            let mut worst = 0.0_f64;
            for j in 0..=cells.1 {
                for i in 0..=cells.0 {
                    let wanted = manufactured(&bench, grid.node(i, j)).slope;
                    worst = worst.max((state.spline.node_jet(i, j).slope - wanted).length());
                }
            }
            worst
        };
        let (coarse, fine) = (worst((32, 24)), worst((64, 48)));
        let order = (coarse / fine).log2();
        assert!(order > 1.9, "{bench:?}: {coarse:e} and {fine:e}, order {order}");
    }
}

#[test]
fn the_residual_follows_its_linearisation_through_the_border() {
    let glass = bench(20.0, 16.0, 60.0, GLASS);
    let shifted = glass.clone().with_window(Extent::new(26.0, 12.0), DVec2::new(3.0, -4.0)).unwrap();
    let oblique = glass.clone().with_light_direction(DVec3::new(0.1, -0.15, 1.0)).unwrap();
    let point = lit(shifted.clone(), DVec3::new(8.0, 5.0, -90.0));
    for bench in [glass, shifted, oblique, point] {
        let grid = ReceiverGrid::new(&bench, (14, 11));
        let (nx, ny) = grid.nodes();
        let light = Field::from_fn(nx, ny, |i, j| 1.0 + 0.2 * ((i + 2 * j) % 5) as f64);
        let equation = Equation::new(&bench, grid, &light);
        let base = start::plain(&bench, grid);
        let bump = |i: usize, j: usize| 1e-3 * ((i * 7 + j * 13) % 17) as f64;
        let at = |step: f64| {
            let mut state = base.clone();
            state.mu = 0.3 + 0.2 * step;
            for j in 1..=ny {
                for i in 1..=nx {
                    state.spline.coefficients[(i, j)] += 0.3 * bump(j, i) + step * bump(i, j);
                }
            }
            for _ in 0..3 {
                equation.fit_border(&mut state);
            }
            state
        };
        let residual = |step: f64| {
            let mut out = vec![0.0_f32; nx * ny];
            equation.residual(&at(step), &mut out).unwrap();
            out
        };
        let (forward, backward) = (residual(0.05), residual(-0.05));
        let mut state = at(0.0);
        let (mut out, mut rows) = (vec![0.0; nx * ny], vec![[0.0; 7]; nx * ny]);
        equation.linearise(&state, &mut out, &mut rows).unwrap();
        let border = equation.linearise_border(&mut state);
        let mut variation = PathSpline::zero(grid);
        for j in 1..=ny {
            for i in 1..=nx {
                variation.coefficients[(i, j)] = bump(i, j);
            }
        }
        border.set_ghosts(&mut variation, &mut BorderSlopes::zero(grid.cells));
        newton::product(&rows, &variation, 0.2, &mut out);
        let (mut difference, mut size) = (0.0, 0.0);
        for k in 0..nx * ny {
            let slope = f64::from(forward[k] - backward[k]) / 0.1;
            difference += (slope - f64::from(out[k])).powi(2);
            size += slope * slope;
        }
        // The border's variation ignores that the ghosts it sets move the value at the border: an
        // error of second order in the spacing where the border carries a slope. The difference
        // itself is good to 1e-4 in single precision.
        at_worst(1.94e-5, difference.sqrt() / size.sqrt(), "difference");
    }
}

/// The receiver turned, and the window where undisturbed light falls.
fn leaning(bench: Bench, rotation: DVec3) -> Bench {
    undisturbed(bench.with_receiver_turned(rotation).unwrap())
}

fn undisturbed(bench: Bench) -> Bench {
    let (window, centre) = (bench.window(), bench.undisturbed_landing_mm().unwrap());
    bench.with_window(window, centre).unwrap()
}

/// Its source aimed at the middle of the block, half as bright at an angle of this many degrees.
fn torch(bench: Bench, half_deg: f64) -> Bench {
    let Light::Point { position_mm, .. } = bench.light() else { panic!("no source") };
    let axis = -position_mm.normalize();
    let profile = Profile::of(&bench, 30.0, |ray| {
        let angle = ray.direction.angle_between(axis).to_degrees() / half_deg;
        (-(angle * angle) * std::f64::consts::LN_2).exp()
    });
    bench.with_profile(profile.unwrap())
}

/// Light that has been measured over the block.
fn beam(bench: Bench) -> Bench {
    let picture = Field::from_fn(30, 20, |i, j| 1.0 + 0.08 * i as f64 + 0.5 * (0.3 * j as f64).sin());
    let profile = Profile::measured(&bench, 30.0, &picture).unwrap();
    bench.with_profile(profile)
}

/// Solves for a block that must draw the target to within the relative error that was measured.
fn drawn(name: &str, target: &TargetIrradiance, bench: &Bench, measured: f64) -> Solution {
    let solution = Transport::default().solve(&Problem::new(bench, target), (101, 81), &Silent).unwrap();
    let error = error(&solution, target, bench);
    println!("{name}: {error:.4} {:?}", solution.summary.warnings);
    within_tenth_of(measured, error, name);
    solution
}

#[test]
fn every_bench_draws_the_picture() {
    let glass = bench(50.0, 40.0, 120.0, GLASS);
    let mirror = bench(50.0, 40.0, 120.0, ExitFace::Reflects);
    let window =
        |w: f64, h: f64, x: f64, y: f64| glass.clone().with_window(Extent::new(w, h), DVec2::new(x, y)).unwrap();
    let steep_mirror = undisturbed(mirror.clone().with_light_direction(DVec3::new(0.5, 0.0, -0.866)).unwrap());
    let steep_glass = glass.clone().with_light_direction(DVec3::new(0.0, -0.333, 0.943)).unwrap();
    let benches = [
        ("glass at 30 degrees", undisturbed(steep_glass.clone()), 0.0067),
        ("glass", glass.clone(), 0.0072),
        ("mirror", mirror.clone(), 0.0073),
        ("near", bench(50.0, 40.0, 30.0, GLASS), 0.0067),
        ("far", bench(50.0, 40.0, 500.0, GLASS), 0.0073),
        ("dense", bench(50.0, 40.0, 120.0, ExitFace::Refracts { ior: 1.9 }), 0.0072),
        ("small window", window(25.0, 20.0, 0.0, 0.0), 0.007),
        ("large window", window(90.0, 72.0, 0.0, 0.0), 0.0073),
        ("other aspect, shifted", window(40.0, 50.0, 12.0, -7.0), 0.0063),
        ("oblique", glass.clone().with_light_direction(DVec3::new(0.1, 0.05, 1.0)).unwrap(), 0.0068),
        ("oblique mirror", mirror.clone().with_light_direction(DVec3::new(0.1, 0.05, -1.0)).unwrap(), 0.0073),
        ("source at 1 m", lit(glass.clone(), DVec3::new(0.0, 0.0, -1000.0)), 0.0072),
        ("source at 300 mm", lit(glass.clone(), DVec3::new(0.0, 0.0, -300.0)), 0.0067),
        ("source at 80 mm", lit(glass.clone(), DVec3::new(0.0, 0.0, -80.0)), 0.0078),
        ("mirror, source at 1 m", lit(mirror.clone(), DVec3::new(0.0, 0.0, 1000.0)), 0.0074),
        ("mirror, source at 300 mm", lit(mirror.clone(), DVec3::new(0.0, 0.0, 300.0)), 0.0075),
        ("oblique source", lit(glass.clone(), DVec3::new(60.0, -40.0, -300.0)), 0.0061),
        ("mirror, source at 20 mm", lit(mirror.clone(), DVec3::new(0.0, 0.0, 20.0)), 0.0065),
        (
            "source 15 mm before the block",
            glass.clone().with_point_source(DVec3::new(0.0, 0.0, -75.0), 60.0, Intensity::Isotropic).unwrap(),
            0.0096,
        ),
        (
            "oblique source, mirror, shifted",
            lit(mirror.clone(), DVec3::new(90.0, 30.0, 300.0))
                .with_window(Extent::new(60.0, 40.0), DVec2::new(-20.0, 5.0))
                .unwrap(),
            0.0073,
        ),
        ("receiver leaning by 20 degrees", leaning(glass.clone(), DVec3::new(0.35, 0.0, 0.0)), 0.0062),
        ("receiver leaning by 40 degrees", leaning(glass.clone(), DVec3::new(0.4, 0.6, 0.1)), 0.0073),
        ("leaning, mirror at 30 degrees", leaning(steep_mirror.clone(), DVec3::new(0.0, 0.35, 0.0)), 0.0065),
        ("mirror at 30 degrees", steep_mirror, 0.0067),
        (
            "leaning, source at 100 mm",
            leaning(lit(glass.clone(), DVec3::new(10.0, 0.0, -100.0)), DVec3::new(0.35, 0.2, 0.0)),
            0.0075,
        ),
        ("torch", torch(lit(glass.clone(), DVec3::new(0.0, 0.0, -120.0)), 9.0), 0.0073),
        ("torch on a mirror", torch(lit(mirror.clone(), DVec3::new(0.0, 0.0, 120.0)), 9.0), 0.0069),
        (
            "torch beside the axis, leaning",
            leaning(torch(lit(glass.clone(), DVec3::new(20.0, 10.0, -120.0)), 12.0), DVec3::new(0.2, 0.0, 0.0)),
            0.0071,
        ),
        ("beam brighter at one side", beam(glass.clone()), 0.0109),
        ("oblique beam brighter at one side", beam(undisturbed(steep_glass)), 0.0111),
        (
            "small flat source at 100 mm, large window",
            window(90.0, 72.0, 0.0, 0.0)
                .with_point_source(DVec3::new(5.0, 5.0, -100.0), 20.0, Intensity::Lambertian)
                .unwrap(),
            0.0076,
        ),
    ];
    let target = picture(50, 40, 0.1);
    for (name, bench, measured) in benches {
        let solution = drawn(name, &target, &bench, measured);
        assert!(solution.exit.heights_mm().mean().abs() < 1e-12);
    }
}

#[test]
fn blocks_of_any_outline_draw_the_whole_picture() {
    let glass = bench(50.0, 40.0, 120.0, GLASS);
    let of = |bench: &Bench, outline| bench.clone().with_outline(outline).unwrap();
    let rounded = |radius_mm| Outline::Rounded { radius_mm };
    let mirror = bench(50.0, 40.0, 120.0, ExitFace::Reflects);
    // What the four corners of the window cost, which a smooth outline has not, is a matter of
    // nodes: see docs/transport.md.
    let benches = [
        ("ellipse", of(&glass, Outline::Circle), 0.0107),
        ("rounded", of(&glass, rounded(8.0)), 0.0081),
        ("slightly rounded", of(&glass, rounded(1.0)), 0.0073),
        ("stadium", of(&glass, rounded(20.0)), 0.0092),
        ("mirror", of(&mirror, Outline::Circle), 0.0312),
        ("source at 300 mm", of(&lit(glass.clone(), DVec3::new(0.0, 0.0, -300.0)), Outline::Circle), 0.0093),
        (
            "small window",
            of(&glass, Outline::Circle).with_window(Extent::new(25.0, 20.0), DVec2::ZERO).unwrap(),
            0.0092,
        ),
    ];
    let target = picture(50, 40, 0.1);
    for (name, bench, measured) in benches {
        let solution = drawn(name, &target, &bench, measured);
        assert!(solution.summary.levels.iter().all(|level| level.termination == Termination::Converged), "{name}");
        assert_eq!(solution.exit.outline(), bench.outline());
    }
}

#[test]
fn the_face_for_a_far_source_is_that_for_parallel_light() {
    let target = picture(24, 20, 0.1);
    for (face, side) in [(GLASS, -1.0), (ExitFace::Reflects, 1.0)] {
        let parallel = bench(30.0, 25.0, 100.0, face);
        let solve =
            |bench: &Bench| Transport::default().solve(&Problem::new(bench, &target), (49, 41), &Silent).unwrap().exit;
        let wanted = solve(&parallel);
        let mut before = f64::INFINITY;
        for far in [1e4, 1e5, 1e6] {
            let got = solve(&lit(parallel.clone(), DVec3::new(0.0, 0.0, side * far)));
            let pairs = got.heights_mm().as_slice().iter().zip(wanted.heights_mm().as_slice());
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{face:?} {far}: {worst:e} of {}", wanted.relief_mm());
            assert!(worst < 0.3 * before, "{face:?} {far}: {worst} after {before}");
            before = worst;
        }
        at_worst(1.81e-4, before / wanted.relief_mm(), format_args!("{face:?}: {before}"));
    }
}

#[test]
fn a_block_too_thin_for_its_face_and_a_source_too_near_are_refused() {
    let thin = bench(50.0, 40.0, 60.0, GLASS);
    let thin = thin.with_point_source(DVec3::new(0.0, 0.0, -60.0), 0.5, Intensity::Isotropic).unwrap();
    let error = Transport::default().solve(&Problem::new(&thin, &picture(16, 16, 0.1)), (33, 33), &Silent).unwrap_err();
    assert!(matches!(error, SolveError::ReachesLight { limit_mm: -0.5, .. }), "{error}");
    for (face, z) in [(GLASS, -40.0), (ExitFace::Reflects, 10.0)] {
        let near = lit(bench(50.0, 40.0, 120.0, face), DVec3::new(0.0, 0.0, z));
        let error =
            Transport::default().solve(&Problem::new(&near, &picture(16, 16, 0.1)), (33, 33), &Silent).unwrap_err();
        assert!(matches!(error, SolveError::SourceTooNear { position_mm } if position_mm.z == z), "{error}");
    }
}

#[test]
fn every_shape_of_picture_is_drawn() {
    for (pixels, nodes, measured) in [
        ((4, 4), (65, 65), 0.0022),
        ((37, 23), (75, 47), 0.008),
        ((90, 9), (181, 33), 0.0046),
        ((31, 40), (50, 97), 0.0099),
    ] {
        let bench = bench(pixels.0 as f64, pixels.1 as f64, 150.0, GLASS);
        let target = picture(pixels.0, pixels.1, 0.1);
        let solution = Transport::default().solve(&Problem::new(&bench, &target), nodes, &Silent).unwrap();
        let error = error(&solution, &target, &bench);
        println!("{pixels:?}: {error:.4}");
        within_tenth_of(measured, error, format_args!("{pixels:?}"));
    }
}

#[test]
fn a_picture_finer_than_the_lens_is_averaged() {
    let bench = bench(40.0, 40.0, 150.0, GLASS);
    let target = picture(300, 300, 0.1);
    let solution = Transport::default().solve(&Problem::new(&bench, &target), (41, 41), &Silent).unwrap();
    within_tenth_of(0.0171, error(&solution, &target.resampled(20, 20), &bench), "finer");
}

#[test]
fn true_black_needs_no_offset() {
    let bench = bench(40.0, 40.0, 150.0, GLASS);
    let target = picture(40, 40, 0.0);
    assert!(target.cells().min_max().0 == 0.0);
    let solution = Transport::default().solve(&Problem::new(&bench, &target), (161, 161), &Silent).unwrap();
    let error = error(&solution, &target, &bench);
    within_tenth_of(0.013, error, "true black");
}

/// White bars and a white corner on black.
fn bars(n: usize) -> TargetIrradiance {
    let white = |i: usize, j: usize| i % (n / 3) < n / 10 || (i > n / 2 && j < n / 4);
    TargetIrradiance::new(Field::from_fn(n, n, |i, j| if white(i, j) { 1.0 } else { 0.0 })).unwrap()
}

#[test]
fn the_face_is_the_envelope_of_all_ovals_wherever_the_search_starts() {
    for face in [GLASS, ExitFace::Reflects] {
        let bench = bench(40.0, 40.0, 150.0, face);
        let nodes = (81, 81);
        let mut summary = Summary::default();
        let solved =
            pyramid::solve(&TransportOptions::default(), &bars(40), &bench, nodes, &Silent, &mut summary).unwrap();
        let (grid, spline) = (solved.grid, &solved.state.spline);
        let path = Equation::new(&bench, grid, &solved.light).map;
        let mut carrier = carry::Carrier::new(bench.contour(), nodes);
        // A first use leaves the landing points of a flat face behind.
        carrier.heights(&path, &start::plain(&bench, grid).spline);
        let carried = carrier.heights(&path, spline).heights_mm;
        for j in 0..nodes.1 {
            for i in 0..nodes.0 {
                let x = bench.block().node(i, j, nodes.0, nodes.1);
                let height = carried[(i, j)];
                for m in 0..=grid.cells.1 {
                    spline.row_jets(m, |k, jet| {
                        let oval = path.oval_height(x, grid.node(k, m), jet.value);
                        let above = path.forms_face(oval, height) && (oval - height).abs() > 1e-6;
                        assert!(!above, "{face:?}: {oval} over {height} at {x}");
                    });
                }
            }
        }
    }
}

#[test]
fn an_even_picture_leaves_the_block_flat() {
    let bench = bench(30.0, 20.0, 100.0, GLASS);
    let target = TargetIrradiance::new(Field::filled(12, 8, 3.0)).unwrap();
    let solution = Transport::default().solve(&Problem::new(&bench, &target), (41, 31), &Silent).unwrap();
    assert!(solution.exit.relief_mm() < 1e-9, "{}", solution.exit.relief_mm());
    assert!(solution.summary.warnings.is_empty(), "{:?}", solution.summary.warnings);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let bench = bench(40.0, 30.0, 100.0, GLASS);
    let target = picture(40, 30, 0.05);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Transport::default().solve(&Problem::new(&bench, &target), (81, 61), &Silent).unwrap().exit)
    };
    let one = solve(1);
    for threads in [2, 3] {
        assert_eq!(one, solve(threads), "{threads} threads");
    }
}

#[test]
fn a_picture_out_of_reach_is_refused_with_the_place() {
    let near = bench(20.0, 20.0, 30.0, GLASS).with_window(Extent::new(200.0, 200.0), DVec2::ZERO).unwrap();
    let error = Transport::default().solve(&Problem::new(&near, &picture(16, 16, 0.1)), (33, 33), &Silent).unwrap_err();
    assert!(matches!(error, SolveError::TotalInternalReflection { limit_deg, .. } if (limit_deg - 48.19).abs() < 0.01));
}

#[test]
fn options_out_of_range_are_refused_with_their_limit() {
    assert!(Transport::new(TransportOptions::default()).is_ok());
    let refused = |options: TransportOptions| Transport::new(options).unwrap_err().to_string();
    assert!(
        refused(TransportOptions { cells_per_pixel: Some(0), ..TransportOptions::default() })
            .contains("between 1 and 16")
    );
    assert!(refused(TransportOptions { rounds: Some(1000), ..TransportOptions::default() }).contains("at most 50"));
    assert!(
        refused(TransportOptions { min_radius_mm: Some(0.0), ..TransportOptions::default() })
            .contains("between 0.001 mm")
    );
    let floor = TransportOptions { floor: BlackFloor::Relative(f64::NAN), ..TransportOptions::default() };
    assert!(refused(floor).contains("NaN"));
}

#[test]
fn the_manufacturable_variant_keeps_its_radius_without_folds_and_states_its_price() {
    let bench = bench(40.0, 40.0, 150.0, GLASS);
    let target = picture(40, 40, 0.02);
    let solve = |min_radius_mm| {
        let options = TransportOptions { min_radius_mm, ..TransportOptions::default() };
        Transport::new(options).unwrap().solve(&Problem::new(&bench, &target), (161, 161), &Silent).unwrap()
    };
    let (sharp, soft) = (solve(None), solve(Some(2.0)));
    let spline = SurfaceSpline::through(&soft.exit);
    for j in 0..161 {
        for i in 0..161 {
            let [xx, xy, yy] = spline.sample(bench.block().node(i, j, 161, 161)).curvature;
            assert!((0.5 * (xx + yy)).abs() + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt() <= 1.0 / 2.0 + 1e-12);
        }
    }
    let caustic = irradiance(&spline, &bench, Geometry::Displaced, (320, 320), (40, 40));
    assert!(caustic.folded == 0.0, "{}", caustic.folded);
    let (price, before) = (error(&soft, &target, &bench), error(&sharp, &target, &bench));
    println!("softened: {price:.4} for {before:.4}");
    assert!(before < price, "{price} for {before}");
    within_tenth_of(0.022, price, format_args!("{price} for {before}"));
    assert!(soft.summary.warnings.iter().any(|w| w.contains("costs accuracy")), "{:?}", soft.summary.warnings);
}

#[test]
fn a_curved_entry_face_hardly_costs_accuracy() {
    let planar = bench(100.0, 100.0, 250.0, GLASS);
    let target = picture(64, 64, 0.1);
    let drawn = |bench: &Bench| {
        let solution = Transport::default().solve(&Problem::new(bench, &target), (129, 129), &Silent).unwrap();
        error(&solution, &target, bench)
    };
    within_tenth_of(0.00561, drawn(&planar), "planar");
    for (shape, measured) in [
        (FaceShape::Plane, 0.00564),
        (FaceShape::Sphere { radius_mm: 300.0 }, 0.00610),
        (FaceShape::Sphere { radius_mm: -300.0 }, 0.00620),
        (FaceShape::Cylinder { radius_mm: 150.0, along_x: true }, 0.00607),
    ] {
        let what = format!("{shape:?}");
        let bench = planar.clone().behind(vec![KnownFace { shape, z_mm: -15.0, index_behind: 1.5 }]).unwrap();
        within_tenth_of(measured, drawn(&bench), what);
    }
}
