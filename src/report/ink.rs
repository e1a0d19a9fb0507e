//! Lines and lettering on a grey picture, anti-aliased. The letters are strokes, so that no font
//! file is needed and text can run in any direction.

use glam::DVec2;
use image::{GrayImage, Luma};

/// Height of a digit, in units of the letters' grid.
const CAP: f64 = 6.0;
/// Where the letters stand on their grid.
const BASELINE: f64 = 2.0;
/// From one letter to the next beyond its own width.
const GAP: f64 = 1.7;
/// Half the width of a letter's stroke.
const NIB: f64 = 0.36;

/// Ink of a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lettering {
    /// Height of a digit, pixels.
    pub(super) height: f64,
    /// From 0, black, to 255, white.
    pub(super) grey: u8,
    /// Width of the white border around the letters, pixels.
    pub(super) halo: f64,
}

/// Width of a text, pixels.
pub(super) fn text_width(text: &str, height: f64) -> f64 {
    (text.chars().map(|c| glyph(c).1 + GAP).sum::<f64>() - GAP).max(0.0) * height / CAP
}

/// Writes a text whose middle is at `centre`, along the direction of `angle` (radians, clockwise
/// from the right).
pub(super) fn write(image: &mut GrayImage, centre: DVec2, angle: f64, text: &str, ink: Lettering) {
    let scale = ink.height / CAP;
    let along = DVec2::from_angle(angle) * scale;
    let up = -along.perp();
    let start = centre - 0.5 * text_width(text, ink.height) / scale * along - 0.5 * CAP * up;
    let mut strokes = Vec::new();
    let mut advance = 0.0;
    for character in text.chars() {
        let (curves, width) = glyph(character);
        for curve in curves {
            let place = |p: DVec2| start + (p.x + advance) * along + (p.y - BASELINE) * up;
            strokes.extend(curve.windows(2).map(|pair| (place(pair[0]), place(pair[1]))));
        }
        advance += width + GAP;
    }
    if ink.halo > 0.0 {
        // What runs through the text is wiped out between the letters too: a rest of it would read
        // as a minus.
        let left = start + 0.5 * CAP * up;
        line(image, left, left + (advance - GAP) * along, 0.3 * ink.height, 255);
        strokes.iter().for_each(|&(a, b)| line(image, a, b, NIB * scale + ink.halo, 255));
    }
    strokes.iter().for_each(|&(a, b)| line(image, a, b, NIB * scale, ink.grey));
}

/// Writes a level text whose left end is at `left`, centred on its height.
pub(super) fn write_from(image: &mut GrayImage, left: DVec2, text: &str, ink: Lettering) {
    write(image, left + DVec2::new(0.5 * text_width(text, ink.height), 0.0), 0.0, text, ink);
}

/// Draws a line with round ends. Pixel `(i, j)` is the point `(i, j)`.
pub(super) fn line(image: &mut GrayImage, a: DVec2, b: DVec2, half_width: f64, grey: u8) {
    let reach = DVec2::splat(half_width + 1.0);
    let last = DVec2::new(f64::from(image.width()) - 1.0, f64::from(image.height()) - 1.0);
    let low = (a.min(b) - reach).floor().max(DVec2::ZERO);
    let high = (a.max(b) + reach).ceil().min(last);
    let ab = b - a;
    for j in low.y as i64..=high.y as i64 {
        for i in low.x as i64..=high.x as i64 {
            let ap = DVec2::new(i as f64, j as f64) - a;
            let t = if ab == DVec2::ZERO { 0.0 } else { (ap.dot(ab) / ab.length_squared()).clamp(0.0, 1.0) };
            blend(image, i as u32, j as u32, half_width - (ap - t * ab).length(), grey);
        }
    }
}

/// Mixes in an ink whose edge is `inside` pixels away (negative: outside of it).
pub(super) fn blend(image: &mut GrayImage, i: u32, j: u32, inside: f64, grey: u8) {
    let coverage = (inside + 0.5).clamp(0.0, 1.0);
    let Luma([old]) = *image.get_pixel(i, j);
    let mixed = f64::from(old) + coverage * (f64::from(grey) - f64::from(old));
    image.put_pixel(i, j, Luma([mixed.round() as u8]));
}

/// The strokes of a character and its width, in units of the letters' grid. Characters that are not
/// drawn are blank.
fn glyph(character: char) -> (Vec<Vec<DVec2>>, f64) {
    // Points as pairs of digits, x and y; strokes parted by `|`; those that begin with `-` have
    // corners, others are round.
    let strokes = match character.to_ascii_lowercase() {
        '0' => "28 48 42 02 08 28",
        '1' => "-17 28 22",
        '2' => "06 08 48 45 02|-02 42",
        '3' => "07 08 48 45 15|15 45 42 02 03",
        '4' => "-38 04 44|-38 32",
        '5' => "-48 08 05|05 46 42 02 03",
        '6' => "38 08 02 42 46 06 04",
        '7' => "-08 48 12",
        '8' => "28 48 45 05 08 28|25 45 42 02 05 25",
        '9' => "12 42 48 08 04 44 46",
        '.' => "-02 02",
        ',' => "-12 01",
        ':' => "-02 02|-05 05",
        '-' => "-05 35",
        '+' => "-05 45|-27 23",
        '/' => "-02 48",
        '×' => "-03 36|-06 33",
        '(' => "-28 06 04 22",
        ')' => "-08 26 24 02",
        '=' => "-04 44|-06 46",
        '%' => "-02 48|-08 17|-33 42",
        '\'' => "-08 06",
        'a' => "44 46 06 02 42 44|-46 42",
        'b' => "-08 02|04 06 46 42 02 04",
        'c' => "45 46 06 02 42 43",
        'd' => "-48 42|44 46 06 02 42 44",
        'e' => "-04 44|44 46 06 02 42 43",
        'f' => "38 18 16 12|-06 36",
        'g' => "-46 42|44 46 06 02 42 44|42 40 00 01",
        'h' => "-08 02|04 06 46 44 42",
        'i' => "-06 02|-08 08",
        'j' => "26 21 20 00|-28 28",
        'k' => "-08 02|-46 04 42",
        'l' => "-08 02",
        'm' => "-06 02|04 06 36 34 32|34 36 66 64 62",
        'n' => "-06 02|04 06 46 44 42",
        'o' => "26 46 42 02 06 26",
        'p' => "-06 00|04 06 46 42 02 04",
        'q' => "-46 40|44 46 06 02 42 44",
        'r' => "-06 02|03 06 36",
        's' => "45 46 06 04 44 42 02 03",
        't' => "-18 13|13 12 32|-06 36",
        'u' => "06 04 02 42 44|-46 42",
        'v' => "-06 22 46",
        'w' => "-06 22 35 42 66",
        'x' => "-06 42|-02 46",
        'y' => "-06 22|-46 10",
        'z' => "-06 46 02 42",
        _ => "",
    };
    let curves: Vec<Vec<DVec2>> = strokes.split('|').filter(|stroke| !stroke.is_empty()).map(curve).collect();
    let width = curves.iter().flatten().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    // Digits and the blank stand on a fixed width, so that figures line up.
    let fixed = if character.is_ascii_digit() { 4.0 } else { 2.0 };
    (curves, if character.is_ascii_digit() || width < 0.0 { fixed } else { width })
}

fn curve(stroke: &str) -> Vec<DVec2> {
    let (points, rounds) = stroke.strip_prefix('-').map_or((stroke, 3), |points| (points, 0));
    let coordinate = |c: Option<char>| c.and_then(|c| c.to_digit(10)).map_or(0.0, f64::from);
    let mut curve: Vec<DVec2> = points
        .split(' ')
        .map(|pair| DVec2::new(coordinate(pair.chars().next()), coordinate(pair.chars().nth(1))))
        .collect();
    // Chaikin's corner cutting, which keeps the ends.
    for _ in 0..rounds {
        let mut cut = vec![curve[0]];
        for (k, pair) in curve.windows(2).enumerate() {
            let near = |t: f64| pair[0].lerp(pair[1], t);
            if k > 0 {
                cut.push(near(0.25));
            }
            cut.push(if k + 2 < curve.len() { near(0.75) } else { pair[1] });
        }
        curve = cut;
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::within_tenth_of;

    #[test]
    fn letters_stay_within_their_width_and_darken_the_paper() {
        for character in "0123456789.-+,:/×()=%'abcdefghijklmnopqrstuvwxyz".chars() {
            let (curves, width) = glyph(character);
            let on_grid = |p: &DVec2| (0.0..=width).contains(&p.x) && (0.0..=8.0).contains(&p.y);
            assert!(curves.iter().flatten().all(on_grid), "{character}");
            let mut image = GrayImage::from_pixel(40, 40, Luma([255]));
            let ink = Lettering { height: 20.0, grey: 0, halo: 0.0 };
            write(&mut image, DVec2::splat(20.0), 0.0, &character.to_string(), ink);
            assert!(image.pixels().any(|p| p.0[0] < 64), "{character}");
        }
    }

    #[test]
    fn a_line_covers_its_area() {
        let mut image = GrayImage::from_pixel(100, 100, Luma([255]));
        line(&mut image, DVec2::new(20.3, 30.1), DVec2::new(70.9, 61.7), 2.0, 0);
        let ink: f64 = image.pixels().map(|p| 1.0 - f64::from(p.0[0]) / 255.0).sum();
        let area = 4.0 * DVec2::new(50.6, 31.6).length() + 4.0 * std::f64::consts::PI;
        within_tenth_of(6.5e-4, (ink - area).abs() / area, format_args!("{ink} for {area}"));
    }
}
