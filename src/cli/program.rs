//! `glasswarp verify portrait.ngc`: a machine's program, run over its block, and the picture that
//! what it cuts draws.

use super::{
    console::{self, say},
    machine::{IrradianceFile, has_extension, read_mesh},
    outcome::unless_within,
    outputs,
    progress::TerminalProgress,
    side_files::{self, hash_of, stem},
};
use crate::{
    export::write_atomically,
    fabricate::{CHORD_MM, Cutter, Direction, Machining, Pass, Pattern, Post, Roughing, Sense},
    failure::Failure,
    record::{SideFile, document},
    report::{
        self,
        pages::{common::exposure_of, maps},
        text,
    },
    spec::{Feed, Length, NumberedTool, SmallLength, StockSize, Travel, UnitsName, ZeroPlace},
    study::{
        placement::Placing,
        program::{ProgramPlan, ProgramQuestion, ProgramStudy, ProgramWarning, WrittenProgram, Zero},
        verdict::{Answer, Verdict},
        workpiece::Workpiece,
    },
    surface::Polish,
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    metrics::Likeness,
    program::{Dynamics, Units},
};
use std::{
    fs::File,
    io::{BufRead, BufReader, Write as _},
    path::{Path, PathBuf},
};

const HEADING: &str = "Programs of machines (.ngc, .nc, .tap, .gcode, .cnc)";

#[derive(clap::Args)]
pub(crate) struct ProgramArgs {
    /// A tool: ball:d6mm (its diameter) or ball:r3mm, flat:d12mm, bull:d12mm,r1mm, vee:60deg,d6mm,
    /// taper:r1mm,5deg,d6mm; one of several with its number, as in 2=flat:d6mm. May be given
    /// several times [default: as comments of the program say]
    #[arg(long, value_name = "TOOL", help_heading = HEADING)]
    tool: Vec<NumberedTool>,

    /// The block's own file, which the cut face is compared with [default: the one that the side
    /// file names]
    #[arg(long, value_name = "FILE", help_heading = HEADING)]
    design: Option<PathBuf>,

    /// The program's zero: exit, entry, stock-top or corner, or X,Y,Z in the frame of the bench
    /// [default: the side file's]
    #[arg(long, value_name = "PLACE", allow_hyphen_values = true, help_heading = HEADING)]
    origin: Option<ZeroPlace>,

    /// The stock: its thickness, or WIDTHxHEIGHTxTHICKNESS [default: the side file's]
    #[arg(long, value_name = "SIZE", help_heading = HEADING)]
    stock: Option<StockSize>,

    /// How far the machine's axes go, as in 300x200x80mm: what is larger is told
    #[arg(long, value_name = "SIZE", help_heading = HEADING)]
    travel: Option<Travel>,

    /// The machine's acceleration, per square second; without it time is that of feeds alone
    #[arg(long, value_name = "LENGTH", help_heading = HEADING)]
    acceleration: Option<Length>,

    /// The machine's speed of rapids
    #[arg(long, value_name = "FEED", default_value = "5000mm/min", help_heading = HEADING)]
    rapid: Feed,

    /// Units of a program that names none
    #[arg(long, value_name = "UNIT", help_heading = HEADING)]
    units: Option<UnitsName>,

    /// Polish the cut face: the standard deviation of the Gaussian that blurs its heights
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, help_heading = HEADING)]
    polish: Option<Length>,

    /// Write NAME.cut.png beside the program: the light after every step, and a map of what the cut
    /// face lies off the design
    #[arg(long, help_heading = HEADING)]
    pictures: bool,
}

const WRITING: &str = "Writing a program (.ngc, .nc, .tap, .gcode, .cnc)";

/// How a program is written.
#[derive(clap::Args)]
pub(crate) struct WriteArgs {
    /// How the way lies on the face: rows, spiral (from the middle outwards) or contour-parallel
    #[arg(long, value_name = "PATTERN", default_value_t, hide_short_help = true, help_heading = WRITING)]
    pattern: Pattern,

    /// Cut all rows in the sense in which the cutter climbs, instead of to and fro
    #[arg(long, hide_short_help = true, help_heading = WRITING)]
    climb: bool,

    /// Rough in levels before, with this cutter
    #[arg(long, value_name = "CUTTER", hide_short_help = true, help_heading = WRITING)]
    rough: Option<Cutter>,

    /// From level to level of roughing [default: a quarter of its cutter's diameter]
    #[arg(long, value_name = "LENGTH", requires = "rough", hide_short_help = true, help_heading = WRITING)]
    step_down: Option<Length>,

    /// What roughing leaves, along the normal
    #[arg(long, value_name = "LENGTH", default_value = "0.3mm", hide_short_help = true, help_heading = WRITING)]
    rough_allowance: Length,

    /// The control: linuxcnc, grbl, mach, fanuc or haas
    #[arg(long, value_name = "NAME", default_value_t, hide_short_help = true, help_heading = WRITING)]
    post: Post,

    /// Speed of the spindle, per minute
    #[arg(long, value_name = "SPEED", default_value_t = 18_000.0, allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    spindle: f64,

    /// How far above the stock the tip goes between cuts
    #[arg(long, value_name = "LENGTH", default_value = "5mm", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    safe_height: Length,

    /// How far strokes may lie off the face, in um [default: 0.001]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    chord_error: Option<SmallLength>,

    /// Write rows along x or y as arcs: a third of the words, for controls that look ahead little
    #[arg(long, hide_short_help = true, help_heading = WRITING)]
    arcs: bool,
}

/// Part of its cutter's diameter from row to row of roughing, and from level to level.
const ROUGH_STEP_OVER: f64 = 0.4;
const ROUGH_STEP_DOWN: f64 = 0.25;

impl WriteArgs {
    /// What a program of this pass shall be like.
    pub(super) fn plan(&self, pass: Pass, feed: Feed) -> ProgramPlan {
        let roughing = self.rough.map(|cutter| Roughing {
            cutter,
            step_over_mm: 2.0 * ROUGH_STEP_OVER * cutter.radius_mm(),
            step_down_mm: self.step_down.map_or(2.0 * ROUGH_STEP_DOWN * cutter.radius_mm(), |step| step.mm),
            allowance_mm: self.rough_allowance.mm,
        });
        let machining = Machining {
            feed_mm_per_min: feed.mm_per_minute,
            spindle_per_min: self.spindle,
            safe_mm: self.safe_height.mm,
            chord_mm: self.chord_error.map_or(CHORD_MM, |error| 1e-3 * error.um),
            arcs: self.arcs,
            post: self.post,
        };
        let sense = if self.climb { Sense::Climb } else { Sense::BothWays };
        ProgramPlan { pass, pattern: self.pattern, sense, roughing, machining }
    }
}

/// The pass of a program that is written of a design.
#[derive(clap::Args)]
pub(crate) struct PassArgs {
    /// The finishing cutter: ball:d6mm (its diameter) or ball:r3mm, flat:d12mm, bull:d12mm,r1mm
    #[arg(long, value_name = "CUTTER", default_value = "ball:d6mm", hide_short_help = true, help_heading = WRITING)]
    cutter: Cutter,

    /// From row to row
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    step_over: Length,

    /// Direction of the rows: x, y or an angle such as 45deg
    #[arg(long, value_name = "DIRECTION", default_value = "x", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    direction: Direction,

    /// Feed of the cutter
    #[arg(long, value_name = "FEED", default_value = "2000mm/min", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    feed: Feed,

    #[command(flatten)]
    write: WriteArgs,
}

impl PassArgs {
    pub(super) fn plan(&self) -> ProgramPlan {
        let (cutter, direction) = (self.cutter, self.direction);
        let pass = Pass { direction, ..Pass::finishing(cutter, self.step_over.mm) };
        self.write.plan(pass, self.feed)
    }
}

/// Writes programs of a block, each read back first, and tells what it draws. `side` is the side
/// file that goes with them.
pub(super) fn write(
    outputs: &[PathBuf],
    piece: &Workpiece,
    plan: &ProgramPlan,
    (side, polish): (&Path, Option<Polish>),
    progress: &TerminalProgress,
) -> Result<Vec<document::Program>, Failure> {
    let mut documents = Vec::new();
    for output in outputs {
        let name = output.display().to_string();
        let written = WrittenProgram::of(piece, plan, (&stem(output), &hash_of(side)?), polish, progress);
        progress.finish();
        let WrittenProgram { text: program, study } = written?;
        write_atomically(output, |out| out.write_all(&program)).map_err(Failure::writing)?;
        say!("");
        console::text(&text::program::program(&name, &study, None));
        study.diagnoses.iter().for_each(console::warn);
        documents.push(study.document(&name, vec![name.clone()]));
    }
    Ok(documents)
}

/// Corners of a program that does not say how they are treated are cut by so much at most, mm: what
/// GRBL does unless it is told otherwise.
const CORNER_MM: f64 = 0.01;
/// Extensions of programs.
const EXTENSIONS: [&str; 5] = ["ngc", "nc", "tap", "gcode", "cnc"];
/// Bytes that are read at once.
const BUFFER: usize = 1 << 18;

/// Whether a file is a program, by its name.
pub(super) fn is_program(path: &Path) -> bool {
    EXTENSIONS.iter().any(|extension| has_extension(path, extension))
}

impl ProgramArgs {
    /// Whether something is said that only programs have.
    pub(super) fn is_given(&self) -> bool {
        let of_machine = self.origin.is_some() || self.stock.is_some() || self.travel.is_some();
        of_machine
            || !self.tool.is_empty()
            || self.design.is_some()
            || self.acceleration.is_some()
            || self.units.is_some()
            || self.polish.is_some()
            || self.pictures
    }

    fn question(&self) -> Result<ProgramQuestion, Failure> {
        let dynamics = Dynamics {
            acceleration: self.acceleration.map_or(f64::INFINITY, |length| length.mm),
            rapid_feed: self.rapid.mm_per_minute,
            corner_mm: CORNER_MM,
        };
        if dynamics.acceleration <= 0.0 {
            return Err(Failure::Usage("an acceleration (--acceleration) must be above 0".into()));
        }
        Ok(ProgramQuestion {
            tools: self.tool.iter().map(|one| (one.number, one.tool)).collect(),
            units: self.units.map(|unit| if unit == UnitsName::In { Units::Inches } else { Units::Millimetres }),
            zero: self.origin.map(|zero| match zero {
                ZeroPlace::Named(name) => Zero::At(name.into()),
                ZeroPlace::At(place) => Zero::Place(DVec3::from(place)),
            }),
            stock_mm: (
                self.stock.and_then(|stock| stock.across_mm).map(DVec2::from),
                self.stock.map(|stock| stock.thickness_mm),
            ),
            travel_mm: self.travel.map(|Travel(travel)| DVec3::from(travel)),
            dynamics,
            polish: self.polish.map(|length| Polish::new(length.mm)).transpose().map_err(Failure::refused)?,
        })
    }
}

/// A look at a program.
pub(super) struct Look<'a> {
    /// What is said of the machine.
    pub(super) machine: &'a ProgramArgs,
    /// The side file, if it does not lie beside it.
    pub(super) bench: Option<&'a Path>,
    /// Index and distance, if they are not the side file's, mm.
    pub(super) changed: (Option<f64>, Option<f64>),
    /// Pixels across.
    pub(super) pixels: usize,
    /// Where to the light is written.
    pub(super) output: &'a [PathBuf],
    /// The greatest error.
    pub(super) max_error: Option<f64>,
}

/// Judges a program.
pub(super) fn verify(program: &Path, args: &Look<'_>) -> Result<(), Failure> {
    args.output.iter().try_for_each(|output| IrradianceFile::of(output).map(drop))?;
    let question = args.machine.question()?;
    let side = side_files::of_block(program, args.bench)?;
    let block = block_of(program, args, &side)?;
    let sheet = args.machine.pictures.then(|| program.with_extension("cut.png"));
    let inputs = side_files::inputs(program, args.bench)?;
    outputs::plan(
        inputs.iter().chain([&block]).map(PathBuf::as_path),
        args.output.iter().cloned().chain(sheet.clone()),
    )?;
    let progress = TerminalProgress::new();
    let (mesh, name) = (read_mesh(&block)?, block.display().to_string());
    let origin_mm = side_files::origin_of(&side, &block);
    let host = &super::machine::Machine;
    let piece = Workpiece::of(
        (mesh, &name),
        (origin_mm, Placing::Righted),
        side,
        args.changed,
        args.pixels,
        (host, &progress),
    )?;
    let open = || File::open(program).map(|file| Box::new(BufReader::with_capacity(BUFFER, file)) as Box<dyn BufRead>);
    let study = ProgramStudy::of(&open, &program.display().to_string(), &piece, &question, &progress);
    progress.finish();
    let study = study?;
    let harm: Vec<String> = study.faults.harmful().map(ProgramWarning::in_words).collect();
    let mut verdict = Verdict::default();
    match study.last() {
        Some(last) => verdict.say_picture(Likeness::from(&last.view.metrics), ", as the program cuts it"),
        None => verdict.say("picture", Answer::No, "the program cuts through the block"),
    }
    if !harm.is_empty() {
        verdict.say("program", Answer::No, format!("it must not be run like this: {}", harm.join("; ")));
    }
    console::verdict(&verdict);
    let acceleration = Some(question.dynamics.acceleration).filter(|most| most.is_finite());
    console::text(&text::program::program(
        &program.display().to_string(),
        &study,
        acceleration.map(|most| (most, CORNER_MM)),
    ));
    study.faults.list.iter().for_each(|fault| console::warn(fault.in_words()));
    study.diagnoses.iter().for_each(console::warn);
    let exposure = exposure_of(&piece.ideal, &piece);
    if let Some(path) = &sheet {
        report::write_png(path, &maps::program(&piece, &study, exposure)).map_err(Failure::writing)?;
        say!("  pictures       {}", path.display());
    }
    if let Some(last) = study.last() {
        let target = piece.examiner.target().unwrap_or(&last.view.image);
        let peak = target.values.iter().copied().fold(0.0, f64::max);
        for output in args.output {
            IrradianceFile::of(output)?.write(output, &last.view.image, peak)?;
        }
    }
    let files: Vec<PathBuf> = args.output.iter().cloned().chain(sheet).collect();
    let document = study.document(&program.display().to_string(), document::texts(&files));
    console::result(document::Result::Program(Box::new(document)));
    if !harm.is_empty() {
        return Err(Failure::BelowThreshold(format!(
            "{} must not be run like this: {}",
            program.display(),
            harm.join("; ")
        )));
    }
    match study.last() {
        Some(last) => unless_within(args.max_error, last.view.metrics.rel_rms, "the", " in the end"),
        None => Err(Failure::BelowThreshold(format!("{} cuts through the block", program.display()))),
    }
}

/// The file of the block that a program is for.
fn block_of(program: &Path, args: &Look<'_>, side: &SideFile) -> Result<PathBuf, Failure> {
    if let Some(design) = &args.machine.design {
        return Ok(design.clone());
    }
    let folder = args.bench.unwrap_or(program).with_file_name("");
    let found = side.files.iter().find_map(|(name, sha256)| {
        let path = folder.join(name);
        let is_it = !is_program(&path) && hash_of(&path).is_ok_and(|found| found == *sha256);
        is_it.then_some(path)
    });
    found.ok_or_else(|| {
        Failure::Usage(format!(
            "none of the block's files that the side file names ({}) lies beside it unchanged: name one with --design",
            side.files.keys().cloned().collect::<Vec<_>>().join(", ")
        ))
    })
}
