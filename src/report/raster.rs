//! Drawings as pixels.

use super::svg::{FONT, NAMESPACE, Svg};
use image::{GrayImage, Luma};
use resvg::{
    tiny_skia::{Color, Pixmap, PremultipliedColorU8, Transform},
    usvg::{Options, Tree, fontdb::Database},
};
use std::sync::{Arc, LazyLock};

static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_data(FONT.to_vec());
    Arc::new(fonts)
});

impl Svg {
    /// The drawing in pixels. Its pictures keep theirs, to the last bit, where there is no ink.
    ///
    /// # Panics
    /// If a side is zero, or there is no memory for it.
    pub fn raster(&self) -> GrayImage {
        let mut sheet = Pixmap::new(self.width, self.height).expect("a sheet of paper");
        sheet.fill(Color::WHITE);
        for ((left, top), picture) in &self.pictures {
            for (i, j, &Luma([grey])) in picture.enumerate_pixels() {
                let (x, y) = (left + i, top + j);
                if x < self.width && y < self.height {
                    sheet.pixels_mut()[(y * self.width + x) as usize] = opaque(grey);
                }
            }
        }
        resvg::render(&parsed(&self.markup(NAMESPACE, false)), Transform::identity(), &mut sheet.as_mut());
        GrayImage::from_fn(self.width, self.height, |i, j| Luma([sheet.pixels()[(j * self.width + i) as usize].red()]))
    }
}

fn opaque(grey: u8) -> PremultipliedColorU8 {
    Color::from_rgba8(grey, grey, grey, 255).premultiply().to_color_u8()
}

fn parsed(drawing: &str) -> Tree {
    let options = Options { fontdb: Arc::clone(&FONTS), ..Options::default() };
    Tree::from_str(drawing, &options).expect("drawings are written by this module alone")
}
