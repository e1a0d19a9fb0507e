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
    failure::Failure,
    record::{SideFile, document},
    report::{
        self,
        pages::{common::exposure_of, maps},
        text,
    },
    spec::ProgramArgs,
    study::{
        placement::{Placing, origin_of},
        program::{CORNER_MM, ProgramPlan, ProgramQuestion, ProgramStudy, WrittenProgram},
        verdict::Verdict,
        workpiece::Workpiece,
    },
    surface::Polish,
};
use std::{
    fs::File,
    io::{BufRead, BufReader, Write as _},
    path::{Path, PathBuf},
};

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

/// Extensions of programs.
const EXTENSIONS: [&str; 5] = ["ngc", "nc", "tap", "gcode", "cnc"];
/// Bytes that are read at once.
const BUFFER: usize = 1 << 18;

/// Whether a file is a program, by its name.
pub(super) fn is_program(path: &Path) -> bool {
    EXTENSIONS.iter().any(|extension| has_extension(path, extension))
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
    let question = ProgramQuestion::of(args.machine)?;
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
    let origin_mm = origin_of(&side, &block);
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
    let mut verdict = Verdict::default();
    study.say(&mut verdict);
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
        console::light("irradiance", &last.view.image);
        console::light("target", target);
        let peak = target.values.iter().copied().fold(0.0, f64::max);
        for output in args.output {
            IrradianceFile::of(output)?.write(output, &last.view.image, peak)?;
        }
    }
    let files: Vec<PathBuf> = args.output.iter().cloned().chain(sheet).collect();
    let document = study.document(&program.display().to_string(), document::texts(&files));
    console::result(document::Result::Program(Box::new(document)));
    if let Some(harm) = study.harm() {
        return Err(Failure::BelowThreshold(format!("{} must not be run like this: {harm}", program.display())));
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
