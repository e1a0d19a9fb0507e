//! Irradiance on the receiver: collected in exact integer arithmetic, shown as a picture.

use super::flux::PowerTally;
use crate::{image::Image, scene::Window, trace::End};
use glam::DVec2;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Collects power by fate and by pixel. Shared between threads.
pub(crate) struct Film {
    pub(super) nx: usize,
    pub(super) ny: usize,
    /// Greatest corner of the window, mm: the top left of the picture.
    origin: DVec2,
    per_mm: DVec2,
    pixels: Vec<AtomicU64>,
}

impl Film {
    pub(crate) fn new(window: &Window) -> Self {
        let resolution = DVec2::new(window.nx as f64, window.ny as f64);
        Self {
            nx: window.nx,
            ny: window.ny,
            origin: window.centre_mm + 0.5 * window.size_mm,
            per_mm: resolution / window.size_mm,
            pixels: (0..window.nx * window.ny).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    /// A point of the receiver in pixels from the top left of the picture.
    #[inline]
    pub(crate) fn in_pixels(&self, at_mm: DVec2) -> DVec2 {
        (self.origin - at_mm) * self.per_mm
    }

    #[inline]
    pub(super) fn add(&self, pixel: usize, units: u64) {
        self.pixels[pixel].fetch_add(units, Relaxed);
    }

    /// Records the power of a ray where it ends.
    #[inline]
    pub(crate) fn record(&self, end: End, units: u64, tally: &mut PowerTally) {
        let account = match end {
            End::Receiver(at) => {
                let p = self.in_pixels(at);
                // A comparison that is false for NaN, so that no nonsense is recorded as light.
                if p.x >= 0.0 && p.y >= 0.0 && p.x < self.nx as f64 && p.y < self.ny as f64 {
                    self.add(self.pixel(p.x as usize, p.y as usize), units);
                    &mut tally.window
                } else if p.is_nan() {
                    &mut tally.lost
                } else {
                    &mut tally.missed
                }
            }
            End::TotallyReflected => &mut tally.totally_reflected,
            End::Side => &mut tally.side,
            End::Beside => &mut tally.beside,
            End::Lost => &mut tally.lost,
        };
        *account += u128::from(units);
    }

    /// The pixel of this column and row, on this film.
    #[inline]
    pub(super) fn pixel(&self, column: usize, row: usize) -> usize {
        row * self.nx + column
    }

    /// The collected power of every pixel in [`UNIT`]s, in picture order; the film is empty
    /// afterwards.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = u64> + '_ {
        self.pixels.iter_mut().map(|p| std::mem::take(p.get_mut()))
    }

    /// The picture of light of this power: 1 is the irradiance of all of it spread evenly over the
    /// window.
    pub(crate) fn develop(mut self, total: u128) -> Image {
        let (nx, ny) = (self.nx, self.ny);
        let scale = (nx * ny) as f64 / total.max(1) as f64;
        Image::new(nx, ny, self.take().map(|units| units as f64 * scale).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::flux::UNIT;

    fn window(nx: usize, ny: usize) -> Window {
        Window { size_mm: DVec2::new(nx as f64, ny as f64), centre_mm: DVec2::ZERO, nx, ny }
    }

    #[test]
    fn the_left_of_the_picture_is_at_plus_x_and_its_top_at_plus_y() {
        let film = Film::new(&window(4, 2));
        let mut tally = PowerTally::default();
        film.record(End::Receiver(DVec2::new(1.9, 0.9)), UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(-1.9, 0.9)), 2 * UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(1.9, -0.9)), 3 * UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(2.1, 0.0)), UNIT, &mut tally);
        let image = film.develop(UNIT.into());
        assert_eq!(image.values.iter().map(|v| v / 8.0).collect::<Vec<_>>(), [1.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!((tally.window, tally.missed), (6 * u128::from(UNIT), u128::from(UNIT)));
    }
}
