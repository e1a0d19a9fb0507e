//! What it takes to draw an SVG, found before it is drawn: some bytes can ask for years.

use super::super::error::ReferenceError;
use resvg::{
    tiny_skia::PathSegment,
    usvg::{
        Group, Node as Drawn, Stroke,
        roxmltree::{Document, Node, NodeId},
    },
};
use std::collections::HashMap;

/// Elements that are drawn once all that a drawing repeats is written out: so many, and so many for
/// every one that it has.
const MOST: f64 = 50_000.0;
const MOST_FOR_EACH: f64 = 50.0;
/// Elements that take as long as one that is mixed as a whole or a step of a filter, and dashes that
/// take as long as an element.
const LAYER: f64 = 20.0;
const DASHES: f64 = 50.0;
/// How deep elements, and what they refer to, may lie in one another.
const DEEPEST: usize = 256;
/// Attributes of filters, and the greatest product of their numbers.
const FILTERS: [(&str, &str, f64); 3] =
    [("feTurbulence", "numOctaves", 16.0), ("feMorphology", "radius", 2500.0), ("feConvolveMatrix", "order", 400.0)];

fn refused(what: impl std::fmt::Display) -> ReferenceError {
    ReferenceError::malformed("SVG", format!("{what}: simplify it"))
}

/// Refuses a document that would take too long.
pub(super) fn check(document: &Document<'_>) -> Result<(), ReferenceError> {
    let elements = || document.descendants().filter(Node::is_element);
    for node in elements() {
        let name = node.tag_name().name();
        for (_, attribute, most) in FILTERS.iter().filter(|(filter, ..)| *filter == name) {
            let text = node.attribute(*attribute).unwrap_or_default();
            let numbers: Vec<f64> = text.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
            // One number stands for both directions.
            let product = match numbers[..] {
                [] => 0.0,
                [one] if name != "feTurbulence" => one * one,
                _ => numbers.iter().product(),
            };
            if product > *most {
                return Err(refused(format_args!("it has a filter {name} whose {attribute} is '{text}'")));
            }
        }
    }
    let by_id = elements().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let work = Work { by_id, known: HashMap::new() }.of(document.root_element(), 0)?;
    within(work, elements().count())
}

/// Refuses a drawing with too many dashes.
pub(super) fn check_dashes(root: &Group, elements: usize) -> Result<(), ReferenceError> {
    within(dashes(root) / DASHES, elements)
}

fn within(work: f64, elements: usize) -> Result<(), ReferenceError> {
    let most = MOST + MOST_FOR_EACH * elements as f64;
    if work <= most {
        Ok(())
    } else {
        Err(refused(format_args!("it is as much work as {work:.0} elements, and at most {most:.0} are drawn")))
    }
}

/// Work of elements, with all that they refer to.
struct Work<'a, 'input> {
    by_id: HashMap<&'a str, Node<'a, 'input>>,
    /// `None` while it is being found: what refers to itself is not drawn.
    known: HashMap<NodeId, Option<f64>>,
}

impl<'a, 'input> Work<'a, 'input> {
    fn of(&mut self, node: Node<'a, 'input>, depth: usize) -> Result<f64, ReferenceError> {
        if depth > DEEPEST {
            return Err(refused(format_args!("it has elements more than {DEEPEST} deep in one another")));
        }
        if let Some(known) = self.known.get(&node.id()) {
            return Ok(known.unwrap_or(0.0));
        }
        self.known.insert(node.id(), None);
        let mut work = if node.tag_name().name().starts_with("fe") { LAYER } else { 1.0 };
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            let mixes = ["opacity", "mask", "clip-path", "filter", "mix-blend-mode", "isolation"];
            if mixes.iter().any(|word| name == *word || name == "style" && value.contains(word)) {
                work += LAYER;
            }
            // A marker stands at every vertex, of which two bytes may be one.
            let is_marker = name.starts_with("marker") || value.contains("marker");
            let vertices = node.attribute("d").or_else(|| node.attribute("points")).map_or(0, str::len) / 2;
            let times = if is_marker { 1.0 + vertices as f64 } else { 1.0 };
            let href = (name == "href").then(|| value.trim().strip_prefix('#')).flatten();
            let urls = value.split("url(").skip(1).filter_map(|url| {
                let name = url.trim_start_matches([' ', '"', '\'']).strip_prefix('#')?;
                name.split([')', '"', '\'']).next()
            });
            for id in href.into_iter().chain(urls) {
                if let Some(&other) = self.by_id.get(id) {
                    work += times * self.of(other, depth + 1)?;
                }
            }
        }
        for child in node.children().filter(Node::is_element) {
            work += self.of(child, depth + 1)?;
        }
        self.known.insert(node.id(), Some(work));
        Ok(work)
    }
}

/// How many dashes the lines of a drawing have, at most.
fn dashes(group: &Group) -> f64 {
    let of = |node: &Drawn| -> f64 {
        let mut sum = match node {
            Drawn::Group(inner) => dashes(inner),
            Drawn::Path(path) => path.stroke().and_then(Stroke::dasharray).map_or(0.0, |pattern| {
                let period: f64 = pattern.iter().map(|&dash| f64::from(dash)).sum();
                pattern.len() as f64 * length(path.data()) / period
            }),
            _ => 0.0,
        };
        node.subroots(|root| sum += dashes(root));
        sum
    };
    group.children().iter().map(of).sum()
}

/// The length of a path by its control points, which is no less than its own.
fn length(path: &resvg::tiny_skia::Path) -> f64 {
    let (mut sum, mut at, mut begin) = (0.0, Default::default(), Default::default());
    let mut go = |points: &[resvg::tiny_skia::Point], at: &mut resvg::tiny_skia::Point| {
        for &point in points {
            sum += f64::from(point.distance(*at));
            *at = point;
        }
    };
    for segment in path.segments() {
        match segment {
            PathSegment::MoveTo(point) => (at, begin) = (point, point),
            PathSegment::LineTo(a) => go(&[a], &mut at),
            PathSegment::QuadTo(a, b) => go(&[a, b], &mut at),
            PathSegment::CubicTo(a, b, c) => go(&[a, b, c], &mut at),
            PathSegment::Close => go(&[begin], &mut at),
        }
    }
    sum
}
