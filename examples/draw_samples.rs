//! Draws the sample pictures that are no photographs: `cargo run --release --example draw_samples`.

use glam::DVec2;
use image::{GrayImage, Luma};
use std::{f64::consts::TAU, path::Path};

fn main() -> Result<(), image::ImageError> {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    draw(384, 384, letter_f).save(samples.join("letter-f/target.png"))?;
    draw(480, 320, rosette).save(samples.join("rosette/target.png"))
}

/// A picture of `light(p)` on a 0..1 scale, averaged over each pixel; `p` has its origin in the
/// centre, y up, and the shorter side spans -1..1.
fn draw(width: u32, height: u32, light: impl Fn(DVec2) -> f64) -> GrayImage {
    const SAMPLES: u32 = 6;
    let scale = 2.0 / f64::from(width.min(height));
    GrayImage::from_fn(width, height, |column, row| {
        let mut sum = 0.0;
        for k in 0..SAMPLES * SAMPLES {
            let inside = DVec2::new(f64::from(k % SAMPLES), f64::from(k / SAMPLES)) + 0.5;
            let pixel = DVec2::new(f64::from(column), f64::from(row)) + inside / f64::from(SAMPLES);
            let centred = pixel - 0.5 * DVec2::new(f64::from(width), f64::from(height));
            sum += light(centred * DVec2::new(scale, -scale));
        }
        let mean = sum / f64::from(SAMPLES * SAMPLES);
        Luma([(255.0 * mean.clamp(0.0, 1.0)).round() as u8])
    })
}

/// Line art with a hand: a letter F in outline, inside of two rings and above a row of strokes that
/// thicken to the right. No mirror image and no rotation of it looks the same.
fn letter_f(p: DVec2) -> f64 {
    let ring = |radius: f64, width: f64| (p.length() - radius).abs() < 0.5 * width;
    let boxed = |low: DVec2, high: DVec2| (p - 0.5 * (low + high)).abs() - 0.5 * (high - low);
    let distance_to_box = |low, high| {
        let d: DVec2 = boxed(low, high);
        d.max(DVec2::ZERO).length() + d.x.max(d.y).min(0.0)
    };
    let stem = distance_to_box(DVec2::new(-0.34, -0.38), DVec2::new(-0.12, 0.58));
    let top = distance_to_box(DVec2::new(-0.34, 0.38), DVec2::new(0.40, 0.58));
    let bar = distance_to_box(DVec2::new(-0.34, 0.02), DVec2::new(0.24, 0.20));
    let f = stem.min(top).min(bar);
    let strokes = (0..7).any(|k| {
        let (at, width) = (-0.36 + 0.12 * f64::from(k), 0.008 + 0.008 * f64::from(k));
        (p.x - at).abs() < 0.5 * width && (-0.62..-0.48).contains(&p.y)
    });
    let lit = f.abs() < 0.018 || ring(0.86, 0.03) || ring(0.94, 0.012) || strokes;
    if lit { 1.0 } else { 0.12 }
}

/// Smooth gradients: petals of light around a bright heart, brighter towards the right.
fn rosette(p: DVec2) -> f64 {
    let (radius, angle) = (p.length(), p.y.atan2(p.x));
    let petals = 0.5 + 0.5 * (7.0 * angle + 5.0 * radius).cos();
    let envelope = (-(radius - 0.55).powi(2) / 0.08).exp();
    let heart = (-radius * radius / 0.02).exp();
    let ripple = 0.08 * (TAU * 4.0 * radius).cos();
    0.16 + 0.06 * p.x + 0.62 * petals * envelope + 0.55 * heart + ripple
}
