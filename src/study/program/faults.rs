//! What of a program would harm machine, cutter or block.

use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block,
    cut::{Removal, Stock},
    program::{Move, Survey, Tool, Way},
};
use std::collections::BTreeMap;

/// A kind of harm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// A rapid goes through the stock.
    RapidInStock,
    /// The tool is fed steeply down into the stock.
    Plunge,
    /// The tip goes below the entry face, into what lies under the stock.
    BelowStock,
    /// The program is larger than the machine.
    OutsideTravel,
    /// Something is cut while the spindle stands.
    SpindleStands,
    /// The rim is cut.
    Rim,
}

/// What was found of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramWarning {
    /// Its kind.
    pub kind: FaultKind,
    /// How many moves do it.
    pub count: u64,
    /// The line of the first of them; 0 where no line is meant.
    pub line: u64,
    /// How far the worst one goes, mm.
    pub depth_mm: f64,
    /// Where, in the coordinates of the program, mm.
    pub at: DVec3,
}

/// All that was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProgramFaults {
    /// One for every kind.
    pub list: Vec<ProgramWarning>,
    /// The most that one feed move takes off in depth, mm, and its line.
    pub deepest: Option<(f64, u64)>,
}

impl ProgramWarning {
    /// The same in words.
    pub fn in_words(&self) -> String {
        let Self { kind, count, line, depth_mm, at } = self;
        let place = format!("at ({:.3}, {:.3}, {:.3})", at.x, at.y, at.z);
        let moves = |what: &str| {
            if *count == 1 {
                format!("line {line}: {what}")
            } else {
                format!("{count} moves, the first in line {line}: {what}")
            }
        };
        match kind {
            FaultKind::RapidInStock => {
                moves(&format!("a rapid goes through the stock, {depth_mm:.3} mm deep at most, {place}"))
            }
            FaultKind::Plunge => moves(&format!(
                "the tool is fed straight down into the stock, {depth_mm:.3} mm deep at most, {place}: go in along a ramp, or beside the stock"
            )),
            FaultKind::BelowStock => moves(&format!("the tip goes {depth_mm:.3} mm below the stock, {place}")),
            FaultKind::OutsideTravel => format!(
                "the program needs {depth_mm:.3} mm more than the machine has (`travel`): it reaches over {:.3} x {:.3} x {:.3} mm",
                at.x, at.y, at.z
            ),
            FaultKind::SpindleStands => moves("something is cut while the spindle stands (no M3, or no S)"),
            FaultKind::Rim => format!("the rim is cut, {depth_mm:.3} mm deep {place}"),
        }
    }
}

/// Rapids that go less deep than this, mm, only touch.
const TOUCHES_MM: f64 = 0.01;
/// Down more steeply than this is a plunge, and of no concern below this part of the radius.
const STEEP: f64 = 1.0;
const SHALLOW: f64 = 0.25;
/// Depth below the stock that is rounding, mm.
const ROUNDING_MM: f64 = 1e-4;

/// What is found on the way.
pub(super) struct Gatherer {
    stock: (DVec3, DVec3),
    reach: BTreeMap<u32, f64>,
    found: BTreeMap<FaultKind, ProgramWarning>,
    deepest: Option<(f64, u64)>,
    /// Of the moves since the last batch: line, whether it feeds, whether that is down steeply, the
    /// tool's radius.
    moves: Vec<(u64, bool, bool, f64)>,
    before: u64,
}

impl Gatherer {
    pub(super) fn new(stock: (DVec3, DVec3), tools: &BTreeMap<u32, Tool>) -> Self {
        let reach = tools.iter().map(|(number, tool)| (*number, tool.radius_mm)).collect();
        Self { stock, reach, found: BTreeMap::new(), deepest: None, moves: Vec::new(), before: 0 }
    }

    /// What shallower removals are of no concern, mm.
    pub(super) fn least_mm(&self) -> f64 {
        TOUCHES_MM
    }

    fn note(&mut self, kind: FaultKind, line: u64, depth_mm: f64, at: DVec3) {
        let known = self.found.entry(kind).or_insert(ProgramWarning { kind, count: 0, line, depth_mm, at });
        known.count += 1;
        if depth_mm > known.depth_mm {
            (known.depth_mm, known.at) = (depth_mm, at);
        }
    }

    /// Looks at a move by itself.
    pub(super) fn moved(&mut self, made: &Move) {
        let reach = self.reach.get(&made.tool).copied().unwrap_or(0.0);
        let (low, high) = match made.way {
            Way::Arc { arc, .. } => arc.bounds(),
            _ => (made.from.min(made.to), made.from.max(made.to)),
        };
        let way = made.to - made.from;
        let steep = way.z < 0.0 && -way.z > STEEP * way.truncate().length();
        self.moves.push((made.line, made.feeds(), steep, reach));
        let over = (low.truncate() - reach).cmplt(self.stock.1.truncate()).all()
            && (high.truncate() + reach).cmpgt(self.stock.0.truncate()).all();
        let below = self.stock.0.z - low.z;
        if over && below > ROUNDING_MM {
            self.note(FaultKind::BelowStock, made.line, below, made.to.with_z(low.z));
        }
    }

    /// Takes what moves met.
    pub(super) fn removed(&mut self, removals: &[Removal]) {
        for Removal { order, depth_mm, at } in removals {
            let Some(&(line, feeds, steep, radius)) = self.moves.get((order - self.before) as usize) else { continue };
            if !feeds {
                self.note(FaultKind::RapidInStock, line, *depth_mm, *at);
                continue;
            }
            if steep && *depth_mm > SHALLOW * radius {
                self.note(FaultKind::Plunge, line, *depth_mm, *at);
            }
            if self.deepest.is_none_or(|(deepest, _)| *depth_mm > deepest) {
                self.deepest = Some((*depth_mm, line));
            }
        }
        self.before += self.moves.len() as u64;
        self.moves.clear();
    }

    pub(super) fn found(&mut self) -> ProgramFaults {
        let list = std::mem::take(&mut self.found).into_values().collect();
        ProgramFaults { list, deepest: self.deepest }
    }
}

impl ProgramFaults {
    /// The same with what the bounds of all moves tell.
    pub(super) fn with_bounds(mut self, survey: &Survey, travel_mm: Option<DVec3>) -> Self {
        if let Some(line) = survey.cuts_standing {
            let kind = FaultKind::SpindleStands;
            self.list.push(ProgramWarning { kind, count: 1, line, depth_mm: 0.0, at: DVec3::ZERO });
        }
        let size = survey.bounds.1 - survey.bounds.0;
        if let Some(travel) = travel_mm {
            let over = (size - travel).max_element();
            if over > 0.0 {
                let kind = FaultKind::OutsideTravel;
                self.list.push(ProgramWarning { kind, count: 1, line: 0, depth_mm: over, at: size });
            }
        }
        self
    }

    /// Looks whether a rim is left as high as it shall be.
    pub(super) fn rim_cut(&mut self, stock: &Stock, block: &Block, rim_z: f64, zero: DVec3) {
        let plan = stock.plan();
        let half = 0.5 * block.size_mm();
        let mut worst: Option<(f64, DVec2)> = None;
        for (k, height) in stock.heights().iter().enumerate() {
            let at = plan.node(k % plan.nodes.0, k / plan.nodes.0);
            let place = at + zero.truncate();
            let outside = place.abs().cmpgt(half).any() || !block.covers(place);
            let depth = rim_z - zero.z - height;
            if outside && depth > TOUCHES_MM && worst.is_none_or(|(most, _)| depth > most) {
                worst = Some((depth, at));
            }
        }
        if let Some((depth_mm, at)) = worst {
            let at = at.extend(rim_z - zero.z - depth_mm);
            self.list.push(ProgramWarning { kind: FaultKind::Rim, count: 1, line: 0, depth_mm, at });
        }
    }

    /// What no program may do. A plunge may meet stock that another program has roughed, and a
    /// spindle may be turned on by hand.
    pub fn harmful(&self) -> impl Iterator<Item = &ProgramWarning> {
        self.list.iter().filter(|fault| !matches!(fault.kind, FaultKind::Plunge | FaultKind::SpindleStands))
    }
}
