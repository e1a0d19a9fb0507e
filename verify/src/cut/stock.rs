//! What moves meet on their way: the stock as it stands when they come.

use super::{
    sheet::{Plan, Sheet, SheetError},
    stroke::Strokes,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// What a stroke is to the stock. What it takes away is told of either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// It cuts.
    Cuts,
    /// It should take nothing away, as a rapid: what it would take stays.
    Rapid,
}

/// What a move takes away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Removal {
    /// Place of the move among all that were told.
    pub order: u64,
    /// How deep it goes into the stock, mm.
    pub depth_mm: f64,
    /// Where, mm: the place of the stock's surface.
    pub at: DVec3,
}

/// The stock, on a grid that is coarse beside the cutters: fine enough for what is a collision.
#[derive(Clone, Debug)]
pub struct Stock {
    plan: Plan,
    heights: Vec<f64>,
}

/// Nodes along a side of a tile.
const TILE: usize = 32;
/// Strokes after which the highest place of a tile is looked up again.
const AGAIN: usize = 64;

impl Stock {
    /// Stock that nothing has touched, level at a height, mm.
    ///
    /// # Errors
    /// Those of [`Sheet::level`].
    pub fn level(plan: Plan, top_mm: f64) -> Result<Self, SheetError> {
        let sheet = Sheet::level(plan, top_mm)?.into_cut();
        Ok(Self { plan, heights: sheet.heights })
    }

    /// Heights that are left at the nodes, mm.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// The grid.
    pub fn plan(&self) -> Plan {
        self.plan
    }

    /// Takes strokes in their order, `passes` telling what each is, and returns what they take away,
    /// in order: of every move that goes deeper than `least_mm`.
    pub fn pass(&mut self, strokes: &Strokes, passes: &[Passes], least_mm: f64) -> Vec<Removal> {
        let (nx, ny) = self.plan.nodes;
        let plan = self.plan;
        let reaching: Vec<Vec<u32>> = {
            let mut rows = vec![Vec::new(); ny.div_ceil(TILE)];
            let step = (plan.upper.y - plan.lower.y) / (ny - 1) as f64 * TILE as f64;
            for k in 0..strokes.len() {
                let (low, high) = strokes.bounds(k);
                let reach = strokes.reach(k);
                let row = |y: f64| ((y - plan.lower.y) / step).floor().clamp(-1.0, rows.len() as f64);
                let (first, last) = (row(low.y - reach), row(high.y + reach));
                for row in first.max(0.0) as usize..((last + 1.0).max(0.0) as usize).min(rows.len()) {
                    rows[row].push(k as u32);
                }
            }
            rows
        };
        let bands = self.heights.par_chunks_mut(nx * TILE).zip(reaching).enumerate();
        let found: Vec<Vec<Removal>> = bands
            .map(|(row, (heights, listed))| {
                let mut found = Vec::new();
                for first in (0..nx).step_by(TILE) {
                    let columns = (first, (first + TILE).min(nx));
                    tile(&plan, (row * TILE, heights), columns, (strokes, &listed, passes), least_mm, &mut found);
                }
                found
            })
            .collect();
        let mut all: Vec<Removal> = found.into_iter().flatten().collect();
        // The deepest of every move; of equally deep ones the first in space.
        all.sort_by(|a, b| a.order.cmp(&b.order).then(b.depth_mm.total_cmp(&a.depth_mm)));
        all.dedup_by_key(|removal| removal.order);
        all
    }
}

fn tile(
    plan: &Plan,
    (first_row, heights): (usize, &mut [f64]),
    columns: (usize, usize),
    (strokes, listed, passes): (&Strokes, &[u32], &[Passes]),
    least_mm: f64,
    found: &mut Vec<Removal>,
) {
    let nx = plan.nodes.0;
    let rows = heights.len() / nx;
    let (low, high) = (plan.node(columns.0, first_row), plan.node(columns.1 - 1, first_row + rows - 1));
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let highest = |heights: &[f64]| {
        let nodes = (0..rows).flat_map(|j| &heights[j * nx + columns.0..j * nx + columns.1]);
        nodes.fold(f64::NEG_INFINITY, |highest, &height| highest.max(height))
    };
    let mut top = highest(heights);
    for (count, &k) in listed.iter().enumerate() {
        if count % AGAIN == AGAIN - 1 {
            top = highest(heights);
        }
        let stroke = k as usize;
        if !strokes.reaches(stroke, (low, high), top) || strokes.at_least(stroke, middle, radius) >= top {
            continue;
        }
        let mut worst: Option<(f64, DVec2, f64)> = None;
        for j in 0..rows {
            for i in columns.0..columns.1 {
                let at = plan.node(i, first_row + j);
                let height = &mut heights[j * nx + i];
                let left = strokes.touch(stroke, at).height;
                let depth = *height - left;
                if depth <= 0.0 {
                    continue;
                }
                if worst.is_none_or(|(most, ..)| depth > most) {
                    worst = Some((depth, at, *height));
                }
                if passes[stroke] == Passes::Cuts {
                    *height = left;
                }
            }
        }
        if let Some((depth_mm, at, height)) = worst
            && depth_mm > least_mm
        {
            found.push(Removal { order: strokes.list[stroke].order, depth_mm, at: at.extend(height) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{Move, ProgramFault, Run, Tool, run};

    struct Into(Strokes, Vec<Passes>, Vec<u64>);

    impl Run for Into {
        fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
            self.0.add(made, 0);
            let kind = if made.feeds() { Passes::Cuts } else { Passes::Rapid };
            self.1.resize(self.0.len(), kind);
            self.2.push(made.line);
            Ok(())
        }
    }

    #[test]
    fn a_rapid_meets_what_stands_when_it_comes_and_nothing_that_was_cut_before() {
        let program = "G21 G0 X-10 Y0 Z5\nG0 Z-1\nG1 X10 F100\nG0 X-10\nG0 Y5\nG0 Z5\nX0\nG1 Z-3\nG0 Z2\n";
        let mut into = Into(Strokes::of(&[Tool::ball(1.0)]), Vec::new(), Vec::new());
        run(program.as_bytes(), None, &mut into).unwrap();
        let plan = Plan { lower: DVec2::new(-8.0, -8.0), upper: DVec2::new(8.0, 8.0), nodes: (81, 81) };
        let mut stock = Stock::level(plan, 0.0).unwrap();
        let found = stock.pass(&into.0, &into.1, 0.01);
        let said: Vec<(u64, f64)> =
            found.iter().map(|r| (into.2[r.order as usize], (1e6 * r.depth_mm).round() / 1e6)).collect();
        // The cut, the plunge. The way back is free, and the way aside lies beside the stock.
        assert_eq!(said, [(3, 1.0), (8, 3.0)]);
        assert!(found[1].at.truncate().distance(DVec2::new(0.0, 5.0)) < 1e-9);
        // Into the stock without a cut before.
        let mut into = Into(Strokes::of(&[Tool::ball(1.0)]), Vec::new(), Vec::new());
        run(b"G21 G0 X-10 Y3 Z-0.5\nX10\n".as_slice(), None, &mut into).unwrap();
        let found = stock.pass(&into.0, &into.1, 0.01);
        assert_eq!((found.len(), into.2[found[0].order as usize]), (1, 2));
        assert!((found[0].depth_mm - 0.5).abs() < 1e-12);
    }
}
