//! Irradiance on the receiver: collected in exact integer arithmetic, shown as a picture.

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

/// Polygons of a smaller area, in pixels, are treated as points.
const LEAST_AREA: f64 = 1e-12;

/// Signed area of the part of a polygon to the left of and above `corner` (x and y less than its own): by Green's theorem the
/// integral of min(x, corner.x) dy over the edges, as far as y < corner.y. Coordinates are taken relative to `origin`, near
/// the polygon, so that no digits are lost.
#[inline]
fn part_below(polygon: &[DVec2], origin: DVec2, corner: DVec2) -> f64 {
    let limit = corner - origin;
    if limit.x <= 0.0 || limit.y <= 0.0 {
        return 0.0;
    }
    let mut sum = 0.0;
    let mut a = polygon[polygon.len() - 1] - origin;
    for &vertex in polygon {
        let b = vertex - origin;
        sum += under_edge(a, b, limit);
        a = b;
    }
    sum
}

/// Signed area of the part of a polygon with x less than 0: the integral of min(x, 0) dy over its edges.
#[inline(always)]
fn part_beside<const N: usize>(x: [f64; N], y: [f64; N]) -> f64 {
    let (mut sum, mut k) = (0.0, N - 1);
    for next in 0..N {
        let (least, greatest) = if x[k] <= x[next] { (x[k], x[next]) } else { (x[next], x[k]) };
        if least < 0.0 {
            // An edge that crosses has x less than 0 on its part -least / (greatest - least), where its mean is half of the least.
            let mean =
                if greatest <= 0.0 { 0.5 * (least + greatest) } else { -0.5 * least * least / (greatest - least) };
            sum += mean * (y[next] - y[k]);
        }
        k = next;
    }
    sum
}

/// Signed area of a polygon.
#[inline(always)]
fn area_of<const N: usize>(polygon: &[DVec2; N]) -> f64 {
    let mut sum = 0.0;
    for k in 1..N - 1 {
        sum += (polygon[k] - polygon[0]).perp_dot(polygon[k + 1] - polygon[0]);
    }
    0.5 * sum
}

/// The contribution of the edge from `a` to `b`.
#[inline]
fn under_edge(mut a: DVec2, mut b: DVec2, limit: DVec2) -> f64 {
    let sign = if a.y <= b.y { 1.0 } else { -1.0 };
    if sign < 0.0 {
        std::mem::swap(&mut a, &mut b);
    }
    if a.y >= limit.y {
        return 0.0;
    }
    if b.y > limit.y {
        b = DVec2::new(a.x + (b.x - a.x) * (limit.y - a.y) / (b.y - a.y), limit.y);
    }
    let dy = sign * (b.y - a.y);
    let (least, greatest) = if a.x <= b.x { (a.x, b.x) } else { (b.x, a.x) };
    if greatest <= limit.x {
        0.5 * (least + greatest) * dy
    } else if least >= limit.x {
        limit.x * dy
    } else {
        let inside = limit.x - least;
        (limit.x - 0.5 * inside * inside / (greatest - least)) * dy
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

/// Spreads beams over a film. Neighbours land in the same pixel, and what they bring is booked there at once.
pub(crate) struct Brush<'a> {
    film: &'a Film,
    limit: DVec2,
    pixel: usize,
    units: u64,
}

impl<'a> Brush<'a> {
    pub(crate) fn on(film: &'a Film) -> Self {
        Self { film, limit: DVec2::new(film.nx as f64, film.ny as f64), pixel: 0, units: 0 }
    }

    #[inline(always)]
    fn add(&mut self, pixel: usize, units: u64) {
        if pixel != self.pixel {
            self.film.add(self.pixel, self.units);
            (self.pixel, self.units) = (pixel, 0);
        }
        self.units += units;
    }

    /// Spreads the power of a beam evenly over the quadrilateral between its landing points, in pixels from the top left of the picture
    /// and in their order round the beam; every pixel gets the part that it covers.
    #[inline(always)]
    pub(crate) fn quadrilateral(&mut self, corners: [DVec2; 4], units: u64, tally: &mut Tally) {
        if self.dot(&corners, units, tally) {
            return;
        }
        let [a, b, c, d] = corners;
        let turns =
            [(b - a).perp_dot(c - b), (c - b).perp_dot(d - c), (d - c).perp_dot(a - d), (a - d).perp_dot(b - a)];
        if turns.iter().all(|&t| t > 0.0) || turns.iter().all(|&t| t < 0.0) {
            self.spread(&corners, units, tally);
        } else {
            // Folded or bent inwards: each triangle of an even beam carries half of its power.
            self.spread(&[a, b, c], units / 2, tally);
            self.spread(&[a, c, d], units - units / 2, tally);
        }
    }

    /// The same for a beam of three landing points.
    #[inline(always)]
    pub(crate) fn triangle(&mut self, corners: [DVec2; 3], units: u64, tally: &mut Tally) {
        if !self.dot(&corners, units, tally) {
            self.spread(&corners, units, tally);
        }
    }

    /// Books power that lands within one pixel of the window; tells whether it does.
    #[inline(always)]
    fn dot<const N: usize>(&mut self, corners: &[DVec2; N], units: u64, tally: &mut Tally) -> bool {
        let (lo, hi) = bounds(corners);
        if !self.is_within(lo, hi) {
            return false;
        }
        // Truncation is much quicker than rounding down, and the same here.
        let (column, row) = (lo.x as u32, lo.y as u32);
        let within = (column, row) == (hi.x as u32, hi.y as u32);
        if within {
            self.add(self.film.pixel(column as usize, row as usize), units);
            tally.window += u128::from(units);
        }
        within
    }

    #[inline(always)]
    fn is_within(&self, lo: DVec2, hi: DVec2) -> bool {
        lo.cmpge(DVec2::ZERO).all() && hi.cmplt(self.limit).all()
    }

    /// Spreads power evenly over a polygon without self-intersections, in pixels.
    fn spread<const N: usize>(&mut self, polygon: &[DVec2; N], units: u64, tally: &mut Tally) {
        let (lo, hi) = bounds(polygon);
        let area = area_of(polygon);
        if !(self.is_within(lo, hi) && area.abs() >= LEAST_AREA) {
            return self.spread_anywhere(polygon, units, tally);
        }
        tally.window += u128::from(units);
        let (column, row) = (lo.x as u32, lo.y as u32);
        let size = (hi.x as u32 - column, hi.y as u32 - row);
        let corner = DVec2::new(f64::from(column + 1), f64::from(row + 1));
        let pixel = self.film.pixel(column as usize, row as usize);
        let scale = units as f64 / area;
        let share = |covered: f64, left: u64| ((scale * covered).max(0.0) as u64).min(left);
        let (x, y) = (polygon.map(|p| p.x - corner.x), polygon.map(|p| p.y - corner.y));
        match size {
            (0, 0) => self.add(pixel, units),
            (1, 0) => {
                let left = share(part_beside(x, y), units);
                self.add(pixel, left);
                self.add(pixel + 1, units - left);
            }
            (0, 1) => {
                let above = share(-part_beside(y, x), units);
                self.add(pixel, above);
                self.add(pixel + self.film.nx, units - above);
            }
            (1, 1) => {
                let both = part_below(polygon, lo, corner);
                let (left, above) = (part_beside(x, y), -part_beside(y, x));
                let first = share(both, units);
                let second = share(above - both, units - first);
                let third = share(left - both, units - first - second);
                self.add(pixel, first);
                self.add(pixel + 1, second);
                self.add(pixel + self.film.nx, third);
                self.add(pixel + self.film.nx + 1, units - first - second - third);
            }
            _ => {
                let booked = self.scan(polygon, scale, units);
                // What rounding left.
                self.add(pixel, units - booked);
            }
        }
    }

    /// The same where a part of the polygon may be outside of the window, or nowhere.
    #[cold]
    fn spread_anywhere(&mut self, polygon: &[DVec2], units: u64, tally: &mut Tally) {
        let (lo, hi) = bounds(polygon);
        if !polygon.iter().all(|p| p.is_finite()) {
            tally.lost += u128::from(units);
            return;
        }
        let area = part_below(polygon, lo, hi);
        let booked = if area.abs() >= LEAST_AREA {
            self.scan(polygon, units as f64 / area, units)
        } else {
            // Light on a line: as good as on its centre.
            let centre = 0.5 * (lo + hi);
            let arrives = self.is_within(centre, centre);
            if arrives {
                self.add(self.film.pixel(centre.x as usize, centre.y as usize), units);
            }
            if arrives { units } else { 0 }
        };
        // What rounding left of light that falls into the window is light in the window.
        let rest = if self.is_within(lo, hi) { units - booked } else { 0 };
        if rest > 0 {
            self.add(self.film.pixel(lo.x as usize, lo.y as usize), rest);
        }
        tally.window += u128::from(booked + rest);
        tally.missed += u128::from(units - booked - rest);
    }

    /// Gives every pixel of the window its part of the polygon, with `scale` units per area; returns how many units that are.
    fn scan(&mut self, polygon: &[DVec2], scale: f64, units: u64) -> u64 {
        let (lo, hi) = bounds(polygon);
        let (first, last) = (lo.floor().max(DVec2::ZERO), hi.floor().min(self.limit - 1.0));
        let mut booked = 0;
        let mut row = first.y;
        while row <= last.y {
            let mut below = [row, row + 1.0].map(|y| part_below(polygon, lo, DVec2::new(first.x, y)));
            let mut column = first.x;
            while column <= last.x {
                let next = [row, row + 1.0].map(|y| part_below(polygon, lo, DVec2::new(column + 1.0, y)));
                let covered = (next[1] - below[1]) - (next[0] - below[0]);
                let share = ((scale * covered).max(0.0) as u64).min(units - booked);
                self.add(self.film.pixel(column as usize, row as usize), share);
                booked += share;
                below = next;
                column += 1.0;
            }
            row += 1.0;
        }
        booked
    }
}

impl Drop for Brush<'_> {
    fn drop(&mut self) {
        self.film.add(self.pixel, self.units);
    }
}

/// Least and greatest corner of the box around points.
#[inline(always)]
fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    points[1..].iter().fold((points[0], points[0]), |(lo, hi), &p| (lo.min(p), hi.max(p)))
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
