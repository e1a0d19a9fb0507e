//! Gates: light at an angle, from a point, from a mirror, onto a tilted receiver, on solids whose
//! light is known in closed form.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, every_tracer, relief, scene};
use glam::{DMat3, DQuat, DVec2, DVec3};
use glasswarp_verify::{
    BeamProfile, Block, Emission, End, Flux, Fresnel, Geometry, Image, IntensityTable, Light, PhotonPlan, Scene,
    SceneError, Surface, Tracer, Window, beams, facet_beams, photons,
};
use measured::{at_worst, within_tenth_of};
use std::f64::consts::FRAC_PI_2;

const SIZE: DVec2 = DVec2::new(40.0, 30.0);
const MM: f64 = 1e-9;

fn landed(end: End) -> DVec2 {
    match end {
        End::Receiver(at) => at,
        other => panic!("ended as {other:?}"),
    }
}

/// Points inside of the block's plan, and on grid lines and nodes of a 9 x 7 grid.
fn points() -> impl Iterator<Item = DVec2> {
    (0..=20)
        .flat_map(|j| (0..=24).map(move |i| DVec2::new(f64::from(i) / 24.0 - 0.5, f64::from(j) / 20.0 - 0.5) * SIZE))
}

fn at_degrees(degrees: f64) -> DVec3 {
    let a = degrees.to_radians();
    DVec3::new(a.sin() * 0.8, a.sin() * 0.6, a.cos())
}

fn point(position_mm: DVec3) -> Light {
    Light::Point { position_mm, emission: Emission::Isotropic, axis: None }
}

/// Where the line from a point along a direction meets the plane through `(0, 0, distance)` turned
/// by a rotation vector, by the plane's equations and not by its axes.
fn on_plane(from: DVec3, direction: DVec3, distance: f64, turned: DVec3) -> DVec2 {
    let frame = DMat3::from_quat(DQuat::from_scaled_axis(turned));
    // from + t direction = centre + y1 e1 + y2 e2: three linear equations.
    let system = DMat3::from_cols(frame.x_axis, frame.y_axis, -direction);
    (system.inverse() * (from - DVec3::new(0.0, 0.0, distance))).truncate()
}

const TURNED: [DVec3; 3] = [DVec3::ZERO, DVec3::new(0.0, 0.35, 0.0), DVec3::new(-0.3, 0.2, 0.5)];

#[test]
fn a_prism_bends_oblique_light_onto_any_receiver() {
    let (n, slope, entry) = (1.5, 0.3, -20.0);
    let mesh = block(9, 7, SIZE, entry, |x, _| slope * x);
    let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
    // Snell's law by the components along the surfaces.
    let bend = |d: DVec3, normal: DVec3, eta: f64| {
        let along = eta * (d - d.dot(normal) * normal);
        along + (1.0 - along.length_squared()).sqrt() * normal
    };
    for degrees in [0.0, 10.0, 30.0] {
        for turned in TURNED {
            let light = at_degrees(degrees);
            let inside = bend(light, DVec3::Z, 1.0 / n);
            let outside = bend(inside, normal, n);
            let scene = Scene { light: Light::parallel(light), receiver_turned: turned, ..scene(SIZE, 32, 100.0) };
            for (name, tracer) in every_tracer(&mesh, &scene) {
                for at in points().filter(|p| p.x.abs() < 10.0 && p.y.abs() < 6.0) {
                    let exit = at.extend(slope * at.x);
                    let start = exit - inside * ((exit.z - entry) / inside.z);
                    let wanted = on_plane(exit, outside, 100.0, turned);
                    let error = (landed(tracer.path(start.truncate()).end) - wanted).length();
                    assert!(error < MM, "{name} at {degrees} degrees, {at}: {error:e} mm");
                    if name != "full solid" {
                        let error = (landed(tracer.path_at(at).end) - wanted).length();
                        assert!(error < MM, "{name} at {degrees} degrees, {at} of the face: {error:e} mm");
                    }
                }
            }
        }
    }
}

#[test]
fn a_plate_shifts_the_light_of_a_point_by_what_its_thickness_says() {
    let (n, thickness, distance) = (1.5, 10.0, 100.0);
    let mesh = block(9, 7, SIZE, -thickness, |_, _| 0.0);
    for source in [DVec3::new(0.0, 0.0, -300.0), DVec3::new(15.0, -8.0, -60.0)] {
        for turned in TURNED {
            let scene = Scene { light: point(source), receiver_turned: turned, ..scene(SIZE, 32, distance) };
            for (name, tracer) in every_tracer(&mesh, &scene) {
                for start in points().filter(|p| p.x.abs() < 13.0 && p.y.abs() < 9.0) {
                    let air = (start.extend(-thickness) - source).normalize();
                    let glass =
                        DVec3::new(air.x / n, air.y / n, (1.0 - (air.x * air.x + air.y * air.y) / (n * n)).sqrt());
                    let exit = start.extend(-thickness) + glass * (thickness / glass.z);
                    let wanted = on_plane(exit, air, distance, turned);
                    let error = (landed(tracer.path(start).end) - wanted).length();
                    assert!(error < MM, "{name}, {start}: {error:e} mm");
                    if name != "full solid" {
                        // The same ray, found from where it leaves.
                        let error = (landed(tracer.path_at(exit.truncate()).end) - wanted).length();
                        assert!(error < MM, "{name}, {exit} of the face: {error:e} mm");
                    }
                }
            }
        }
    }
}

#[test]
fn a_plane_mirror_shows_the_source_behind_itself() {
    let slope = 0.1f64;
    let mesh = block(9, 7, SIZE, -10.0, |x, _| slope * x);
    let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
    let mirrored = |v: DVec3| v - 2.0 * v.dot(normal) * normal;
    for turned in TURNED {
        let on = |light: Light| Scene { light, receiver_turned: turned, ..Scene::mirror(100.0, window(32)) };
        for degrees in [0.0, 30.0] {
            let d = -at_degrees(degrees);
            for (name, tracer) in every_tracer(&mesh, &on(Light::parallel(d))) {
                for at in points() {
                    let wanted = on_plane(at.extend(slope * at.x), mirrored(d), 100.0, turned);
                    let error = (landed(tracer.path_at(at).end) - wanted).length();
                    assert!(error < MM, "{name} at {degrees} degrees, {at}: {error:e} mm");
                }
            }
        }
        let source = DVec3::new(20.0, 5.0, 70.0);
        for (name, tracer) in every_tracer(&mesh, &on(point(source))) {
            for at in points() {
                let exit = at.extend(slope * at.x);
                let wanted = on_plane(exit, exit - mirrored(source), 100.0, turned);
                let error = (landed(tracer.path_at(at).end) - wanted).length();
                assert!(error < MM, "{name}, source, {at}: {error:e} mm");
            }
        }
    }
}

#[test]
fn a_hollow_parabolic_mirror_has_one_focus() {
    // z = r^2 / 4f sends light along the axis through (0, 0, f), whatever the height.
    let focus = 60.0;
    let mesh = block(41, 31, SIZE, -10.0, |x, y| (x * x + y * y) / (4.0 * focus));
    let tracer = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &Scene::mirror(focus, window(32))).unwrap();
    for at in points() {
        let error = landed(tracer.path_at(at).end).length();
        assert!(error < MM, "{at}: {error:e} mm");
    }
}

#[test]
fn a_spherical_mirror_sends_light_from_its_centre_back_to_it() {
    let radius = 80.0f64;
    let cap = |x: f64, y: f64| radius - (radius * radius - x * x - y * y).sqrt();
    let scene = Scene { light: point(DVec3::new(0.0, 0.0, radius)), ..Scene::mirror(radius, window(32)) };
    let worst = |n: usize| {
        let mesh = block(4 * n + 1, 3 * n + 1, SIZE, -10.0, cap);
        let tracer = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene).unwrap();
        points().map(|at| landed(tracer.path_at(at).end).length()).fold(0.0, f64::max)
    };
    // The spline's slopes converge with the third power, and faster at nodes and cell centres.
    let (coarse, fine) = (worst(20), worst(40));
    within_tenth_of(7.92, coarse / fine, format_args!("{coarse:e} {fine:e} mm"));
    within_tenth_of(5.5e-6, fine, "at the centre, mm");
    // Seen from 30 degrees off, by hand: normal of the sphere, law of reflection.
    let d = -at_degrees(30.0);
    let mesh = block(161, 121, SIZE, -10.0, cap);
    let scene = Scene { light: Light::parallel(d), ..Scene::mirror(100.0, window(32)) };
    let tracer = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene).unwrap();
    for at in points() {
        let exit = at.extend(cap(at.x, at.y));
        let normal = (DVec3::new(0.0, 0.0, radius) - exit) / radius;
        let wanted = on_plane(exit, d - 2.0 * d.dot(normal) * normal, 100.0, DVec3::ZERO);
        let error = (landed(tracer.path_at(at).end) - wanted).length();
        // Slopes of the spline are worst at the corners of the face.
        at_worst(3.9e-5, error, format_args!("{at}, mm"));
    }
}

fn window(pixels: usize) -> Window {
    Window { size_mm: SIZE, centre_mm: DVec2::ZERO, nx: pixels, ny: pixels * 3 / 4 }
}

/// What an image must be where its light falls on all of the window, up to one factor; by beams and
/// by photons.
fn demand_irradiance(tracer: &Tracer, wanted: impl Fn(DVec2) -> f64, what: &str) {
    let scene = tracer.scene();
    let (nx, ny) = (scene.window.nx, scene.window.ny);
    let pixel = scene.window.size_mm / DVec2::new(nx as f64, ny as f64);
    // Means over pixels, by four points of Gauss.
    let g = 0.5 / 3f64.sqrt();
    let mean = |k: usize| {
        let place = DVec2::new((k % nx) as f64 + 0.5, (k / nx) as f64 + 0.5);
        let at = scene.window.centre_mm + 0.5 * scene.window.size_mm - place * pixel;
        0.25 * [(-g, -g), (g, -g), (g, g), (-g, g)]
            .iter()
            .map(|&(u, v)| wanted(at + DVec2::new(u, v) * pixel))
            .sum::<f64>()
    };
    let expected: Vec<f64> = (0..nx * ny).map(mean).collect();
    let total: f64 = expected.iter().sum();
    let seen = beams(tracer, 16 * nx, 16 * ny);
    let scale = seen.image.values.iter().sum::<f64>() / total;
    for (k, (value, &wanted)) in seen.image.values.iter().zip(&expected).enumerate() {
        let error = (value / (scale * wanted) - 1.0).abs();
        at_worst(6.8e-5, error, format_args!("{what}: pixel {k}"));
    }
    let noisy = photons(tracer, &PhotonPlan::new(400_000, 5)).unwrap();
    let (image, error) = (noisy.image(), noisy.standard_error());
    let squares: f64 =
        image.values.iter().zip(&expected).zip(&error.values).map(|((a, b), s)| ((a - scale * b) / s).powi(2)).sum();
    let mean_square = squares / (nx * ny) as f64;
    // Of this seed; standard errors of few replicates are themselves known to an eighth.
    at_worst(0.214, (mean_square - 1.0).abs(), format_args!("{what}: {mean_square}"));
    for flux in [seen.flux, noisy.flux()] {
        assert!((flux.total() - 1.0).abs() < 1e-12 && flux.lost == 0.0, "{what}: {flux:?}");
    }
    at_worst(
        4.7e-5,
        (seen.flux.window - noisy.flux().window).abs(),
        format_args!("{what}: {:?} {:?}", seen.flux, noisy.flux()),
    );
}

/// A plate so thin that what it shifts the light by is nothing: irradiance on the receiver is that
/// of the source in air.
fn thin_plate() -> Block {
    Block::from_heights(SIZE, -1e-6, (9, 7), vec![0.0; 63]).unwrap()
}

#[test]
fn the_light_of_a_point_falls_off_as_the_cosine_says() {
    let (source, distance) = (DVec3::new(4.0, -3.0, -90.0), 100.0);
    // The shadow of the plate is twice its size and more: this window is well inside.
    let small = Window { size_mm: DVec2::new(48.0, 36.0), centre_mm: DVec2::ZERO, nx: 32, ny: 24 };
    let axis = DVec3::new(0.2, 0.1, 1.0);
    let table = [(0.0, 1.0), (0.2, 0.8), (0.6, 0.1)];
    type Intensity<'a> = &'a dyn Fn(f64) -> f64;
    let cases: [(Emission, Option<DVec3>, Intensity<'_>); 5] = [
        (Emission::Isotropic, None, &|_| 1.0),
        (Emission::Lambertian, None, &|cos| cos),
        (Emission::Lambertian, Some(axis), &|cos| cos),
        (Emission::Gaussian { half_angle: 0.2 }, Some(axis), &|cos: f64| {
            (-(2f64.ln()) * (cos.acos() / 0.2).powi(2)).exp()
        }),
        (Emission::Table(IntensityTable::new(&table).unwrap()), None, &|cos: f64| {
            let angle = cos.acos();
            if angle < 0.2 { 1.0 - angle } else { 0.8 - 1.75 * (angle - 0.2) }
        }),
    ];
    for (emission, axis, intensity) in cases {
        let what = format!("{emission:?} about {axis:?}");
        let towards = axis.unwrap_or(DVec3::Z).normalize();
        let light = Light::Point { position_mm: source, emission, axis };
        let scene = Scene { light, ..Scene::new(1.5, distance, small) };
        let tracer = Tracer::for_block(&thin_plate(), &scene).unwrap();
        // I(angle) cos / r^2 on the receiver.
        let wanted = |at: DVec2| {
            let r = at.extend(distance) - source;
            intensity(r.normalize().dot(towards)) * r.normalize().z / r.length_squared()
        };
        demand_irradiance(&tracer, wanted, &what);
    }
}

#[test]
fn a_mirror_and_a_tilted_receiver_keep_to_the_cosine_law_too() {
    let source = DVec3::new(10.0, 4.0, 90.0);
    let turned = DVec3::new(0.1, -0.3, 0.0);
    let small = Window { size_mm: DVec2::new(36.0, 27.0), centre_mm: DVec2::new(-8.0, -3.0), nx: 32, ny: 24 };
    let scene = Scene { light: point(source), receiver_turned: turned, ..Scene::mirror(100.0, small) };
    let tracer = Tracer::for_block(&thin_plate(), &scene).unwrap();
    let frame = DMat3::from_quat(DQuat::from_scaled_axis(turned));
    let image = DVec3::new(source.x, source.y, -source.z);
    let wanted = |at: DVec2| {
        let r = DVec3::new(0.0, 0.0, 100.0) + frame * at.extend(0.0) - image;
        r.normalize().dot(frame.z_axis) / r.length_squared()
    };
    demand_irradiance(&tracer, wanted, "mirror");
}

#[test]
fn parallel_light_keeps_its_irradiance_and_a_measured_beam_its_own() {
    let light = Light::parallel(at_degrees(20.0));
    let distance = 50.0;
    let shift = distance * (at_degrees(20.0) / at_degrees(20.0).z).truncate();
    let small = Window { size_mm: DVec2::new(30.0, 21.0), centre_mm: shift, nx: 30, ny: 21 };
    let even = Scene { light: light.clone(), ..Scene::new(1.5, distance, small) };
    demand_irradiance(&Tracer::for_block(&thin_plate(), &even).unwrap(), |_| 1.0, "even");
    // Bilinear between 2 x 2 pixels: the middle half of the picture is a plane.
    let picture = Image::new(2, 2, vec![3.0, 1.0, 4.0, 2.0]);
    let profile = BeamProfile::new(picture, DVec2::new(80.0, 60.0), DVec2::ZERO).unwrap();
    let measured = Scene { profile: Some(profile.clone()), ..even };
    let plane = |p: DVec2| 2.5 + 2.0 * p.x / 40.0 - 1.0 * p.y / 30.0;
    demand_irradiance(&Tracer::for_block(&thin_plate(), &measured).unwrap(), |at| plane(at - shift), "profile");
    // From a point the measured light spreads on.
    let source = DVec3::new(0.0, 0.0, -150.0);
    let small = Window { size_mm: DVec2::new(36.0, 27.0), centre_mm: DVec2::ZERO, nx: 36, ny: 27 };
    let scene = Scene { light: point(source), profile: Some(profile), ..Scene::new(1.5, distance, small) };
    demand_irradiance(&Tracer::for_block(&thin_plate(), &scene).unwrap(), |at| plane(0.75 * at), "spreading profile");
}

#[test]
fn estimators_agree_through_a_relief_on_every_bench() {
    let mesh = block(61, 46, SIZE, -8.0, |x, y| 0.4 * relief(2.0 * x, 2.0 * y));
    let flat = block(61, 46, SIZE, -8.0, |x, y| 0.4 * relief(2.0 * x, 2.0 * y));
    let block = Block::from_mesh(&flat).unwrap().with_entry_face(-SIZE, SIZE).unwrap();
    let window = Window { size_mm: 1.6 * SIZE, centre_mm: DVec2::ZERO, nx: 32, ny: 24 };
    let oblique = |z: f64| Light::parallel(DVec3::new(0.3, -0.1, z));
    let glass = Scene::new(1.5, 80.0, window);
    let mirror = Scene::mirror(80.0, window);
    let benches = [
        Scene { light: oblique(1.0), ..glass.clone() },
        Scene { light: oblique(1.0), turned: DVec3::new(0.1, 0.2, 0.0), fresnel: Fresnel::On, ..glass.clone() },
        Scene { light: point(DVec3::new(20.0, 0.0, -100.0)), ..glass.clone() },
        Scene { light: oblique(1.0), geometry: Geometry::NormalMappedPlane, ..glass },
        Scene { light: oblique(-1.0), receiver_turned: DVec3::new(0.2, 0.0, 0.0), ..mirror.clone() },
        Scene { light: point(DVec3::new(20.0, 0.0, 100.0)), turned: DVec3::new(0.1, 0.0, 0.0), ..mirror },
    ];
    for scene in benches {
        for surface in [Surface::Spline, Surface::Smooth, Surface::Facets] {
            let scene = Scene { surface, ..scene.clone() };
            let tracer = Tracer::for_block(&block, &scene).unwrap();
            let sharp = match (surface, scene.geometry) {
                (Surface::Facets, Geometry::Displaced) => facet_beams(&tracer, &block),
                // Its light tears at every edge.
                (Surface::Facets, Geometry::NormalMappedPlane) => continue,
                _ => beams(&tracer, 32 * 16, 24 * 16),
            };
            let noisy = photons(&tracer, &PhotonPlan::new(300_000, 3)).unwrap();
            for flux in [sharp.flux, noisy.flux()] {
                assert!((flux.total() - 1.0).abs() < 1e-12 && flux.lost == 0.0, "{scene:?}: {flux:?}");
                assert!(flux.window > 0.4 && tracer.vignetting() == 0.0, "{scene:?}: {flux:?}");
            }
            let (image, error) = (noisy.image(), noisy.standard_error());
            let pairs = image.values.iter().zip(&sharp.image.values).zip(&error.values);
            let squares: Vec<f64> = pairs.filter(|(_, s)| **s > 0.0).map(|((a, b), s)| ((a - b) / s).powi(2)).collect();
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            at_worst(0.247, (mean - 1.0).abs(), format_args!("{scene:?}: {mean}"));
        }
    }
    // A full solid sees the same light in the middle, where nothing comes that its walls have
    // reflected.
    let scene =
        Scene { light: point(DVec3::new(0.0, 0.0, -400.0)), surface: Surface::Facets, ..Scene::new(1.5, 80.0, window) };
    let whole = photons(&Tracer::for_solid(&mesh, &scene).unwrap(), &PhotonPlan::new(3_000_000, 1)).unwrap().image();
    let narrow = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene).unwrap();
    let narrow = facet_beams(&narrow, &Block::from_mesh(&mesh).unwrap()).image;
    let inner = |image: &Image| -> Vec<f64> {
        let sum = |j: usize, i: usize| (0..16).map(|k| image.values[(4 * j + k / 4) * 32 + 4 * i + k % 4]).sum::<f64>();
        let sums: Vec<f64> = (2..4).flat_map(|j| (3..5).map(move |i| (j, i))).map(|(j, i)| sum(j, i)).collect();
        let total: f64 = sums.iter().sum();
        sums.iter().map(|v| v / total * 4.0).collect()
    };
    for (a, b) in inner(&whole).iter().zip(inner(&narrow)) {
        // 6.9e-5 was measured; one of some 20 000 photons in each part may fall on the other side of
        // its border elsewhere.
        at_worst(1.2e-4, (a - b).abs(), format_args!("{a} {b}"));
    }
}

#[test]
fn light_that_comes_by_the_walls_is_told_and_a_rim_lets_it_in() {
    let (thickness, tan_inside) = (10.0, (30f64.to_radians().sin() / 1.5).asin().tan());
    let light = Light::parallel(DVec3::new(30f64.to_radians().sin(), 0.0, 30f64.to_radians().cos()));
    let scene = Scene { light, ..scene(SIZE, 32, 100.0) };
    let bare = Block::from_heights(SIZE, -thickness, (9, 7), vec![0.0; 63]).unwrap();
    let tracer = Tracer::for_block(&bare, &scene).unwrap();
    let wanted = thickness * tan_inside / SIZE.x;
    within_tenth_of(2.45e-3, (tracer.vignetting() - wanted).abs(), "vignetting");
    let side = |flux: Flux| {
        at_worst(1.07e-4, (flux.side - wanted).abs(), format_args!("{flux:?} {wanted}"));
        assert_eq!(flux.lost, 0.0);
    };
    side(beams(&tracer, 640, 48).flux);
    side(photons(&tracer, &PhotonPlan::new(100_000, 1)).unwrap().flux());
    let rimmed = bare.clone().with_entry_face(-0.5 * SIZE - 5.0, 0.5 * SIZE).unwrap();
    let tracer = Tracer::for_block(&rimmed, &scene).unwrap();
    assert_eq!((tracer.vignetting(), beams(&tracer, 64, 48).flux.side), (0.0, 0.0));
    assert!(bare.with_entry_face(-0.4 * SIZE, 0.5 * SIZE).is_err());
}

#[test]
fn benches_that_cannot_be_are_refused_with_their_limit() {
    let block = Block::from_heights(SIZE, -10.0, (9, 7), vec![0.0; 63]).unwrap();
    let glass = scene(SIZE, 32, 100.0);
    let mirror = Scene::mirror(100.0, window(32));
    let refused = |scene: Scene| Tracer::for_block(&block, &scene).unwrap_err();
    let lit = |scene: &Scene, light: Light| refused(Scene { light, ..scene.clone() });
    let axis = |z: f64| point(DVec3::new(0.0, 0.0, z));
    assert!(matches!(lit(&glass, Light::parallel(DVec3::NEG_Z)), SceneError::Light { towards: "+z", .. }));
    assert!(matches!(lit(&mirror, Light::parallel(DVec3::Z)), SceneError::Light { towards: "-z", .. }));
    assert!(matches!(lit(&mirror, Light::parallel(DVec3::NAN)), SceneError::Light { .. }));
    assert!(matches!(lit(&glass, Light::parallel(1e-160 * DVec3::Z)), SceneError::Light { .. }));
    assert!(
        matches!(lit(&glass, Light::parallel(at_degrees(86.0))), SceneError::Tilt { degrees, .. } if degrees > 85.9)
    );
    for z in [-10.0, -5.0, 50.0] {
        assert!(matches!(lit(&glass, axis(z)), SceneError::Source { side: "below", .. }), "{z}");
    }
    assert!(matches!(lit(&mirror, axis(-1.0)), SceneError::Source { side: "above", .. }));
    assert!(matches!(lit(&mirror, point(DVec3::NAN)), SceneError::Value { .. }));
    let behind = Light::Point {
        position_mm: DVec3::new(0.0, 0.0, -100.0),
        emission: Emission::Lambertian,
        axis: Some(DVec3::NEG_Z),
    };
    assert_eq!(lit(&glass, behind), SceneError::Dark);
    let far = BeamProfile::new(Image::new(1, 1, vec![1.0]), DVec2::ONE, DVec2::splat(500.0)).unwrap();
    assert_eq!(refused(Scene { profile: Some(far), ..glass.clone() }), SceneError::Dark);
    let turned = |distance_mm: f64, angle: f64| {
        let receiver_turned = DVec3::new(0.0, angle, 0.0);
        Tracer::for_block(&block, &Scene { distance_mm, receiver_turned, ..glass.clone() }).map(drop)
    };
    assert!(turned(20.0, 0.7).is_ok());
    assert!(matches!(turned(20.0, 0.9), Err(SceneError::ReceiverCuts { by_mm, .. }) if by_mm > 0.0));
    assert!(matches!(turned(1e4, FRAC_PI_2 - 0.05), Err(SceneError::Tilt { what: "the receiver", .. })));
    let mesh = common::block(9, 7, SIZE, -10.0, |_, _| 0.0);
    let solid = Scene { surface: Surface::Facets, ..mirror };
    assert!(matches!(Tracer::for_solid(&mesh, &solid), Err(SceneError::Needs(why)) if why.contains("mirror")));
}

#[test]
fn results_of_uneven_light_do_not_depend_on_threads_and_survive_a_file() {
    let block = Block::from_mesh(&block(61, 46, SIZE, -8.0, relief)).unwrap();
    let light = Light::Point { position_mm: DVec3::new(9.0, 2.0, -50.0), emission: Emission::Lambertian, axis: None };
    let tracer = Tracer::for_block(&block, &Scene { light, ..scene(SIZE, 32, 60.0) }).unwrap();
    let plan = PhotonPlan::new(60_000, 4).with_replicates(6);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (beams(&tracer, 200, 160), photons(&tracer, &plan).unwrap()))
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tally.exr");
    one.1.write(&path, "a bench").unwrap();
    assert_eq!(glasswarp_verify::PhotonTally::read(&path).unwrap().0, one.1);
}
