//! Irradiance on the receiver: collected in exact integer arithmetic, shown as a picture.

mod brush;

pub(crate) use brush::Brush;

use crate::{scene::Window, trace::End};
use glam::DVec2;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// One ray's power in fixed point. Integers add up to the same sum in any order, so results do not depend on the number
/// of threads, and power is neither lost nor gained by rounding.
pub(crate) const UNIT: u64 = 1 << 32;

/// Irradiance in picture order: row 0 is the top of the picture (greatest y), column 0 its left (greatest x).
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Row-major values.
    pub values: Vec<f64>,
}

impl Image {
    /// Takes over `nx * ny` values, row by row.
    ///
    /// # Panics
    /// If there is another number of values.
    pub fn new(nx: usize, ny: usize, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), nx * ny, "an image of {nx} x {ny} values");
        Self { nx, ny, values }
    }

    /// Mean of all values.
    pub fn mean(&self) -> f64 {
        // Row by row, so that rounding does not grow with the size of the image.
        self.values.chunks(self.nx.max(1)).map(|row| row.iter().sum::<f64>()).sum::<f64>() / self.values.len() as f64
    }
}

/// Where the light of the aperture goes, as parts of it; they sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flux {
    /// Arrives in the window.
    pub window: f64,
    /// Reaches the receiver outside of the window.
    pub missed: f64,
    /// Is totally reflected inside.
    pub totally_reflected: f64,
    /// Meets a side wall before the exit face or behind it, or the solid again, or never reaches the receiver.
    pub side: f64,
    /// Is partially reflected on the way.
    pub reflected: f64,
    /// Passes beside the solid.
    pub beside: f64,
    /// Was lost by the tracer: 0, or the solid is not sound.
    pub lost: f64,
}

impl Flux {
    /// The sum of all parts: 1.
    pub fn total(&self) -> f64 {
        self.window + self.missed + self.totally_reflected + self.side + self.reflected + self.beside + self.lost
    }
}

/// Collects power by fate and by pixel. Shared between threads.
pub(crate) struct Film {
    nx: usize,
    ny: usize,
    /// Greatest corner of the window, mm: the top left of the picture.
    origin: DVec2,
    per_mm: DVec2,
    pixels: Vec<AtomicU64>,
}

/// Power by fate, in [`UNIT`]s; kept by each thread and added up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) window: u128,
    pub(crate) missed: u128,
    pub(crate) totally_reflected: u128,
    pub(crate) side: u128,
    pub(crate) reflected: u128,
    pub(crate) beside: u128,
    pub(crate) lost: u128,
}

impl Tally {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            window: self.window + other.window,
            missed: self.missed + other.missed,
            totally_reflected: self.totally_reflected + other.totally_reflected,
            side: self.side + other.side,
            reflected: self.reflected + other.reflected,
            beside: self.beside + other.beside,
            lost: self.lost + other.lost,
        }
    }

    /// All power that was sent out.
    pub(crate) fn total(&self) -> u128 {
        self.window + self.missed + self.totally_reflected + self.side + self.reflected + self.beside + self.lost
    }

    /// As parts of all power.
    pub(crate) fn flux(&self) -> Flux {
        let total = self.total().max(1) as f64;
        let part = |units: u128| units as f64 / total;
        Flux {
            window: part(self.window),
            missed: part(self.missed),
            totally_reflected: part(self.totally_reflected),
            side: part(self.side),
            reflected: part(self.reflected),
            beside: part(self.beside),
            lost: part(self.lost),
        }
    }
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
    fn add(&self, pixel: usize, units: u64) {
        self.pixels[pixel].fetch_add(units, Relaxed);
    }

    /// Books the power of a ray where it ends.
    #[inline]
    pub(crate) fn record(&self, end: End, units: u64, tally: &mut Tally) {
        let account = match end {
            End::Receiver(at) => {
                let p = self.in_pixels(at);
                // A comparison that is false for NaN, so that no nonsense is booked as light.
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
    fn pixel(&self, column: usize, row: usize) -> usize {
        row * self.nx + column
    }

    /// The collected power of every pixel in [`UNIT`]s, in picture order; the film is empty afterwards.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = u64> + '_ {
        self.pixels.iter_mut().map(|p| std::mem::take(p.get_mut()))
    }

    /// The picture of light of this power: 1 is the irradiance of all of it spread evenly over the window.
    pub(crate) fn develop(mut self, total: u128) -> Image {
        let (nx, ny) = (self.nx, self.ny);
        let scale = (nx * ny) as f64 / total.max(1) as f64;
        Image::new(nx, ny, self.take().map(|units| units as f64 * scale).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(nx: usize, ny: usize) -> Window {
        Window { size_mm: DVec2::new(nx as f64, ny as f64), centre_mm: DVec2::ZERO, nx, ny }
    }

    #[test]
    fn the_left_of_the_picture_is_at_plus_x_and_its_top_at_plus_y() {
        let film = Film::new(&window(4, 2));
        let mut tally = Tally::default();
        film.record(End::Receiver(DVec2::new(1.9, 0.9)), UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(-1.9, 0.9)), 2 * UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(1.9, -0.9)), 3 * UNIT, &mut tally);
        film.record(End::Receiver(DVec2::new(2.1, 0.0)), UNIT, &mut tally);
        let image = film.develop(UNIT.into());
        assert_eq!(image.values.iter().map(|v| v / 8.0).collect::<Vec<_>>(), [1.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!((tally.window, tally.missed), (6 * u128::from(UNIT), u128::from(UNIT)));
    }

    #[test]
    fn a_beam_is_shared_by_area_and_what_passes_the_border_is_counted() {
        let film = Film::new(&window(4, 4));
        let mut tally = Tally::default();
        // 1 x 1 box, centred on the corner of four pixels; then one with three quarters outside of the window.
        let square = |x: f64, y: f64| {
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(u, v)| DVec2::new(x + u, y + v))
        };
        for (x, y) in [(0.0, 0.0), (2.0, 2.0)] {
            Brush::on(&film).quadrilateral(square(x, y).map(|p| film.in_pixels(p)), UNIT, &mut tally);
        }
        let image = film.develop(16 * u128::from(UNIT));
        for k in [5, 6, 9, 10] {
            assert!((image.values[k] - 0.25).abs() < 1e-9);
        }
        assert!((image.values[0] - 0.25).abs() < 1e-9);
        assert!((tally.flux().missed - 0.375).abs() < 1e-9 && (tally.flux().total() - 1.0).abs() < 1e-15);
    }
}
