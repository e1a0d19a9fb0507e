//! Pictures side by side on white paper, and maps of a face.

use super::{
    pictures::{Exposure, difference_picture, irradiance_picture},
    svg::{Anchor, Lettering, Pen, Svg},
};
use crate::{
    grid::{Extent, Field, bilinear_resample},
    irradiance::to_picture_order,
};
use glam::DVec2;
use image::{GrayImage, Luma, imageops};

/// White around and between the pictures, pixels.
pub(super) const MARGIN: u32 = 16;
/// Height of the strip with the captions, pixels.
pub(super) const CAPTION: u32 = 36;
const TEXT: Lettering = Lettering { height: 11.0, grey: 30, halo: 0.0 };
const FRAME: u8 = 170;

/// A picture with words under it.
#[derive(Clone, Debug)]
pub struct Captioned {
    /// The words.
    pub caption: String,
    /// The picture.
    pub picture: GrayImage,
}

/// Pictures in rows of `columns`, each `width_px` wide.
pub fn contact_sheet(pictures: &[Captioned], columns: usize, width_px: u32) -> GrayImage {
    let resized = pictures.iter().map(|Captioned { caption, picture }| {
        let height = (f64::from(picture.height()) * f64::from(width_px) / f64::from(picture.width())).round();
        let filter = imageops::FilterType::Triangle;
        let picture = imageops::resize(picture, width_px, height.max(1.0) as u32, filter);
        Captioned { caption: caption.clone(), picture }
    });
    sheet(resized.collect(), columns)
}

/// Target, caustic and their [difference](difference_picture) side by side, with `note` under the
/// last: how large the error is, say. Both in picture order.
///
/// # Panics
/// If the two have different sizes.
pub fn panel(target: &Field<f64>, caustic: &Field<f64>, exposure: Exposure, note: &str) -> GrayImage {
    const LEAST_PX: u32 = 320;
    let note = format!("difference × 4: {note}");
    let pictures = [
        ("target", irradiance_picture(target, exposure)),
        ("caustic", irradiance_picture(caustic, exposure)),
        (note.trim_end_matches([':', ' ']), difference_picture(target, caustic, exposure)),
    ];
    let enlarged = pictures.map(|(caption, picture)| {
        // By a whole factor if there are few pixels: nothing is smoothed.
        let factor = LEAST_PX.div_ceil(picture.width());
        let (width, height) = (factor * picture.width(), factor * picture.height());
        let picture = imageops::resize(&picture, width, height, imageops::FilterType::Nearest);
        Captioned { caption: caption.to_owned(), picture }
    });
    sheet(enlarged.into(), 3)
}

/// Rows of pictures, each in a thin frame, with its caption below.
pub(super) fn sheet(pictures: Vec<Captioned>, columns: usize) -> GrayImage {
    let columns = columns.max(1);
    let width_of = |row: &[Captioned]| row.iter().map(|one| one.picture.width() + MARGIN).sum::<u32>() + MARGIN;
    let height_of = |row: &[Captioned]| row.iter().map(|one| one.picture.height()).max().unwrap_or(0);
    let width = pictures.chunks(columns).map(width_of).max().unwrap_or(1);
    let height: u32 = pictures.chunks(columns).map(|row| height_of(row) + MARGIN + CAPTION).sum();
    let mut sheet = Svg::new(width, height.max(1));
    let heights: Vec<u32> = pictures.chunks(columns).map(height_of).collect();
    let mut pictures = pictures.into_iter();
    let mut top = MARGIN;
    for row_height in heights {
        let mut left = MARGIN;
        for Captioned { caption, picture } in pictures.by_ref().take(columns) {
            let (width, height) = picture.dimensions();
            let (low, size) = (DVec2::new(left.into(), top.into()), DVec2::new(width.into(), height.into()));
            sheet.frame(low, size, FRAME);
            let centre = low + DVec2::new(0.5 * size.x, size.y + 0.5 * f64::from(CAPTION) - 1.0);
            // A long caption is written smaller rather than cut.
            sheet.fitted_text(centre, Anchor::Middle, &caption, TEXT, size.x);
            sheet.picture(left, top, picture);
            left += width + MARGIN;
        }
        top += row_height + MARGIN + CAPTION;
    }
    sheet.raster()
}

/// A map of values at the nodes of a face, white at `range.0` and black at `range.1`, as the
/// picture lies on the wall (left = `+x`, top = `+y`), with a ring around `at`, mm.
pub fn map(values: &Field<f64>, extent: Extent, range: (f64, f64), at: Option<DVec2>, width_px: u32) -> GrayImage {
    let size = extent.as_vec();
    let height_px = ((f64::from(width_px) * size.y / size.x).round() as u32).max(2);
    let shown = to_picture_order(&bilinear_resample(values, width_px as usize, height_px as usize));
    let image = GrayImage::from_fn(width_px, height_px, |i, j| {
        let part = (shown[(i as usize, j as usize)] - range.0) / (range.1 - range.0);
        Luma([(255.0 * (1.0 - part.clamp(0.0, 1.0))).round() as u8])
    });
    let Some(at) = at else { return image };
    let mut map = Svg::new(width_px, height_px);
    map.picture(0, 0, image);
    let place = (0.5 - at / size) * DVec2::new(f64::from(width_px - 1), f64::from(height_px - 1));
    for (width, grey) in [(4.8, 255), (2.2, 0)] {
        map.circle(place, 9.0, Pen { width, grey });
    }
    map.raster()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irradiance::{TargetIrradiance, Transfer};

    #[test]
    fn a_map_lies_like_the_picture_and_rings_its_place() {
        let extent = Extent::new(40.0, 20.0);
        let ramp = Field::from_fn(81, 41, |i, _| i as f64 / 80.0);
        let map = map(&ramp, extent, (0.0, 1.0), Some(DVec2::new(10.0, 5.0)), 200);
        assert_eq!(map.dimensions(), (200, 100));
        // Black where +x is, which is left.
        assert!(map.get_pixel(2, 90).0[0] < 10 && map.get_pixel(197, 90).0[0] > 245);
        // x = 10 of 40 is a quarter from the left, y = 5 of 20 a quarter from the top.
        let dark = |i: u32, j: u32| map.get_pixel(i, j).0[0] < 60;
        assert!(dark(50 + 9, 25) && dark(50, 25 + 9) && !dark(50 + 12, 25));
    }

    #[test]
    fn a_sheet_holds_all_rows() {
        let one = Captioned { caption: "one".into(), picture: GrayImage::from_pixel(30, 20, Luma([99])) };
        let sheet = contact_sheet(&vec![one; 5], 2, 60);
        assert_eq!(sheet.dimensions(), (2 * 60 + 3 * 16, 3 * (40 + 16 + 36)));
        for (column, row) in [(0, 0), (1, 1), (0, 2)] {
            let at = (16 + 30 + column * 76, 16 + 20 + row * 92);
            assert_eq!(sheet.get_pixel(at.0, at.1).0[0], 99);
        }
        assert_eq!(sheet.get_pixel(16 + 30 + 76, 16 + 20 + 2 * 92).0[0], 255, "there are five");
        assert_eq!(contact_sheet(&[], 3, 60).dimensions(), (1, 1));
    }

    #[test]
    fn the_panel_holds_the_three_pictures() {
        let ramp = TargetIrradiance::new(Field::from_fn(256, 8, |i, _| i as f64)).unwrap();
        let exposure = Exposure::of(&ramp, Transfer::Linear);
        let panel = panel(ramp.cells(), ramp.cells(), exposure, "relative rms 0.0000");
        assert_eq!(panel.dimensions(), (3 * 512 + 64, 16 + 16 + 36));
        assert_eq!(panel.get_pixel(16 + 400, 20).0[0], 200);
        assert_eq!(panel.get_pixel(16 + 528 + 400, 20).0[0], 200);
        assert_eq!(panel.get_pixel(16 + 2 * 528 + 400, 20).0[0], 255);
        assert_eq!(panel.get_pixel(15, 20).0[0], 170, "in a frame");
    }
}
