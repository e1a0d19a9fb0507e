//! SVG: drawn by resvg, and fitted here.

use super::super::{
    colour::Meaning,
    error::ReferenceError,
    raster::{Alpha, Inks, Raster, Samples},
};
use super::{decoded::Decoded, svg_work};
use resvg::{
    tiny_skia::{Color, Pixmap, Transform},
    usvg::{ImageHrefResolver, ImageKind, Options, Tree, fontdb::Database, roxmltree},
};
use std::{
    io::Cursor,
    sync::{
        Arc, LazyLock,
        atomic::{AtomicBool, Ordering},
    },
};

const NAME: &str = "SVG";

/// Fonts are looked for once.
static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_system_fonts();
    Arc::new(fonts)
});

/// Draws a file on a page of this colour, so many pixels wide as long as no side has more than
/// `most`.
pub(in crate::reference) fn draw(
    bytes: &[u8],
    page: [u8; 3],
    width: usize,
    most: usize,
) -> Result<Decoded, ReferenceError> {
    let failed = |error: &dyn std::fmt::Display| ReferenceError::malformed(NAME, error);
    let text = std::str::from_utf8(bytes).map_err(|error| failed(&error))?;
    let parsing = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, parsing).map_err(|error| failed(&error))?;
    refuse_references(&document)?;
    svg_work::check(&document)?;
    let thin = AtomicBool::new(false);
    let by_default = ImageHrefResolver::default_data_resolver();
    let options = Options {
        fontdb: if text.contains("<text") || text.contains(":text") { Arc::clone(&FONTS) } else { Arc::default() },
        image_href_resolver: ImageHrefResolver {
            resolve_data: Box::new(|mime, data, options| {
                let kind = by_default(mime, Arc::clone(&data), options)?;
                let (w, h) = match &kind {
                    ImageKind::SVG(tree) => (f64::from(tree.size().width()), f64::from(tree.size().height())),
                    _ => {
                        let reader = image::ImageReader::new(Cursor::new(data.as_slice())).with_guessed_format();
                        let (w, h) = reader.ok()?.into_dimensions().ok()?;
                        (f64::from(w), f64::from(h))
                    }
                };
                let is_thin = w.max(h) > THINNEST * w.min(h);
                thin.fetch_or(is_thin, Ordering::Relaxed);
                (!is_thin).then_some(kind)
            }),
            resolve_string: Box::new(|_, _| None),
        },
        ..Options::default()
    };
    let tree = Tree::from_xmltree(&document, &options).map_err(|error| failed(&error))?;
    if thin.load(Ordering::Relaxed) {
        return Err(failed(&format!("it shows a picture more than {THINNEST} times as long as wide")));
    }
    svg_work::check_dashes(tree.root(), document.descendants().count())?;
    let size = tree.size();
    let aspect = f64::from(size.height()) / f64::from(size.width());
    let high = |wide: f64| (wide * aspect).round().max(1.0);
    let mut wide = (width.clamp(1, most)) as f64;
    if high(wide) > most as f64 {
        wide = (most as f64 / aspect).floor().max(1.0);
    }
    let (nx, ny) = (wide as u32, high(wide).min(most as f64) as u32);
    let mut pixmap = Pixmap::new(nx, ny).ok_or(ReferenceError::Empty { width: nx as usize, height: ny as usize })?;
    let [r, g, b] = page;
    pixmap.fill(Color::from_rgba8(r, g, b, 255));
    let fitted = Transform::from_scale(nx as f32 / size.width(), ny as f32 / size.height());
    resvg::render(&tree, fitted, &mut pixmap.as_mut());
    // The page has left nothing transparent.
    let samples = pixmap.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let raster = Raster {
        nx: nx as usize,
        ny: ny as usize,
        inks: Inks::Rgb,
        alpha: Alpha::None,
        samples: Samples::Bits8(samples),
    };
    Ok(Decoded::new(raster, None, Meaning::srgb()))
}

/// Refuses what would have to be read from elsewhere.
fn refuse_references(document: &roxmltree::Document<'_>) -> Result<(), ReferenceError> {
    let refused = |what: &str| {
        let shown: String = what.chars().take(80).collect();
        Err(ReferenceError::malformed(NAME, format!("it refers to '{shown}', and nothing outside of the file is read")))
    };
    for node in document.descendants() {
        if let Some(instruction) = node.pi()
            && instruction.target == "xml-stylesheet"
        {
            return refused(instruction.value.unwrap_or("a style sheet"));
        }
        if let Some(text) = node.text().filter(|text| node.is_text() && text.contains("@import")) {
            return refused(text.trim());
        }
        // A link leads elsewhere and draws nothing.
        if !node.is_element() || node.tag_name().name() == "a" {
            continue;
        }
        if node.tag_name().name() == "image" && vanishes(&node) {
            return Err(ReferenceError::malformed(NAME, "it shows a picture that is too small for where it stands"));
        }
        for attribute in node.attributes().filter(|attribute| attribute.name() == "href") {
            let target = attribute.value().trim();
            if !(target.is_empty() || target.starts_with('#') || target.starts_with("data:")) {
                return refused(target);
            }
        }
    }
    Ok(())
}

/// Most that a picture in a drawing may be longer than wide, and that its place may be larger than it: in single precision, by which it is
/// placed, it would have no extent beyond.
const THINNEST: f64 = 1000.0;
const FARTHEST: f64 = 1e4;

/// Whether a picture is lost where it stands. Its size is its own where none is told: of one pixel at least.
fn vanishes(image: &roxmltree::Node<'_, '_>) -> bool {
    let magnitude = |name: &str, otherwise: f64| {
        let text = image.attribute(name).unwrap_or_default().trim().trim_start_matches(['+', '-']);
        // Units are left away: the greatest is a hundred of the smallest.
        let end = text
            .char_indices()
            .find(|&(k, c)| {
                let exponent = matches!(c, 'e' | 'E')
                    && text[k + 1..].starts_with(|c: char| c.is_ascii_digit() || c == '+' || c == '-');
                !(c.is_ascii_digit() || c == '.' || c == '+' || c == '-' || exponent)
            })
            .map_or(text.len(), |(k, _)| k);
        text[..end].parse::<f64>().unwrap_or(otherwise)
    };
    let [width, height] = ["width", "height"].map(|name| magnitude(name, 1.0));
    let reach = magnitude("x", 0.0).max(magnitude("y", 0.0)).max(width).max(height);
    width > 0.0 && height > 0.0 && reach > FARTHEST * width.min(height)
}
