//! Pictures and numbers as text.

use image::{GrayImage, imageops};
use serde::Serialize;

/// A picture whose longer side has at most so many pixels.
pub(super) fn shrunk(picture: &GrayImage, most_px: u32) -> GrayImage {
    let (width, height) = picture.dimensions();
    let longest = width.max(height);
    if longest <= most_px {
        return picture.clone();
    }
    let side = |n: u32| ((f64::from(n) * f64::from(most_px) / f64::from(longest)).round() as u32).max(1);
    imageops::resize(picture, side(width), side(height), imageops::FilterType::Triangle)
}

/// A number for people: four significant figures at most behind the point, no more digits than it
/// has.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let places = (3.0 - value.abs().log10().floor()).clamp(0.0, 9.0);
    let scale = 10_f64.powf(places);
    format!("{}", (value * scale).round() / scale + 0.0)
}

/// A length with its unit.
pub(super) fn mm(value_mm: f64) -> String {
    format!("{}\u{a0}mm", figure(value_mm))
}

/// Anything as JSON that can stand in a script element.
pub(super) fn script_json(what: &impl Serialize) -> String {
    // Nothing on a page can fail to become JSON. A `<` would end the element that it stands in.
    serde_json::to_string(what).unwrap_or_default().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::svg::png_uri;
    use base64::{Engine, engine::general_purpose::STANDARD};

    #[test]
    fn numbers_have_the_digits_that_matter() {
        for (value, text) in [
            (250.0, "250"),
            (0.0, "0"),
            (-0.0, "0"),
            (9.7812345, "9.781"),
            (123.456, "123.5"),
            (0.00123456, "0.001235"),
            (12_345.6, "12346"),
            (1e-12, "0"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn pictures_keep_their_shape_and_read_back() {
        let tall = GrayImage::from_fn(30, 90, |_, j| image::Luma([2 * j as u8]));
        assert_eq!(shrunk(&tall, 45).dimensions(), (15, 45));
        assert_eq!(shrunk(&tall, 90), tall);
        let uri = png_uri(&image::DynamicImage::from(tall.clone()));
        let bytes = STANDARD.decode(uri.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        assert_eq!(image::load_from_memory(&bytes).unwrap().into_luma8(), tall);
    }
}
