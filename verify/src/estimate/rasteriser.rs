//! Beams spread over pixels: every pixel gets the part of a beam's polygon that it covers.

use super::{film::Film, flux::PowerTally};
use glam::DVec2;

/// Polygons of a smaller area, in pixels, are treated as points.
const LEAST_AREA: f64 = 1e-12;

/// Signed area of the part of a polygon to the left of and above `corner` (x and y less than its
/// own): by Green's theorem the integral of min(x, corner.x) dy over the edges, as far as y <
/// corner.y. Coordinates are taken relative to `origin`, near the polygon, so that no digits are
/// lost.
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

/// Signed area of the part of a polygon with x less than 0: the integral of min(x, 0) dy over its
/// edges.
#[inline(always)]
fn part_beside<const N: usize>(x: [f64; N], y: [f64; N]) -> f64 {
    let (mut sum, mut k) = (0.0, N - 1);
    for next in 0..N {
        let (least, greatest) = if x[k] <= x[next] { (x[k], x[next]) } else { (x[next], x[k]) };
        if least < 0.0 {
            // An edge that crosses has x less than 0 on its part -least / (greatest - least), where
            // its mean is half of the least.
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

/// Spreads beams over a film. Neighbours land in the same pixel, and what they bring is recorded
/// there at once.
pub(crate) struct Rasteriser<'a> {
    film: &'a Film,
    limit: DVec2,
    pixel: usize,
    units: u64,
}

impl<'a> Rasteriser<'a> {
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

    /// Spreads the power of a beam evenly over the quadrilateral between its landing points, in
    /// pixels from the top left of the picture and in their order round the beam; every pixel gets
    /// the part that it covers.
    #[inline(always)]
    pub(crate) fn quadrilateral(&mut self, corners: [DVec2; 4], units: u64, tally: &mut PowerTally) {
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
    pub(crate) fn triangle(&mut self, corners: [DVec2; 3], units: u64, tally: &mut PowerTally) {
        if !self.dot(&corners, units, tally) {
            self.spread(&corners, units, tally);
        }
    }

    /// Records power that lands within one pixel of the window; tells whether it does.
    #[inline(always)]
    fn dot<const N: usize>(&mut self, corners: &[DVec2; N], units: u64, tally: &mut PowerTally) -> bool {
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
    fn spread<const N: usize>(&mut self, polygon: &[DVec2; N], units: u64, tally: &mut PowerTally) {
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
                let recorded = self.scan(polygon, scale, units);
                // What rounding left.
                self.add(pixel, units - recorded);
            }
        }
    }

    /// The same where a part of the polygon may be outside of the window, or nowhere.
    #[cold]
    fn spread_anywhere(&mut self, polygon: &[DVec2], units: u64, tally: &mut PowerTally) {
        let (lo, hi) = bounds(polygon);
        if !polygon.iter().all(|p| p.is_finite()) {
            tally.lost += u128::from(units);
            return;
        }
        let area = part_below(polygon, lo, hi);
        let recorded = if area.abs() >= LEAST_AREA {
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
        let rest = if self.is_within(lo, hi) { units - recorded } else { 0 };
        if rest > 0 {
            self.add(self.film.pixel(lo.x as usize, lo.y as usize), rest);
        }
        tally.window += u128::from(recorded + rest);
        tally.missed += u128::from(units - recorded - rest);
    }

    /// Gives every pixel of the window its part of the polygon, with `scale` units per area;
    /// returns how many units that are.
    fn scan(&mut self, polygon: &[DVec2], scale: f64, units: u64) -> u64 {
        let (lo, hi) = bounds(polygon);
        let (first, last) = (lo.floor().max(DVec2::ZERO), hi.floor().min(self.limit - 1.0));
        let mut recorded = 0;
        let mut row = first.y;
        while row <= last.y {
            let mut below = [row, row + 1.0].map(|y| part_below(polygon, lo, DVec2::new(first.x, y)));
            let mut column = first.x;
            while column <= last.x {
                let next = [row, row + 1.0].map(|y| part_below(polygon, lo, DVec2::new(column + 1.0, y)));
                let covered = (next[1] - below[1]) - (next[0] - below[0]);
                let share = ((scale * covered).max(0.0) as u64).min(units - recorded);
                self.add(self.film.pixel(column as usize, row as usize), share);
                recorded += share;
                below = next;
                column += 1.0;
            }
            row += 1.0;
        }
        recorded
    }
}

impl Drop for Rasteriser<'_> {
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
    use crate::{estimate::flux::UNIT, scene::Window};

    /// What every pixel gets of a beam, as parts of it.
    fn shares(spread: impl Fn(&mut Rasteriser, &mut PowerTally)) -> Vec<f64> {
        let window = Window { size_mm: DVec2::splat(6.0), centre_mm: DVec2::ZERO, nx: 6, ny: 6 };
        let (mut film, mut tally) = (Film::new(&window), PowerTally::default());
        spread(&mut Rasteriser::on(&film), &mut tally);
        let units: Vec<u64> = film.take().collect();
        assert_eq!(u128::from(units.iter().sum::<u64>()), tally.window);
        assert_eq!(tally.total(), u128::from(UNIT), "nothing is lost or gained");
        units.iter().map(|&units| units as f64 / UNIT as f64).collect()
    }

    #[test]
    fn few_pixels_get_what_the_scan_of_all_would_give_them() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        for k in 0..4000 {
            let (size, centre) = (0.05 + 1.5 * random(), DVec2::new(2.0 + 2.0 * random(), 2.0 + 2.0 * random()));
            // Going round, clockwise or not.
            let sense = if k % 2 == 0 { 1.0 } else { -1.0 };
            let corners: [DVec2; 4] = std::array::from_fn(|c| {
                let angle = sense * std::f64::consts::FRAC_PI_2 * (c as f64 + 0.8 * random());
                centre + 0.5 * size * DVec2::from_angle(angle)
            });
            let triangle = [corners[0], corners[1], corners[2]];
            let quick = [
                shares(|rasteriser, tally| rasteriser.spread(&corners, UNIT, tally)),
                shares(|rasteriser, tally| rasteriser.spread(&triangle, UNIT, tally)),
            ];
            let slow = [
                shares(|rasteriser, tally| rasteriser.spread_anywhere(&corners, UNIT, tally)),
                shares(|rasteriser, tally| rasteriser.spread_anywhere(&triangle, UNIT, tally)),
            ];
            for (quick, slow) in quick.iter().zip(&slow) {
                let off = quick.iter().zip(slow).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 2e-9, "{off} for {corners:?}");
            }
        }
    }

    #[test]
    fn a_triangle_is_shared_by_area() {
        let at = |x: f64, y: f64| DVec2::new(x, y);
        // A right angle at (2.5, 2.5) with sides of 1: half of it is a square, and a quarter is at
        // either end.
        let seen =
            shares(|rasteriser, tally| rasteriser.triangle([at(2.5, 2.5), at(3.5, 2.5), at(2.5, 3.5)], UNIT, tally));
        for (pixel, wanted) in [(14, 0.5), (15, 0.25), (20, 0.25), (21, 0.0)] {
            assert!((seen[pixel] - wanted).abs() < 1e-9, "{pixel}: {}", seen[pixel]);
        }
    }

    #[test]
    fn light_outside_of_the_window_is_counted_and_light_from_nowhere_is_lost() {
        let window = Window { size_mm: DVec2::splat(4.0), centre_mm: DVec2::ZERO, nx: 4, ny: 4 };
        let (film, mut tally) = (Film::new(&window), PowerTally::default());
        let at = |x: f64, y: f64| DVec2::new(x, y);
        Rasteriser::on(&film).triangle([at(-1.0, 0.0), at(1.0, 0.0), at(0.0, 2.0)], 1000, &mut tally);
        assert!(tally.window.abs_diff(500) <= 2 && tally.window + tally.missed == 1000, "{tally:?}");
        Rasteriser::on(&film).triangle([at(f64::NAN, 0.0), at(1.0, 0.0), at(0.0, 2.0)], 7, &mut tally);
        assert_eq!(tally.lost, 7);
    }

    #[test]
    fn a_beam_is_shared_by_area_and_what_passes_the_border_is_counted() {
        let window = Window { size_mm: DVec2::splat(4.0), centre_mm: DVec2::ZERO, nx: 4, ny: 4 };
        let film = Film::new(&window);
        let mut tally = PowerTally::default();
        // 1 x 1 box, centred on the corner of four pixels; then one with three quarters outside of
        // the window.
        let square = |x: f64, y: f64| {
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(u, v)| DVec2::new(x + u, y + v))
        };
        for (x, y) in [(0.0, 0.0), (2.0, 2.0)] {
            Rasteriser::on(&film).quadrilateral(square(x, y).map(|p| film.in_pixels(p)), UNIT, &mut tally);
        }
        let image = film.develop(16 * u128::from(UNIT));
        for k in [5, 6, 9, 10] {
            assert!((image.values[k] - 0.25).abs() < 1e-9);
        }
        assert!((image.values[0] - 0.25).abs() < 1e-9);
        assert!((tally.flux().missed - 0.375).abs() < 1e-9 && (tally.flux().total() - 1.0).abs() < 1e-15);
    }
}
