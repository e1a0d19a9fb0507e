//! Solves onto meshes that are given, judged by beams cast through the result.

use super::{Warping, WarpingPaper};
use crate::measured::within_tenth_of;
use crate::{
    bench::{Bench, ExitFace},
    forward::{Geometry, irradiance, photon_mesh},
    grid::{Extent, Field},
    irradiance::{CausticMesh, TargetIrradiance},
    solver::{Problem, Silent, Solution, Solver},
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use std::sync::Arc;

const BLOCK: Extent = Extent::new(60.0, 45.0);
const PIXELS: (usize, usize) = (64, 48);
const NODES: (usize, usize) = (129, 97);

/// Without any symmetry, so that a flip cannot hide.
fn target() -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(PIXELS.0, PIXELS.1, |i, j| {
        let p = DVec2::new((i as f64 + 0.5) / PIXELS.0 as f64, (j as f64 + 0.5) / PIXELS.1 as f64);
        let spot = |x: f64, y: f64, width: f64| (-((p - DVec2::new(x, y)).length() / width).powi(2)).exp();
        0.4 + 1.5 * spot(0.3, 0.4, 0.2) + 0.8 * spot(0.75, 0.6, 0.15) + 0.3 * (9.0 * p.x + 4.0 * p.y).sin().powi(2)
    }))
    .unwrap()
}

/// A window larger than the block, so that a mesh has room.
fn bench(face: ExitFace) -> Bench {
    Bench::new(BLOCK, 150.0, face).unwrap().with_window(Extent::new(80.0, 60.0), DVec2::ZERO).unwrap()
}

/// The mesh of a map from the block, where both coordinates go from -1 to 1, to the receiver, mm.
fn mesh(map: impl Fn(DVec2) -> DVec2) -> Arc<CausticMesh> {
    let (nx, ny) = (25, 19);
    let at = |k: usize, n: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
    Arc::new(CausticMesh::new(Field::from_fn(nx, ny, |i, j| map(DVec2::new(at(i, nx), at(j, ny))))).unwrap())
}

/// Relative RMS error against the picture on the mesh, without the pixels on its brim, which is a
/// matter of how they are cut.
fn error(surface: &HeightField, mesh: &CausticMesh, bench: &Bench, geometry: Geometry) -> f64 {
    let covered = |light: &TargetIrradiance| mesh.covered(light, bench).unwrap().cells().clone();
    let wanted = covered(&target());
    let whole = covered(&TargetIrradiance::new(Field::filled(PIXELS.0, PIXELS.1, 1.0)).unwrap());
    let spline = SurfaceSpline::through(surface);
    let drawn = irradiance(&spline, bench, geometry, (16 * PIXELS.0, 16 * PIXELS.1), PIXELS).irradiance;
    let (mean, full) = (drawn.mean(), whole.min_max().1);
    let (mut difference, mut square) = (0.0, 0.0);
    for (k, wanted) in wanted.as_slice().iter().enumerate() {
        if whole.as_slice()[k] > 0.999 * full {
            difference += (drawn.as_slice()[k] / mean - wanted).powi(2);
            square += wanted * wanted;
        }
    }
    (difference / square).sqrt()
}

fn solve(solver: &dyn Solver, bench: &Bench) -> Solution {
    solver.solve(&Problem::new(bench, &target()), NODES, &Silent).unwrap()
}

#[test]
fn the_window_as_a_mesh_is_the_window() {
    let bench = bench(ExitFace::Refracts { ior: 1.5 });
    let (window, given) = (Warping::default(), Warping::default().onto(mesh(|p| p * DVec2::new(40.0, 30.0))));
    let (a, b) = (solve(&window, &bench).exit, solve(&given, &bench).exit);
    let off = a.heights_mm().as_slice().iter().zip(b.heights_mm().as_slice()).map(|(a, b)| (a - b).abs());
    let worst = off.fold(0.0, f64::max);
    within_tenth_of(6.2e-6, worst / a.relief_mm(), format_args!("{worst} mm of {} mm", a.relief_mm()));
}

#[test]
fn pictures_are_drawn_on_meshes_that_are_sheared_turned_bent_and_turned_over() {
    let sheared = mesh(|p| DVec2::new(28.0 * p.x + 6.0 * p.y, 8.0 * p.x + 20.0 * p.y));
    let turned = mesh(|p| DVec2::from_angle(10_f64.to_radians()).rotate(p * DVec2::new(28.0, 20.0)));
    let ring = mesh(|p| {
        let (sin, cos) = (0.28 * p.x).sin_cos();
        (100.0 + 15.0 * p.y) * DVec2::new(sin, cos) - DVec2::Y * 100.0
    });
    let over = mesh(|p| p * DVec2::new(-30.0, 22.5));
    for (name, mesh, measured) in
        [("sheared", sheared, 0.00248), ("turned", turned, 0.00379), ("ring", ring, 0.00512), ("over", over, 0.00487)]
    {
        let bench = bench(ExitFace::Refracts { ior: 1.5 });
        mesh.check(&bench).unwrap();
        let solution = solve(&Warping::default().onto(Arc::clone(&mesh)), &bench);
        let error = error(&solution.exit, &mesh, &bench, Geometry::Displaced);
        within_tenth_of(measured, error, name);
    }
}

#[test]
fn a_fold_is_kept_and_its_layers_draw_the_picture_together() {
    let bench = bench(ExitFace::Reflects);
    let folded = mesh(|p| DVec2::new(30.0 * (p.x + 0.25 * (6.0 * p.x).sin()), 24.0 * p.y));
    let (front, back) = folded.sides();
    assert!(back > 50 && front > back, "{front} {back}");
    let solution = solve(&Warping::default().onto(Arc::clone(&folded)), &bench);
    let error = error(&solution.exit, &folded, &bench, Geometry::Displaced);
    within_tenth_of(0.055, error, "folded");
    // Light from the left of a fold passes that from its right.
    let spline = SurfaceSpline::through(&solution.exit);
    let landings = photon_mesh(&spline, &bench, Geometry::Displaced, 241, 181);
    let backwards = (1..241).filter(|&i| landings[(i, 90)].x < landings[(i - 1, 90)].x).count();
    assert!(backwards > 5, "{backwards}");
}

#[test]
fn the_paper_s_own_solver_takes_meshes_too() {
    let bench = bench(ExitFace::Refracts { ior: 1.5 });
    let sheared = mesh(|p| DVec2::new(28.0 * p.x + 6.0 * p.y, 8.0 * p.x + 20.0 * p.y));
    let solution = solve(&WarpingPaper::default().onto(Arc::clone(&sheared)), &bench);
    let error = error(&solution.exit, &sheared, &bench, Geometry::NormalMappedPlane);
    within_tenth_of(0.0023, error, "sheared");
}

#[test]
fn it_is_told_how_far_light_misses_a_mesh_that_no_height_field_draws() {
    let bench = bench(ExitFace::Refracts { ior: 1.5 });
    let off_mm = |degrees: f64| -> f64 {
        let turned = mesh(|p| DVec2::from_angle(degrees.to_radians()).rotate(p * DVec2::new(28.0, 16.0)));
        let solution = solve(&Warping::default().onto(turned), &bench);
        let note = solution.summary.notes.iter().find_map(|note| note.strip_prefix("light lands ")).unwrap();
        note.split(' ').next().unwrap().parse().unwrap()
    };
    let (little, much) = (off_mm(5.0), off_mm(30.0));
    assert!(much > 3.0 * little, "{little} mm, {much} mm");
}
