use super::Corner;
use glam::DVec2;

/// Part of the receiver on which a band of beams lands.
pub(super) struct Film {
    columns: usize,
    first_row: usize,
    flux: Vec<f64>,
    /// Flux on this film.
    pub(super) landed: f64,
    /// Flux beside the window.
    pub(super) outside: f64,
    /// Flux that never left the block.
    pub(super) reflected: f64,
}

impl Film {
    /// Splats the beams between consecutive rows of `width` corners.
    pub(super) fn of_band(corners: &[Corner], width: usize, (columns, rows): (usize, usize)) -> Self {
        // The box of a beam lies within the bounds of its corners.
        let (low, high) = corners
            .iter()
            .filter(|c| c.at.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c.at.y), hi.max(c.at.y)));
        let clamp = |y: f64| y.clamp(0.0, rows as f64) as usize;
        let (first_row, end_row) = if low > high { (0, 0) } else { (clamp(low), clamp(high.floor() + 1.0)) };
        let mut film = Self {
            columns,
            first_row,
            flux: vec![0.0; columns * end_row.saturating_sub(first_row)],
            landed: 0.0,
            outside: 0.0,
            reflected: 0.0,
        };
        for (row, next) in corners.chunks_exact(width).zip(corners.chunks_exact(width).skip(1)) {
            for (here, there) in row.windows(2).zip(next.windows(2)) {
                film.splat([here[0], here[1], there[1], there[0]]);
            }
        }
        film
    }

    /// Adds this film to a complete one.
    pub(super) fn add_to(&self, sum: &mut [f64]) {
        let begin = self.first_row * self.columns;
        for (total, value) in sum[begin..begin + self.flux.len()].iter_mut().zip(&self.flux) {
            *total += value;
        }
    }

    /// Spreads a beam evenly over the box with its centre and the extents of its mean edges.
    ///
    /// Beams are small against a cell, so that the difference between the box and the quadrilateral averages out; the split of
    /// the box between cells is exact.
    fn splat(&mut self, corners: [Corner; 4]) {
        let [a, b, c, d] = corners.map(|corner| corner.at);
        let flux = 0.25 * corners.iter().map(|corner| corner.flux).sum::<f64>();
        let centre = 0.25 * (a + b + c + d);
        if !centre.is_finite() {
            self.reflected += flux;
            return;
        }
        let half = (0.25 * ((b + c - a - d).abs() + (c + d - a - b).abs())).max(DVec2::splat(1e-9));
        let (low, high) = (centre - half, centre + half);
        let end_row = self.first_row + self.flux.len() / self.columns;
        let range = |low: f64, high: f64, least: usize, end: usize| {
            let begin = (low.max(least as f64) as usize).min(end);
            (begin, (high.clamp(0.0, end as f64).ceil() as usize).max(begin))
        };
        let (i0, i1) = range(low.x, high.x, 0, self.columns);
        let (j0, j1) = range(low.y, high.y, self.first_row, end_row);
        let density = flux / (4.0 * half.x * half.y);
        let mut landed = 0.0;
        for j in j0..j1 {
            let dy = high.y.min((j + 1) as f64) - low.y.max(j as f64);
            let row = &mut self.flux[(j - self.first_row) * self.columns..][..self.columns];
            for (i, cell) in row.iter_mut().enumerate().take(i1).skip(i0) {
                let dx = high.x.min((i + 1) as f64) - low.x.max(i as f64);
                let part = (density * dx.max(0.0) * dy.max(0.0)).max(0.0);
                *cell += part;
                landed += part;
            }
        }
        self.landed += landed;
        self.outside += flux - landed;
    }
}
