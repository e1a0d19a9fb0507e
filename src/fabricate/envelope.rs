//! What a cutter leaves that has been moved along all rows: the lower envelope of its sweeps.

use super::{CutterShape, PassError, Rows, rows::Pass};
use crate::{
    grid::Field,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use rayon::prelude::*;

/// Nodes of a milled face from one row to the next. Their slopes are linear in between, and they
/// throw light as far as the scallops do but for a fifteenth at most. Not a whole number but the
/// worst approximable one, so that in no region of the face all scallops are caught in the same
/// phase: that would draw bands that are not there.
pub const SAMPLES_PER_ROW: f64 = 7.618_034;

/// Steps of Newton's iteration along a row, with bisection where that does not converge.
const STEPS: usize = 40;
/// Positions of a row whose least tip is known, and rows whose least is.
const STRETCH: usize = 16;
const BAND: usize = 16;
/// As near to a position as this, in parts of the spacing, is there but for rounding.
const AT_POSITION: f64 = 1e-9;

/// A milled face: heights, and the slopes that belong to them, which jump where two rows meet.
#[derive(Clone, Debug)]
pub struct Milled {
    /// Heights on nodes fine enough for the scallops.
    pub surface: HeightField,
    /// Slopes at the same nodes, mm per mm: those of the cutter where it was last. No spline
    /// through the heights has them.
    pub slopes: Field<DVec2>,
}

impl Milled {
    /// The face that a pass leaves. One that is not rectangular is cut into a larger
    /// [`sheet`](HeightField::sheet), on which the cutter goes straight on across the outline.
    ///
    /// # Errors
    /// Whatever [`Rows::along`] and [`Rows::milled`] refuse.
    pub fn of(surface: &HeightField, pass: Pass) -> Result<Self, PassError> {
        if surface.contour().is_rectangle() {
            return Rows::along(surface, pass)?.milled();
        }
        let sheet = surface.sheet();
        let (mut heights, mut slopes) = Rows::along(&sheet, pass)?.cut()?;
        let (extent, contour, (nx, ny)) = (surface.extent(), surface.contour(), (heights.nx(), heights.ny()));
        let nodes = heights.as_mut_slice().par_iter_mut().zip(slopes.as_mut_slice()).enumerate();
        // Towards the corners of the sheet the face may fall off more steeply than a cutter comes
        // down to it; they are cut away.
        nodes.filter(|(_, (z, _))| !z.is_finite()).for_each(|(k, (z, slope))| {
            if !contour.contains(extent.node(k % nx, k / nx, nx, ny)) {
                (*z, *slope) = (f64::NAN, DVec2::ZERO);
            }
        });
        Ok(Self { surface: surface.with_heights(heights), slopes })
    }
}

impl Rows<'_> {
    /// The face that the pass leaves, on nodes fine enough for its scallops.
    ///
    /// # Errors
    /// [`PassError::TooFine`] where these would be too many.
    pub fn milled(&self) -> Result<Milled, PassError> {
        let (heights, slopes) = self.cut()?;
        Ok(Milled { surface: self.surface.with_heights(heights), slopes })
    }

    /// Heights and slopes of that face.
    fn cut(&self) -> Result<(Field<f64>, Field<DVec2>), PassError> {
        let (nx, ny) = self.nodes();
        if nx.saturating_mul(ny) > Pass::MOST_NODES {
            return Err(PassError::TooFine { step_over_mm: self.pass.step_over_mm, nx, ny });
        }
        Ok(self.left(nx, ny))
    }

    /// Nodes that resolve the scallops, and twice as many as the design has, between which slopes
    /// are nearly linear.
    fn nodes(&self) -> (usize, usize) {
        let along = |size: f64, across: f64, nodes: usize| {
            let cells = size * SAMPLES_PER_ROW * across.abs() / self.pass.step_over_mm;
            (2 * nodes - 1).max(1 + (cells - 1e-9).ceil().clamp(0.0, 1e9) as usize)
        };
        let (extent, heights) = (self.surface.extent(), self.surface.heights_mm());
        (along(extent.width_mm, self.across.x, heights.nx()), along(extent.height_mm, self.across.y, heights.ny()))
    }

    /// Heights that the pass leaves at `nx` by `ny` nodes, mm, on the zero of the design, and
    /// slopes.
    ///
    /// At every node the least of `tip + profile` over all rows and all positions in them. For a
    /// ball that is a convex problem as far as the face bulges less than the ball, solved from row
    /// to row and by Newton's iteration along them; for other cutters all positions within reach
    /// are searched, with bounds over stretches of the rows, and the best is improved between
    /// positions.
    pub fn left(&self, nx: usize, ny: usize) -> (Field<f64>, Field<DVec2>) {
        let extent = self.surface.extent();
        let spline = SurfaceSpline::through(self.surface);
        let lattice = spline.lattice(nx, ny);
        let least = self.least_tips();
        let sweep = Sweep { rows: self, bands: self.least_of_bands(&least), least };
        // Cutters with their axes further inside touch the face and no edge of the block.
        let steepest = spline.node_slopes().as_slice().iter().map(|slope| slope.length()).fold(0.0, f64::max);
        let margin = 2.0 * self.pass.cutter.contact_mm(steepest) + self.pass.step_over_mm;
        let (mut heights, mut slopes) = (vec![0.0; nx * ny], vec![DVec2::ZERO; nx * ny]);
        let lines = heights.par_chunks_mut(nx).zip(slopes.par_chunks_mut(nx)).enumerate();
        lines.for_each_init(Vec::new, |scratch, (j, (heights, slopes))| {
            lattice.row(j, scratch, |i, height, slope| {
                let at = extent.node(i, j, nx, ny);
                // The axis of a cutter that touches the design here.
                let axis = at - self.pass.cutter.contact_mm(slope.length()) * slope.normalize_or_zero();
                let turned = |p: DVec2| DVec2::new(p.dot(self.along), p.dot(self.across));
                let inside = (at.abs() + extent.lower()).max_element() < -margin;
                let cut = sweep.cut(turned(at), turned(axis), height + self.pass.allowance_mm, inside);
                let rise = sweep.slope(turned(at), &cut);
                heights[i] = cut.height;
                slopes[i] = rise.x * self.along + rise.y * self.across;
            });
        });
        (Field::from_vec(nx, ny, heights), Field::from_vec(nx, ny, slopes))
    }

    /// The least tip on every stretch of every band of rows.
    fn least_of_bands(&self, least: &[f64]) -> Vec<f64> {
        let stretches = self.positions.div_ceil(STRETCH);
        least
            .chunks(BAND * stretches)
            .flat_map(|band| {
                (0..stretches)
                    .map(|stretch| band[stretch..].iter().step_by(stretches).copied().fold(f64::INFINITY, f64::min))
            })
            .collect()
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

    /// The way of the tip at a place in a row: cubic between positions. `None` beside the block.
    #[inline]
    pub(super) fn tip(&self, row: usize, u: f64) -> Option<Tip> {
        let position = (u - self.first.x) / self.spacing_mm;
        let i = (position.max(0.0) as usize).min(self.positions - 2);
        let (t, h) = (position - i as f64, self.spacing_mm);
        let begin = row * self.positions + i;
        let ([a, p], [b, q]) = (self.tips[begin], self.tips[begin + 1]);
        // The way ends at positions, which are part of it.
        match (a.is_finite(), b.is_finite()) {
            (true, true) => {}
            (true, false) if t < AT_POSITION => return Some(Tip { height: a, slope: p, bend: 0.0 }),
            (false, true) if t > 1.0 - AT_POSITION => return Some(Tip { height: b, slope: q, bend: 0.0 }),
            _ => return None,
        }
        let (p, q) = (p * h, q * h);
        let (c, d) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        let height = a + t * (p + t * (c + t * d));
        // Where the contact jumps the way has a kink, which a cubic would cut below its tangents.
        if q > p {
            let (mut above, mut slope) =
                if a + p * t > b - q * (1.0 - t) { (a + p * t, p / h) } else { (b - q * (1.0 - t), q / h) };
            let kinks = &self.kinks[row];
            if let (false, Ok(k)) = (kinks.is_empty(), kinks.binary_search_by_key(&i, |kink| kink.position)) {
                let [z, rise] = kinks[k].tip;
                let held_up = z + rise * h * (t - kinks[k].at);
                if held_up > above {
                    (above, slope) = (held_up, rise);
                }
            }
            if above > height {
                return Some(Tip { height: above, slope, bend: 0.0 });
            }
        }
        Some(Tip { height, slope: (p + t * (2.0 * c + 3.0 * d * t)) / h, bend: (2.0 * c + 6.0 * d * t) / (h * h) })
    }
}

struct Sweep<'a> {
    rows: &'a Rows<'a>,
    least: Vec<f64>,
    bands: Vec<f64>,
}

/// Tip height, slope and second derivative along a row.
pub(super) struct Tip {
    pub(super) height: f64,
    pub(super) slope: f64,
    pub(super) bend: f64,
}

/// What is left at a place: by the cutter in which row, and where in it.
#[derive(Clone, Copy)]
struct Cut {
    height: f64,
    row: usize,
    u: f64,
}

impl Sweep<'_> {
    /// What is left at `at` (along and across the rows, mm), by cutters whose axes are likely near
    /// `axis`. No cutter leaves less than `floor`, mm. `inside` says that all cutters that reach
    /// here have their axes over the block.
    fn cut(&self, at: DVec2, axis: DVec2, floor: f64, inside: bool) -> Cut {
        let rows = self.rows;
        let position = (axis.y - rows.first.y) / rows.pass.step_over_mm;
        let row = (position.round().max(0.0) as usize).min(rows.count - 1);
        let cutter = &rows.pass.cutter;
        let ball = cutter.disc_mm() == 0.0;
        let start = if ball { self.downhill(at, row, axis.x) } else { self.try_at(at, row, axis.x) };
        // The way of the tip falls off beside the block: no longer a convex problem. But where no
        // more than a scallop is left, or two on a bulge, the cutter that touches the design has
        // been found.
        let scallops = 0.25 * rows.pass.step_over_mm * rows.pass.step_over_mm / cutter.radius_mm();
        if ball && (inside || start.height - floor < scallops) {
            return start;
        }
        let found = self.search(at, start);
        let better = if ball { self.downhill(at, found.row, found.u) } else { found };
        if better.height < found.height { better } else { found }
    }

    /// What the cutter leaves at `at` with its axis at a place in a row.
    #[inline]
    fn try_at(&self, at: DVec2, row: usize, u: f64) -> Cut {
        let aside = self.aside(at, row);
        let profile = self.rows.pass.cutter.profile_mm(DVec2::new(u - at.x, aside).length());
        let tip = if profile.is_finite() { self.rows.tip(row, u) } else { None };
        Cut { height: tip.map_or(f64::INFINITY, |tip| tip.height + profile), row, u }
    }

    /// How far a row runs from `at`, mm.
    #[inline]
    fn aside(&self, at: DVec2, row: usize) -> f64 {
        self.rows.first.y + row as f64 * self.rows.pass.step_over_mm - at.y
    }

    /// The slope at `at` of the cutter that was there last; 0 on the steps of a flat one.
    fn slope(&self, at: DVec2, cut: &Cut) -> DVec2 {
        let rows = self.rows;
        let from_axis = at - DVec2::new(cut.u, rows.first.y + cut.row as f64 * rows.pass.step_over_mm);
        if rows.pass.cutter.corner_mm() == 0.0 {
            return DVec2::ZERO;
        }
        rows.pass.cutter.profile_slope(from_axis.length()) * from_axis.normalize_or_zero()
    }

    /// The least that a ball leaves at `at`, from row to row as long as it becomes less.
    fn downhill(&self, at: DVec2, row: usize, u: f64) -> Cut {
        let rows = self.rows;
        let start = self.along_row(row, at, u);
        let mut best = start;
        for forwards in [true, false] {
            let mut from = start;
            loop {
                let next = if forwards { from.row + 1 } else { from.row.wrapping_sub(1) };
                if next >= rows.count {
                    break;
                }
                from = self.along_row(next, at, from.u);
                if from.height >= best.height {
                    break;
                }
                best = from;
            }
        }
        best
    }

    /// The least height at `at` that a ball in a row leaves, and where its axis is then.
    fn along_row(&self, row: usize, at: DVec2, guess: f64) -> Cut {
        let rows = self.rows;
        let radius = rows.pass.cutter.radius_mm();
        let aside = self.aside(at, row);
        let square = radius * radius - aside * aside;
        if square <= 0.0 {
            return Cut { height: f64::INFINITY, row, u: guess };
        }
        let reach = 0.999_999 * square.sqrt();
        let (mut low, mut high) = (at.x - reach, at.x + reach);
        let mut u = guess.clamp(low, high);
        let mut best = Cut { height: f64::INFINITY, row, u };
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let Some(tip) = self.rows.tip(row, u) else { break };
            let from = u - at.x;
            let depth = (square - from * from).sqrt();
            let height = tip.height + radius - depth;
            if height < best.height {
                best = Cut { height, row, u };
            }
            let profile_bend = (1.0 + from * from / (depth * depth)) / depth;
            let bend = profile_bend + tip.bend;
            let rise = tip.slope + from / depth;
            if rise > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let newton = u - rise / if bend > 0.1 * profile_bend { bend } else { profile_bend };
            // At a kink of the way Newton's iteration leaps to and fro.
            let leaps = newton <= low || newton >= high || (newton - u).abs() > 0.5 * last;
            let next = if leaps && rise != 0.0 { 0.5 * (low + high) } else { newton };
            last = (next - u).abs();
            u = next;
            // The height's error is quadratic in that of the place.
            if last < 1e-5 {
                break;
            }
        }
        best
    }

    /// The least that any cutter leaves at `at`: all positions within its reach. `best` is what is
    /// known so far.
    fn search(&self, at: DVec2, mut best: Cut) -> Cut {
        let (rows, cutter) = (self.rows, &self.rows.pass.cutter);
        let (radius, step_over) = (cutter.radius_mm(), rows.pass.step_over_mm);
        // What positions can miss between each other: the profile's bend of a ball, which goes
        // downhill after this, else its steepest slope.
        let slack = match cutter.shape() {
            CutterShape::Ball => 4.0 * rows.spacing_mm * rows.spacing_mm / cutter.corner_mm(),
            CutterShape::Bull | CutterShape::Flat => 3.0 * rows.spacing_mm,
        };
        let nearest = |v: f64| (v.max(0.0) as usize).min(rows.count - 1);
        let row_of = |v: f64| (v - rows.first.y) / step_over;
        let (begin, end) = (nearest(row_of(at.y - radius).ceil()), nearest(row_of(at.y + radius).floor()));
        let stretches = rows.positions.div_ceil(STRETCH);
        let stretch_mm = STRETCH as f64 * rows.spacing_mm;
        let stretch_of = |u: f64| (((u - rows.first.x) / stretch_mm).max(0.0) as usize).min(stretches - 1);
        let all = (stretch_of(at.x - radius), stretch_of(at.x + radius));
        let apart_of = |stretch: usize| {
            let low = rows.first.x + stretch as f64 * stretch_mm;
            (low - at.x).max(at.x - low - stretch_mm).max(0.0)
        };
        for band in begin / BAND..=end / BAND {
            let first = self.aside(at, band * BAND);
            let aside = first.max(-first - (BAND - 1) as f64 * step_over).max(0.0);
            let hopeful = |stretch: &usize| {
                let profile = cutter.profile_mm(DVec2::new(apart_of(*stretch), aside).length().min(radius));
                self.bands[band * stretches + stretch] + profile < best.height + slack
            };
            let Some(low) = (all.0..=all.1).find(hopeful) else { continue };
            let high = (all.0..=all.1).rfind(hopeful).unwrap_or(low);
            for row in begin.max(band * BAND)..=end.min(band * BAND + BAND - 1) {
                let found = self.search_row(at, row, (low, high), best.height + slack);
                if found.height < best.height + slack {
                    let found = self.improve(at, found);
                    if found.height < best.height {
                        best = found;
                    }
                }
            }
        }
        best
    }

    /// The best of the positions of a row on some of its stretches that may be below `limit`, and
    /// of the ends of its reach, which are positions too: a rim cuts with them.
    fn search_row(&self, at: DVec2, row: usize, (low, high): (usize, usize), limit: f64) -> Cut {
        let (rows, cutter) = (self.rows, &self.rows.pass.cutter);
        let (radius, aside) = (cutter.radius_mm(), self.aside(at, row));
        let reach = (radius * radius - aside * aside).max(0.0).sqrt() * (1.0 - 1e-12);
        let position = |u: f64| ((u - rows.first.x) / rows.spacing_mm).clamp(0.0, (rows.positions - 1) as f64);
        let (begin, end) = (position(at.x - reach), position(at.x + reach));
        let stretches = rows.positions.div_ceil(STRETCH);
        let mut best = Cut { height: f64::INFINITY, row, u: at.x };
        for stretch in low.max(begin as usize / STRETCH)..=high.min(end as usize / STRETCH) {
            let left = rows.first.x + (stretch * STRETCH) as f64 * rows.spacing_mm;
            let right = left + STRETCH as f64 * rows.spacing_mm;
            let apart = (left - at.x).max(at.x - right).max(0.0);
            let bound = self.least[row * stretches + stretch]
                + cutter.profile_mm(DVec2::new(apart, aside).length().min(radius));
            if bound >= limit {
                continue;
            }
            let inside = (stretch * STRETCH).max(begin.ceil() as usize)..=((stretch + 1) * STRETCH).min(end as usize);
            let places = inside.map(|i| rows.first.x + i as f64 * rows.spacing_mm);
            let ends = [at.x - reach, at.x + reach];
            for u in places.chain(ends.into_iter().filter(|u| (left..=right).contains(u))) {
                let cut = self.try_at(at, row, u);
                if cut.height < best.height {
                    best = cut;
                }
            }
        }
        best
    }

    /// Looks between positions.
    fn improve(&self, at: DVec2, mut best: Cut) -> Cut {
        let mut step = 0.5 * self.rows.spacing_mm;
        let last = 1e-3 * step;
        while step > last {
            let sides = [best.u - step, best.u + step].map(|u| self.try_at(at, best.row, u));
            let better = sides[usize::from(sides[1].height < sides[0].height)];
            if better.height < best.height {
                best = better;
            } else {
                step *= 0.5;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests;
