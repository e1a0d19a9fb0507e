//! A picture as a page holds it.

use super::{View, data};
use crate::report::svg::png_uri;
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
