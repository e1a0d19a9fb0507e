//! A picture and a drawing on a page.

use super::{data, page::View};
use crate::report::{drawing::Drawing, svg::png_uri};
use image::DynamicImage;

/// A picture on the page.
pub(super) struct Figure {
    pub(super) title: String,
    pub(super) note: String,
    pub(super) alt: String,
    pub(super) uri: String,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Figure {
    pub(super) fn of(view: &View, most_px: u32) -> Self {
        let picture = data::shrunk(&view.picture, most_px);
        let (width, height) = picture.dimensions();
        let uri = png_uri(&DynamicImage::from(picture));
        Self { title: view.title.clone(), note: view.note.clone(), alt: view.alt.clone(), uri, width, height }
    }

    /// Few pixels are shown as such.
    pub(super) fn rendering(&self) -> &'static str {
        if self.width.max(self.height) < 200 { "coarse" } else { "fine" }
    }
}

/// A workshop drawing: its views as a picture, and its notes as text, which is read at any width.
pub(super) struct Sheet {
    pub(super) uri: String,
    pub(super) width: u32,
    pub(super) height: u32,
    /// In paragraphs.
    pub(super) notes: Vec<Vec<String>>,
}

impl Sheet {
    pub(super) fn of(drawing: &Drawing) -> Self {
        let (width, height) = drawing.views.size();
        let notes = drawing.notes.split(String::is_empty).map(<[String]>::to_vec).collect();
        Self { uri: drawing.views.uri(), width, height, notes }
    }
}
