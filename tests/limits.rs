//! The library takes any number: what makes no sense is a typed error, never a panic and never a
//! bench that is none.

use glam::{DVec2, DVec3};
use glasswarp::{
    bench::{Bench, BenchError, ExitFace, Receiver},
    export::StepTolerance,
    fabricate::{Cutter, Pass},
    grid::{Extent, Field, Outline},
    irradiance::{Framing, Picture, PsfPicture, TargetIrradiance, Vignette},
    light::Intensity,
    pipeline::{self, DesignError},
    solid::{Rim, Shape, Stock},
    solver::{FreeFaces, Problem, Silent, SolveError, Solver, TwoFacesError},
    surface::Polish,
    transport::{Transport, TwoFaces},
    warp::{Warping, WarpingPaper},
};
use proptest::prelude::*;

/// Numbers that nobody thinks of, and numbers that make sense.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(-0.0),
        Just(f64::MIN_POSITIVE),
        Just(f64::MAX),
        Just(-f64::MAX),
        Just(1e-9),
        Just(1e-160),
        any::<f64>(),
        -1000.0..1000.0,
        0.5..300.0,
        1.0..2.0,
    ]
}

fn vector() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Light of a bench that was accepted arrives, and lands where numbers are.
fn check(bench: &Bench) -> Result<(), TestCaseError> {
    let direction = bench.light_direction();
    prop_assert!(direction.is_finite() && (direction.length() - 1.0).abs() < 1e-9, "{bench:?}: {direction}");
    prop_assert!(bench.light_in_air().is_finite(), "{bench:?}");
    prop_assert!(bench.distance_mm().is_finite() && bench.window_centre_mm().is_finite());
    if let Ok(at) = bench.undisturbed_landing_mm() {
        prop_assert!(at.is_finite());
    }
    for k in 0..9 {
        let at = bench.block().node(k % 3, k / 3, 3, 3);
        prop_assert!(at.is_finite());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_bench_is_sound_or_refused(
        sizes in (number(), number(), number(), number()),
        glass in any::<bool>(),
        light in vector(),
        point in (vector(), number()),
        receiver in vector(),
        window in (number(), number(), number(), number()),
        radius_mm in number(),
    ) {
        let face = if glass { ExitFace::Refracts { ior: sizes.3 } } else { ExitFace::Reflects };
        if let Ok(bench) = Bench::new(Extent::new(sizes.0, sizes.1), sizes.2, face) {
            check(&bench)?;
        }
        // A bench that is sound, so that every step is tried.
        let face = if glass { ExitFace::Refracts { ior: 1.5 } } else { ExitFace::Reflects };
        let bench = Bench::new(Extent::new(100.0, 80.0), 250.0, face).unwrap();
        for changed in [
            bench.clone().with_light_direction(light),
            bench.clone().with_light_in_air(light),
            bench.clone().with_point_source(point.0, point.1, Intensity::Isotropic),
            bench.clone().with_point_source(point.0, point.1, Intensity::Lambertian),
            bench.clone().with_receiver_turned(receiver),
            bench.clone().with_window(Extent::new(window.0, window.1), DVec2::new(window.2, window.3)),
            bench.clone().with_outline(Outline::Rounded { radius_mm }),
        ].into_iter().flatten() {
            check(&changed)?;
        }
    }

    #[test]
    fn other_numbers_are_taken_or_refused(a in number(), b in number(), c in number()) {
        let extent = Extent::new(100.0, 80.0);
        let _ = StepTolerance::Micrometres(a).check();
        let _ = Stock::of_thickness(a).leaving_at_least(b).check();
        let _ = Shape { skirt_mm: a, rim: Some(Rim { width_mm: b, rise_mm: c, mark_mm: Some(a) }), ..Shape::default() }.check(extent);
        let _ = Polish::new(a).and_then(|polish| polish.with_gain(b));
        for cutter in [Cutter::ball(a), Cutter::flat(a), Cutter::bull(a, b)].into_iter().flatten() {
            prop_assert!(cutter.radius_mm().is_finite());
            let _ = Pass::finishing(cutter, b).check(extent);
            let _ = Pass { allowance_mm: c, ..Pass::finishing(cutter, b) }.check(extent);
        }
        let _ = Framing::new(a, Vignette::Circle { soft: b });
        let _ = PsfPicture::new(&Field::filled(5, 5, a), b);
        let _ = PsfPicture::new(&Field::filled(5, 5, 1.0), b);
        if let Ok(picture) = Picture::from_values(Field::filled(8, 8, a)) {
            let _ = TargetIrradiance::from_picture(&picture, b);
        }
        let _ = TargetIrradiance::new(Field::filled(8, 8, a));
        let _ = pipeline::node_grid(Extent::new(a, b), 65);
    }

    #[test]
    fn grids_of_nodes_are_within_their_limits_or_refused(across in any::<usize>(), width in number(), height in number()) {
        if let Ok((nx, ny)) = pipeline::node_grid(Extent::new(width, height), across) {
            let limits = pipeline::LEAST_NODES..=pipeline::GREATEST_NODES;
            prop_assert!(limits.contains(&nx) && limits.contains(&ny));
        }
    }
}

#[test]
fn angles_that_are_none_do_not_get_through() {
    let mirror = Bench::new(Extent::new(1e4, 1e4), 250.0, ExitFace::Reflects).unwrap();
    // Light that grazes so nearly that the sine is 1 to rounding.
    let error = mirror.with_point_source(DVec3::new(9.9e5, 9.9e5, 1.0), 1.0, Intensity::Isotropic).unwrap_err();
    assert!(matches!(error, BenchError::Grazing { angle_deg, .. } if angle_deg > 89.0), "{error}");
}

#[test]
fn problems_of_more_faces_or_pictures_than_a_solver_finds_are_refused_with_the_limit() {
    let target = TargetIrradiance::new(Field::filled(16, 16, 1.0)).unwrap();
    let bench = Bench::new(Extent::new(100.0, 100.0), 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let one = Problem::new(&bench, &target);
    let far = Receiver::new(400.0, bench.window());
    let two = one.clone().and_target(&target, far).unwrap();
    assert_eq!((two.targets()[0].receiver, two.targets()[1].receiver), (*bench.receiver(), far));
    let both = one.clone().with_free_faces(FreeFaces::EntryAndExit { thickness_mm: 20.0 });
    let solvers: [&dyn Solver; 3] = [&Transport::default(), &Warping::default(), &WarpingPaper::default()];
    for solver in solvers {
        let refused = solver.solve(&two, (33, 33), &Silent).unwrap_err();
        assert!(matches!(refused, SolveError::Targets { targets: 2, limit: 1, .. }), "{refused}");
    }
    let refused = TwoFaces::default().solve(&both, (33, 33), &Silent).unwrap_err();
    assert!(matches!(refused, SolveError::TwoFaces(TwoFacesError::Pictures { targets: 1 })), "{refused}");
    let refused = TwoFaces::default().solve(&one, (33, 33), &Silent).unwrap_err();
    assert!(matches!(refused, SolveError::TwoFaces(TwoFacesError::OneFree)), "{refused}");
    for solver in solvers {
        let refused = solver.solve(&both, (33, 33), &Silent).unwrap_err();
        assert!(matches!(refused, SolveError::FreeFaces { faces: 2, limit: 1, .. }), "{refused}");
    }
    for bad in [Receiver::new(f64::NAN, bench.window()), far.turned(DVec3::new(1.5, 0.0, 0.0))] {
        assert!(one.clone().and_target(&target, bad).is_err());
    }
}

#[test]
fn grids_that_hold_no_picture_are_refused_by_every_solver() {
    let target = TargetIrradiance::new(Field::from_fn(16, 16, |i, j| 1.0 + (i * j % 5) as f64)).unwrap();
    let bench = Bench::new(Extent::new(100.0, 100.0), 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let solvers: [&dyn Solver; 3] = [&Transport::default(), &Warping::default(), &WarpingPaper::default()];
    for solver in solvers {
        for nodes in [(0, 0), (1, 1), (3, 3), (4, 9), (0, 33), (33, 0), (usize::MAX, 9), (9, 1 << 40)] {
            let refused = solver.solve(&Problem::new(&bench, &target), nodes, &Silent).unwrap_err();
            assert!(matches!(refused, SolveError::Nodes { .. }), "{nodes:?}: {refused}");
            let stock = Stock::thinnest_sheet();
            let refused =
                pipeline::design(&Problem::new(&bench, &target), nodes, solver, &stock.into(), &Silent).unwrap_err();
            assert!(matches!(refused, DesignError::Nodes { .. }), "{nodes:?}: {refused}");
        }
        for thickness in [f64::NAN, 0.0, -3.0, f64::INFINITY] {
            let refused = pipeline::design(
                &Problem::new(&bench, &target),
                (33, 33),
                solver,
                &Stock::of_thickness(thickness).into(),
                &Silent,
            )
            .unwrap_err();
            assert!(matches!(refused, DesignError::Solid(_)), "{thickness}: {refused}");
        }
    }
}
