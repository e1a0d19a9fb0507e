//! `glasswarp mill`: a block milled and polished in simulation, and its picture after every step.

use super::{
    console::{self, say},
    machine::{Machine, has_extension},
    outcome::{error_limit, unless_within, with_flags},
    outputs, program,
    progress::TerminalProgress,
    report_files::{self, command, file_record},
    side_files::{self, file_name, hash_of, open_workpiece, stem},
    verify::PlacingArgs,
};
use crate::{
    export::{self, Format},
    fabricate::Pass,
    failure::Failure,
    record::{SideFile, WorkRecord, document},
    report::{
        self,
        pages::{
            common::exposure_of,
            found::{FoundPage, ReportedFile},
            maps,
        },
        text,
    },
    spec::{CutterList, Feed, Host, Length, RowsArgs, WriteArgs},
    study::{
        cutters::{CutterRequirements, CutterTrial, cheapest},
        mill::{MillStep, MillStudy},
        program::ProgramPlan,
        side_record::side_file,
        verdict::Verdict,
        workpiece::Workpiece,
    },
    surface::Polish,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

#[derive(clap::Args)]
pub(crate) struct MillArgs {
    /// The block: .stl, .obj, .glb or .ply, with its side file
    block: PathBuf,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    #[command(flatten)]
    placing: PlacingArgs,

    #[command(flatten)]
    rows: RowsArgs,

    /// What the pass leaves on the face, along its normal: 0 for finishing, the allowance for
    /// finishing of a roughing pass
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    allowance: Length,

    /// Polish the milled face: the standard deviation of the Gaussian that blurs its heights
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    polish: Option<Length>,

    /// Feed of the cutter: gives the time
    #[arg(long, value_name = "FEED", default_value = "2000mm/min", allow_hyphen_values = true)]
    feed: Feed,

    /// Find the cheapest cutter and step-over of a list (TOML) that keep to --want-error
    #[arg(long, value_name = "FILE", requires = "want_error", conflicts_with_all = ["cutter", "step_over"], help_heading = "Choosing a cutter")]
    cutters: Option<PathBuf>,

    /// The relative RMS error of the picture that is wanted, after milling and polishing
    #[arg(long, value_name = "ERROR", requires = "cutters", help_heading = "Choosing a cutter", value_parser = error_limit)]
    want_error: Option<f64>,

    /// Pixels across at which to judge, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Write the block as it is in the end (.stl, .obj, .glb), the pictures of all steps (.png), or
    /// the program of the pass (.ngc, .nc, .tap, .gcode, .cnc). May be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    #[command(flatten)]
    write: WriteArgs,

    /// Write a report on the work, a page of HTML
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,

    /// Fail (exit code 3) if the relative RMS error of the picture exceeds this in the end
    #[arg(long, value_name = "ERROR", value_parser = error_limit)]
    max_error: Option<f64>,
}

pub(crate) fn run(args: &MillArgs) -> Result<(), Failure> {
    let (programs, others): (Vec<PathBuf>, Vec<PathBuf>) =
        args.output.iter().cloned().partition(|output| program::is_program(output));
    let (pictures, blocks): (Vec<&PathBuf>, Vec<&PathBuf>) =
        others.iter().partition(|output| has_extension(output, "png"));
    if args.placing.as_placed && !blocks.is_empty() {
        return Err(Failure::Usage(
            "--as-placed judges a block as it stands in its file; one is written where its bench has it, without that flag"
                .into(),
        ));
    }
    for block in &blocks {
        Format::from_path(block).map_err(Failure::refused)?;
    }
    let report = report_files::path(args.report.as_deref(), args.report.is_none(), &args.block)?;
    let mut side_files: Vec<PathBuf> = blocks.iter().map(|output| side_files::path_beside(output)).collect();
    side_files.sort();
    side_files.dedup();
    let inputs = side_files::inputs(&args.block, args.bench.as_deref())?;
    let lists = args.cutters.iter().chain(&inputs).map(PathBuf::as_path);
    outputs::plan(lists, args.output.iter().cloned().chain(side_files).chain(report.clone()))?;
    let polish = args.polish.map(|length| Polish::new(length.mm)).transpose().map_err(Failure::refused)?;
    let progress = TerminalProgress::new();
    let piece = open_workpiece(
        &args.block,
        args.bench.as_deref(),
        args.placing.placing(),
        (None, None),
        args.pixels as usize,
        &progress,
    )?;
    let pass = match (&args.cutters, args.want_error) {
        (Some(list), Some(error)) => {
            let (direction, allowance_mm) = (args.rows.direction, args.allowance.mm);
            choose(list, &piece, &CutterRequirements { error, direction, allowance_mm, polish })?
        }
        _ => Pass { allowance_mm: args.allowance.mm, ..args.rows.pass() },
    };
    let mut verdict = Verdict::default();
    let study = MillStudy::of(&piece, pass, polish, &progress)
        .and_then(|study| study.say(&piece, &progress, &mut verdict).map(|()| study));
    progress.finish();
    let study = study?;
    console::verdict(&verdict);
    let name = args.block.display().to_string();
    console::text(&text::mill::steps(&name, &piece, &study, args.feed));
    for output in pictures {
        report::write_png(output, &maps::milling(&piece, &study, exposure_of(&piece.ideal, &piece)))
            .map_err(Failure::writing)?;
    }
    if !blocks.is_empty() {
        write_blocks(args, &piece, &study, &blocks)?;
    }
    let side = args.bench.clone().unwrap_or_else(|| side_files::path_beside(&args.block));
    let plan = ProgramPlan::of_pass(pass, args.feed, &args.write);
    let programs = program::write(&programs, &piece, &plan, (&side, polish), &progress)?;
    if let Some(path) = &report {
        let record = file_record(&args.block, None)?;
        let file = ReportedFile { name: &name, title: stem(&args.block), record, command: command() };
        let page = FoundPage::of_milling(
            file,
            &piece,
            (&study, &verdict, with_flags),
            args.feed,
            exposure_of(&piece.ideal, &piece),
        )?;
        report_files::write(path, &page.html()?)?;
        say!("\n  report         {}", path.display());
    }
    console::result(document::Result::Mill(document::Mill {
        file: name,
        verdict: verdict.document(with_flags),
        cutter: pass.cutter.to_string(),
        step_over_mm: pass.step_over_mm,
        rows: study.cost.rows,
        length_mm: study.cost.length_mm,
        minutes: study.cost.minutes(args.feed.mm_per_minute),
        steps: study.steps.iter().map(MillStep::document).collect(),
        files: document::texts(&args.output),
        programs,
    }));
    unless_within(args.max_error, study.last().view.metrics.rel_rms, "the", " in the end")
}

/// Tries the cutters of a list, and tells of every one.
fn choose(path: &Path, piece: &Workpiece, requirements: &CutterRequirements) -> Result<Pass, Failure> {
    let list = CutterList::parse(&Machine.text(path)?, path)?;
    let progress = TerminalProgress::new();
    say!("Cutters of {} for a relative RMS error of {}:", path.display(), requirements.error);
    console::text(&text::mill::trial_header());
    let tell = |trial: &CutterTrial| console::text(&text::mill::trial(trial));
    let chosen = cheapest(&list, piece, requirements, &progress, tell);
    progress.finish();
    match chosen? {
        Ok(pass) => {
            say!("Cheapest: {}; {} mm from row to row.\n", pass.cutter.in_words(), pass.step_over_mm);
            Ok(pass)
        }
        Err(least) => Err(Failure::BelowThreshold(format!(
            "no cutter of {} keeps to a relative RMS error of {}: the least met was {least:.4}; polish more or less, take smaller step-overs, or ask for less",
            path.display(),
            requirements.error
        ))),
    }
}

/// Writes the block as it is in the end, and its side files.
fn write_blocks(args: &MillArgs, piece: &Workpiece, study: &MillStudy, outputs: &[&PathBuf]) -> Result<(), Failure> {
    let (solid, bench, done) = study.result(piece)?;
    let design = study.export_design(piece, &stem(&args.block));
    let settings = &piece.side.design;
    let side = side_file(settings, bench, &solid, hash_of, &Machine)?;
    let mut sets: BTreeMap<PathBuf, SideFile> = BTreeMap::new();
    for output in outputs {
        export::export(output, &solid, &design).map_err(Failure::exporting)?;
        let side = sets.entry(side_files::path_beside(output)).or_insert_with(|| side.clone());
        side.files.insert(file_name(output), hash_of(output)?);
        side.work = Some(WorkRecord { done: done.clone() });
    }
    sets.iter().try_for_each(|(path, side)| side_files::write(side, path))
}
