//! Gates: light with an extent and faces with a finish, against what they do to a picture in closed
//! form.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, relief, scene};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, Emission, Image, Light, PhotonPlan, PhotonTally, Scene, SceneError, SourceExtent, Surface, Tracer, Window,
    beams, photons,
};
use measured::{at_worst, within_tenth_of};

const DISTANCE: f64 = 100.0;
const SIDES: DVec2 = DVec2::new(0.4, 0.3);

/// A plate so small that it is a pinhole.
fn pinhole() -> Block {
    Block::from_heights(SIDES, -1e-6, (5, 4), vec![0.0; 20]).unwrap()
}

fn on(window_mm: f64) -> Window {
    Window { size_mm: DVec2::splat(window_mm), centre_mm: DVec2::ZERO, nx: 100, ny: 100 }
}

fn seen(block: &Block, scene: &Scene) -> PhotonTally {
    let tally = photons(&Tracer::for_block(block, scene).unwrap(), &PhotonPlan::new(400_000, 3)).unwrap();
    let flux = tally.flux();
    assert!((flux.total() - 1.0).abs() < 1e-12 && flux.lost == 0.0, "{flux:?}");
    tally
}

/// Mean square of x and y over the light, mm², less what pixels and the pinhole add.
fn moments(tally: &PhotonTally, window_mm: f64) -> DVec2 {
    let image = tally.image();
    let pixel = window_mm / 100.0;
    let (mut sum, mut total) = (DVec2::ZERO, 0.0);
    for (k, &v) in image.values.iter().enumerate() {
        let at = pixel * (DVec2::new((k % 100) as f64, (k / 100) as f64) - 49.5);
        sum += v * at * at;
        total += v;
    }
    sum / total - pixel * pixel / 12.0 - SIDES * SIDES / 12.0
}

fn near(found: DVec2, wanted: DVec2, what: &str) {
    // 400 000 photons know a second moment to 0.2 %; an even disc better than a Gaussian. Their
    // seeds are fixed.
    at_worst(0.0046, ((found - wanted) / wanted).abs().max_element(), what);
}

#[test]
fn the_image_of_the_sun_is_a_disc_of_its_angle() {
    let angle = 0.02f64;
    let radius = DISTANCE * angle.tan();
    let scene = Scene { spread: SourceExtent::AngularDisc { radius: angle }, ..Scene::new(1.5, DISTANCE, on(6.0)) };
    let tally = seen(&pinhole(), &scene);
    near(moments(&tally, 6.0), DVec2::splat(radius * radius / 4.0), "sun");
    // Even within, dark without.
    let share = |within: f64| {
        let image = tally.image();
        let inside = |k: usize| {
            let at = 0.06 * (DVec2::new((k % 100) as f64, (k / 100) as f64) - 49.5);
            if at.length() < within { image.values[k] } else { 0.0 }
        };
        (0..10_000).map(inside).sum::<f64>() / image.values.iter().sum::<f64>()
    };
    at_worst(9e-4, (share(0.5 * radius) - 0.25).abs(), "share within half the radius");
    at_worst(1.8e-3, (share(0.8 * radius) - 0.64).abs(), "share within 0.8 of the radius");
    assert!(share(radius + SIDES.length()) == 1.0);
    let hazy = Scene { spread: SourceExtent::AngularGaussian { rms: 0.005 }, ..scene };
    near(moments(&seen(&pinhole(), &hazy), 6.0), DVec2::splat((DISTANCE * 0.005).powi(2)), "haze");
}

#[test]
fn the_image_of_a_lamp_is_the_lamp_scaled_by_the_distances() {
    let before = 80.0;
    let light =
        |z: f64| Light::Point { position_mm: DVec3::new(0.0, 0.0, z), emission: Emission::Lambertian, axis: None };
    let rectangle = DVec2::new(3.0, 1.5);
    let magnified = |size: DVec2| (size * DISTANCE / before).powf(2.0);
    // The pinhole is seen larger than it is.
    let wider = SIDES * SIDES * ((1.0 + DISTANCE / before).powi(2) - 1.0) / 12.0;
    for scene in [
        Scene { light: light(-before), ..Scene::new(1.5, DISTANCE, on(8.0)) },
        Scene { light: light(before), ..Scene::mirror(DISTANCE, on(8.0)) },
    ] {
        let led = Scene { spread: SourceExtent::SourceRectangle { size_mm: rectangle }, ..scene.clone() };
        near(moments(&seen(&pinhole(), &led), 8.0) - wider, magnified(rectangle) / 12.0, "LED");
        let disc = Scene { spread: SourceExtent::SourceDisc { radius_mm: 2.0 }, ..scene };
        near(moments(&seen(&pinhole(), &disc), 8.0) - wider, magnified(DVec2::splat(2.0)) / 4.0, "lamp");
    }
}

#[test]
fn a_rough_face_blurs_by_its_slopes() {
    let slope = 0.01;
    let glass = Scene { roughness: slope, ..Scene::new(1.5, DISTANCE, on(8.0)) };
    near(moments(&seen(&pinhole(), &glass), 8.0), DVec2::splat((0.5 * slope * DISTANCE).powi(2)), "glass");
    let mirror = Scene { roughness: slope, ..Scene::mirror(DISTANCE, on(16.0)) };
    near(moments(&seen(&pinhole(), &mirror), 16.0), DVec2::splat((2.0 * slope * DISTANCE).powi(2)), "mirror");
}

#[test]
fn a_caustic_in_the_sun_is_the_sum_of_those_of_its_directions() {
    let size = DVec2::new(40.0, 30.0);
    let block = Block::from_mesh(&block(61, 46, size, -8.0, |x, y| 0.4 * relief(2.0 * x, 2.0 * y))).unwrap();
    let block = block.with_entry_face(-size, size).unwrap();
    let radius = 0.03f64;
    let ideal = Scene { surface: Surface::Smooth, ..scene(size, 32, 80.0) };
    let mut sum = Image::new(32, 24, vec![0.0; 32 * 24]);
    let (rings, mut directions) = (8, 0);
    for ring in 0..rings {
        // Each ring holds a part of the disc that goes as its number of directions.
        let members = 6 * ring + 3;
        let at = radius * ((f64::from(ring) + 0.5) / f64::from(rings));
        for k in 0..members {
            let aside = at.tan() * DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(members));
            let tracer =
                Tracer::for_block(&block, &Scene { light: Light::parallel(aside.extend(1.0)), ..ideal.clone() });
            let image = beams(&tracer.unwrap(), 256, 192).image;
            sum.values.iter_mut().zip(&image.values).for_each(|(sum, v)| *sum += v);
            directions += 1;
        }
    }
    let tally = seen(&block, &Scene { spread: SourceExtent::AngularDisc { radius }, ..ideal.clone() });
    let (image, errors) = (tally.image(), tally.standard_error());
    let squares = |other: &dyn Fn(usize) -> f64| {
        let square = |k: usize| ((image.values[k] - other(k)) / errors.values[k]).powi(2);
        (0..32 * 24).map(square).sum::<f64>() / (32.0 * 24.0)
    };
    let own = squares(&|k| sum.values[k] / f64::from(directions));
    within_tenth_of(1.083, own, "chi squared of a photon");
    let sharp = beams(&Tracer::for_block(&block, &ideal).unwrap(), 256, 192).image;
    let without = squares(&|k| sharp.values[k]);
    within_tenth_of(13.18, without, "chi squared without the sun");
}

#[test]
fn spread_light_does_not_depend_on_threads_and_knows_its_noise() {
    let scene = Scene {
        spread: SourceExtent::AngularDisc { radius: 0.01 },
        roughness: 0.003,
        light: Light::parallel(DVec3::new(0.1, 0.0, 1.0)),
        ..Scene::new(1.5, DISTANCE, Window { centre_mm: DVec2::new(10.0, 0.0), ..on(6.0) })
    };
    let tracer = Tracer::for_block(&pinhole(), &scene).unwrap();
    let run = |threads: usize, count: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| photons(&tracer, &PhotonPlan::new(count, 4)).unwrap())
    };
    assert!(run(1, 40_000) == run(3, 40_000));
    let ratio = run(2, 32_768).noise() / run(2, 32_768 * 16).noise();
    // The root of 16, as of independent photons: of a pinhole nothing is left but directions.
    within_tenth_of(4.0, ratio, "noise of a sixteenth of the photons");
}

#[test]
fn what_cannot_be_spread_is_refused() {
    let mesh = block(9, 7, DVec2::new(40.0, 30.0), -10.0, |_, _| 0.0);
    let rough = Scene { roughness: 0.01, surface: Surface::Facets, ..scene(DVec2::new(40.0, 30.0), 32, 100.0) };
    assert!(matches!(Tracer::for_solid(&mesh, &rough), Err(SceneError::Needs(_))));
    let refused = |scene: Scene| Tracer::for_block(&pinhole(), &scene).unwrap_err();
    let ideal = Scene::new(1.5, DISTANCE, on(6.0));
    assert!(matches!(refused(Scene { roughness: -1.0, ..ideal.clone() }), SceneError::Value { .. }));
    let lamp = SourceExtent::SourceDisc { radius_mm: 1.0 };
    assert!(matches!(refused(Scene { spread: lamp, ..ideal }), SceneError::Needs(_)));
}
