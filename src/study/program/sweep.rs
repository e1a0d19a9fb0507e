//! Running a program over stock and face.

use super::{
    faults::{Gatherer, ProgramFaults},
    question::Setup,
};
use crate::{failure::Failure, study::workpiece::Workpiece};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    cut::{Cut, Passes, Plan, Sheet, Stock, Strokes},
    program::{Move, ProgramFault, Run, Survey, Tool, Units, Way, run},
};
use std::{collections::BTreeMap, f64::consts::PI, io::BufRead};

/// Nodes of the cut face from row to row: as many as of a milled one, and for the same reason
/// ([`SAMPLES_PER_ROW`](crate::fabricate::SAMPLES_PER_ROW)).
const PER_ROW: f64 = crate::fabricate::SAMPLES_PER_ROW;
/// Part of the length over the face whose directions decide how fine the grid is: links between
/// rows are the rest.
const DIRECTIONS: f64 = 0.98;
/// Rows nearer to each other than this, mm, are one row cut twice.
const LEAST_STEP_MM: f64 = 0.005;
/// Strokes of a batch.
const BATCH: usize = 1 << 18;
/// Nodes of the stock to the least cutter's radius, and limits of their spacing, mm.
const PER_RADIUS: f64 = 6.0;
const STOCK_SPACING_MM: (f64, f64) = (0.1, 1.0);
/// Most nodes of the stock along a side.
const MOST_STOCK: f64 = 2000.0;

/// The grid on which a program's face is found: fine enough for its scallops. Their distance is the
/// area of the face over the length that is cut there by the last tool.
pub(super) fn plan_of(survey: &Survey, piece: &Workpiece, zero: DVec3) -> Result<Plan, Failure> {
    let (size, nodes) = (piece.block.size_mm(), piece.block.nodes());
    let used = survey.finishing();
    let (mut nx, mut ny) = (2 * nodes.0 - 1, 2 * nodes.1 - 1);
    if let Some(used) = used {
        let step_over = (piece.surface.contour().area_mm2() / used.over_face_mm).max(LEAST_STEP_MM);
        // How much of a row's direction lies along an axis, which its scallops lie across.
        let along = |axis: fn(f64) -> f64| {
            let mut parts: Vec<(f64, f64)> = used
                .directions
                .iter()
                .enumerate()
                .map(|(k, length)| (axis((k as f64 + 0.5) * PI / 180.0).abs(), *length))
                .collect();
            parts.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (all, mut sum): (f64, f64) = (parts.iter().map(|(_, length)| length).sum(), 0.0);
            let found = parts.iter().find(|(_, length)| {
                sum += length;
                sum >= DIRECTIONS * all
            });
            found.map_or(1.0, |(part, _)| *part)
        };
        let fine = |size: f64, across: f64| 1 + (size * PER_ROW * across / step_over).ceil().clamp(0.0, 1e9) as usize;
        (nx, ny) = (nx.max(fine(size.x, along(f64::sin))), ny.max(fine(size.y, along(f64::cos))));
    }
    if nx.saturating_mul(ny) > Sheet::MOST_NODES {
        return Err(Failure::Usage(format!(
            "resolving what this program leaves takes {nx} x {ny} nodes, more than {}: judge a smaller block, or a program of wider rows",
            Sheet::MOST_NODES
        )));
    }
    let half = 0.5 * size;
    Ok(Plan { lower: -half - zero.truncate(), upper: half - zero.truncate(), nodes: (nx, ny) })
}

/// A program on its way over the work.
pub(super) struct Sweep<'a> {
    pub(super) piece: &'a Workpiece,
    pub(super) setup: &'a Setup,
    pub(super) tools: &'a BTreeMap<u32, Tool>,
    pub(super) plan: Plan,
    pub(super) units: Option<Units>,
}

impl Sweep<'_> {
    /// Runs the program: what it leaves of the face, and, with `watched`, what its moves meet.
    /// Coordinates are rounded once more, to a step of `rounding` mm, unless that is 0.
    pub(super) fn run(
        &self,
        source: impl BufRead,
        name: &str,
        rounding: f64,
        watched: bool,
    ) -> Result<(Cut, ProgramFaults), Failure> {
        let zero = self.setup.zero_mm;
        let (low, high) = (self.setup.stock_mm.0 - zero, self.setup.stock_mm.1 - zero);
        let shapes: Vec<Tool> = self.tools.values().copied().collect();
        let least = shapes.iter().map(|tool| tool.radius_mm).fold(f64::INFINITY, f64::min);
        let sheet = Sheet::level(self.plan, high.z).map_err(Failure::refused)?;
        let size = (high - low).truncate();
        let spacing = (least / PER_RADIUS).clamp(STOCK_SPACING_MM.0, STOCK_SPACING_MM.1);
        let nodes = (size / spacing).clamp(DVec2::splat(8.0), DVec2::splat(MOST_STOCK)).ceil();
        let plan =
            Plan { lower: low.truncate(), upper: high.truncate(), nodes: (nodes.x as usize + 1, nodes.y as usize + 1) };
        let stock = Stock::level(plan, high.z).map_err(Failure::refused)?;
        let mut sweeper = Sweeper {
            face: (self.plan.lower, self.plan.upper),
            sheet,
            strokes: Strokes::of(&shapes).within(self.plan.lower, self.plan.upper),
            stock: watched.then(|| (stock, Strokes::of(&shapes).within(low.truncate(), high.truncate()), Vec::new())),
            numbers: self.tools.keys().copied().collect(),
            top: high.z,
            rounding,
            shift: DVec3::ZERO,
            gatherer: Gatherer::new((low, high), self.tools),
        };
        let ran = run(source, self.units, &mut sweeper);
        ran.map_err(|error| Failure::Unreadable(format!("{name}, {error}")))?;
        sweeper.flush();
        let mut faults = sweeper.gatherer.found();
        if let (Some((stock, ..)), Some(rim)) = (&sweeper.stock, self.piece.block.rim_z_mm()) {
            faults.rim_cut(stock, &self.piece.block, rim, zero);
        }
        Ok((sweeper.sheet.into_cut(), faults))
    }
}

struct Sweeper {
    face: (DVec2, DVec2),
    sheet: Sheet,
    strokes: Strokes,
    stock: Option<(Stock, Strokes, Vec<Passes>)>,
    numbers: Vec<u32>,
    top: f64,
    rounding: f64,
    shift: DVec3,
    gatherer: Gatherer,
}

impl Run for Sweeper {
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
        let tool = self.numbers.binary_search(&made.tool).ok();
        if made.feeds() {
            let Some(tool) = tool else { return Ok(()) };
            let made = self.rounded(made);
            if self.strokes.comes_near(&made, tool, self.face, self.top) {
                self.strokes.add(&made, tool);
            }
        }
        if let Some((_, strokes, passes)) = &mut self.stock {
            let made = arrived(made);
            strokes.add(&made, tool.unwrap_or(0));
            passes.resize(strokes.len(), if made.feeds() { Passes::Cuts } else { Passes::Rapid });
            self.gatherer.moved(&made);
        }
        let full = self.stock.as_ref().is_some_and(|(_, strokes, _)| strokes.len() >= BATCH);
        if full || self.strokes.len() >= BATCH {
            self.flush();
        }
        Ok(())
    }
}

/// A rapid from a place that nobody knows, as far as it matters: it arrives.
fn arrived(made: &Move) -> Move {
    let from = DVec3::select(made.from.is_nan_mask(), made.to, made.from);
    if made.feeds() { *made } else { Move { from, ..*made } }
}

impl Sweeper {
    /// The move with ends that are rounded once more: straight ones only.
    fn rounded(&mut self, made: &Move) -> Move {
        if self.rounding == 0.0 || !matches!(made.way, Way::Straight { .. }) {
            return *made;
        }
        // Evenly distributed, and the same for the same place.
        let chance = |v: f64, salt: u64| {
            let mut z = v.to_bits().wrapping_add(salt).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (from, to) = (made.from, made.to);
        let salt = (to.x + 3.1 * to.y + 7.3 * to.z).to_bits();
        let next = self.rounding * DVec3::new(chance(to.x, salt), chance(to.y, salt ^ 1), chance(to.z, salt ^ 2));
        let before = std::mem::replace(&mut self.shift, next);
        Move { from: from + before, to: to + next, ..*made }
    }

    fn flush(&mut self) {
        self.sheet.cut(&self.strokes);
        self.strokes.clear();
        if let Some((stock, strokes, passes)) = &mut self.stock {
            let removals = stock.pass(strokes, passes, self.gatherer.least_mm());
            self.gatherer.removed(&removals);
            strokes.clear();
            passes.clear();
        }
    }
}
