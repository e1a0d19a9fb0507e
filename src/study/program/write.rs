//! Writing a program for a block, and reading it back before anybody may run it.

use super::{
    examine::ProgramStudy,
    faults::{FaultKind, ProgramWarning},
    question::{ProgramQuestion, setup_of},
};
use crate::{
    fabricate::{CHORD_MM, Machining, Pass, Pattern, Place, Program, Roughing, Sense},
    failure::Failure,
    solver::Progress,
    spec::{Feed, PassArgs, WriteArgs},
    study::workpiece::Workpiece,
    surface::Polish,
};
use glasswarp_verify::program::Dynamics;
use std::io::{BufRead, Cursor};

/// What a program shall be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgramPlan {
    /// The finishing pass.
    pub pass: Pass,
    /// How its way lies on the face.
    pub pattern: Pattern,
    /// In which sense rows are cut.
    pub sense: Sense,
    /// What goes before it.
    pub roughing: Option<Roughing>,
    /// How the machine goes.
    pub machining: Machining,
}

/// Part of its cutter's diameter from row to row of roughing, and from level to level.
const ROUGH_STEP_OVER: f64 = 0.4;
const ROUGH_STEP_DOWN: f64 = 0.25;

impl ProgramPlan {
    /// A program of this pass, written as the arguments say.
    pub fn of_pass(pass: Pass, feed: Feed, args: &WriteArgs) -> Self {
        let roughing = args.rough.map(|cutter| Roughing {
            cutter,
            step_over_mm: 2.0 * ROUGH_STEP_OVER * cutter.radius_mm(),
            step_down_mm: args.step_down.map_or(2.0 * ROUGH_STEP_DOWN * cutter.radius_mm(), |step| step.mm),
            allowance_mm: args.rough_allowance.mm,
        });
        let machining = Machining {
            feed_mm_per_min: feed.mm_per_minute,
            spindle_per_min: args.spindle,
            safe_mm: args.safe_height.mm,
            chord_mm: args.chord_error.map_or(CHORD_MM, |error| 1e-3 * error.um),
            arcs: args.arcs,
            post: args.post,
        };
        let sense = if args.climb { Sense::Climb } else { Sense::BothWays };
        Self { pass, pattern: args.pattern, sense, roughing, machining }
    }

    /// A program whose pass the arguments say too.
    pub fn of(args: &PassArgs) -> Self {
        let pass = Pass { direction: args.direction, ..Pass::finishing(args.cutter, args.step_over.mm) };
        Self::of_pass(pass, args.feed, &args.write)
    }
}

/// A program that has been read back.
pub struct WrittenProgram {
    /// The text.
    pub text: Vec<u8>,
    /// What it draws.
    pub study: ProgramStudy,
}

/// Roughing and finishing are read back without acceleration, at this speed of rapids, mm per
/// minute.
const RAPID_FEED: f64 = 5000.0;

impl WrittenProgram {
    /// Writes a program for a block and reads it back as any other file. `side_sha256` is that of
    /// the side file that it goes with.
    ///
    /// # Errors
    /// A pass that does not fit; a program that would harm something, which then nobody gets.
    pub fn of(
        piece: &Workpiece,
        plan: &ProgramPlan,
        (title, side_sha256): (&str, &str),
        polish: Option<Polish>,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let question = ProgramQuestion {
            tools: Vec::new(),
            units: None,
            zero: None,
            stock_mm: (None, None),
            travel_mm: None,
            dynamics: Dynamics { acceleration: f64::INFINITY, rapid_feed: RAPID_FEED, corner_mm: 0.0 },
            polish,
        };
        let setup = setup_of(piece, &question)?;
        let ProgramPlan { pass, pattern, sense, roughing, machining } = *plan;
        let place = Place {
            top_mm: setup.stock_mm.1.z,
            floor_mm: setup.stock_mm.0.z,
            rim_mm: piece.block.rim_z_mm(),
            origin_mm: setup.zero_mm,
        };
        let surface = &piece.surface;
        let program = Program { surface, pass, pattern, sense, roughing, machining, place };
        let size = setup.stock_mm.1 - setup.stock_mm.0;
        let [x, y, z] = setup.zero_mm.to_array().map(|v| v + 0.0);
        let header = [
            format!("glasswarp {}: {title}", env!("CARGO_PKG_VERSION")),
            format!("stock {:.3} x {:.3} x {:.3} mm", size.x, size.y, size.z),
            format!("zero at {x:.4}, {y:.4}, {z:.4} mm of the bench's frame; z up, the flat face below"),
            format!("side file sha256 {side_sha256}"),
        ];
        let mut text = Vec::new();
        program.write(&mut text, title, &header).map_err(Failure::refused)?;
        let open = || Ok(Box::new(Cursor::new(&text[..])) as Box<dyn BufRead>);
        let study = ProgramStudy::of(&open, title, piece, &question, progress)?;
        let mut harms: Vec<String> = study.faults.harmful().map(ProgramWarning::in_words).collect();
        // Nothing but this program may have cut the stock before.
        if plan.roughing.is_some() {
            let plunges = study.faults.list.iter().filter(|fault| fault.kind == FaultKind::Plunge);
            harms.extend(plunges.map(ProgramWarning::in_words));
        }
        if !harms.is_empty() {
            return Err(Failure::BelowThreshold(format!(
                "the program would do harm, and was not written: {}",
                harms.join("; ")
            )));
        }
        Ok(Self { text, study })
    }
}
