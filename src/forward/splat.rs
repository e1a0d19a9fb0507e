use glam::DVec2;

/// A corner of a beam: where it lands, in cells of the receiver, and the flux density it carries
/// per area of the mesh.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: DVec2,
    pub(super) flux: f64,
}

/// Part of the receiver on which a band of beams lands.
///
/// Every beam is split into two triangles, over which its flux is spread evenly. Coverage of the
/// cells is exact: each edge adds the area between itself and the right border of the film,
/// weighted by the difference of the densities on its two sides, and a running sum over the row
/// completes it. Neighbouring triangles share their edge, so that a mesh leaves no gap and counts
/// nothing twice, however it is sheared; a folded triangle has negative density and negative area.
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
    /// Flux in folded triangles.
    pub(super) folded: f64,
    /// The beams of the band that have such triangles, numbered row by row.
    pub(super) folds: Vec<u32>,
}

/// Triangles of less area than this share of their longest edge's square, or of a cell, are put on
/// one cell: the density of such a sliver is so large that rounding at its edges would be seen.
const LEAST_AREA: f64 = 1e-7;
/// Triangles of more cells than this are none, whatever their edges.
const AMPLE_AREA: f64 = 1e-4;

impl Film {
    /// Splats the beams between consecutive rows of `width` corners that are `whole(column, row)`,
    /// and triangles `pieces` of others, with the number of the beam, whose flux is scaled by their
    /// area over half of a beam's.
    pub(super) fn of_band(
        corners: &[Corner],
        width: usize,
        (columns, rows): (usize, usize),
        whole: impl Fn(usize, usize) -> bool,
        pieces: &[(u32, [Corner; 3])],
    ) -> Self {
        let (low, high) = corners
            .iter()
            .chain(pieces.iter().flat_map(|(_, corners)| corners))
            .filter(|c| c.at.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c.at.y), hi.max(c.at.y)));
        let clamp = |y: f64| y.clamp(0.0, rows as f64) as usize;
        let (first_row, end_row) = if low > high { (0, 0) } else { (clamp(low), clamp(high.floor() + 1.0).min(rows)) };
        let mut film = Self {
            columns,
            first_row,
            // One more column for what lies to the right of the film.
            flux: vec![0.0; (columns + 1) * end_row.saturating_sub(first_row)],
            landed: 0.0,
            outside: 0.0,
            reflected: 0.0,
            folded: 0.0,
            folds: Vec::new(),
        };
        let mut total = 0.0;
        let mut below = vec![0.0; width - 1];
        let empty = corners.len() / width - 1;
        for (j, row) in corners.chunks_exact(width).enumerate() {
            let next = (j < empty).then(|| &corners[(j + 1) * width..][..width]);
            // The density left of the edge between two quads.
            let mut before = 0.0;
            for i in 0..width - 1 {
                let (a, b) = (row[i], row[i + 1]);
                let (lower, upper) = match next {
                    Some(next) if whole(i, j) => {
                        let (c, d) = (next[i + 1], next[i]);
                        let beam = (j * (width - 1) + i) as u32;
                        let lower = film.density([a, b, c], beam, &mut total);
                        let upper = film.density([a, c, d], beam, &mut total);
                        // Diagonal: the upper triangle lies on its left.
                        film.edge(a.at, c.at, upper - lower);
                        film.edge(a.at, d.at, before - upper);
                        (lower, upper)
                    }
                    Some(next) => {
                        film.edge(a.at, next[i].at, before);
                        (0.0, 0.0)
                    }
                    None => (0.0, 0.0),
                };
                film.edge(a.at, b.at, lower - below[i]);
                // The triangle below the next row's edge, and the one left of the next quad.
                (below[i], before) = (upper, lower);
            }
            if let Some(next) = next {
                film.edge(row[width - 1].at, next[width - 1].at, before);
            }
        }
        for &(beam, [a, b, c]) in pieces {
            let density = film.density([a, b, c], beam, &mut total);
            film.edge(a.at, b.at, density);
            film.edge(b.at, c.at, density);
            film.edge(c.at, a.at, density);
        }
        for row in film.flux.chunks_mut(columns + 1) {
            let mut sum = 0.0;
            for value in row.iter_mut() {
                sum += *value;
                // Where nothing lands, rounding can leave a trace of either sign.
                *value = sum.max(0.0);
            }
            film.landed += row[..columns].iter().sum::<f64>();
        }
        film.outside = total - film.landed - film.reflected;
        film
    }

    /// Adds this film to a complete one.
    pub(super) fn add_to(&self, sum: &mut [f64]) {
        let rows = sum[self.first_row * self.columns..].chunks_mut(self.columns);
        for (total, value) in rows.zip(self.flux.chunks(self.columns + 1)) {
            total.iter_mut().zip(value).for_each(|(total, value)| *total += value);
        }
    }

    /// Flux per area of half a beam, negative if it is folded; 0 if it is reflected or was put on a
    /// single cell.
    #[inline(always)]
    fn density(&mut self, [a, b, c]: [Corner; 3], beam: u32, total: &mut f64) -> f64 {
        let flux = (a.flux + b.flux + c.flux) / 6.0;
        *total += flux;
        let area = 0.5 * (b.at - a.at).perp_dot(c.at - a.at);
        let longest =
            || (b.at - a.at).length_squared().max((c.at - a.at).length_squared()).max((c.at - b.at).length_squared());
        if area.abs() > AMPLE_AREA || area.abs() > LEAST_AREA * longest().max(1.0) {
            if area < 0.0 {
                self.folded += flux;
                self.folds.push(beam);
            }
            return flux / area;
        }
        let centre = (a.at + b.at + c.at) / 3.0;
        if !centre.is_finite() {
            self.reflected += flux;
            return 0.0;
        }
        let (column, row) = (centre.x.floor(), centre.y.floor() - self.first_row as f64);
        let width = self.columns + 1;
        if column >= 0.0 && column < self.columns as f64 && row >= 0.0 && row < (self.flux.len() / width) as f64 {
            let k = row as usize * width + column as usize;
            self.flux[k] += flux;
            self.flux[k + 1] -= flux;
        }
        0.0
    }

    /// An edge that leaves the film: its part beside the film counts as running along the `border`.
    #[cold]
    #[inline(never)]
    fn bent(&mut self, low: DVec2, high: DVec2, border: f64, weight: f64) {
        let share = (border - low.x) / (high.x - low.x);
        let bend = DVec2::new(border, low.y + share * (high.y - low.y));
        self.edge(low, bend, -weight);
        self.edge(bend, high, -weight);
    }

    /// Adds `weight` times the area to the right of the edge, counted negative where it runs along
    /// +y: `weight` is the density on its left less that on its right.
    #[inline(always)]
    fn edge(&mut self, from: DVec2, to: DVec2, weight: f64) {
        // Triangles with a corner that is not finite have no density: no edge with a weight has
        // such an end.
        if weight == 0.0 || from.y == to.y {
            return;
        }
        let (low, high, weight) = if from.y < to.y { (from, to, -weight) } else { (to, from, weight) };
        let (width, first) = (self.columns + 1, self.first_row as f64);
        let rows = self.flux.len() / width;
        let most = self.columns as f64;
        let (left, right) = (low.x.min(high.x), low.x.max(high.x));
        let (row, column) = ((low.y - first) as usize, left as usize);
        if left >= 0.0
            && right < (column + 1) as f64
            && column < self.columns
            && low.y >= first
            && high.y - first <= (row + 1) as f64
            && row < rows
        {
            // Most edges lie in one cell.
            let (share, part) = (weight * (high.y - low.y), 0.5 * (left + right) - column as f64);
            let cells = &mut self.flux[row * width + column..][..2];
            cells[0] += share * (1.0 - part);
            cells[1] += share * part;
            return;
        }
        if (left < 0.0 && right > 0.0) || (left < most && right > most) {
            self.bent(low, high, if left < 0.0 { 0.0 } else { most }, weight);
            return;
        }
        let slant = (high.x - low.x) / (high.y - low.y);
        let begin = (low.y - first).max(0.0);
        let end = (high.y - first).min(rows as f64);
        let mut y = begin;
        let mut row = begin as usize;
        let at = |y: f64| low.x + slant * (y + first - low.y);
        while y < end {
            let next = end.min((row + 1) as f64);
            let share = weight * (next - y);
            // Left of the film everything to the right counts, right of it nothing.
            let (x0, x1) = (at(y).clamp(0.0, most), at(next).clamp(0.0, most));
            let (x0, x1) = if x0 < x1 { (x0, x1) } else { (x1, x0) };
            let (column, last) = (x0 as usize, x1 as usize);
            let cells = &mut self.flux[row * width..][..width];
            if last <= column {
                let part = 0.5 * (x0 + x1) - column as f64;
                cells[column] += share * (1.0 - part);
                if column + 1 < width {
                    cells[column + 1] += share * part;
                }
            } else {
                // The share of the edge left of x grows linearly between x0 and x1; its integral is
                // what a cell gets.
                let scale = 0.5 / (x1 - x0);
                let covered = |x: f64| {
                    let inside = x.min(x1) - x0;
                    inside * inside * scale + (x - x1).max(0.0)
                };
                let (mut before, mut step) = (0.0, 0.0);
                for (cell, k) in cells[column..].iter_mut().take(last - column + 2).zip(column + 1..) {
                    let sum = covered(k as f64);
                    let now = sum - before;
                    *cell += share * (now - step);
                    (before, step) = (sum, now);
                }
            }
            y = next;
            row += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dense_beam_across_the_border_of_the_film_leaves_its_share_on_it() {
        // Thin, long and leaning: 0.01 cells wide, half of it beside the film.
        for (left, sign) in [(0.0, 1.0), (7.0, -1.0)] {
            let at = |x: f64, y: f64| Corner { at: DVec2::new(left + sign * x, y), flux: 1.0 };
            let corners = [at(-0.805, 1.3), at(-0.795, 1.3), at(0.795, 1.7), at(0.805, 1.7)];
            let film = Film::of_band(&corners, 2, (7, 5), |_, _| true, &[]);
            assert!((film.landed - 0.5).abs() < 1e-9, "{}", film.landed);
            assert!((film.outside - 0.5).abs() < 1e-9, "{}", film.outside);
        }
    }
}
