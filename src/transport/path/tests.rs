use super::*;
use crate::measured::at_worst;
use crate::{
    bench::ExitFace,
    grid::{Extent, Field},
    light::{Congruence, FaceShape, Intensity, KnownFace, Light},
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec3;
use std::sync::Arc;

fn benches() -> Vec<Bench> {
    let block = Extent::new(100.0, 80.0);
    let glass = Bench::new(block, 150.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let mirror = Bench::new(block, 150.0, ExitFace::Reflects).unwrap();
    let lit = |bench: &Bench, direction: DVec3| bench.clone().with_light_direction(direction).unwrap();
    let near = |bench: &Bench, at: DVec3, how| bench.clone().with_point_source(at, 15.0, how).unwrap();
    let face = |shape, z_mm, index_behind| KnownFace { shape, z_mm, index_behind };
    let sphere = face(FaceShape::Sphere { radius_mm: 300.0 }, -15.0, 1.5);
    // Larger than the block, as its light converges.
    let larger = Extent::new(120.0, 100.0);
    let wave = |p: DVec2| 0.2 * (0.11 * p.x).sin() * (0.13 * p.y).cos();
    let heights = Field::from_fn(145, 121, |i, j| wave(larger.node(i, j, 145, 121)));
    let heights = Arc::new(SurfaceSpline::through(&HeightField::new(larger, heights)));
    let plate = vec![
        face(FaceShape::Plane, -50.0, 1.5),
        face(FaceShape::Heights(heights), -40.0, 1.0),
        face(FaceShape::Plane, -10.0, 1.5),
    ];
    let upright = [
        glass.clone(),
        mirror.clone(),
        lit(&glass, DVec3::new(0.15, -0.1, 1.0)),
        lit(&mirror, DVec3::new(-0.1, 0.2, -1.0)),
        near(&glass, DVec3::new(0.0, 0.0, -200.0), Intensity::Isotropic),
        near(&glass, DVec3::new(20.0, -30.0, -90.0), Intensity::Lambertian),
        near(&mirror, DVec3::new(-20.0, 25.0, 160.0), Intensity::Isotropic),
        glass.clone().behind(vec![sphere.clone()]).unwrap(),
        near(&glass, DVec3::new(20.0, -30.0, -290.0), Intensity::Isotropic).behind(vec![sphere]).unwrap(),
        glass.clone().behind(plate).unwrap(),
    ];
    let leaning = upright.iter().map(|bench| bench.clone().with_receiver_turned(DVec3::new(0.3, -0.2, 0.1)).unwrap());
    upright.iter().cloned().chain(leaning).collect()
}

/// The optical length up to a point of the face, less that up to its middle: by the shortest way,
/// searched for.
fn phase(bench: &Bench, to: DVec3) -> f64 {
    if let Some(congruence @ Congruence::Passed(_)) = bench.congruence() {
        // The wave itself is compared with its rays where it is made.
        let phase = |at: DVec3| congruence.at(at.truncate(), at.z).unwrap().phase_mm();
        return phase(to) - phase(DVec3::ZERO);
    }
    let (source, thickness, n) = match (bench.light(), bench.exit_face()) {
        (Light::Parallel { direction }, face) => return face.ior() * direction.dot(to),
        (Light::Point { position_mm, .. }, ExitFace::Reflects) => {
            return (to - position_mm).length() - position_mm.length();
        }
        (Light::Point { position_mm, thickness_mm, .. }, ExitFace::Refracts { ior }) => {
            (position_mm, thickness_mm, ior)
        }
    };
    let shortest = |to: DVec3| {
        let length = |share: f64| {
            let entry = source.truncate().lerp(to.truncate(), share).extend(-thickness);
            (entry - source).length() + n * (to - entry).length()
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..100 {
            let (a, b) = (low + (high - low) * 0.382, low + (high - low) * 0.618);
            if length(a) < length(b) { high = b } else { low = a }
        }
        length(0.5 * (low + high))
    };
    shortest(to) - shortest(DVec3::ZERO)
}

fn jet(u: f64) -> Jet {
    Jet { value: u, slope: DVec2::new(0.11, -0.07), curvature: [2e-3, -7e-4, -1e-3] }
}

/// A quadratic u with the given jet at `y0`.
fn around(jet: &Jet, y0: DVec2, y: DVec2) -> Jet {
    let d = y - y0;
    let bend = jet.hessian() * d;
    Jet { value: jet.value + jet.slope.dot(d) + 0.5 * d.dot(bend), slope: jet.slope + bend, ..*jet }
}

#[test]
fn the_ray_has_the_stated_path_and_obeys_snell() {
    for bench in benches() {
        let path = OpticalPath::new(&bench);
        let (y, jet) = (DVec2::new(21.0, -13.0), jet(0.4));
        let leaves = |u: f64, slope: DVec2, y: DVec2| {
            let ray = path.ray(y, u, slope).unwrap();
            let (h, dh) = path.height(y, &ray);
            (path.lens_point(y, &ray).extend(h), dh, ray)
        };
        let (from, dh, ray) = leaves(jet.value, jet.slope, y);
        let to = bench.receiver().point(y);
        // Its length is that of the ray through the flat face, and kappa u more.
        let (flat, _, _) = leaves(0.0, DVec2::ZERO, y);
        let length = |x: DVec3| phase(&bench, x) + (to - x).length();
        assert!((length(from) - length(flat) - path.kappa * jet.value).abs() < 1e-11, "{bench:?}");
        assert!(((to - from).normalize() - path.direction(ray.s, ray.c)).length() < 1e-13);
        assert!((path.oval_height(from.truncate(), y, jet.value) - from.z).abs() < 1e-11);
        let (moved, _, _) = leaves(jet.value + 1e-5, jet.slope, y);
        assert!(((moved.z - from.z) / 1e-5 - dh).abs() < 1e-7);
        // Along the face, which neighbouring rays leave, the path is stationary (Fermat): Snell's
        // law and that of reflection.
        let incident = {
            let slope = |d: DVec3| (phase(&bench, from + 1e-3 * d) - phase(&bench, from - 1e-3 * d)) / 2e-3;
            DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z))
        };
        let arrived = path.direction(ray.arrived.tangential, ray.arrived.axial);
        assert!((incident - arrived).length() < 1e-9, "{bench:?}");
        for d in [DVec2::X, DVec2::Y] {
            let at = |step: f64| {
                let jet = around(&jet, y, y + step * d);
                leaves(jet.value, jet.slope, y + step * d).0
            };
            let along = (at(1e-4) - at(-1e-4)) / 2e-4;
            assert!((incident - path.direction(ray.s, ray.c)).dot(along).abs() < 1e-8, "{bench:?}");
        }
    }
}

#[test]
fn a_flat_face_has_u_zero() {
    // Behind known faces the reference is the light of the middle.
    for bench in benches().into_iter().filter(|bench| bench.known_faces().is_empty()) {
        let path = OpticalPath::new(&bench);
        let y = DVec2::new(3.0, 4.0);
        let ray = path.ray(y, 0.0, DVec2::ZERO).unwrap();
        assert!(path.height(y, &ray).0.abs() < 1e-12);
        let (before, after) = (path.direction(ray.arrived.tangential, ray.arrived.axial), path.direction(ray.s, ray.c));
        let bent = (before - after).truncate().length();
        // The length of a ray from a source is found to 1e-11 of the distance.
        assert!(bent < 1e-11, "{bent:e} {bench:?}");
    }
}

#[test]
fn the_jacobians_agree_with_finite_differences() {
    for bench in benches() {
        let path = OpticalPath::new(&bench);
        let (y, jet) = (DVec2::new(-17.0, 28.0), jet(-0.3));
        let points = |at: DVec2| {
            let jet = around(&jet, y, at);
            let ray = path.ray(at, jet.value, jet.slope).unwrap();
            let x = path.lens_point(at, &ray);
            let footprint = match (&path.curved, &ray.curved) {
                (Some(light), Some(of)) => light.congruence.place_of_label(&of.arrival),
                _ => path.crossing_point(at, &ray),
            };
            (x, footprint)
        };
        let ray = path.ray(y, jet.value, jet.slope).unwrap();
        let (lens, foot) =
            (path.lens_jacobian(&ray, &jet), path.footprint_jacobian(&ray, &jet, path.label(&ray).as_ref()));
        for (axis, step) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let (a, b) = (points(y + 1e-4 * step), points(y - 1e-4 * step));
            assert!(((a.0 - b.0) / 2e-4 - lens.col(axis)).length() < 1e-9);
            assert!(((a.1 - b.1) / 2e-4 - foot.col(axis)).length() < 1e-9);
        }
    }
}

#[test]
fn the_variations_agree_with_finite_differences() {
    let weights = DMat2::from_cols(DVec2::new(0.7, -0.2), DVec2::new(0.3, 1.2));
    let mut worst = 0.0_f64;
    for bench in benches() {
        let path = OpticalPath::new(&bench);
        let (y, jet) = (DVec2::new(25.0, 9.0), jet(0.2));
        let moved = |k: usize, step: f64| {
            let mut jet = jet;
            match k {
                0 => jet.value += step,
                1 | 2 => jet.slope[k - 1] += step,
                _ => jet.curvature[k - 3] += step,
            }
            let ray = path.ray(y, jet.value, jet.slope).unwrap();
            let a = path.footprint_jacobian(&ray, &jet, path.label(&ray).as_ref());
            let x = path.lens_point(y, &ray);
            (weights.col(0).dot(a.col(0)) + weights.col(1).dot(a.col(1)), x)
        };
        let ray = path.ray(y, jet.value, jet.slope).unwrap();
        let variation = path.footprint_variation(&ray, &jet, path.label(&ray).as_ref(), weights);
        for k in 0..6 {
            let step = 1e-6;
            let (a, b) = (moved(k, step), moved(k, -step));
            let difference = (a.0 - b.0) / (2.0 * step);
            let off = (variation[k] - difference).abs() / (1.0 + difference.abs());
            if bench.known_faces().is_empty() {
                assert!(off < 1e-8, "component {k}: {} against {difference}", variation[k]);
            } else {
                // What is left out: how the spread of the light changes across its rays.
                worst = worst.max(off);
            }
            if k < 3 {
                for axis in 0..2 {
                    let difference = (a.1 - b.1)[axis] / (2.0 * step);
                    assert!((path.lens_point_variation(&ray, DVec2::AXES[axis])[k] - difference).abs() < 1e-7);
                }
            }
        }
    }
    at_worst(1.15e-3, worst, "behind known faces");
}

#[test]
fn a_far_source_has_the_path_of_parallel_light() {
    for parallel in benches() {
        if parallel.congruence().is_some() {
            continue;
        }
        let mut before = f64::INFINITY;
        for far in [1e4, 1e5, 1e6] {
            let outside = parallel.light_direction().truncate() * parallel.exit_face().ior();
            let up = -parallel.light_direction().z.signum();
            let source = far * (-outside).extend(up * (1.0 - outside.length_squared()).sqrt());
            let point = parallel.clone().with_point_source(source, 15.0, Intensity::Isotropic).unwrap();
            let of = |bench: &Bench| {
                let path = OpticalPath::new(bench);
                let (y, jet) = (DVec2::new(21.0, -13.0), jet(0.4));
                let ray = path.ray(y, jet.value, jet.slope).unwrap();
                // On oblique footprints the two differ by a linear map; the flux is the
                // determinant.
                let flux = path.footprint_jacobian(&ray, &jet, path.label(&ray).as_ref()).determinant();
                (path.lens_point(y, &ray), path.height(y, &ray).0, flux)
            };
            let (a, b) = (of(&parallel), of(&point));
            let difference = (a.0 - b.0).length() + (a.1 - b.1).abs() + 10.0 * (a.2 - b.2).abs();
            assert!(difference < 0.2 * before, "{point:?}: {difference} after {before}");
            before = difference;
        }
        at_worst(0.0145, before, format_args!("{parallel:?}: {before}"));
    }
}
