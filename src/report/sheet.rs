use super::ink::{Lettering, text_width, write};
use glam::DVec2;
use image::{GrayImage, Luma, imageops};

/// White around and between the pictures, pixels.
pub(super) const MARGIN: u32 = 16;
/// Height of the strip with the captions, pixels.
pub(super) const CAPTION: u32 = 36;
/// Height of a figure in a caption, pixels.
const TEXT_PX: f64 = 11.0;

/// Pictures of one height side by side on white paper, each in a thin frame, with its caption
/// below.
pub(super) fn sheet(pictures: &[(String, GrayImage)]) -> GrayImage {
    let height = pictures.iter().map(|(_, picture)| picture.height()).max().unwrap_or(0);
    let width: u32 = pictures.iter().map(|(_, picture)| picture.width() + MARGIN).sum();
    let mut sheet = GrayImage::from_pixel(width + MARGIN, height + MARGIN + CAPTION, Luma([255]));
    let mut left = MARGIN;
    for (caption, picture) in pictures {
        let (width, height) = picture.dimensions();
        let frame = GrayImage::from_pixel(width + 2, height + 2, Luma([170]));
        imageops::replace(&mut sheet, &frame, i64::from(left) - 1, i64::from(MARGIN) - 1);
        imageops::replace(&mut sheet, picture, i64::from(left), i64::from(MARGIN));
        // A long caption is written smaller rather than cut.
        let text_height = TEXT_PX * (f64::from(width) / text_width(caption, TEXT_PX)).min(1.0);
        let centre = DVec2::new(
            f64::from(left) + 0.5 * f64::from(width),
            f64::from(MARGIN + height) + 0.5 * f64::from(CAPTION) - 1.0,
        );
        write(&mut sheet, centre, 0.0, caption, Lettering { height: text_height, grey: 30, halo: 0.0 });
        left += width + MARGIN;
    }
    sheet
}
