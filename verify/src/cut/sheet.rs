//! The surface that is left, on a grid.

use super::stroke::{Strokes, Touch};
use glam::DVec2;
use rayon::prelude::*;

/// A grid over a part of the work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Its corner of least x and y, mm.
    pub lower: DVec2,
    /// The opposite one, mm.
    pub upper: DVec2,
    /// Nodes along x and y, borders included.
    pub nodes: (usize, usize),
}

/// Why there is no sheet.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// A grid of too few nodes, or over nothing.
    #[error("a grid of {nx} x {ny} nodes from {lower} to {upper} mm holds no face")]
    Plan {
        /// Along x.
        nx: usize,
        /// Along y.
        ny: usize,
        /// Its least corner, mm.
        lower: DVec2,
        /// Its greatest corner, mm.
        upper: DVec2,
    },
    /// More than can be kept in memory.
    #[error("the cut face takes {nx} x {ny} nodes, more than {most}", most = Sheet::MOST_NODES)]
    TooFine {
        /// Along x.
        nx: usize,
        /// Along y.
        ny: usize,
    },
}

impl Plan {
    /// The place of a node, mm.
    #[inline]
    pub fn node(&self, i: usize, j: usize) -> DVec2 {
        let part = |k: usize, n: usize| k as f64 / (n - 1) as f64;
        let (x, y) = (part(i, self.nodes.0), part(j, self.nodes.1));
        // The ends are exact.
        DVec2::new(self.lower.x * (1.0 - x) + self.upper.x * x, self.lower.y * (1.0 - y) + self.upper.y * y)
    }

    fn spacing(&self) -> DVec2 {
        (self.upper - self.lower) / DVec2::new((self.nodes.0 - 1) as f64, (self.nodes.1 - 1) as f64)
    }
}

/// What is left: heights and slopes at the nodes of a plan.
///
/// Strokes are told in batches. A tile of the grid looks only at those that reach it; a part of a
/// tile only at those that can leave less there than the one that leaves least at its middle does
/// at its corners. What a straight stroke leaves is convex: its tangent plane at the middle is a
/// bound from below, and its greatest value stands at a corner.
#[derive(Clone, Debug)]
pub struct Sheet {
    plan: Plan,
    heights: Vec<f64>,
    slopes: Vec<DVec2>,
}

/// What is left in the end.
#[derive(Clone, Debug)]
pub struct Cut {
    /// The grid.
    pub plan: Plan,
    /// Heights at its nodes, mm, row by row along +y.
    pub heights: Vec<f64>,
    /// Slopes there, mm per mm: of the stroke that was there last.
    pub slopes: Vec<DVec2>,
}

/// Nodes along a side of the parts in which every stroke that is left is tried at every node.
const LEAF: usize = 8;
/// Most nodes along a side of a tile.
const TILE: usize = 512;

impl Sheet {
    /// Most nodes of a face: 24 bytes each.
    pub const MOST_NODES: usize = 1 << 27;

    /// Stock that nothing has touched: level at a height, mm.
    ///
    /// # Errors
    /// Fewer than 4 nodes along a side, a grid over nothing, more nodes than
    /// [`MOST_NODES`](Self::MOST_NODES).
    pub fn level(plan: Plan, top_mm: f64) -> Result<Self, SheetError> {
        let Plan { lower, upper, nodes: (nx, ny) } = plan;
        if nx.min(ny) < 4 || !(upper.cmpgt(lower).all() && (upper - lower).is_finite()) {
            return Err(SheetError::Plan { nx, ny, lower, upper });
        }
        match nx.checked_mul(ny) {
            Some(nodes) if nodes <= Self::MOST_NODES => {
                Ok(Self { plan, heights: vec![top_mm; nodes], slopes: vec![DVec2::ZERO; nodes] })
            }
            _ => Err(SheetError::TooFine { nx, ny }),
        }
    }

    /// The grid.
    pub fn plan(&self) -> Plan {
        self.plan
    }

    /// What is left in the end.
    pub fn into_cut(self) -> Cut {
        Cut { plan: self.plan, heights: self.heights, slopes: self.slopes }
    }

    /// Cuts with all strokes of a batch.
    pub fn cut(&mut self, strokes: &Strokes) {
        let (nx, ny) = self.plan.nodes;
        let spacing = self.plan.spacing();
        let widest = (0..strokes.len()).map(|k| strokes.reach(k)).fold(0.0, f64::max);
        let side = |step: f64, n: usize| {
            let nodes = (widest / step).ceil().clamp(LEAF as f64, TILE as f64) as usize;
            nodes.div_ceil(LEAF) * LEAF.min(n)
        };
        let (wide, high) = (side(spacing.x, nx), side(spacing.y, ny));
        let (columns, rows) = (nx.div_ceil(wide), ny.div_ceil(high));
        let bins = Bins::of(strokes, &self.plan, (wide, high), (columns, rows));
        let plan = self.plan;
        let bands = self.heights.par_chunks_mut(nx * high).zip(self.slopes.par_chunks_mut(nx * high)).enumerate();
        bands.for_each(|(row, (heights, slopes))| {
            let mut band = Band { strokes, plan, first: row * high, heights, slopes };
            let rows = band.heights.len() / nx;
            for column in 0..columns {
                let listed = bins.of_tile(row * columns + column);
                if listed.is_empty() {
                    continue;
                }
                let part = Part { i: (column * wide, ((column + 1) * wide).min(nx)), j: (0, rows) };
                band.descend(part, listed);
            }
        });
    }
}

/// For every tile the strokes that reach it, in order.
struct Bins {
    starts: Vec<usize>,
    list: Vec<u32>,
}

impl Bins {
    fn of(strokes: &Strokes, plan: &Plan, (wide, high): (usize, usize), (columns, rows): (usize, usize)) -> Self {
        let spacing = plan.spacing();
        let size = spacing * DVec2::new(wide as f64, high as f64);
        let tiles = |k: usize| {
            let (low, up) = strokes.bounds(k);
            let reach = strokes.reach(k);
            let first = ((low - reach - plan.lower) / size).floor();
            let last = ((up + reach - plan.lower) / size).floor();
            let within = |v: f64, n: usize| v.clamp(0.0, (n - 1) as f64) as usize;
            let outside = last.x < 0.0 || last.y < 0.0 || first.x >= columns as f64 || first.y >= rows as f64;
            let [a, b] =
                [(within(first.x, columns), within(last.x, columns)), (within(first.y, rows), within(last.y, rows))];
            (!outside).then_some((a, b))
        };
        let half = 0.5 * size.length();
        let is_near = |k: usize, column: usize, row: usize| {
            let middle = plan.lower + size * DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            strokes.at_least(k, middle, half).is_finite()
        };
        let mut starts = vec![0; columns * rows + 1];
        let each = |visit: &mut dyn FnMut(usize, usize)| {
            for k in 0..strokes.len() {
                let Some((a, b)) = tiles(k) else { continue };
                for row in b.0..=b.1 {
                    for column in a.0..=a.1 {
                        if (a.0 == a.1 && b.0 == b.1) || is_near(k, column, row) {
                            visit(k, row * columns + column);
                        }
                    }
                }
            }
        };
        each(&mut |_, tile| starts[tile + 1] += 1);
        (0..columns * rows).for_each(|tile| starts[tile + 1] += starts[tile]);
        let (mut next, mut list) = (starts.clone(), vec![0; starts[columns * rows]]);
        each(&mut |k, tile| {
            list[next[tile]] = k as u32;
            next[tile] += 1;
        });
        Self { starts, list }
    }

    fn of_tile(&self, tile: usize) -> &[u32] {
        &self.list[self.starts[tile]..self.starts[tile + 1]]
    }
}

/// Columns and rows of a band, from and to.
#[derive(Clone, Copy)]
struct Part {
    i: (usize, usize),
    j: (usize, usize),
}

/// Some rows of the sheet.
struct Band<'a> {
    strokes: &'a Strokes,
    plan: Plan,
    first: usize,
    heights: &'a mut [f64],
    slopes: &'a mut [DVec2],
}

impl Band<'_> {
    fn descend(&mut self, part: Part, listed: &[u32]) {
        let (wide, high) = (part.i.1 - part.i.0, part.j.1 - part.j.0);
        if wide <= LEAF && high <= LEAF {
            let kept = self.able(part, listed);
            return self.each_node(part, &kept);
        }
        let kept = self.able(part, listed);
        if kept.is_empty() {
            return;
        }
        // Halved along the side with more nodes, at a whole number of leaves.
        let cut = |(from, to): (usize, usize)| from + (to - from).div_ceil(2 * LEAF) * LEAF;
        let parts = if wide >= high {
            let middle = cut(part.i);
            [Part { i: (part.i.0, middle), ..part }, Part { i: (middle, part.i.1), ..part }]
        } else {
            let middle = cut(part.j);
            [Part { j: (part.j.0, middle), ..part }, Part { j: (middle, part.j.1), ..part }]
        };
        parts.into_iter().filter(|part| part.i.1 > part.i.0 && part.j.1 > part.j.0).for_each(|part| {
            self.descend(part, &kept);
        });
    }

    /// Those of the strokes that may leave less somewhere in a part than is there already, or than
    /// the best of them does.
    fn able(&self, part: Part, listed: &[u32]) -> Vec<u32> {
        let nx = self.plan.nodes.0;
        let (low, high) =
            (self.plan.node(part.i.0, self.first + part.j.0), self.plan.node(part.i.1 - 1, self.first + part.j.1 - 1));
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let radius = half.length();
        let highest = (part.j.0..part.j.1)
            .flat_map(|j| &self.heights[j * nx + part.i.0..j * nx + part.i.1])
            .fold(f64::NEG_INFINITY, |highest, &height| highest.max(height));
        let touches: Vec<Touch> = listed.iter().map(|&k| self.strokes.line(k as usize, middle)).collect();
        let best = (0..listed.len()).min_by(|&a, &b| touches[a].height.total_cmp(&touches[b].height));
        // Its height over the tangent plane of the best stroke, at most, in all of the part.
        let plane = best.map(|k| touches[k]).filter(|best| best.height.is_finite());
        let over = plane.map_or(f64::INFINITY, |plane| {
            let k = listed[best.unwrap_or(0)] as usize;
            let corner = |x: f64, y: f64| {
                let off = half * DVec2::new(x, y);
                // Of a piece of an arc only the cutter in one place is convex.
                let left = if self.strokes.list[k].off > 0.0 {
                    let tip = self.strokes.touch(k, middle).tip;
                    self.strokes.standing(k, tip, middle + off)
                } else {
                    self.strokes.line(k, middle + off).height
                };
                left - plane.height - plane.slope.dot(off)
            };
            corner(-1.0, -1.0).max(corner(1.0, -1.0)).max(corner(-1.0, 1.0)).max(corner(1.0, 1.0))
        });
        let plane = plane.unwrap_or(Touch { height: 0.0, slope: DVec2::ZERO, ..Touch::default() });
        let leans = plane.slope.abs().dot(half);
        let kept = |(&k, touch): (&u32, &Touch)| {
            let k = k as usize;
            let off = self.strokes.list[k].off;
            let (least, relative) = if touch.height.is_finite() {
                let lift = off * (1.0 + touch.slope.length_squared()).sqrt();
                let least = touch.height - touch.slope.abs().dot(half) - lift;
                let relative = touch.height - plane.height - (touch.slope - plane.slope).abs().dot(half) - lift;
                (least, relative)
            } else {
                let least = self.strokes.at_least(k, middle, radius);
                (least, least - plane.height - leans)
            };
            // Rounding must not decide: what is as good as equal stays.
            (least < highest && relative <= over + 1e-9).then_some(k as u32)
        };
        listed.iter().zip(&touches).filter_map(kept).collect()
    }

    fn each_node(&mut self, part: Part, listed: &[u32]) {
        let nx = self.plan.nodes.0;
        for j in part.j.0..part.j.1 {
            for i in part.i.0..part.i.1 {
                let at = self.plan.node(i, self.first + j);
                let node = j * nx + i;
                let (mut height, mut slope) = (self.heights[node], self.slopes[node]);
                for &k in listed {
                    let touch = self.strokes.touch(k as usize, at);
                    if touch.height < height {
                        (height, slope) = (touch.height, touch.slope);
                    }
                }
                (self.heights[node], self.slopes[node]) = (height, slope);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{Move, ProgramFault, Run, Tool, run};

    struct Into<'a>(&'a mut Strokes, usize);

    impl Run for Into<'_> {
        fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
            if made.feeds() {
                self.0.add(made, self.1);
            }
            Ok(())
        }
    }

    fn strokes(tool: &str, program: &str) -> Strokes {
        let mut strokes = Strokes::of(&[tool.parse::<Tool>().unwrap()]);
        run(program.as_bytes(), None, &mut Into(&mut strokes, 0)).unwrap();
        strokes
    }

    /// Rows to and fro over a wavy face, at an angle, with an arc among them.
    fn program(degrees: f64) -> String {
        use std::fmt::Write as _;
        let mut text = String::from("G21 G90 G17 F500\nG0 X-9 Y-9 Z5\nG1 Z0\n");
        let (sin, cos) = degrees.to_radians().sin_cos();
        for row in 0..30 {
            for k in 0..60 {
                let (u, v) = (0.3 * f64::from(if row % 2 == 0 { k } else { 59 - k }) - 9.0, 0.6 * f64::from(row) - 9.0);
                let z = 0.3 * (0.7 * u).sin() * (0.5 * v).cos() - 1.0;
                writeln!(text, "G1 X{:.5} Y{:.5} Z{z:.6}", u * cos - v * sin, u * sin + v * cos).unwrap();
            }
        }
        text + "G0 Z5\nX3 Y0\nG1 Z-1.2\nG3 X3 Y0 Z-1.2 I-3 J0\n"
    }

    #[test]
    fn the_sheet_is_the_least_of_all_strokes_at_every_node() {
        for tool in ["ball:d4mm", "bull:d4mm,r0.5mm", "flat:d2mm", "vee:120deg,d3mm", "taper:r0.5mm,20deg,d3mm"] {
            let strokes = strokes(tool, &program(27.0));
            let plan = Plan { lower: DVec2::new(-5.0, -4.0), upper: DVec2::new(6.0, 5.0), nodes: (131, 77) };
            let mut sheet = Sheet::level(plan, 0.0).unwrap();
            sheet.cut(&strokes);
            let cut = sheet.into_cut();
            for j in 0..77 {
                for i in 0..131 {
                    let at = plan.node(i, j);
                    let least = (0..strokes.len()).map(|k| strokes.touch(k, at).height).fold(0.0, f64::min);
                    let found = cut.heights[j * 131 + i];
                    assert!((found - least).abs() <= 1e-12, "{tool} at {at}: {found} for {least}");
                }
            }
        }
    }

    #[test]
    fn batches_and_threads_change_no_bit() {
        let all = strokes("ball:d4mm", &program(0.0));
        let plan = Plan { lower: DVec2::splat(-5.0), upper: DVec2::splat(5.0), nodes: (97, 101) };
        let cut = |batches: usize, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut sheet = Sheet::level(plan, 0.0).unwrap();
                for batch in all.list.chunks(all.list.len().div_ceil(batches)) {
                    let mut strokes = all.clone();
                    strokes.list = batch.to_vec();
                    sheet.cut(&strokes);
                }
                sheet.into_cut()
            })
        };
        let once = cut(1, 1);
        for (batches, threads) in [(1, 3), (7, 2), (500, 1)] {
            let again = cut(batches, threads);
            let bits = |cut: &Cut| cut.heights.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&once), bits(&again), "{batches} batches, {threads} threads");
            assert_eq!(once.slopes, again.slopes);
        }
    }
}
