//! Pictures side by side on white paper, and maps of a face.

use super::{
    axes::{Axes, from_above, place},
    pictures::{Exposure, difference_picture, irradiance_picture},
    svg::{Anchor, Lettering, Pen, Svg},
};
use crate::grid::{Extent, Field, bilinear_resample};
use glam::DVec2;
use image::{GrayImage, Luma, imageops};

pub(super) const ON_THE_WALL: &str = "as on the wall";
/// White around and between the pictures, pixels.
pub(super) const MARGIN: u32 = 16;
/// Height of the strip with captions of one line, pixels, and of every further line.
pub(super) const CAPTION: u32 = 36;
const LINE: u32 = 19;
const TEXT: Lettering = Lettering { height: 11.0, grey: 30, halo: 0.0 };
const FRAME: u8 = 170;

/// A picture with words under it.
#[derive(Clone, Debug)]
pub struct Captioned {
    /// The words, in lines.
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
    let target_is = format!("target, {ON_THE_WALL}");
    let pictures = [
        (target_is.as_str(), irradiance_picture(target, exposure)),
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
    let lines_of = |row: &[Captioned]| row.iter().map(|one| one.caption.lines().count()).max().unwrap_or(1).max(1);
    let strip_of = |row: &[Captioned]| CAPTION + LINE * (lines_of(row) as u32 - 1);
    let width = pictures.chunks(columns).map(width_of).max().unwrap_or(1);
    let height: u32 = pictures.chunks(columns).map(|row| height_of(row) + MARGIN + strip_of(row)).sum();
    let mut sheet = Svg::new(width, height.max(1));
    let rows: Vec<(u32, u32)> = pictures.chunks(columns).map(|row| (height_of(row), strip_of(row))).collect();
    let mut pictures = pictures.into_iter();
    let mut top = MARGIN;
    for (row_height, strip) in rows {
        let mut left = MARGIN;
        for Captioned { caption, picture } in pictures.by_ref().take(columns) {
            let (width, height) = picture.dimensions();
            let (low, size) = (DVec2::new(left.into(), top.into()), DVec2::new(width.into(), height.into()));
            sheet.frame(low, size, FRAME);
            for (k, line) in (0_u32..).zip(caption.lines()) {
                let below = 0.5 * f64::from(CAPTION) - 1.0 + f64::from(k * LINE);
                let centre = low + DVec2::new(0.5 * size.x, size.y + below);
                // A long caption is written smaller rather than cut.
                sheet.fitted_text(centre, Anchor::Middle, line, TEXT, size.x);
            }
            sheet.picture(left, top, picture);
            left += width + MARGIN;
        }
        top += row_height + MARGIN + strip;
    }
    sheet.raster()
}

/// A row of a table: small pictures and words beside them.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Lines; the first is its name.
    pub(super) words: Vec<String>,
    /// At most two.
    pub(super) pictures: Vec<GrayImage>,
}

/// Longer side of a picture in a table, pixels.
const SMALL: u32 = 132;
/// Height of the title of a table, pixels.
const TITLE: u32 = 44;
const NAME: Lettering = Lettering { height: 11.5, grey: 0, halo: 0.0 };
const FINE: Lettering = Lettering { height: 10.0, grey: 70, halo: 0.0 };

/// Rows with small pictures, in columns that are filled one after the other, on a sheet of this
/// width, pixels.
pub(super) fn table_of_pictures(title: &str, rows: Vec<Row>, columns: u32, width_px: u32) -> GrayImage {
    let column_px = (width_px - MARGIN) / columns.max(1);
    let longest = rows.len().div_ceil(columns.max(1) as usize).max(1);
    let small = |picture: &GrayImage| {
        let longer = picture.width().max(picture.height()).max(1);
        let side = |n: u32| ((f64::from(n) * f64::from(SMALL) / f64::from(longer)).round() as u32).max(1);
        imageops::resize(picture, side(picture.width()), side(picture.height()), imageops::FilterType::Triangle)
    };
    let rows: Vec<(Vec<String>, Vec<GrayImage>)> =
        rows.into_iter().map(|row| (row.words, row.pictures.iter().map(small).collect())).collect();
    let tall =
        rows.iter().flat_map(|(_, pictures)| pictures).map(GrayImage::height).max().unwrap_or(0).max(86) + MARGIN;
    let mut sheet = Svg::new(width_px, TITLE + tall * longest as u32 + MARGIN);
    sheet.text(DVec2::new(MARGIN.into(), 20.0), Anchor::Start, title, NAME);
    for (k, (words, pictures)) in rows.into_iter().enumerate() {
        let (column, row) = ((k / longest) as u32, (k % longest) as u32);
        let (left, top) = (MARGIN + column * column_px, TITLE + row * tall);
        for (n, picture) in (0_u32..).zip(pictures) {
            let at = left + n * (SMALL + 10);
            let size = DVec2::new(picture.width().into(), picture.height().into());
            sheet.frame(DVec2::new(at.into(), top.into()), size, FRAME);
            sheet.picture(at, top, picture);
        }
        let begin = left + 2 * (SMALL + 10) + 8;
        let room = f64::from((left + column_px).saturating_sub(begin + MARGIN).max(1));
        for (n, line) in words.iter().enumerate() {
            let at = DVec2::new(begin.into(), f64::from(top) + 10.0 + 21.0 * n as f64);
            sheet.fitted_text(at, Anchor::Start, line, if n == 0 { NAME } else { FINE }, room);
        }
    }
    sheet.raster()
}

/// Sheets below each other.
pub(super) fn stacked(sheets: &[GrayImage]) -> GrayImage {
    let width = sheets.iter().map(GrayImage::width).max().unwrap_or(1);
    let height: u32 = sheets.iter().map(GrayImage::height).sum();
    let mut whole = GrayImage::from_pixel(width, height.max(1), Luma([255]));
    let mut top = 0;
    for sheet in sheets {
        imageops::replace(&mut whole, sheet, 0, top);
        top += i64::from(sheet.height());
    }
    whole
}

/// A map of values at the nodes of a face, white at `range.0` and black at `range.1`, seen from
/// above the face (`+x` is right, `+y` up) with axes in mm around it, and with a ring around `at`,
/// mm. `width_px` is that of the face.
pub fn map(values: &Field<f64>, extent: Extent, range: (f64, f64), at: Option<DVec2>, width_px: u32) -> Svg {
    let size = extent.as_vec();
    let height_px = ((f64::from(width_px) * size.y / size.x).round() as u32).max(2);
    let shown = from_above(&bilinear_resample(values, width_px as usize, height_px as usize));
    let image = GrayImage::from_fn(width_px, height_px, |i, j| {
        let part = (shown[(i as usize, j as usize)] - range.0) / (range.1 - range.0);
        Luma([(255.0 * (1.0 - part.clamp(0.0, 1.0))).round() as u8])
    });
    let mut map = Svg::new(width_px, height_px);
    map.picture(0, 0, image);
    if let Some(at) = at {
        for (width, grey) in [(4.8, 255), (2.2, 0)] {
            map.circle(place(at, size, (width_px, height_px)), 9.0, Pen { width, grey });
        }
    }
    Axes::new(extent, TEXT.height).around(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irradiance::{TargetIrradiance, Transfer};

    #[test]
    fn a_map_is_seen_from_above_the_face_and_rings_its_place() {
        let extent = Extent::new(40.0, 20.0);
        let ramp = Field::from_fn(81, 41, |i, _| i as f64 / 80.0);
        let map = map(&ramp, extent, (0.0, 1.0), Some(DVec2::new(10.0, 5.0)), 200).raster();
        let axes = Axes::new(extent, TEXT.height);
        let ((left, top), (across, down)) = (axes.corner(), axes.taken());
        assert_eq!(map.dimensions(), (200 + across, 100 + down));
        let grey = |i: u32, j: u32| map.get_pixel(left + i, top + j).0[0];
        // Black where +x is, which is right.
        assert!(grey(197, 90) < 10 && grey(2, 90) > 245);
        // x = 10 of 40 is a quarter from the right, y = 5 of 20 a quarter from the top.
        let ring = |i: u32, j: u32| [grey(i, j), grey(i + 3, j)];
        assert!(grey(149 - 9, 25) < 40 && grey(149, 25 + 9) < 40, "{:?}", ring(149 - 9, 25));
        assert!(grey(149 - 12, 25) > 60 && grey(149, 25) > 40 && grey(50 + 9, 25) > 100);
    }

    #[test]
    fn captions_have_lines() {
        let of = |caption: &str| Captioned { caption: caption.into(), picture: GrayImage::new(30, 20) };
        let sheet = sheet(vec![of("one"), of("one\ntwo\nthree")], 2);
        assert_eq!(sheet.dimensions(), (2 * 30 + 3 * MARGIN, 20 + MARGIN + CAPTION + 2 * LINE));
        let ink = |left: u32| (left..left + 30).flat_map(|i| (60..92).map(move |j| (i, j)));
        let dark = |left: u32| ink(left).filter(|&(i, j)| sheet.get_pixel(i, j).0[0] < 160).count();
        assert!(dark(MARGIN) == 0 && dark(2 * MARGIN + 30) > 10);
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
