//! Maps of a face in colours, seen from above the face (`+x` is right, `+y` up), with axes; and the
//! face in shades as its light lies on the wall (left = `+x`, top = `+y`).

use super::data::figure;
use crate::{
    grid::{Extent, Field, bilinear_resample},
    irradiance::to_picture_order,
    report::{
        axes::{Axes, from_above},
        svg::Svg,
    },
    surface::SurfaceSpline,
};
use colorous::{Color, Gradient};
use glam::{DVec2, DVec3};
use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};
use rayon::prelude::*;

/// Height of a figure along the axes, pixels.
const AXES_PX: f64 = 13.0;

/// A map with its axes and its bar of colours.
pub(super) struct ColourMap {
    pub(super) uri: String,
    pub(super) width: u32,
    pub(super) height: u32,
    /// The bar, as a gradient of CSS.
    pub(super) gradient: String,
    /// Places along the bar, percent, and what stands there.
    pub(super) ticks: Vec<(f64, String)>,
}

/// Slopes in degrees, given in mm per mm.
pub(super) fn slope(slope: &Field<f64>, extent: Extent, longest_px: u32) -> ColourMap {
    let degrees = slope.map(|slope| slope.atan().to_degrees());
    let most = round_up(quantile(&degrees, 0.999)).max(1e-3);
    let ticks = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| (part, format!("{}°", figure(part * most))));
    coloured(&degrees, extent, longest_px, (0.0, most), colorous::VIRIDIS, &ticks)
}

/// Curvatures in 1/m, given per mm: hollows on one side, bulges on the other.
pub(super) fn hollow(per_mm: &Field<f64>, extent: Extent, longest_px: u32) -> ColourMap {
    let per_m = per_mm.map(|curvature| 1000.0 * curvature);
    let most = round_up(quantile(&per_m.map(|v| v.abs()), 0.99)).max(1e-3);
    let label = |part: f64| match part * most {
        0.0 => "flat".to_owned(),
        value if value > 0.0 => format!("+{}", figure(value)),
        value => format!("−{}", figure(-value)),
    };
    let ticks = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|part| (0.5 + 0.5 * part, label(part)));
    coloured(&per_m, extent, longest_px, (most, -most), colorous::RED_BLUE, &ticks)
}

/// Where the value that this share of all values stays below lies, found without sorting all of
/// them.
fn quantile(values: &Field<f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.as_slice().iter().copied().filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

/// The next of 1, 2, 5 times a power of ten, and of steps in between.
fn round_up(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let decade = 10_f64.powf(value.log10().floor());
    [1.0, 1.2, 1.6, 2.0, 2.4, 3.2, 4.0, 5.0, 6.0, 8.0, 10.0]
        .map(|step| step * decade)
        .into_iter()
        .find(|step| *step >= value * (1.0 - 1e-9))
        .unwrap_or(value)
}

fn coloured(
    values: &Field<f64>,
    extent: Extent,
    longest_px: u32,
    (from, to): (f64, f64),
    gradient: Gradient,
    ticks: &[(f64, String)],
) -> ColourMap {
    let image = painted(values, extent, longest_px, |value| {
        gradient.eval_continuous(((value - from) / (to - from)).clamp(0.0, 1.0))
    });
    let mut map = Svg::new(image.width(), image.height());
    map.colours(0, 0, &DynamicImage::from(image));
    let map = Axes::new(extent, AXES_PX).around(map);
    let (width, height) = map.size();
    // The bar runs from the least value to the greatest, whichever way the colours do.
    let part = |share: f64| if to > from { share } else { 1.0 - share };
    let stops: Vec<String> =
        (0..=12).map(|k| format!("#{:x}", gradient.eval_continuous(part(f64::from(k) / 12.0)))).collect();
    ColourMap {
        uri: map.uri(),
        width,
        height,
        gradient: format!("linear-gradient(to right, {})", stops.join(", ")),
        ticks: ticks.iter().map(|(at, label)| (100.0 * at, label.clone())).collect(),
    }
}

/// Values as colours, seen from above the face.
fn painted(values: &Field<f64>, extent: Extent, longest_px: u32, colour: impl Fn(f64) -> Color) -> RgbImage {
    let (width, height) = pixels(extent.as_vec(), longest_px);
    let shown = from_above(&bilinear_resample(values, width as usize, height as usize));
    RgbImage::from_fn(width, height, |i, j| {
        let Color { r, g, b } = colour(shown[(i as usize, j as usize)]);
        Rgb([r, g, b])
    })
}

fn pixels(size: DVec2, longest_px: u32) -> (u32, u32) {
    let pixels = (size / size.max_element() * f64::from(longest_px)).round().max(DVec2::splat(2.0));
    (pixels.x as u32, pixels.y as u32)
}

/// The face as matte plaster in light from the top left of the picture, with heights stretched
/// until its relief shows.
pub(super) fn hillshade(spline: &SurfaceSpline, longest_px: u32) -> GrayImage {
    let (width, height) = pixels(spline.extent().as_vec(), longest_px);
    let (nx, ny) = (width as usize, height as usize);
    let lattice = spline.lattice(nx, ny);
    let mut slopes = vec![DVec2::ZERO; nx * ny];
    slopes.par_chunks_mut(nx).enumerate().for_each_init(Vec::new, |scratch, (j, row)| {
        lattice.row(j, scratch, |i, _, slope| row[i] = slope);
    });
    let mean_square = slopes.iter().map(|slope| slope.length_squared()).sum::<f64>() / slopes.len() as f64;
    let stretch = if mean_square > 0.0 { 0.45 / mean_square.sqrt() } else { 1.0 };
    let light = DVec3::new(0.5, 0.6, 0.75).normalize();
    let shown = to_picture_order(&Field::from_vec(nx, ny, slopes));
    GrayImage::from_fn(width, height, |i, j| {
        let normal = (-stretch * shown[(i as usize, j as usize)]).extend(1.0).normalize();
        Luma([(40.0 + 215.0 * normal.dot(light).max(0.0)).round() as u8])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::HeightField;

    #[test]
    fn scales_are_round_and_hold_the_values() {
        for (value, rounded) in [(0.9, 1.0), (1.0, 1.0), (1.1, 1.2), (47.0, 50.0), (0.00031, 0.00032)] {
            assert!((round_up(value) / rounded - 1.0).abs() < 1e-9, "{value}");
        }
        let ramp = Field::from_fn(100, 10, |i, j| (i + 100 * j) as f64);
        assert_eq!(quantile(&ramp, 0.5), 499.0);
        assert_eq!(quantile(&Field::filled(3, 3, f64::NAN), 0.5), 0.0);
    }

    #[test]
    fn colours_tell_hollows_from_bulges_and_are_seen_from_above_the_face() {
        let extent = Extent::new(40.0, 20.0);
        let ramp = Field::from_fn(81, 41, |i, _| 0.001 * (i as f64 - 40.0));
        let map = hollow(&ramp, extent, 80);
        let svg = map.uri.strip_prefix("data:image/svg+xml;base64,").unwrap();
        let decoded = |text: &str| base64::Engine::decode(&base64::engine::general_purpose::STANDARD, text).unwrap();
        let svg = String::from_utf8(decoded(svg)).unwrap();
        assert!(svg.contains("x in mm") && svg.contains(">−10<") && svg.contains(">10<"), "axes: {svg}");
        let png = svg.split_once("data:image/png;base64,").unwrap().1.split_once('"').unwrap().0;
        let image = image::load_from_memory(&decoded(png)).unwrap().into_rgb8();
        assert_eq!(image.dimensions(), (80, 40));
        // Hollow is at +x, which is right, and red.
        let (left, right) = (image.get_pixel(1, 20), image.get_pixel(78, 20));
        assert!(right[0] > right[2] + 50 && left[2] > left[0] + 50, "{left:?} {right:?}");
        assert_eq!(map.ticks.len(), 5);
        assert!(map.ticks[0].1.starts_with('−') && map.ticks[4].1.starts_with('+'));
        let up = Field::from_fn(81, 41, |_, j| j as f64);
        let grey = |value: f64| Color { r: value as u8, g: 0, b: 0 };
        let painted = painted(&up, extent, 80, grey);
        assert!(painted.get_pixel(40, 1)[0] > painted.get_pixel(40, 38)[0] + 30, "+y is up");
    }

    #[test]
    fn a_hill_is_lit_from_the_top_left() {
        let extent = Extent::new(40.0, 40.0);
        let hill = HeightField::new(
            extent,
            Field::from_fn(41, 41, |i, j| -0.001 * extent.node(i, j, 41, 41).length_squared()),
        );
        let shaded = hillshade(&SurfaceSpline::through(&hill), 81);
        assert!(shaded.get_pixel(15, 15)[0] > shaded.get_pixel(65, 65)[0] + 40);
    }
}
