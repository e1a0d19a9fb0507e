//! The light of a picture while it is turned, reduced and framed.

use crate::image::Image;
use rayon::prelude::*;
use std::ops::Range;

/// Light by pixels, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) nx: usize,
    pub(super) ny: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// A plane of this size whose pixels are found at the given places of this one.
    pub(super) fn gathered(&self, nx: usize, ny: usize, place: impl Fn(usize, usize) -> (usize, usize) + Sync) -> Self {
        let mut values = vec![0.0; nx * ny];
        values.par_chunks_mut(nx.max(1)).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let (column, line) = place(x, y);
                *value = self.values[line * self.nx + column];
            }
        });
        Self { nx, ny, values }
    }

    /// The upright picture, by the orientation of EXIF: 1 as it is, 2 mirrored, 3 turned by 180
    /// degrees, 4 upside down, 6 and 8 to be turned by 90 degrees clockwise and counterclockwise, 5
    /// and 7 transposed.
    pub(super) fn upright(self, orientation: u8) -> Self {
        let (nx, ny) = (self.nx, self.ny);
        match orientation {
            2 => self.gathered(nx, ny, |x, y| (nx - 1 - x, y)),
            3 => self.gathered(nx, ny, |x, y| (nx - 1 - x, ny - 1 - y)),
            4 => self.gathered(nx, ny, |x, y| (x, ny - 1 - y)),
            5 => self.gathered(ny, nx, |x, y| (y, x)),
            6 => self.gathered(ny, nx, |x, y| (y, ny - 1 - x)),
            7 => self.gathered(ny, nx, |x, y| (nx - 1 - y, ny - 1 - x)),
            8 => self.gathered(ny, nx, |x, y| (nx - 1 - y, x)),
            _ => self,
        }
    }

    /// Means of blocks of `factor x factor` pixels; the last row and column of blocks may hold
    /// fewer.
    pub(super) fn reduced(self, factor: usize) -> Self {
        if factor <= 1 {
            return self;
        }
        let (nx, ny) = (self.nx.div_ceil(factor), self.ny.div_ceil(factor));
        let mut values = vec![0.0; nx * ny];
        values.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            let lines = j * factor..((j + 1) * factor).min(self.ny);
            for (i, value) in row.iter_mut().enumerate() {
                let columns = i * factor..((i + 1) * factor).min(self.nx);
                let sum: f64 = lines
                    .clone()
                    .map(|y| self.values[y * self.nx..][columns.clone()].iter().map(|v| f64::from(*v)).sum::<f64>())
                    .sum();
                *value = (sum / (lines.len() * columns.len()) as f64) as f32;
            }
        });
        Self { nx, ny, values }
    }

    pub(super) fn map(&mut self, change: impl Fn(f64) -> f64 + Sync) {
        self.values.par_iter_mut().for_each(|value| *value = change(f64::from(*value)) as f32);
    }
}

/// An image at another number of pixels: every new pixel holds the mean of what it covers of the
/// old ones, so that light is kept.
pub fn resampled(image: &Image, nx: usize, ny: usize) -> Image {
    if (nx, ny) == (image.nx, image.ny) {
        return image.clone();
    }
    let columns: Vec<Cover> = (0..nx).map(|i| Cover::of(i, nx, image.nx)).collect();
    let mut values = vec![0.0; nx * ny];
    values.par_chunks_mut(nx.max(1)).enumerate().for_each(|(j, out)| {
        let lines = Cover::of(j, ny, image.ny);
        let mut line = vec![0.0; image.nx];
        for (y, weight) in lines.weights() {
            for (sum, value) in line.iter_mut().zip(&image.values[y * image.nx..]) {
                *sum += weight * value;
            }
        }
        for (value, cover) in out.iter_mut().zip(&columns) {
            *value = cover.weights().map(|(x, weight)| weight * line[x]).sum();
        }
    });
    Image::new(nx, ny, values)
}

/// What a new pixel covers of the old ones along one axis. In whole numbers: the old pixels are
/// `new` units wide, the new ones `old`.
struct Cover {
    begin: usize,
    end: usize,
    unit: usize,
}

impl Cover {
    fn of(k: usize, new: usize, old: usize) -> Self {
        Self { begin: k * old, end: (k + 1) * old, unit: new }
    }

    fn pixels(&self) -> Range<usize> {
        self.begin / self.unit..self.end.div_ceil(self.unit)
    }

    fn weights(&self) -> impl Iterator<Item = (usize, f64)> {
        let whole = (self.end - self.begin) as f64;
        self.pixels().map(move |p| {
            let covered = self.end.min((p + 1) * self.unit) - self.begin.max(p * self.unit);
            (p, covered as f64 / whole)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(nx: usize, ny: usize) -> Plane {
        Plane { nx, ny, values: (0..nx * ny).map(|k| k as f32).collect() }
    }

    #[test]
    fn stored_corners_go_where_exif_says() {
        // Where EXIF says that row 0 and column 0 of the stored picture are: their meeting point is
        // pixel 0.
        let corners = [
            (1, "top", "left"),
            (2, "top", "right"),
            (3, "bottom", "right"),
            (4, "bottom", "left"),
            (5, "left", "top"),
            (6, "right", "top"),
            (7, "right", "bottom"),
            (8, "left", "bottom"),
        ];
        for (orientation, row, column) in corners {
            let upright = numbered(3, 2).upright(orientation);
            assert_eq!((upright.nx, upright.ny), if orientation < 5 { (3, 2) } else { (2, 3) });
            let sides = [row, column];
            let x = if sides.contains(&"left") { 0 } else { upright.nx - 1 };
            let y = if sides.contains(&"top") { 0 } else { upright.ny - 1 };
            assert_eq!(upright.values[y * upright.nx + x], 0.0, "orientation {orientation}");
            // The second pixel of row 0 is next to it along that row.
            let (x, y) = match row {
                "top" | "bottom" => (if x == 0 { 1 } else { x - 1 }, y),
                _ => (x, if y == 0 { 1 } else { y - 1 }),
            };
            assert_eq!(upright.values[y * upright.nx + x], 1.0, "orientation {orientation}");
        }
    }

    #[test]
    fn reduction_takes_means_also_of_the_last_blocks() {
        let reduced = numbered(5, 3).reduced(2);
        assert_eq!((reduced.nx, reduced.ny), (3, 2));
        assert_eq!(reduced.values, [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
    }

    #[test]
    fn resampling_keeps_the_mean_and_the_place_of_light() {
        let image = Image::new(5, 3, (0..15).map(|k| f64::from(k * k)).collect());
        for (nx, ny) in [(2, 2), (4, 3), (5, 1), (7, 9)] {
            let other = resampled(&image, nx, ny);
            assert!((other.mean() - image.mean()).abs() < 1e-12 * image.mean());
        }
        let halves = resampled(&Image::new(3, 1, vec![1.0, 2.0, 4.0]), 2, 1);
        assert!((halves.values[0] - 4.0 / 3.0).abs() < 1e-15 && (halves.values[1] - 10.0 / 3.0).abs() < 1e-15);
    }
}
