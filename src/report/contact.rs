//! Many small pictures on one sheet, and maps of a face.

use super::{ink::line, sheet::sheet};
use crate::{
    grid::{Extent, Field, bilinear_resample},
    irradiance::to_picture_order,
};
use glam::DVec2;
use image::{GrayImage, Luma, imageops};

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
    let rows: Vec<GrayImage> = pictures
        .chunks(columns.max(1))
        .map(|row| {
            let resized: Vec<(String, GrayImage)> = row
                .iter()
                .map(|Captioned { caption, picture }| {
                    let height =
                        (f64::from(picture.height()) * f64::from(width_px) / f64::from(picture.width())).round();
                    let filter = imageops::FilterType::Triangle;
                    (caption.clone(), imageops::resize(picture, width_px, height.max(1.0) as u32, filter))
                })
                .collect();
            sheet(&resized)
        })
        .collect();
    let width = rows.iter().map(GrayImage::width).max().unwrap_or(1);
    let height = rows.iter().map(GrayImage::height).sum::<u32>().max(1);
    let mut whole = GrayImage::from_pixel(width, height, Luma([255]));
    let mut top = 0;
    for row in &rows {
        imageops::replace(&mut whole, row, 0, i64::from(top));
        top += row.height();
    }
    whole
}

/// A map of values at the nodes of a face, white at `range.0` and black at `range.1`, as the
/// picture lies on the wall (left = `+x`, top = `+y`), with a ring around `at`, mm.
pub fn map(values: &Field<f64>, extent: Extent, range: (f64, f64), at: Option<DVec2>, width_px: u32) -> GrayImage {
    let size = extent.as_vec();
    let height_px = ((f64::from(width_px) * size.y / size.x).round() as u32).max(2);
    let shown = to_picture_order(&bilinear_resample(values, width_px as usize, height_px as usize));
    let mut image = GrayImage::from_fn(width_px, height_px, |i, j| {
        let part = (shown[(i as usize, j as usize)] - range.0) / (range.1 - range.0);
        Luma([(255.0 * (1.0 - part.clamp(0.0, 1.0))).round() as u8])
    });
    if let Some(at) = at {
        let place = (0.5 - at / size) * DVec2::new(f64::from(width_px - 1), f64::from(height_px - 1));
        let point = |k: u32| place + 9.0 * DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 24.0);
        for (half_width, grey) in [(2.4, 255), (1.1, 0)] {
            (0..24).for_each(|k| line(&mut image, point(k), point(k + 1), half_width, grey));
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(sheet.get_pixel(16 + 30, 16 + 20).0[0], 99);
    }
}
