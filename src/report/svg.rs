//! Drawings as SVG. Their letters come with the program, so that a drawing looks the same on every
//! machine.

use base64::{Engine, engine::general_purpose::STANDARD};
use glam::DVec2;
use image::{
    DynamicImage, GrayImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use skrifa::{
    FontRef, MetadataProvider as _,
    instance::{LocationRef, Size},
};
use std::fmt::{self, Display};

/// The letters of all drawings; on a page, those that are as wide.
const FAMILIES: &str = "Glasswarp Sans, Liberation Sans, Arimo, Arial, Helvetica, sans-serif";
/// Height of a digit in the size of the font.
const DIGIT: f64 = 1409.0 / 2048.0;

pub(super) static FONT: &[u8] = include_bytes!("font/GlasswarpSans.ttf");

/// A line: its width, pixels, and its grey from 0, black, to 255, white.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    pub(super) width: f64,
    pub(super) grey: u8,
}

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

/// Which end of a text stands where it is written; its height is centred there.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A coordinate in a drawing: two decimals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Px(pub(super) f64);

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", (self.0 * 100.0).round() / 100.0 + 0.0)
    }
}

/// Points as the path of a drawing.
pub(super) fn path(points: impl IntoIterator<Item = DVec2>) -> String {
    let points: Vec<String> = points.into_iter().map(|p| format!("{} {}", Px(p.x), Px(p.y))).collect();
    format!("M{}", points.join("L"))
}

/// The same, back to its beginning.
pub(super) fn ring(points: impl IntoIterator<Item = DVec2>) -> String {
    path(points) + "Z"
}

/// The strokes of an arrow.
pub(super) fn arrow(from: DVec2, to: DVec2, head: f64) -> String {
    let back = (from - to).normalize_or_zero();
    let side = |angle: f64| path([to, to + head * DVec2::from_angle(angle).rotate(back)]);
    path([from, to]) + &side(0.38) + &side(-0.38)
}

/// Bytes as base64.
pub(super) fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// A picture as the address of itself, a PNG.
pub(super) fn png_uri(picture: &DynamicImage) -> String {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    // Memory takes all bytes; a picture of no known kind would be shown by its alternative text.
    let _ = picture.write_with_encoder(encoder);
    format!("data:image/png;base64,{}", base64(&bytes))
}

/// A drawing in shades of grey on white: pictures, pixel by pixel, and ink over them. The middle of
/// pixel `(i, j)` is the point `(i, j)`.
#[derive(Clone, Debug)]
pub struct Svg {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) pictures: Vec<((u32, u32), GrayImage)>,
    ink: String,
    clips: usize,
}

impl Svg {
    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width, height, pictures: Vec::new(), ink: String::new(), clips: 0 }
    }

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Lays a picture below all ink.
    pub(super) fn picture(&mut self, left: u32, top: u32, picture: GrayImage) {
        self.pictures.push(((left, top), picture));
    }

    /// Lays another drawing into this one. Only one of the two may have clips, whose names would be
    /// the same.
    pub(super) fn inset(&mut self, left: u32, top: u32, other: Self) {
        debug_assert!(self.clips == 0 || other.clips == 0, "two drawings with clips");
        self.pictures.extend(other.pictures.into_iter().map(|((x, y), picture)| ((left + x, top + y), picture)));
        self.ink += &format!("<g transform=\"translate({left} {top})\">{}</g>", other.ink);
        self.clips += other.clips;
    }

    /// Lays a picture in colours below the ink that follows. It is for pages, and never rastered.
    #[cfg(feature = "report")]
    pub(super) fn colours(&mut self, left: u32, top: u32, picture: &DynamicImage) {
        let [x, y] = [left, top].map(|at| Px(f64::from(at) - 0.5));
        let (width, height, uri) = (picture.width(), picture.height(), png_uri(picture));
        self.ink += &format!("<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"{uri}\"/>");
    }

    pub(super) fn stroke(&mut self, path: &str, pen: Pen) {
        self.ink += &format!("<path d=\"{path}\" stroke=\"{}\" stroke-width=\"{}\"/>", Grey(pen.grey), Px(pen.width));
    }

    pub(super) fn line(&mut self, a: DVec2, b: DVec2, pen: Pen) {
        self.stroke(&path([a, b]), pen);
    }

    pub(super) fn dashed(&mut self, a: DVec2, b: DVec2, pen: Pen) {
        self.ink += "<g stroke-dasharray=\"14 14\" stroke-linecap=\"butt\">";
        self.line(a, b, pen);
        self.ink += "</g>";
    }

    pub(super) fn circle(&mut self, centre: DVec2, radius: f64, pen: Pen) {
        let [x, y, r, width] = [centre.x, centre.y, radius, pen.width].map(Px);
        let grey = Grey(pen.grey);
        self.ink += &format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" stroke=\"{grey}\" stroke-width=\"{width}\"/>");
    }

    /// Fills the pixels around a picture: a line of one pixel would be blurred.
    pub(super) fn frame(&mut self, low: DVec2, size: DVec2, grey: u8) {
        let around = |wide: f64| {
            let (a, b) = (low - 0.5 - wide, low - 0.5 + size + wide);
            ring([a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)])
        };
        let (outer, inner) = (around(1.0), around(0.0));
        self.ink += &format!("<path d=\"{outer}{inner}\" fill=\"{}\" fill-rule=\"evenodd\"/>", Grey(grey));
    }

    /// Fills a rectangle.
    pub(super) fn area(&mut self, low: DVec2, size: DVec2, grey: u8) {
        let [x, y, width, height] = [low.x, low.y, size.x, size.y].map(Px);
        let grey = Grey(grey);
        self.ink += &format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{grey}\"/>");
    }

    /// Draws what stays within a ring.
    pub(super) fn within(&mut self, ring: &str, draw: impl FnOnce(&mut Self)) {
        let id = format!("c{}", self.clips);
        self.clips += 1;
        self.ink += &format!("<clipPath id=\"{id}\"><path d=\"{ring}\"/></clipPath><g clip-path=\"url(#{id})\">");
        draw(self);
        self.ink += "</g>";
    }

    /// Draws what belongs together. The class is for the style of a page, and the name, if any, for
    /// the eye that lingers on it.
    pub(super) fn group(&mut self, class: &str, name: &str, draw: impl FnOnce(&mut Self)) {
        self.ink += &format!("<g class=\"{}\">", Escaped(class));
        if !name.is_empty() {
            self.ink += &format!("<title>{}</title>", Escaped(name));
        }
        draw(self);
        self.ink += "</g>";
    }

    pub(super) fn text(&mut self, at: DVec2, anchor: Anchor, text: &str, ink: Lettering) {
        self.turned_text(at, anchor, 0.0, text, ink);
    }

    /// The same along the direction of `angle` (radians, clockwise from the right).
    pub(super) fn turned_text(&mut self, at: DVec2, anchor: Anchor, angle: f64, text: &str, ink: Lettering) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, size) = (Px(at.x), Px(at.y + 0.5 * ink.height), Px(ink.height / DIGIT));
        let turn = if angle == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({} {x} {})\"", Px(angle.to_degrees()), Px(at.y))
        };
        let halo = if ink.halo > 0.0 {
            format!(" stroke=\"#fff\" stroke-width=\"{}\" paint-order=\"stroke\"", Px(2.0 * ink.halo))
        } else {
            String::new()
        };
        let (grey, text) = (Grey(ink.grey), Escaped(text));
        self.ink += &format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{grey}\"{halo}{turn}>{text}</text>"
        );
    }

    /// Writes a text smaller if it would be wider than there is room, pixels.
    pub(super) fn fitted_text(&mut self, at: DVec2, anchor: Anchor, text: &str, ink: Lettering, room: f64) {
        let height = ink.height * (room / text_width(text, ink.height).max(1.0)).min(1.0);
        self.text(at, anchor, text, Lettering { height, ..ink });
    }

    /// The drawing as an element of a page, with these attributes.
    pub fn element(&self, attributes: &str) -> String {
        self.markup(attributes, true)
    }

    /// The drawing as a file.
    pub fn document(&self) -> String {
        self.markup(NAMESPACE, true)
    }

    /// The drawing as the address of itself.
    #[cfg(feature = "report")]
    pub(super) fn uri(&self) -> String {
        format!("data:image/svg+xml;base64,{}", base64(self.document().as_bytes()))
    }

    pub(super) fn markup(&self, attributes: &str, with_pictures: bool) -> String {
        let (width, height) = self.size();
        let mut text = format!(
            "<svg viewBox=\"-0.5 -0.5 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"{FAMILIES}\" fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\" xml:space=\"preserve\" style=\"white-space: pre\" {attributes}>"
        );
        for ((left, top), picture) in self.pictures.iter().filter(|_| with_pictures) {
            let [x, y] = [left, top].map(|&at| Px(f64::from(at) - 0.5));
            let ((width, height), uri) = (picture.dimensions(), png_uri(&DynamicImage::from(picture.clone())));
            text += &format!("<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"{uri}\"/>");
        }
        text + &self.ink + "</svg>"
    }
}

pub(super) const NAMESPACE: &str = "xmlns=\"http://www.w3.org/2000/svg\"";

/// Width of a text, pixels.
pub(super) fn text_width(text: &str, height: f64) -> f64 {
    let Ok(font) = FontRef::new(FONT) else { unreachable!("the font comes with the program") };
    let size = height / DIGIT;
    let (letters, metrics) = (font.charmap(), font.glyph_metrics(Size::new(size as f32), LocationRef::default()));
    let width = |letter| metrics.advance_width(letters.map(letter).unwrap_or_default()).unwrap_or_default();
    text.chars().map(width).map(f64::from).sum()
}

/// A grey as a colour.
struct Grey(u8);

impl Display for Grey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(grey) = self;
        write!(f, "#{grey:02x}{grey:02x}{grey:02x}")
    }
}

/// Words as words, whatever is in them.
pub(super) struct Escaped<'a>(pub(super) &'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|character| match character {
            '&' => f.write_str("&#38;"),
            '<' => f.write_str("&#60;"),
            '>' => f.write_str("&#62;"),
            '"' => f.write_str("&#34;"),
            // What no XML may hold.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => f.write_str(" "),
            c => write!(f, "{c}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::within_tenth_of;
    use image::Luma;

    const INK: Lettering = Lettering { height: 20.0, grey: 0, halo: 0.0 };

    fn darkness(picture: &GrayImage) -> f64 {
        picture.pixels().map(|p| 1.0 - f64::from(p.0[0]) / 255.0).sum()
    }

    #[test]
    fn letters_need_no_font_of_the_machine() {
        let blank = {
            let mut drawing = Svg::new(60, 60);
            drawing.text(DVec2::splat(30.0), Anchor::Middle, "漢", INK);
            drawing.raster()
        };
        for character in
            "0123456789.-+,:/×()=%'°–−·“”…’äßøλµabcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ".chars()
        {
            let mut drawing = Svg::new(60, 60);
            drawing.text(DVec2::splat(30.0), Anchor::Middle, &character.to_string(), INK);
            let picture = drawing.raster();
            assert!(picture != blank && picture.pixels().any(|p| p.0[0] < 64), "{character}");
        }
        // Figures line up, and a text is as wide as it is told to be.
        let digits: Vec<f64> = ('0'..='9').map(|digit| text_width(&digit.to_string(), 20.0)).collect();
        assert!(digits.iter().all(|width| (width - digits[0]).abs() < 1e-3), "{digits:?}");
        assert!((text_width("0000", 20.0) / digits[0] - 4.0).abs() < 1e-3);
    }

    #[test]
    fn words_are_words() {
        let mut drawing = Svg::new(200, 40);
        drawing.text(DVec2::new(4.0, 20.0), Anchor::Start, "<b>&\"a\u{1}\n\u{ffff}", INK);
        assert!(darkness(&drawing.raster()) > 100.0);
        assert_eq!(Escaped("<&>\"\t").to_string(), "&#60;&#38;&#62;&#34; ");
    }

    #[test]
    fn a_line_covers_its_area() {
        let mut drawing = Svg::new(100, 100);
        drawing.line(DVec2::new(20.3, 30.1), DVec2::new(70.9, 61.7), Pen { width: 4.0, grey: 0 });
        let ink = darkness(&drawing.raster());
        let area = 4.0 * DVec2::new(50.6, 31.6).length() + 4.0 * std::f64::consts::PI;
        within_tenth_of(9.75e-5, (ink - area).abs() / area, format_args!("{ink} for {area}"));
    }

    #[test]
    fn pictures_keep_their_pixels_under_ink() {
        let picture = GrayImage::from_fn(30, 20, |i, j| Luma([(7 * i + 11 * j) as u8]));
        let mut drawing = Svg::new(50, 40);
        drawing.picture(5, 6, picture.clone());
        drawing.line(DVec2::new(0.0, 2.0), DVec2::new(49.0, 2.0), Pen { width: 1.0, grey: 0 });
        let sheet = drawing.raster();
        assert_eq!(image::imageops::crop_imm(&sheet, 5, 6, 30, 20).to_image(), picture);
        assert_eq!([(20, 2), (20, 30)].map(|(i, j)| sheet.get_pixel(i, j).0[0]), [0, 255]);
    }
}
