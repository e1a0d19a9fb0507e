//! A program of a machine: what it cuts out of the stock, the picture that this draws, and what is
//! wrong with it.

mod deviation;
mod diagnosis;
mod faults;
mod sweep;
mod write;

pub use deviation::Deviation;
pub use faults::{FaultKind, ProgramFaults, ProgramWarning};
pub use write::{ProgramPlan, WrittenProgram};

use super::{
    mill::{MillStep, polished},
    progress::{advance, begin},
    workpiece::{Workpiece, view_milled},
};
use crate::{
    fabricate::Milled,
    failure::Failure,
    grid::Field,
    record::document,
    solid::Origin,
    solver::Progress,
    surface::{HeightField, Polish},
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    cut::Cut,
    program::{Blending, Dynamics, ProgramError, Survey, SurveyLimits, Tool, Units, survey},
};
use std::{collections::BTreeMap, io, io::BufRead};
use sweep::{Sweep, plan_of};

/// Opens the program from its beginning; it is read more than once, and never held as a whole.
pub type Source<'a> = &'a dyn Fn() -> io::Result<Box<dyn BufRead + 'a>>;

/// Where the program's zero is, if not where the side file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Zero {
    /// At a place of the block.
    At(Origin),
    /// In the frame of the bench, mm.
    Place(DVec3),
}

/// What is asked of a program.
#[derive(Clone, Debug)]
pub struct ProgramQuestion {
    /// Shapes of tools, by number; `None` for every tool without one of its own.
    pub tools: Vec<(Option<u32>, Tool)>,
    /// Units of a program that names none.
    pub units: Option<Units>,
    /// The program's zero, if the side file's is not meant.
    pub zero: Option<Zero>,
    /// The stock, mm: its size along x and y, its thickness from the entry face up. Each as the side
    /// file has it if it is not given.
    pub stock_mm: (Option<DVec2>, Option<f64>),
    /// How far the machine's axes go, mm.
    pub travel_mm: Option<DVec3>,
    /// What the machine can do.
    pub dynamics: Dynamics,
    /// What is done to the face afterwards.
    pub polish: Option<Polish>,
}

/// The place of the stock and of the program, mm in the frame of the bench.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The program's zero.
    pub zero_mm: DVec3,
    /// Least and greatest corner of the stock: from the entry face to its top.
    pub stock_mm: (DVec3, DVec3),
}

/// A program, swept and traced.
pub struct ProgramStudy {
    /// What it says.
    pub survey: Survey,
    /// The shapes of its tools.
    pub tools: BTreeMap<u32, Tool>,
    /// Where it and the stock are.
    pub setup: Setup,
    /// The face as designed, as cut, and polished, with their light; without light where the block is
    /// cut through.
    pub steps: Vec<MillStep>,
    /// How far what it cuts lies off the design.
    pub deviation: Deviation,
    /// What would harm the machine or the block.
    pub faults: ProgramFaults,
    /// What is likely wrong, in words, with what to do.
    pub diagnoses: Vec<String>,
}

impl ProgramStudy {
    /// Sweeps a program over the block that it is for.
    ///
    /// # Errors
    /// A program that no machine would run, or whose tools are not known; a stock that is none.
    pub fn of(
        source: Source<'_>,
        name: &str,
        piece: &Workpiece,
        question: &ProgramQuestion,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        begin(progress, "cutting and tracing", 5)?;
        let open = || source().map_err(|error| Failure::Io { what: format!("{name} cannot be read"), source: error.into() });
        let refused = |error: ProgramError| Failure::Unreadable(format!("{name}, {error}"));
        let setup = setup_of(piece, question)?;
        let half = 0.5 * piece.block.size_mm();
        let zero = setup.zero_mm;
        let limits = SurveyLimits {
            face: (-half - zero.truncate(), half - zero.truncate()),
            top_mm: setup.stock_mm.1.z - zero.z,
        };
        let survey = survey(open()?, question.units, limits, question.dynamics).map_err(refused)?;
        let tools = shapes(&survey, question, &setup)?;
        advance(progress, 1)?;
        let plan = plan_of(&survey, piece, zero)?;
        let sweep = Sweep { piece, setup: &setup, tools: &tools, plan, units: question.units };
        let (cut, faults) = sweep.run(open()?, name, 0.0, true)?;
        let faults = faults.with_bounds(&survey, question.travel_mm);
        advance(progress, 2)?;
        let design = &piece.surface;
        let deviation = Deviation::of(design, &cut, zero.z);
        let mut diagnoses = diagnosis::of_survey(&survey, piece, &setup);
        let is_placed = diagnoses.is_empty();
        if is_placed {
            diagnoses = diagnosis::of_face(design, &cut, zero.z, (&survey, &tools));
            diagnoses.extend(diagnosis::of_facets(&survey, piece)?);
        }
        let mut steps = vec![MillStep::new("as designed", design.clone(), piece.view(design)?)];
        advance(progress, 3)?;
        let lowest = zero.z + cut.heights.iter().copied().fold(f64::INFINITY, f64::min);
        if lowest > piece.block.entry_z_mm() {
            let (view, surface) =
                view_milled(&piece.examiner, &piece.block, design, milled(design, cut, zero.z))?;
            let rounding = diagnosis::rounding(&survey);
            if let Some(step_mm) = rounding.filter(|_| is_placed) {
                // As much rounding once more, which is as far again from the truth.
                let (again, _) = sweep.run(open()?, name, step_mm, false)?;
                let (rounded, _) = view_milled(&piece.examiner, &piece.block, design, milled(design, again, zero.z))?;
                diagnoses.extend(diagnosis::of_rounding(step_mm, survey.unit_mm, &view.image, &rounded.image)?);
            }
            steps.push(MillStep::new("as the program cuts it", surface, view));
            advance(progress, 4)?;
            if let Some(polish) = question.polish {
                let surface = polished(&steps[1].surface, design, polish);
                let view = piece.view(&surface)?;
                steps.push(MillStep::new(&format!("and polished, sigma {} mm", polish.sigma_mm()), surface, view));
            }
        }
        advance(progress, 5)?;
        Ok(Self { survey, tools, setup, steps, deviation, faults, diagnoses })
    }

    /// The face in the end, and its light: as it is cut, or polished. `None` where the block is cut
    /// through.
    pub fn last(&self) -> Option<&MillStep> {
        self.steps.last().filter(|_| self.steps.len() > 1)
    }

    /// How corners are treated, in words.
    pub fn corners_in_words(&self, corner_mm: f64) -> String {
        let said: Vec<String> = self
            .survey
            .blending
            .iter()
            .map(|blending| match blending {
                Blending::Unsaid => format!("not said (neither G61 nor G64; taken as {corner_mm} mm)"),
                Blending::Exact => "followed exactly (G61)".to_owned(),
                Blending::Within(mm) => format!("cut by at most {mm} mm (G64)"),
                Blending::Unbounded => {
                    "cut as far as the machine likes (G64 without P): nobody can say what it will draw".to_owned()
                }
            })
            .collect();
        said.join(", then ")
    }

    /// The same for programs.
    pub fn document(&self, file: &str, files: Vec<String>) -> document::Program {
        let survey = &self.survey;
        document::Program {
            file: file.to_owned(),
            moves: survey.moves,
            feed_moves: survey.feed_moves,
            feed_mm: survey.feed_mm,
            rapid_mm: survey.rapid_mm,
            minutes: survey.seconds / 60.0,
            tools: self.tools.iter().map(|(number, tool)| format!("{number}={tool}")).collect(),
            resolution_mm: survey.resolution_mm(),
            steps: self.steps.iter().map(MillStep::document).collect(),
            deviation: self.deviation.document(),
            faults: self.faults.list.iter().map(|fault| fault.in_words()).collect(),
            diagnoses: self.diagnoses.clone(),
            files,
        }
    }
}

/// A cut sheet as a milled face of the design.
fn milled(design: &HeightField, cut: Cut, zero_z: f64) -> Milled {
    let (nx, ny) = cut.plan.nodes;
    let mut heights = cut.heights;
    let contour = design.contour();
    let (is_rectangle, extent) = (contour.is_rectangle(), design.extent());
    heights.iter_mut().enumerate().for_each(|(k, z)| {
        *z += zero_z;
        // Beyond the outline nothing of the cut matters; the face goes on as it does at its border.
        if !is_rectangle && !contour.contains(extent.node(k % nx, k / nx, nx, ny)) {
            *z = f64::NAN;
        }
    });
    let surface = design.with_heights(Field::from_vec(nx, ny, heights));
    Milled { surface, slopes: Field::from_vec(nx, ny, cut.slopes) }
}

/// Where stock and program are.
fn setup_of(piece: &Workpiece, question: &ProgramQuestion) -> Result<Setup, Failure> {
    let (frame, entry_z) = (&piece.side.frame, piece.block.entry_z_mm());
    let (low, high) = piece.block.entry_face_mm();
    let (size, thickness) = question.stock_mm;
    let known = |given: f64, found: f64| if given > 0.0 { given } else { found };
    let (_, highest) = piece.block.height_range_mm();
    let highest = highest.max(piece.block.rim_z_mm().unwrap_or(f64::NEG_INFINITY));
    let thickness_mm = thickness.unwrap_or_else(|| known(frame.stock_thickness_mm, highest - entry_z));
    let size_mm = size.unwrap_or_else(|| {
        DVec2::new(known(frame.stock_width_mm, high.x - low.x), known(frame.stock_height_mm, high.y - low.y))
    });
    if !(thickness_mm > 0.0 && size_mm.cmpgt(DVec2::ZERO).all()) {
        return Err(Failure::Usage(format!(
            "the stock (`stock`) is {} x {} x {thickness_mm} mm: every side must be longer than 0",
            size_mm.x, size_mm.y
        )));
    }
    let half = 0.5 * size_mm;
    let top = entry_z + thickness_mm;
    let zero_mm = match question.zero {
        None => frame.origin_mm(),
        Some(Zero::Place(place)) => place,
        Some(Zero::At(origin)) => match origin {
            Origin::Exit => DVec3::ZERO,
            Origin::Entry => DVec3::new(0.0, 0.0, entry_z),
            Origin::StockTop => DVec3::new(0.0, 0.0, top),
            Origin::Corner => (-half).extend(entry_z),
        },
    };
    Ok(Setup { zero_mm, stock_mm: ((-half).extend(entry_z), half.extend(top)) })
}

/// The shape of every tool that feeds.
fn shapes(survey: &Survey, question: &ProgramQuestion, setup: &Setup) -> Result<BTreeMap<u32, Tool>, Failure> {
    let given = |number: Option<u32>| question.tools.iter().find(|(of, _)| *of == number).map(|(_, tool)| *tool);
    let size = setup.stock_mm.1 - setup.stock_mm.0;
    let mut tools = BTreeMap::new();
    for (&number, used) in survey.tools.iter().filter(|(_, used)| used.is_used) {
        let shape = given(Some(number)).or_else(|| given(None)).or(used.shape).or(survey.unnumbered);
        let Some(shape) = shape else {
            let which = if number == 0 { String::new() } else { format!("{number}=") };
            return Err(Failure::Usage(format!(
                "nobody says what tool {number} of the program looks like: name it, as in `tool` {which}ball:d6mm"
            )));
        };
        let across = 2.0 * shape.radius_mm;
        if across > size.x.min(size.y) {
            return Err(Failure::Usage(format!(
                "tool {number} ({shape}) is {across} mm across, more than the stock of {} x {} mm: is a radius meant (ball:r3mm), \
                 or another stock (`stock`)?",
                size.x, size.y
            )));
        }
        tools.insert(number, shape);
    }
    if tools.is_empty() {
        return Err(Failure::Unreadable("the program feeds nothing: all of its moves are rapids".into()));
    }
    Ok(tools)
}
