//! What a cutter leaves that has been moved along all rows: the lower envelope of its sweeps.

use super::{PassError, Rows, rows::Pass};
use crate::{
    grid::Field,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use rayon::prelude::*;

/// Nodes of a milled face from one row to the next: enough for the spline through them to have the slope of the scallops, cusps
/// included, in the right proportion.
pub const SAMPLES_PER_ROW: f64 = 6.0;

/// Steps of Newton's iteration along a row.
const STEPS: usize = 8;
/// Positions of a row whose least tip is known.
const STRETCH: usize = 16;

impl Rows<'_> {
    /// The face that the pass leaves, on nodes fine enough for its scallops.
    ///
    /// # Errors
    /// [`PassError::TooFine`] where these would be too many.
    pub fn milled(&self) -> Result<HeightField, PassError> {
        let (nx, ny) = self.nodes();
        if nx.saturating_mul(ny) > Pass::MOST_NODES {
            return Err(PassError::TooFine { step_over_mm: self.pass.step_over_mm, nx, ny });
        }
        Ok(HeightField::new(self.surface.extent(), self.heights_mm(nx, ny)))
    }

    /// Nodes that resolve the scallops, and never fewer than the design has.
    fn nodes(&self) -> (usize, usize) {
        let along = |size: f64, across: f64, nodes: usize| {
            let cells = size * SAMPLES_PER_ROW * across.abs() / self.pass.step_over_mm;
            nodes.max(1 + (cells - 1e-9).ceil().clamp(0.0, 1e9) as usize)
        };
        let (extent, heights) = (self.surface.extent(), self.surface.heights_mm());
        (along(extent.width_mm, self.across.x, heights.nx()), along(extent.height_mm, self.across.y, heights.ny()))
    }

    /// Heights that the pass leaves at `nx` by `ny` nodes, mm, on the zero of the design.
    ///
    /// At every node the least of `tip + profile` over all rows and all positions in them. For a ball that is a convex
    /// problem as far as the face bulges less than the ball, solved from row to row and by Newton's iteration along
    /// them; for other cutters all positions within reach are searched, with bounds over stretches of the rows, and the
    /// best is improved between positions.
    pub fn heights_mm(&self, nx: usize, ny: usize) -> Field<f64> {
        let extent = self.surface.extent();
        let spline = SurfaceSpline::through(self.surface);
        let lattice = spline.lattice(nx, ny);
        let sweep = Sweep { rows: self, least: self.least_tips() };
        let mut data = vec![0.0; nx * ny];
        data.par_chunks_mut(nx).enumerate().for_each_init(Vec::new, |scratch, (j, out)| {
            lattice.row(j, scratch, |i, _, slope| {
                let at = extent.node(i, j, nx, ny);
                // The axis of a cutter that touches the design here.
                let axis = at - self.pass.cutter.contact_mm(slope.length()) * slope.normalize_or_zero();
                let turned = |p: DVec2| DVec2::new(p.dot(self.along), p.dot(self.across));
                let inside = (at.abs() + extent.lower()).max_element() < -self.pass.cutter.radius_mm();
                out[i] = sweep.height(turned(at), turned(axis), inside);
            });
        });
        Field::from_vec(nx, ny, data)
    }

    /// The least tip on every stretch of every row, its neighbours included.
    fn least_tips(&self) -> Vec<f64> {
        self.tips
            .chunks(self.positions)
            .flat_map(|row| {
                (0..self.positions.div_ceil(STRETCH)).map(|stretch| {
                    let end = ((stretch + 1) * STRETCH + 1).min(self.positions);
                    row[stretch * STRETCH..end].iter().map(|tip| tip[0]).fold(f64::INFINITY, f64::min)
                })
            })
            .collect()
    }
}

struct Sweep<'a> {
    rows: &'a Rows<'a>,
    least: Vec<f64>,
}

/// Tip height, slope and second derivative along a row.
struct Tip {
    height: f64,
    slope: f64,
    bend: f64,
}

impl Sweep<'_> {
    /// What is left at `at` (along and across the rows, mm), by cutters whose axes are likely near `axis`. `inside`
    /// says that all cutters that reach here have their axes over the block.
    fn height(&self, at: DVec2, axis: DVec2, inside: bool) -> f64 {
        let rows = self.rows;
        let position = (axis.y - rows.first.y) / rows.pass.step_over_mm;
        let row = (position.round().max(0.0) as usize).min(rows.count - 1);
        let cutter = &rows.pass.cutter;
        let ball = cutter.disc_mm() == 0.0;
        if ball && inside {
            return self.downhill(at, row, axis.x);
        }
        // The way of the tip falls off beside the block: no longer a convex problem.
        let (height, row, u) = self.search(at, row, axis.x);
        if ball { height.min(self.downhill(at, row, u)) } else { height }
    }

    /// The least that a ball leaves at `at`, from row to row as long as it becomes less.
    fn downhill(&self, at: DVec2, row: usize, u: f64) -> f64 {
        let rows = self.rows;
        let (mut best, start) = self.along_row(row, at, u);
        for forwards in [true, false] {
            let (mut row, mut from) = (row, start);
            loop {
                let next = if forwards { row + 1 } else { row.wrapping_sub(1) };
                if next >= rows.count {
                    break;
                }
                let (height, u) = self.along_row(next, at, from);
                if height >= best {
                    break;
                }
                (best, row, from) = (height, next, u);
            }
        }
        best
    }

    /// The least height at `at` that a ball in a row leaves, and where its axis is then.
    fn along_row(&self, row: usize, at: DVec2, guess: f64) -> (f64, f64) {
        let rows = self.rows;
        let radius = rows.pass.cutter.radius_mm();
        let aside = rows.first.y + row as f64 * rows.pass.step_over_mm - at.y;
        let square = radius * radius - aside * aside;
        if square <= 0.0 {
            return (f64::INFINITY, guess);
        }
        let reach = 0.999_999 * square.sqrt();
        let (mut u, mut best) = (guess.clamp(at.x - reach, at.x + reach), (f64::INFINITY, guess));
        for _ in 0..STEPS {
            let Some(tip) = self.tip(row, u) else { break };
            let from = u - at.x;
            let depth = (square - from * from).sqrt();
            let height = tip.height + radius - depth;
            if height < best.0 {
                best = (height, u);
            }
            let profile_bend = (1.0 + from * from / (depth * depth)) / depth;
            let bend = profile_bend + tip.bend;
            let step = (tip.slope + from / depth) / if bend > 0.1 * profile_bend { bend } else { profile_bend };
            u = (u - step.clamp(-0.25 * radius, 0.25 * radius)).clamp(at.x - reach, at.x + reach);
            // The height's error is quadratic in that of the place.
            if step.abs() < 1e-5 {
                break;
            }
        }
        best
    }

    /// The way of the tip at a place in a row: cubic between positions. `None` beside the block.
    #[inline]
    fn tip(&self, row: usize, u: f64) -> Option<Tip> {
        let rows = self.rows;
        let position = (u - rows.first.x) / rows.spacing_mm;
        let i = (position.max(0.0) as usize).min(rows.positions - 2);
        let (t, h) = (position - i as f64, rows.spacing_mm);
        let begin = row * rows.positions + i;
        let ([a, p], [b, q]) = (rows.tips[begin], rows.tips[begin + 1]);
        if !(a.is_finite() && b.is_finite()) {
            return None;
        }
        let (p, q) = (p * h, q * h);
        let (c, d) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        Some(Tip {
            height: a + t * (p + t * (c + t * d)),
            slope: (p + t * (2.0 * c + 3.0 * d * t)) / h,
            bend: (2.0 * c + 6.0 * d * t) / (h * h),
        })
    }

    /// The least that any cutter leaves at `at`, in which row, and where its axis is then: all positions within reach.
    fn search(&self, at: DVec2, likely_row: usize, likely: f64) -> (f64, usize, f64) {
        let (rows, cutter) = (self.rows, &self.rows.pass.cutter);
        let radius = cutter.radius_mm();
        let left_at = |row: usize, u: f64| {
            let aside = rows.first.y + row as f64 * rows.pass.step_over_mm - at.y;
            let profile = cutter.profile_mm(DVec2::new(u - at.x, aside).length());
            if profile == f64::INFINITY {
                profile
            } else {
                self.tip(row, u).map_or(f64::INFINITY, |tip| tip.height + profile)
            }
        };
        let mut best = (left_at(likely_row, likely), likely_row, likely);
        let nearest = |v: f64| (v.max(0.0) as usize).min(rows.count - 1);
        let row_of = |v: f64| (v - rows.first.y) / rows.pass.step_over_mm;
        let stretches = rows.positions.div_ceil(STRETCH);
        for row in nearest(row_of(at.y - radius).ceil())..=nearest(row_of(at.y + radius).floor()) {
            let aside = rows.first.y + row as f64 * rows.pass.step_over_mm - at.y;
            let reach = (radius * radius - aside * aside).max(0.0).sqrt();
            let position = |u: f64| ((u - rows.first.x) / rows.spacing_mm).clamp(0.0, (rows.positions - 1) as f64);
            let (begin, end) = (position(at.x - reach), position(at.x + reach));
            for stretch in begin as usize / STRETCH..=end as usize / STRETCH {
                let low = rows.first.x + (stretch * STRETCH) as f64 * rows.spacing_mm;
                let high = low + STRETCH as f64 * rows.spacing_mm;
                let apart = (low - at.x).max(at.x - high).max(0.0);
                let least = self.least[row * stretches + stretch];
                if least + cutter.profile_mm(DVec2::new(apart, aside).length().min(radius)) >= best.0 {
                    continue;
                }
                let inside =
                    (stretch * STRETCH).max(begin.ceil() as usize)..=((stretch + 1) * STRETCH).min(end as usize);
                let places = inside.map(|i| rows.first.x + i as f64 * rows.spacing_mm);
                // The ends of the reach are positions too: a rim cuts with them.
                let ends = [at.x - reach * (1.0 - 1e-12), at.x + reach * (1.0 - 1e-12)];
                for u in places.chain(ends.into_iter().filter(|u| (low..=high).contains(u))) {
                    let height = left_at(row, u);
                    if height < best.0 {
                        best = (height, row, u);
                    }
                }
            }
        }
        let (mut height, row, mut u) = best;
        let mut step = 0.5 * rows.spacing_mm;
        while step > 1e-3 * rows.spacing_mm {
            let sides = [u - step, u + step].map(|u| (left_at(row, u), u));
            let better = sides[usize::from(sides[1].0 < sides[0].0)];
            if better.0 < height {
                (height, u) = better;
            } else {
                step *= 0.5;
            }
        }
        (height, row, u)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Cutter, Direction, Scallop};
    use super::*;
    use crate::grid::Extent;

    const BLOCK: Extent = Extent::new(12.0, 10.0);

    fn face(f: impl Fn(DVec2) -> f64) -> HeightField {
        HeightField::new(BLOCK, Field::from_fn(97, 81, |i, j| f(BLOCK.node(i, j, 97, 81))))
    }

    #[test]
    fn a_plane_gets_scallops_of_the_known_height() {
        let plane = face(|_| 0.0);
        for direction in [Direction::X, Direction::Y, Direction::at(33.0)] {
            let cutter = Cutter::ball(2.0).unwrap();
            let pass = Pass { direction, ..Pass::finishing(cutter, 0.3) };
            let rows = Rows::along(&plane, pass).unwrap();
            let (nx, ny) = (601, 501);
            let heights = rows.heights_mm(nx, ny);
            // Away from the border, where the rows end.
            for j in ny / 4..3 * ny / 4 {
                for i in nx / 4..3 * nx / 4 {
                    let place = (BLOCK.node(i, j, nx, ny).dot(rows.across) - rows.first.y) / 0.3;
                    let aside = 0.3 * (place - place.round());
                    let wanted = 2.0 - (4.0 - aside * aside).sqrt();
                    assert!((heights[(i, j)] - wanted).abs() < 1e-8, "{direction}: {} for {wanted}", heights[(i, j)]);
                }
            }
            assert!((Scallop::of(cutter, 0.3).unwrap().height_mm - (2.0 - (4.0_f64 - 0.0225).sqrt())).abs() < 1e-15);
        }
    }

    /// Rows so dense and so finely sampled that every place is tried.
    fn by_force(rows: &Rows<'_>, at: DVec2) -> f64 {
        let sweep = Sweep { rows, least: Vec::new() };
        let cutter = rows.pass.cutter;
        let (u, v) = (at.dot(rows.along), at.dot(rows.across));
        let mut least = f64::INFINITY;
        for row in 0..rows.count {
            let aside = rows.first.y + row as f64 * rows.pass.step_over_mm - v;
            for k in -4000..=4000 {
                let place = u + cutter.radius_mm() * f64::from(k) / 4000.0 * (1.0 - 1e-12);
                let profile = cutter.profile_mm(DVec2::new(place - u, aside).length());
                if let (true, Some(tip)) = (profile.is_finite(), sweep.tip(row, place)) {
                    least = least.min(tip.height + profile);
                }
            }
        }
        least
    }

    #[test]
    fn hills_creases_and_borders_agree_with_a_search_by_force() {
        let wavy = face(|p| 0.2 * (1.1 * p.x).sin() * (0.9 * p.y + 0.3).cos() + 0.01 * p.x * p.y);
        let crease = face(|p| 0.2 * (p.x * 0.8 + p.y * 0.6).abs() - 0.1 * (0.7 * p.y).cos());
        for surface in [&wavy, &crease] {
            for cutter in [Cutter::ball(1.5).unwrap(), Cutter::bull(1.5, 0.5).unwrap(), Cutter::flat(1.0).unwrap()] {
                let pass = Pass { direction: Direction::at(25.0), ..Pass::finishing(cutter, 0.2) };
                let rows = Rows::along(surface, pass).unwrap();
                let (nx, ny) = (13, 11);
                let heights = rows.heights_mm(nx, ny);
                for j in 0..ny {
                    for i in 0..nx {
                        let forced = by_force(&rows, BLOCK.node(i, j, nx, ny));
                        let off = heights[(i, j)] - forced;
                        assert!(off.abs() < 2e-5, "{cutter} at column {i}, row {j}: {off:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_is_gouged_and_an_allowance_stays() {
        let wavy = face(|p| 0.2 * (1.1 * p.x).sin() * (0.9 * p.y + 0.3).cos());
        for (cutter, allowance) in [
            (Cutter::ball(1.0).unwrap(), 0.0),
            (Cutter::ball(1.0).unwrap(), 0.15),
            (Cutter::bull(1.5, 0.4).unwrap(), 0.0),
        ] {
            let pass = Pass { allowance_mm: allowance, ..Pass::finishing(cutter, 0.05) };
            let left = Rows::along(&wavy, pass).unwrap().heights_mm(97, 81);
            let excess = |i: usize, j: usize| left[(i, j)] - wavy.heights_mm()[(i, j)];
            for j in 10..71 {
                for i in 10..87 {
                    assert!(excess(i, j) > allowance - 2e-6, "{cutter} {allowance}: {}", excess(i, j));
                    // Along the normal, so a little more along z; and the scallops.
                    assert!(allowance == 0.0 || excess(i, j) < 1.06 * allowance, "{}", excess(i, j));
                }
            }
        }
    }
}
