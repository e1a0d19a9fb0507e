//! White light through glass whose caustics are known in closed form.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, relief, scene};
use glam::DVec2;
use glasswarp_verify::{
    Block, Optics, Row, Scene, SceneError,
    dispersion::{Dispersed, LINES_NM, disperse, disperse_row},
    image_file,
};
use measured::{at_worst, nothing_but_rounding, within_tenth_of};

const SIZE: DVec2 = DVec2::new(40.0, 30.0);

/// A glass of index 1.5 at 587.6 nm that disperses as much as one of Abbe number 30.
fn ior_at(nm: f64) -> f64 {
    let cauchy = |nm: f64| 1e4 / (nm * nm);
    1.5 + 0.5 / 30.0 * (cauchy(nm) - cauchy(587.6)) / (cauchy(LINES_NM[0]) - cauchy(LINES_NM[1]))
}

fn white(height: impl Fn(f64, f64) -> f64, scene: &Scene) -> Dispersed {
    let block = Block::from_mesh(&block(61, 46, SIZE, -12.0, height)).unwrap();
    disperse(&block, scene, &ior_at, (256, 192)).unwrap()
}

#[test]
fn a_prism_parts_the_lines_by_its_angle_and_shows_a_rainbow() {
    let slope = 0.2f64;
    let bench = scene(SIZE, 64, 200.0);
    let seen = white(|x, _| slope * x, &bench);
    let leaves = |n: f64| (n * slope.atan().sin()).asin() - slope.atan();
    // From where the ray leaves, up to the relief's own height.
    let part = leaves(ior_at(LINES_NM[0])).tan() - leaves(ior_at(LINES_NM[1])).tan();
    within_tenth_of(6.7e-5, (seen.fringing.rms_mm / (200.0 * part) - 1.0).abs(), "in the mean");
    within_tenth_of(7.7e-5, (seen.fringing.worst_mm / ((200.0 + 4.0) * part) - 1.0).abs(), "at worst");
    assert!((seen.fringing.ior[0] - seen.fringing.ior[1] - 0.5 / 30.0).abs() < 1e-12);
    // Thicker glass is at +x, and blue is bent further: where all the light begins, at the
    // picture's right, there is no blue.
    let row = 24 * 64;
    let first = (0..64).rev().find(|&i| seen.luminance.values[row + i] > 0.02).unwrap();
    let [r, g, b] = [0, 1, 2].map(|c| seen.rgb[c].values[row + first]);
    within_tenth_of(0.502, g / r, "green of red");
    within_tenth_of(0.0684, b.abs() / r, "blue of red");
}

#[test]
fn a_plate_leaves_white_white() {
    let seen = white(|_, _| 0.0, &scene(SIZE, 64, 200.0));
    for image in seen.rgb.iter().chain([&seen.luminance]) {
        nothing_but_rounding(image.values.iter().map(|v| (v - 1.0).abs()).fold(0.0, f64::max), "white");
    }
    assert_eq!(seen.fringing.rms_mm, 0.0);
    nothing_but_rounding(seen.fringing.rel_rms, "fringes");
}

#[test]
fn colours_are_lost_to_the_eye_but_cost_sharpness() {
    let seen = white(|x, y| 0.4 * relief(2.0 * x, 2.0 * y), &scene(SIZE, 64, 80.0));
    within_tenth_of(1.97e-3, seen.fringing.rel_rms, "sharpness");
    within_tenth_of(0.0310, seen.fringing.rms_mm, "fringes, mm");
    // All light is there: white in the mean, but for what passes the window's border.
    let mean = seen.luminance.mean();
    seen.rgb.iter().for_each(|image| at_worst(7.93e-4, (image.mean() / mean - 1.0).abs(), mean));
}

/// Two prisms of two kinds of glass, the second of which turns light back.
#[test]
fn a_row_of_prisms_parts_colours_as_snells_law_says() {
    let slope = 0.2;
    let prism = |slope: f64, size: DVec2| {
        let heights = (0..20).map(|k| slope * size.x * (f64::from(k % 5) / 4.0 - 0.5)).collect();
        Block::from_heights(size, -12.0, (5, 4), heights).unwrap()
    };
    let (first, second) = (prism(slope, SIZE), prism(-slope, 2.0 * SIZE));
    let row = Row::of(&first).then(50.0, &second);
    let glass = |block: usize, nm: f64| ior_at(nm) + 0.1 * block as f64;
    let seen = disperse_row(&row, &scene(2.0 * SIZE, 32, 100.0), &glass, (64, 48)).unwrap();
    // The ray from the middle of the first exit face.
    let lands = |nm: f64| {
        let tilt = slope.atan();
        let leaves = (glass(0, nm) * tilt.sin()).asin() - tilt;
        let inside = (leaves.sin() / glass(1, nm)).asin();
        let x = 50.0 * leaves.tan();
        // On z = -slope x, from 12 mm below.
        let up = (12.0 - slope * x) / (1.0 + slope * inside.tan());
        let exit = x + up * inside.tan();
        let out = (glass(1, nm) * (inside - tilt).sin()).asin() + tilt;
        exit + (100.0 + slope * exit) * out.tan()
    };
    let parted = (lands(LINES_NM[0]) - lands(LINES_NM[1])).abs();
    // Of other rays the ways through air and glass are a little longer or shorter.
    within_tenth_of(parted, seen.fringing.rms_mm, "mm");
    assert!((seen.fringing.ior[0] - ior_at(LINES_NM[0])).abs() < 1e-15);
}

#[test]
fn mirrors_have_no_colours() {
    let block = Block::from_heights(SIZE, -1.0, (5, 4), vec![0.0; 20]).unwrap();
    let mirror = Scene { optics: Optics::Reflects, ..scene(SIZE, 8, 100.0) };
    assert!(matches!(disperse(&block, &mirror, &ior_at, (8, 8)), Err(SceneError::Needs(_))));
}

#[test]
fn coloured_pictures_are_written_encoded_and_linear() {
    let seen = white(|x, _| 0.2 * x, &scene(SIZE, 16, 200.0));
    let folder = tempfile::tempdir().unwrap();
    let (png, exr) = (folder.path().join("white.png"), folder.path().join("white.exr"));
    image_file::write_rgb_png(&png, &seen.rgb, 1.0).unwrap();
    image_file::write_rgb_exr(&exr, &seen.rgb).unwrap();
    let back = image::open(&png).unwrap().into_rgb16();
    let linear = exr::prelude::read_first_flat_layer_from_file(&exr).unwrap().layer_data.channel_data.list;
    // Channels are kept by name: blue, green, red.
    let linear = [2, 1, 0].map(|c| linear[c].sample_data.values_as_f32().collect::<Vec<_>>());
    for (k, pixel) in back.pixels().enumerate() {
        for c in 0..3 {
            let v = seen.rgb[c].values[k];
            // Single precision.
            assert!((f64::from(linear[c][k]) - v).abs() <= f64::from(f32::EPSILON) * v.abs(), "{k}");
            let encoded = f64::from(pixel.0[c]) / 65535.0;
            let decoded = if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055f64).powf(2.4) };
            // Half a step of 16 bits, where a step is most light.
            at_worst(1.17e-5, (decoded - v.clamp(0.0, 1.0)).abs(), format_args!("{k}: {decoded} for {v}"));
        }
    }
    assert!(image_file::write_rgb_png(&png, &seen.rgb, 0.0).is_err());
}
