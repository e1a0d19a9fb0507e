//! Drawings, rasterised at what the nodes of a face can draw. Nothing outside of the file is read,
//! and nothing in it may cost time or memory out of proportion to it.

use super::{Background, PictureError, Transfer};
use crate::grid::Field;
use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{
        ImageHrefResolver, ImageKind, Options, Tree,
        roxmltree::{Document, Node, ParsingOptions},
    },
};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

/// Elements that a drawing may have once everything that it repeats is written out: so many, and so
/// many for every one that is there.
const MOST_DRAWN: f64 = 20_000.0;
const MOST_REPEATED: f64 = 20.0;
/// Elements that take as long as a sheet of its own, and dashes that take as long as an element.
const SHEET: f64 = 20.0;
const DASHES: f64 = 50.0;
/// How deep elements may lie in one another.
const MOST_DEEP: usize = 200;
/// Octaves of noise, radius in units of the drawing, numbers of a kernel that a filter may have.
const MOST_OCTAVES: f64 = 16.0;
const MOST_RADIUS: f64 = 50.0;
const MOST_KERNEL: f64 = 400.0;
/// Greatest ratio of the place and size of an embedded picture to its lesser side, and of its own
/// sides: resvg counts in single precision, in which a side must not vanish beside its place.
const MOST_PLACED: f64 = 1e4;
const MOST_SLENDER: u32 = 1000;

/// A drawing in pixels.
pub(super) struct Raster {
    /// Light, row 0 on top.
    pub(super) light: Field<f64>,
    /// What was passed over, in words.
    pub(super) passed_over: Vec<String>,
}

fn broken(error: &dyn std::fmt::Display) -> PictureError {
    PictureError::broken("SVG", error)
}

fn refused(what: String) -> PictureError {
    PictureError::Drawing { what }
}

/// Draws `width` pixels across; no side gets longer than `greatest_side`. `check` is asked whether
/// a size and memory besides its light, bytes, are allowed; `memory` bounds pictures in the
/// drawing.
pub(super) fn read(
    bytes: &[u8],
    (width, greatest_side): (usize, usize),
    (background, transfer): (Background, Transfer),
    memory: u64,
    check: &dyn Fn((usize, usize), u64) -> Result<(), PictureError>,
) -> Result<Raster, PictureError> {
    let text = std::str::from_utf8(bytes).map_err(|_| broken(&"its text is no UTF-8"))?;
    let options = ParsingOptions { allow_dtd: true, nodes_limit: 2_000_000, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| broken(&error))?;
    let survey = Survey::of(&document)?;
    let complaint = Mutex::new(None);
    let mut options = Options {
        image_href_resolver: ImageHrefResolver {
            resolve_data: Box::new(|mime, data, _| embedded(mime, data, memory, &complaint)),
            resolve_string: Box::new(|_, _| None),
        },
        ..Options::default()
    };
    if survey.has_text {
        options.fontdb_mut().load_system_fonts();
        if options.fontdb.is_empty() {
            return Err(refused(
                "has text, and there are no fonts on this machine: convert its text to paths (in Inkscape: Path > Object to Path)"
                    .into(),
            ));
        }
    }
    let tree = Tree::from_xmltree(&document, &options).map_err(|error| broken(&error))?;
    drop(options);
    if let Some(error) = complaint.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let (w, h) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let across = (width as f64).min((greatest_side as f64 * w / h).floor()).max(1.0);
    let (nx, ny) = (across as usize, (across * h / w).round().max(1.0) as usize);
    // Groups that are mixed as a whole are drawn on a sheet of their own.
    check((nx, ny), 4 * (2 + survey.sheets as u64) * nx as u64 * ny as u64)?;
    let mut pixmap = Pixmap::new(nx as u32, ny as u32).ok_or_else(|| broken(&"it has no size"))?;
    let [r, g, b] = background.rgb();
    pixmap.fill(resvg::tiny_skia::Color::from_rgba8(r, g, b, 255));
    let scale = Transform::from_scale((nx as f64 / w) as f32, (ny as f64 / h) as f32);
    resvg::render(&tree, scale, &mut pixmap.as_mut());
    let light = |rgb: [u8; 3]| Background::of(rgb).light(transfer);
    let values = pixmap.pixels().iter().map(|pixel| light([pixel.red(), pixel.green(), pixel.blue()])).collect();
    Ok(Raster { light: Field::from_vec(nx, ny, values), passed_over: survey.passed_over })
}

/// A picture in the drawing, if it is not too large.
fn embedded(mime: &str, data: Arc<Vec<u8>>, memory: u64, complaint: &Mutex<Option<PictureError>>) -> Option<ImageKind> {
    // Its bytes, and those of the sheet that it is scaled on.
    let most = memory / 16;
    let complain = |what: String| {
        *complaint.lock().unwrap_or_else(PoisonError::into_inner) = Some(refused(what));
        None
    };
    let Ok(format) = image::guess_format(&data) else {
        return complain(format!("has an embedded picture of a kind that is not read ({mime}); embed it as PNG"));
    };
    let reader = image::ImageReader::with_format(std::io::Cursor::new(data.as_slice()), format);
    match reader.into_dimensions() {
        Ok((w, h)) if w.max(h) / w.min(h).max(1) > MOST_SLENDER => {
            return complain(format!(
                "has an embedded picture of {w} x {h} pixels; sides up to {MOST_SLENDER} times as long as the other are drawn: crop it"
            ));
        }
        Ok((w, h)) if u64::from(w) * u64::from(h) <= most => {}
        Ok((w, h)) => {
            return complain(format!(
                "has an embedded picture of {w} x {h} pixels; at most {most} are drawn: make it smaller"
            ));
        }
        Err(error) => return complain(format!("has a broken embedded picture: {error}")),
    }
    match format {
        image::ImageFormat::Png => Some(ImageKind::PNG(data)),
        image::ImageFormat::Jpeg => Some(ImageKind::JPEG(data)),
        image::ImageFormat::Gif => Some(ImageKind::GIF(data)),
        image::ImageFormat::WebP => Some(ImageKind::WEBP(data)),
        other => complain(format!("has an embedded picture of a kind that is not drawn ({other:?}); embed it as PNG")),
    }
}

/// What a drawing holds, looked through before any of it is drawn.
struct Survey {
    has_text: bool,
    /// The shortest pattern of dashes, units of the drawing.
    dash: f64,
    /// Most sheets that are drawn on at once.
    sheets: usize,
    passed_over: Vec<String>,
}

impl Survey {
    fn of(document: &Document<'_>) -> Result<Self, PictureError> {
        let mut survey = Self { has_text: false, dash: f64::INFINITY, sheets: 0, passed_over: Vec::new() };
        for node in document.descendants() {
            survey.look(&node)?;
        }
        let ids = document.descendants().filter_map(|node| node.attribute("id").map(|id| (id, node))).collect();
        let there = document.descendants().filter(Node::is_element).count() as f64;
        let mut costs = Costs { ids, known: HashMap::new(), dash: survey.dash };
        let cost = costs.of(document.root_element(), 0)?;
        let most = MOST_DRAWN + MOST_REPEATED * there;
        if cost.elements > most {
            return Err(refused(format!(
                "is as much work as {:.0} elements once all that it repeats is written out; at most {most:.0} are drawn: simplify it",
                cost.elements
            )));
        }
        survey.sheets = cost.sheets;
        survey.passed_over.sort_unstable();
        survey.passed_over.dedup();
        Ok(survey)
    }

    fn look(&mut self, node: &Node<'_, '_>) -> Result<(), PictureError> {
        if node.is_pi() && node.pi().is_some_and(|pi| pi.target == "xml-stylesheet") {
            return Err(refused("takes its style from another file: put it into the drawing".into()));
        }
        let name = node.tag_name().name();
        let style = node.is_text() && node.parent_element().is_some_and(|of| of.tag_name().name() == "style");
        if style {
            self.style(node.text().unwrap_or_default())?;
        }
        for attribute in node.attributes() {
            let value = attribute.value().trim();
            if attribute.name() == "href"
                && name != "a"
                && !value.starts_with('#')
                && !value.starts_with("data:")
                && !value.is_empty()
            {
                return Err(outside(value));
            }
            if attribute.name() == "stroke-dasharray" {
                self.dashes(value);
            }
            self.style(value)?;
        }
        match name {
            "text" => self.has_text = true,
            "foreignObject" => self.passed_over.push("its foreignObject, which is no SVG, was passed over".into()),
            "animate" | "animateTransform" | "animateMotion" | "set" => {
                self.passed_over.push("its animation was passed over".into());
            }
            "script" => self.passed_over.push("its script was passed over".into()),
            "image" => placed(node)?,
            "feTurbulence" => within(node, "numOctaves", MOST_OCTAVES, f64::max)?,
            "feMorphology" => within(node, "radius", MOST_RADIUS, f64::max)?,
            "feConvolveMatrix" => within(node, "order", MOST_KERNEL, |a, b| a * b)?,
            _ => {}
        }
        Ok(())
    }
}

impl Survey {
    /// Looks at a style, or at what may be one.
    fn style(&mut self, style: &str) -> Result<(), PictureError> {
        for dashes in style.split("stroke-dasharray:").skip(1) {
            self.dashes(dashes.split([';', '}']).next().unwrap_or_default());
        }
        only_inside(style)
    }

    fn dashes(&mut self, dashes: &str) {
        let sum = numbers_of(dashes).sum::<f64>();
        if sum > 0.0 {
            self.dash = self.dash.min(sum);
        }
    }
}

/// The numbers in a text, without their signs.
fn numbers_of(text: &str) -> impl Iterator<Item = f64> {
    let mut rest = text;
    std::iter::from_fn(move || {
        rest = &rest[rest.find(|c: char| c.is_ascii_digit() || c == '.')?..];
        let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        let mut end = digits(rest);
        if rest[end..].starts_with('.') {
            end += 1 + digits(&rest[end + 1..]);
        }
        if let Some(power) = rest[end..].strip_prefix(['e', 'E']) {
            let sign = usize::from(power.starts_with(['+', '-']));
            let length = digits(&power[sign..]);
            end += if length > 0 { 1 + sign + length } else { 0 };
        }
        let (number, behind) = rest.split_at(end);
        rest = behind;
        Some(number.parse().unwrap_or(0.0))
    })
}

/// Refuses numbers that would take a filter too long.
fn within(node: &Node<'_, '_>, name: &str, most: f64, join: fn(f64, f64) -> f64) -> Result<(), PictureError> {
    let text = node.attribute(name).unwrap_or_default();
    let mut numbers = text.split([' ', ',']).filter_map(|part| part.trim().parse::<f64>().ok());
    let first = numbers.next().unwrap_or(0.0);
    let value = join(first, numbers.next().unwrap_or(first));
    if value > most {
        let kind = node.tag_name().name();
        return Err(refused(format!(
            "has a filter {kind} whose {name} is {text}; at most {most} is drawn: make it smaller"
        )));
    }
    Ok(())
}

/// Refuses a picture in the drawing that is too small for where it is.
fn placed(node: &Node<'_, '_>) -> Result<(), PictureError> {
    let number = |name: &str| numbers_of(node.attribute(name).unwrap_or_default()).next();
    // Without a side it has its own, of a pixel at least.
    let least = ["width", "height"].map(|side| number(side).unwrap_or(1.0)).into_iter().fold(f64::INFINITY, f64::min);
    for name in ["x", "y", "width", "height"] {
        let value = number(name).unwrap_or(0.0);
        if least > 0.0 && value > MOST_PLACED * least {
            return Err(refused(format!(
                "has an embedded picture whose {name} is {value}, and whose lesser side is {least}; up to {MOST_PLACED} times that is drawn: make it larger"
            )));
        }
    }
    Ok(())
}

/// Refuses style that is taken from elsewhere.
fn only_inside(style: &str) -> Result<(), PictureError> {
    if style.contains("@import") {
        return Err(refused("takes its style from another file (@import): put it into the drawing".into()));
    }
    for part in style.split("url(").skip(1) {
        let name = part.trim_start_matches(['"', '\'', ' ']);
        if !name.starts_with('#') && !name.starts_with("data:") {
            return Err(outside(name.split([')', '"', '\'']).next().unwrap_or_default()));
        }
    }
    Ok(())
}

fn outside(name: &str) -> PictureError {
    let short: String = name.chars().filter(|c| !c.is_control()).take(80).collect();
    refused(format!(
        "refers to another file, '{short}', which is not read: embed it (in Inkscape: Extensions > Images > Embed)"
    ))
}

/// What drawing an element takes.
#[derive(Clone, Copy, Default)]
struct Cost {
    elements: f64,
    sheets: usize,
}

/// Costs of elements, with all that they refer to.
struct Costs<'a, 'input> {
    ids: HashMap<&'a str, Node<'a, 'input>>,
    /// `None` while it is being found: an element within itself.
    known: HashMap<Node<'a, 'input>, Option<Cost>>,
    /// The shortest pattern of dashes.
    dash: f64,
}

impl<'a, 'input> Costs<'a, 'input> {
    fn of(&mut self, node: Node<'a, 'input>, depth: usize) -> Result<Cost, PictureError> {
        if depth > MOST_DEEP {
            return Err(refused(format!("has elements more than {MOST_DEEP} deep in one another: simplify it")));
        }
        match self.known.get(&node) {
            Some(Some(cost)) => return Ok(*cost),
            // What draws itself draws nothing.
            Some(None) => return Ok(Cost::default()),
            None => self.known.insert(node, None),
        };
        let mut cost = Cost { elements: 1.0, sheets: 0 };
        let mut own_sheets = 0;
        if node.tag_name().name().starts_with("fe") {
            cost.elements += SHEET;
        }
        if self.dash.is_finite() {
            // No line is longer than the sum of its numbers, there and back.
            let long = ["d", "points", "x1", "x2", "y1", "y2", "width", "height", "r", "rx", "ry"];
            let length: f64 = long.iter().filter_map(|of| node.attribute(*of)).flat_map(numbers_of).sum();
            cost.elements += 8.0 * length / self.dash / DASHES;
        }
        for attribute in node.attributes() {
            let value = attribute.value();
            let name = attribute.name();
            // A marker is drawn at every vertex.
            let times = if name.starts_with("marker") || value.contains("marker") {
                1.0 + node.attribute("d").or(node.attribute("points")).map_or(0.0, |d| d.len() as f64 / 2.0)
            } else {
                1.0
            };
            let linked = (name == "href").then(|| value.trim().strip_prefix('#')).flatten();
            let urls = value.split("url(").skip(1).filter_map(|part| {
                part.trim_start_matches(['"', '\'', ' ']).strip_prefix('#')?.split([')', '"', '\'']).next()
            });
            for id in linked.into_iter().chain(urls) {
                let Some(other) = self.ids.get(id).copied() else { continue };
                let more = self.of(other, depth + 1)?;
                cost.elements += times * more.elements;
                cost.sheets = cost.sheets.max(more.sheets);
            }
            let mixes = ["opacity", "mask", "clip-path", "filter", "mix-blend-mode", "isolation"];
            if mixes.iter().any(|of| name == *of || name == "style" && value.contains(of)) {
                // Its own, that of a mask or a filter, and theirs.
                own_sheets = 3;
                cost.elements += SHEET;
            }
        }
        for child in node.children().filter(Node::is_element) {
            let more = self.of(child, depth + 1)?;
            cost.elements += more.elements;
            cost.sheets = cost.sheets.max(more.sheets);
        }
        cost.sheets += own_sheets;
        self.known.insert(node, Some(cost));
        Ok(cost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_however_they_are_written() {
        let found: Vec<f64> = numbers_of("M1e-3.5L-2,30E+1 4.e z 1ee").collect();
        assert_eq!(found, [1e-3, 0.5, 2.0, 300.0, 4.0, 1.0]);
    }
}
