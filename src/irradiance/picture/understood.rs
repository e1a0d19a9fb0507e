//! How a picture was understood: what a person would want to know before a slab is cut for it.

use super::{Background, Edits, Picture, PictureError, Transfer, canvas::Spread};
use crate::grid::Field;

/// How a picture was understood.
#[derive(Clone, Debug)]
pub struct Understood {
    pub(super) kind: &'static str,
    pub(super) stored: (usize, usize),
    pub(super) orientation: u8,
    pub(super) colour: String,
    pub(super) is_plain: bool,
    pub(super) layer: Option<String>,
    /// What lies behind its transparent parts, if there are any.
    pub(super) background: Option<Background>,
    pub(super) spread: Spread,
    pub(super) factor: usize,
    pub(super) edits: Edits,
    pub(super) passed_over: Vec<String>,
    /// Darkest and brightest light after each stage.
    pub(super) seen: Vec<(Stage, (f64, f64))>,
    pub(super) size: (usize, usize),
}

impl Default for Understood {
    fn default() -> Self {
        Self {
            kind: "",
            stored: (0, 0),
            orientation: 1,
            colour: String::new(),
            is_plain: false,
            layer: None,
            background: None,
            spread: Spread::NONE,
            factor: 1,
            edits: Edits::default(),
            passed_over: Vec::new(),
            seen: Vec::new(),
            size: (0, 0),
        }
    }
}

/// What has been done to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Read,
    Placed,
    Shaded,
}

/// Least relative spread of light that is a picture, and least that is one without a word.
const FLAT: f64 = 1e-6;
const FAINT: f64 = 0.02;

/// The relative spread of light.
fn spread((least, greatest): (f64, f64)) -> f64 {
    if greatest > 0.0 { (greatest - least) / greatest } else { 0.0 }
}

impl Understood {
    /// Looks at the light after a stage.
    pub(super) fn see(&mut self, light: &Field<f64>, stage: Stage) {
        self.seen.push((stage, light.min_max()));
        self.size = (light.nx(), light.ny());
    }

    /// Whether what is left of the picture in its frame can be drawn; if it hardly can, a warning.
    ///
    /// # Errors
    /// [`PictureError::Flat`].
    pub fn contrast(&self, framed: &Picture) -> Result<Option<String>, PictureError> {
        let range = framed.values().min_max();
        if spread(range) < FLAT {
            return Err(PictureError::Flat { why: self.flattened() });
        }
        if spread(range) >= FAINT {
            return Ok(None);
        }
        let floor = |v: f64| (Transfer::Srgb.from_linear(v) * 1000.0).floor() / 1000.0;
        let ceil = |v: f64| (Transfer::Srgb.from_linear(v).min(1.0) * 1000.0).ceil() / 1000.0;
        Ok(Some(format!(
            "the picture is nearly flat: its light differs by {:.2} % at most, which will hardly be seen (`levels {},{}` makes its darkest light black and its brightest white)",
            100.0 * spread(range),
            floor(range.0),
            ceil(range.1)
        )))
    }

    /// What made the picture flat.
    fn flattened(&self) -> String {
        let flat = |stage: Stage| self.seen.iter().any(|(of, range)| *of == stage && spread(*range) < FLAT);
        let share = |light: f64| if light > 0.0 { format!("{light:.3} of white") } else { "black".into() };
        let range =
            |stage: Stage| self.seen.iter().find(|(of, _)| *of == stage).map_or((0.0, 0.0), |(_, range)| *range);
        if flat(Stage::Read) {
            let (alpha, colour) = (self.spread.alpha, self.spread.colour);
            return match self.background {
                Some(_) if alpha.1 <= 0.0 => "it is transparent everywhere".into(),
                Some(background) if alpha.0 < alpha.1 => {
                    let other = if background == Background::WHITE { "black" } else { "white" };
                    let art = if colour.1 <= 0.0 { "black" } else { "of one light" };
                    format!(
                        "what it shows is {art}, and so is what lies behind its transparent parts ({background}); choose another background: `background {other}`, or a colour as #rrggbb"
                    )
                }
                _ => format!("every pixel is {}", share(range(Stage::Read).1)),
            };
        }
        if flat(Stage::Placed) {
            let crop = self.edits.crop.map(|crop| crop.to_string()).unwrap_or_default();
            return format!(
                "the part that is cut out of it (`crop {crop}`) is {} all over",
                share(range(Stage::Placed).1)
            );
        }
        if flat(Stage::Shaded) {
            let levels = self.edits.levels.map(|levels| levels.to_string()).unwrap_or_default();
            let (least, greatest) = range(Stage::Placed);
            let value = |light: f64| Transfer::Srgb.from_linear(light);
            return format!(
                "its levels (`levels {levels}`) leave nothing of it, whose values lie between {:.3} and {:.3}",
                value(least),
                value(greatest)
            );
        }
        "its frame leaves nothing of it (`margin`, `vignette`)".into()
    }

    /// What was not plain about the picture, in one line; `None` if it was an upright picture of
    /// sRGB, used as it is.
    pub fn line(&self) -> Option<String> {
        let mut said = Vec::new();
        if self.orientation != 1 {
            said.push(format!("turned upright ({})", self.orientation()));
        }
        if !self.is_plain {
            said.push(self.colour.clone());
        }
        said.extend(self.layer.as_ref().map(|layer| format!("layer '{layer}'")));
        said.extend(self.background.map(|background| format!("its transparent parts on {background}")));
        if self.factor > 1 {
            said.push(self.reduction());
        }
        said.extend(self.edits.words());
        said.extend(self.passed_over.iter().cloned());
        let (nx, ny) = self.size;
        (!said.is_empty()).then(|| format!("{nx} x {ny} pixels, {}", said.join(", ")))
    }

    /// Whether it is a drawing, which has no pixels of its own.
    pub fn is_drawing(&self) -> bool {
        self.kind == "SVG"
    }

    fn orientation(&self) -> String {
        let tag = if self.kind == "TIFF" { "" } else { "EXIF " };
        format!("{tag}orientation {}", self.orientation)
    }

    fn reduction(&self) -> String {
        let (nx, ny) = self.stored;
        let k = self.factor;
        format!("reduced from {nx} x {ny}, blocks of {k} x {k} pixels each becoming one")
    }

    /// The same at length: names and values for a table.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let (nx, ny) = self.stored;
        let mut rows = vec![("Kind", self.kind.to_owned()), ("Stored", format!("{nx} × {ny} pixels"))];
        rows.push(match self.orientation {
            1 => ("Orientation", "upright".into()),
            _ => ("Orientation", format!("turned upright ({})", self.orientation())),
        });
        rows.push(("Colour", self.colour.clone()));
        rows.extend(self.layer.as_ref().map(|layer| ("Layer", layer.clone())));
        rows.extend(self.background.map(|background| ("Transparent parts", format!("on {background}"))));
        if self.factor > 1 {
            rows.push(("Size", self.reduction()));
        }
        rows.extend(self.edits.words().into_iter().map(|edit| ("Edit", edit)));
        rows.extend(self.passed_over.iter().map(|what| ("Note", what.clone())));
        if let Some((_, (least, greatest))) = self.seen.last() {
            rows.push(("Black, white", format!("its light goes from {least:.4} to {greatest:.4} of white")));
        }
        rows
    }
}
