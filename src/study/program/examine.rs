//! Runs a program over its block, and looks at what comes of it.

use super::{
    deviation::Deviation,
    diagnosis,
    faults::{ProgramFaults, ProgramWarning},
    question::{ProgramQuestion, Setup, Source, setup_of, shapes},
    sweep::{Sweep, plan_of},
};
use crate::{
    fabricate::Milled,
    failure::Failure,
    grid::Field,
    record::document,
    solver::Progress,
    study::{
        mill::{MillStep, polished},
        progress::{advance, begin},
        verdict::{Answer, Verdict},
        workpiece::{Workpiece, view_milled},
    },
    surface::HeightField,
};
use glasswarp_verify::{
    cut::Cut,
    metrics::Likeness,
    program::{Blending, ProgramError, Survey, SurveyLimits, Tool, survey},
};
use std::collections::BTreeMap;

/// A program, swept and traced.
pub struct ProgramStudy {
    /// What it says.
    pub survey: Survey,
    /// The shapes of its tools.
    pub tools: BTreeMap<u32, Tool>,
    /// Where it and the stock are.
    pub setup: Setup,
    /// The face as designed, as cut, and polished, with their light; without light where the block
    /// is cut through.
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
        let open =
            || source().map_err(|error| Failure::Io { what: format!("{name} cannot be read"), source: error.into() });
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
            let (view, surface) = view_milled(&piece.examiner, &piece.block, design, milled(design, cut, zero.z))?;
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

    /// What would be harmed if it were run, in words.
    pub fn harm(&self) -> Option<String> {
        let harm: Vec<String> = self.faults.harmful().map(ProgramWarning::in_words).collect();
        (!harm.is_empty()).then(|| harm.join("; "))
    }

    /// Says what this means for whoever wants to know whether it will work.
    pub fn say(&self, verdict: &mut Verdict) {
        match self.last() {
            Some(last) => verdict.say_picture(Likeness::from(&last.view.metrics), ", as the program cuts it"),
            None => verdict.say("picture", Answer::No, "the program cuts through the block"),
        }
        if let Some(harm) = self.harm() {
            verdict.say("program", Answer::No, format!("it must not be run like this: {harm}"));
        }
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
            faults: self.faults.list.iter().map(ProgramWarning::in_words).collect(),
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
