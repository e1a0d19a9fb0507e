//! Axes in millimetres around a picture of the face, which is seen as it lies on the machine: from
//! above, `+x` to the right and `+y` up.

use super::svg::{Anchor, Lettering, Pen, Svg, text_width};
use crate::grid::{Extent, Field};
use glam::DVec2;

/// White for the figures and names, pixels, in heights of a digit: left, top, right, below.
const ROOM: [f64; 4] = [5.2, 2.6, 2.0, 5.0];
/// Intervals along the longer side, at most.
const MOST_INTERVALS: f64 = 8.0;
const TICK: Pen = Pen { width: 1.2, grey: 60 };
const FRAME: u8 = 60;
/// How both views are called.
pub(super) const FROM_ABOVE: &str = "seen from above the face";

/// Nodes in the rows of a picture that is seen from above the face: `+x` is right, `+y` up.
pub(super) fn from_above<T: Copy>(field: &Field<T>) -> Field<T> {
    let (nx, ny) = (field.nx(), field.ny());
    Field::from_fn(nx, ny, |i, j| field[(i, ny - 1 - j)])
}

/// Where a point of a face, mm, lies on a picture of so many pixels, seen from above: the middles
/// of its outermost pixels are the border of the face.
pub(super) fn place(at: DVec2, size_mm: DVec2, (width, height): (u32, u32)) -> DVec2 {
    let last = DVec2::new(width.into(), height.into()) - 1.0;
    DVec2::new(0.5 + at.x / size_mm.x, 0.5 - at.y / size_mm.y) * last
}

/// Axes around a drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    /// Size of what it shows, mm.
    extent: Extent,
    ink: Lettering,
}

impl Axes {
    /// With figures of this height, pixels.
    pub(super) fn new(extent: Extent, text_px: f64) -> Self {
        Self { extent, ink: Lettering { height: text_px, grey: 30, halo: 0.0 } }
    }

    /// From the left and the top of the whole to the drawing, pixels.
    pub(super) fn corner(&self) -> (u32, u32) {
        let [left, top, ..] = self.room();
        (left, top)
    }

    /// What they take of a sheet, pixels: across and down.
    pub(super) fn taken(&self) -> (u32, u32) {
        let [left, top, right, below] = self.room();
        (left + right, top + below)
    }

    fn room(&self) -> [u32; 4] {
        ROOM.map(|heights| (heights * self.ink.height).round() as u32)
    }

    /// The drawing with axes around it.
    pub(super) fn around(&self, drawing: Svg) -> Svg {
        let inner = drawing.size();
        let (across, down) = self.taken();
        let mut sheet = Svg::new(inner.0 + across, inner.1 + down);
        let (left, top) = self.corner();
        sheet.inset(left, top, drawing);
        self.draw(&mut sheet, inner);
        sheet
    }

    /// The axes alone, around a drawing of this size.
    pub(super) fn draw(&self, sheet: &mut Svg, inner: (u32, u32)) {
        let (size, tall) = (self.extent.as_vec(), self.ink.height);
        let (left, top) = self.corner();
        let low = DVec2::new(left.into(), top.into());
        let high = low + DVec2::new(inner.0.into(), inner.1.into()) - 1.0;
        sheet.frame(low, high - low + 1.0, FRAME);
        let step = round_step(size.max_element() / MOST_INTERVALS);
        let at = |mm: DVec2| low + place(mm, size, inner);
        let label = |mm: f64| format!("{}", (mm * 1e6).round() / 1e6 + 0.0).replace('-', "−");
        let ticks = |reach: f64| {
            let most = (0.5 * reach / step + 1e-9).floor() as i64;
            (-most..=most).map(move |k| k as f64 * step)
        };
        // Figures of a narrow side would lie over each other.
        let room = step / size.x * f64::from(inner.0);
        for x in ticks(size.x) {
            let foot = DVec2::new(at(DVec2::new(x, 0.0)).x, high.y + 1.0);
            sheet.line(foot, foot + DVec2::new(0.0, 0.5 * tall), TICK);
            if x == 0.0 || text_width(&label(x), tall) < 0.9 * room {
                sheet.text(foot + DVec2::new(0.0, 1.4 * tall), Anchor::Middle, &label(x), self.ink);
            }
        }
        for y in ticks(size.y) {
            let foot = DVec2::new(low.x - 1.0, at(DVec2::new(0.0, y)).y);
            sheet.line(foot, foot - DVec2::new(0.5 * tall, 0.0), TICK);
            sheet.text(foot - DVec2::new(0.9 * tall, 0.0), Anchor::End, &label(y), self.ink);
        }
        let middle = 0.5 * (low.x + high.x);
        sheet.text(DVec2::new(middle, high.y + 3.6 * tall), Anchor::Middle, "x in mm", self.ink);
        sheet.text(DVec2::new(4.0, 0.9 * tall), Anchor::Start, "y in mm", self.ink);
    }
}

/// The next of 1, 2, 5 times a power of ten.
pub(super) fn round_step(least: f64) -> f64 {
    let decade = 10_f64.powf(least.max(1e-9).log10().floor());
    [1.0, 2.0, 5.0].map(|m| m * decade).into_iter().find(|step| *step >= least).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    #[test]
    fn from_above_x_is_right_and_y_is_up() {
        let field = Field::from_fn(3, 2, |i, j| 10 * i + j);
        let seen = from_above(&field);
        assert_eq!(seen.as_slice(), [1, 11, 21, 0, 10, 20]);
        let size = DVec2::new(40.0, 20.0);
        let corners = [DVec2::new(-20.0, 10.0), DVec2::new(20.0, -10.0), DVec2::ZERO];
        let places = corners.map(|at| place(at, size, (201, 101)).to_array());
        assert_eq!(places, [[0.0, 0.0], [200.0, 100.0], [100.0, 50.0]]);
    }

    #[test]
    fn axes_have_round_steps_and_ticks_where_the_lengths_are() {
        assert_eq!([0.9, 1.0, 3.0, 6.0, 12.5].map(round_step), [1.0, 1.0, 5.0, 10.0, 20.0]);
        let axes = Axes::new(Extent::new(80.0, 40.0), 10.0);
        let mut drawing = Svg::new(401, 201);
        drawing.picture(0, 0, GrayImage::from_pixel(401, 201, Luma([200])));
        let sheet = axes.around(drawing).raster();
        let (left, top) = axes.corner();
        assert_eq!(sheet.dimensions(), (401 + axes.taken().0, 201 + axes.taken().1));
        // What is within keeps its pixels, in a frame.
        assert!((0..401).all(|i| sheet.get_pixel(left + i, top + 100).0[0] == 200));
        assert_eq!(sheet.get_pixel(left - 1, top + 37).0[0], FRAME);
        // 5 pixels are a millimetre: ticks every 10 mm, 0 in the middle, and none between them.
        let dark = |i: u32, j: u32| sheet.get_pixel(i, j).0[0] < 160;
        for k in 0..9 {
            assert!(dark(left + 50 * k, top + 203), "{k}");
            assert!(k == 8 || !dark(left + 50 * k + 25, top + 203), "{k}");
        }
        for k in 0..5 {
            assert!(dark(left - 4, top + 50 * k) && (k == 4 || !dark(left - 4, top + 50 * k + 25)), "{k}");
        }
    }
}
