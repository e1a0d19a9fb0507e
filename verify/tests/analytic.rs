//! Gates: solids whose light is known in closed form. The tracer may judge nothing before it passes
//! these.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, every_tracer, relief, scene};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, End, Fresnel, Geometry, Light, Mesh, PhotonPlan, Scene, Surface, Tracer, Traversal, beams, photons,
};
use measured::{at_worst, within_tenth_of};
use rayon::prelude::*;

const SIZE: DVec2 = DVec2::new(40.0, 30.0);
/// Landing points are asked for to a picometre of a metre.
const MM: f64 = 1e-9;

fn landing(tracer: &Tracer, start: DVec2) -> DVec2 {
    match tracer.path(start).end {
        End::Receiver(at) => at,
        other => panic!("{start} ended as {other:?}"),
    }
}

/// Points inside of the aperture, and on grid lines and nodes of a 9 x 7 grid.
fn starts() -> impl Iterator<Item = DVec2> {
    (0..=40)
        .flat_map(|j| (0..=48).map(move |i| DVec2::new(f64::from(i) / 48.0 - 0.5, f64::from(j) / 40.0 - 0.5) * SIZE))
}

#[test]
fn a_flat_slab_moves_nothing_or_shifts_everything_alike() {
    let mesh = block(9, 7, SIZE, -10.0, |_, _| 0.0);
    for tilt in [0.0, 0.15f64] {
        let scene = Scene { light: Light::parallel(DVec3::new(tilt.sin(), 0.0, tilt.cos())), ..scene(SIZE, 32, 100.0) };
        let inside = (tilt.sin() / 1.5).asin();
        let shift = DVec2::new(10.0 * inside.tan() + 100.0 * tilt.tan(), 0.0);
        for (name, tracer) in every_tracer(&mesh, &scene) {
            for start in starts().filter(|s| s.x.abs() < 15.0) {
                let error = (landing(&tracer, start) - start - shift).length();
                assert!(error < MM, "{name}: {error:e} mm");
            }
        }
    }
}

#[test]
fn a_prism_bends_by_its_angle() {
    let slope = 0.3f64;
    let mesh = block(9, 7, SIZE, -20.0, |x, _| slope * x);
    let a = slope.atan();
    let deflection = (1.5 * a.sin()).asin() - a;
    for (name, tracer) in every_tracer(&mesh, &scene(SIZE, 32, 100.0)) {
        for start in starts() {
            // Glass grows thicker towards +x: light is bent that way.
            let expected = start.x + (100.0 - slope * start.x) * deflection.tan();
            let error = (landing(&tracer, start) - DVec2::new(expected, start.y)).length();
            assert!(error < MM, "{name} at {start}: {error:e} mm");
        }
    }
}

/// Where a ray at distance `x` from the axis lands that leaves glass at height `z` with the slope
/// `zx`.
fn refracted(x: f64, z: f64, zx: f64, distance: f64) -> f64 {
    let a = zx.atan();
    x + (distance - z) * ((1.5 * a.sin()).asin() - a).tan()
}

#[test]
fn a_cylinder_lens_of_parabolic_profile_is_exact_on_the_spline() {
    let radius = 60.0;
    let mesh = block(41, 31, SIZE, -20.0, |x, _| -x * x / (2.0 * radius));
    let tracer = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene(SIZE, 32, 100.0)).unwrap();
    for start in starts() {
        let expected = refracted(start.x, -start.x * start.x / (2.0 * radius), -start.x / radius, 100.0);
        let error = (landing(&tracer, start) - DVec2::new(expected, start.y)).length();
        assert!(error < MM, "{start}: {error:e} mm");
    }
}

#[test]
fn a_tilted_ray_meets_the_spline_and_not_its_triangles() {
    let radius = 60.0;
    let mesh = block(41, 31, SIZE, -20.0, |x, _| -x * x / (2.0 * radius));
    let light = DVec3::new(0.2, 0.0, 1.0).normalize();
    let tracer = Tracer::for_block(
        &Block::from_mesh(&mesh).unwrap(),
        &Scene { light: Light::parallel(light), ..scene(SIZE, 32, 100.0) },
    )
    .unwrap();
    let tan = (light.x / 1.5).asin().tan();
    for k in -10..=10 {
        let start = DVec2::new(f64::from(k), 1.234);
        // x = x0 + (z + 20) tan, z = -x^2 / 2R: a quadratic for x.
        let c = start.x + 20.0 * tan;
        let b = radius / tan;
        let x = -b + (b * b + 2.0 * c * b).sqrt();
        let (z, zx) = (-x * x / (2.0 * radius), -x / radius);
        let inside = tan.atan() + zx.atan();
        let out = (1.5 * inside.sin()).asin() - zx.atan();
        let expected = x + (100.0 - z) * out.tan();
        let error = (landing(&tracer, start) - DVec2::new(expected, start.y)).length();
        assert!(error < MM, "{start}: {error:e} mm");
    }
}

#[test]
fn a_plano_convex_lens_converges_with_the_order_of_its_surface_model() {
    let radius = 80.0f64;
    let cap = |x: f64, y: f64| (radius * radius - x * x - y * y).sqrt() - radius;
    let scene = scene(SIZE, 32, 100.0);
    let worst = |n: usize, surface: Surface| {
        let mesh = block(4 * n + 1, 3 * n + 1, SIZE, -20.0, cap);
        let tracer = if surface == Surface::Facets {
            Tracer::for_solid(&mesh, &Scene { surface, ..scene.clone() })
        } else {
            Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &Scene { surface, ..scene.clone() })
        }
        .unwrap();
        // Golden-ratio steps, so that no start is on a grid line.
        (1..500)
            .map(|k| DVec2::new(f64::from(k) * 0.618_034 % 1.0 - 0.5, f64::from(k) * 0.754_878 % 1.0 - 0.5) * SIZE)
            .map(|start| {
                let r = start.length();
                let z = cap(start.x, start.y);
                let expected = start / r * refracted(r, z, -r / (z + radius), 100.0);
                (landing(&tracer, start) - expected).length()
            })
            .fold(0.0, f64::max)
    };
    // Slopes converge one order below heights: 3 for the spline, 2 for interpolated normals, 1 for
    // facets.
    for (surface, order, measured) in
        [(Surface::Spline, 3.0, 6.2e-7), (Surface::Smooth, 2.0, 7.8e-5), (Surface::Facets, 1.0, 0.114)]
    {
        let (coarse, fine) = (worst(20, surface), worst(40, surface));
        let found = (coarse / fine).log2();
        at_worst(0.576, (found - order).abs(), format_args!("{surface:?}: order {found} from {coarse:e} to {fine:e}"));
        within_tenth_of(measured, fine, format_args!("{surface:?}, mm"));
    }
}

#[test]
fn a_full_solid_with_true_normals_refracts_like_a_sphere() {
    let radius = 80.0f64;
    let cap = |x: f64, y: f64| (radius * radius - x * x - y * y).sqrt() - radius;
    let mut mesh = block(161, 121, SIZE, -20.0, cap);
    // Normals per vertex: of the sphere on the exit face; walls and entry face keep theirs, being
    // flat.
    let mut normals = glasswarp_verify::CornerNormals::default();
    for k in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(k);
        let facet = (b - a).cross(c - a).normalize();
        for p in [a, b, c] {
            let sphere = (p + DVec3::new(0.0, 0.0, radius)) / radius;
            normals.directions.push(if facet.z > 0.5 { sphere } else { facet });
        }
        normals.corners.push([0, 1, 2].map(|c| 3 * k as u32 + c));
    }
    mesh.normals = Some(normals);
    let tracer = Tracer::for_solid(&mesh, &Scene { surface: Surface::Smooth, ..scene(SIZE, 32, 100.0) }).unwrap();
    for start in starts().filter(|s| s.length() > 0.1 && s.x.abs() < 19.9 && s.y.abs() < 14.9) {
        let (r, z) = (start.length(), cap(start.x, start.y));
        let expected = start / r * refracted(r, z, -r / (z + radius), 100.0);
        let error = (landing(&tracer, start) - expected).length();
        // Chord of the triangles: spacing^2 / 8R times the slope of the outgoing ray.
        at_worst(3.9e-5, error, start);
    }
}

#[test]
fn total_reflection_begins_at_the_critical_slope() {
    let critical = (1.0 / 1.5f64).asin().tan();
    for (slope, through) in [(critical - 1e-6, true), (critical + 1e-6, false)] {
        let mesh = block(9, 7, SIZE, -30.0, |x, _| slope * x);
        let block = Block::from_mesh(&mesh).unwrap();
        let scene = scene(SIZE, 32, 1000.0);
        let end = Tracer::for_block(&block, &scene).unwrap().path(DVec2::new(-3.0, 1.0)).end;
        // Just below the limit light leaves along the surface: upwards, and far off.
        assert_eq!(matches!(end, End::Receiver(_)), through, "{end:?}");
        let flux = beams(&Tracer::for_block(&block, &scene).unwrap(), 20, 15).flux;
        assert!((flux.totally_reflected - if through { 0.0 } else { 1.0 }).abs() < 1e-12);
    }
}

#[test]
fn light_turned_round_inside_comes_out_again() {
    // A roof of 90 degrees reflects everything back: a full solid follows it, a block stops at the
    // exit face.
    let mesh = block(9, 7, SIZE, -40.0, |x, _| 10.0 - x.abs());
    let scene = Scene { surface: Surface::Facets, ..scene(SIZE, 32, 100.0) };
    let whole = photons(&Tracer::for_solid(&mesh, &scene).unwrap(), &PhotonPlan::new(20_000, 1)).unwrap();
    assert!((whole.flux().side - 1.0).abs() < 1e-12, "{:?}", whole.flux());
    let stopped = beams(&Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene).unwrap(), 40, 30).flux;
    assert!((stopped.totally_reflected - 1.0).abs() < 1e-12, "{stopped:?}");
}

#[test]
fn power_adds_up_to_one_whatever_happens() {
    let rough = |x: f64, y: f64| 1.4 * (0.9 * x).sin() * (0.7 * y).cos();
    for light in [DVec3::Z, DVec3::new(0.4, -0.2, 1.0)] {
        for fresnel in [Fresnel::Off, Fresnel::On] {
            let mesh = block(81, 61, SIZE, -15.0, rough);
            let scene = Scene { fresnel, light: Light::parallel(light), ..scene(SIZE, 32, 60.0) };
            for (name, tracer) in every_tracer(&mesh, &scene) {
                let beams = beams(&tracer, 160, 120).flux;
                let photons = photons(&tracer, &PhotonPlan::new(60_000, 7)).unwrap().flux();
                for flux in [beams, photons] {
                    assert!((flux.total() - 1.0).abs() < 1e-12, "{name}: {flux:?}");
                    assert_eq!(flux.lost, 0.0, "{name}: {flux:?}");
                    assert!(
                        flux.window > 0.1 && (flux.reflected > 0.01) == (fresnel == Fresnel::On),
                        "{name}: {flux:?}"
                    );
                }
                assert!(photons.totally_reflected + photons.side > 0.05, "{name} is steep enough: {photons:?}");
            }
        }
    }
}

#[test]
fn fresnel_takes_four_percent_at_each_face() {
    let mesh = block(9, 7, SIZE, -10.0, |_, _| 0.0);
    let scene = Scene { fresnel: Fresnel::On, ..scene(SIZE, 32, 100.0) };
    for (name, tracer) in every_tracer(&mesh, &scene) {
        let flux = beams(&tracer, 64, 48).flux;
        assert!((flux.window - 0.96 * 0.96).abs() < 1e-9, "{name}: {flux:?}");
    }
    // With everything that goes to and fro inside: (1 - r) / (1 + r) for r = 0.04, up to the
    // cut-off of weak branches.
    let whole = Tracer::for_solid(&mesh, &Scene { surface: Surface::Facets, ..scene.clone() }).unwrap();
    let flux = photons(&whole, &PhotonPlan::new(10_000, 3)).unwrap().flux();
    within_tenth_of(2.4e-6, (flux.window - 0.96 / 1.04).abs(), format_args!("{flux:?}"));
}

#[test]
fn the_plane_keeps_the_normals_and_forgets_the_heights() {
    let slope = 0.3f64;
    let mesh = block(9, 7, SIZE, -20.0, |x, _| slope * x);
    let deflection = (1.5 * slope.atan().sin()).asin() - slope.atan();
    let block = Block::from_mesh(&mesh).unwrap();
    for surface in [Surface::Spline, Surface::Smooth, Surface::Facets] {
        let scene = Scene { geometry: Geometry::NormalMappedPlane, surface, ..scene(SIZE, 32, 100.0) };
        let tracer = Tracer::for_block(&block, &scene).unwrap();
        for start in starts() {
            let error = (landing(&tracer, start) - start - DVec2::new(100.0 * deflection.tan(), 0.0)).length();
            assert!(error < MM, "{surface:?}: {error:e} mm");
        }
    }
}

#[test]
fn no_ray_is_lost_at_vertices_and_edges() {
    let mesh = block(61, 46, SIZE, -15.0, relief);
    let block = Block::from_mesh(&mesh).unwrap();
    let scene = scene(SIZE, 32, 250.0);
    aim_at_everything(
        &mesh,
        &Tracer::for_block(&block, &Scene { surface: Surface::Facets, ..scene.clone() }).unwrap(),
        1_000_000,
    );
    aim_at_everything(
        &mesh,
        &Tracer::for_solid(&mesh, &Scene { surface: Surface::Facets, ..scene.clone() }).unwrap(),
        300_000,
    );
}

#[test]
#[ignore = "minutes; run it by name"]
fn no_ray_of_a_hundred_million_is_lost() {
    let mesh = block(641, 481, SIZE, -15.0, relief);
    let scene = scene(SIZE, 32, 250.0);
    let block = Block::from_mesh(&mesh).unwrap();
    for traversal in [Traversal::Bvh, Traversal::Grid] {
        let scene = Scene { traversal, ..scene.clone() };
        aim_at_everything(&mesh, &Tracer::for_block(&block, &scene).unwrap(), 100_000_000);
    }
    let scene = Scene { surface: Surface::Facets, ..scene.clone() };
    aim_at_everything(&mesh, &Tracer::for_solid(&mesh, &scene).unwrap(), 100_000_000);
}

/// Vertices, points on edges and ordinary points in turn.
fn aim_at_everything(mesh: &Mesh, tracer: &Tracer, rays: usize) {
    let n = mesh.triangles.len();
    (0..rays).into_par_iter().for_each(|k| {
        let [a, b, c] = mesh.corners(k / 7 % n);
        let target = match k % 7 {
            0 => a,
            1 => b,
            2 => 0.5 * (a + b),
            3 => a + (b - a) * ((k % 97) as f64 / 97.0),
            4 => c + (a - c) * ((k % 89) as f64 / 89.0),
            5 => c + (b - c) / 3.0,
            _ => (a + b + c) / 3.0,
        };
        let end = tracer.path(target.truncate()).end;
        assert!(matches!(end, End::Receiver(_)), "ray {k} at {target} ended as {end:?}");
    });
}
