//! `glasswarp design`: from a picture to files, and a judgement of what was written.

use super::{
    bench::{self, exit_face_in_words, receiver_in_words},
    budget,
    console::{self, say},
    error::{Failure, error_limit},
    files::{self, Files},
    finish::Finished,
    imperfect::Seen,
    json, memory,
    opinion::{Opinion, draw_weakness},
    outputs,
    page::{self, DesignPage, Portrait},
    plan::Plan,
    progress::TerminalProgress,
    settings::{Settings, name_of},
    toml_file,
};
use glasswarp::{
    export::{Format, HeightMapFormat},
    fabricate::{Cutter, Pass},
    optim::Termination,
    pipeline::DesignedBlock,
    solid::Origin,
};
use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
    time::{Duration, Instant},
};

#[derive(clap::Args)]
pub(crate) struct DesignArgs {
    /// The picture (PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR, SVG), or a design file (.toml) that names it
    picture: PathBuf,

    /// A file to write; its extension is the format: .stl, .obj, .glb, .step, .3mf or .ply. May be given several times
    /// [default: the picture's name with .stl, in the working folder]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Write the exit face as a picture of heights for a router too: .png (16-bit) or .exr (32-bit, mm). May be given several
    /// times
    #[arg(long, value_name = "FILE")]
    height_map: Vec<PathBuf>,

    /// Offset the height maps for this cutter, ball:3mm, flat:6mm or bull:6mm,1mm (radii): they then tell where its tip goes. For
    /// programs that move the tool to the heights of the picture
    #[arg(long, value_name = "CUTTER", requires = "height_map")]
    pub(crate) height_map_cutter: Option<Cutter>,

    #[command(flatten)]
    settings: Settings,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR", conflicts_with = "no_verify", value_parser = error_limit)]
    max_error: Option<f64>,

    /// Take more memory than this machine has free, if it must be
    #[arg(long)]
    ignore_memory: bool,

    /// Do not trace the exported file; draw only where the solver itself expects the light to be wrong
    #[arg(long)]
    no_verify: bool,

    /// The report, a page of HTML for the people who will make the block [default: beside the first file, .report.html]
    #[arg(long, value_name = "FILE", conflicts_with = "no_report")]
    report: Option<PathBuf>,

    /// Write no report
    #[arg(long)]
    no_report: bool,
}

impl DesignArgs {
    pub(crate) fn is_verified(&self) -> bool {
        !self.no_verify
    }

    pub(crate) fn ignores_memory(&self) -> bool {
        self.ignore_memory
    }
}

pub(crate) fn run(args: &DesignArgs) -> Result<(), Failure> {
    let Task { plan, outputs, report } = task(args)?;
    let expected = memory::check(&plan, &outputs, args)?;
    // Before hours are spent on a picture that is read in two ways.
    let wanted = if args.no_verify { None } else { Some(plan.wanted()?) };
    let progress = TerminalProgress::new();
    let start = Instant::now();
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let solved = start.elapsed();
    progress.begin("writing files and tracing", 0);
    let task = files::Task { plan: &plan, block: &block, outputs: &outputs, args };
    let portrait = LazyLock::new(|| Portrait::of(&block, &plan.bench));
    let (Files { notes, others }, opinion) = files::make(&task, |first| {
        if report.is_some() || !args.no_verify {
            // Before there is a file to look at.
            LazyLock::force(&portrait);
        }
        wanted.as_ref().map_or(Ok(None), |wanted| Opinion::of(&plan, wanted, &block, first))
    })?;
    let mut opinion = opinion?;
    opinion.as_mut().map_or(Ok(()), |opinion| opinion.add(others))?;
    progress.begin("drawing", 0);
    let draw = || match &opinion {
        Some(opinion) => opinion.draw(&plan, &outputs[0], &portrait),
        None => draw_weakness(&plan, &outputs[0], &block),
    };
    let write_page = || {
        let Some(path) = &report else { return Ok(()) };
        let (opinion, portrait) = (opinion.as_ref(), &*portrait);
        DesignPage { plan: &plan, outputs: &outputs, block: &block, portrait, opinion, notes: &notes, solved }
            .write(path)
    };
    let (pictures, written) = rayon::join(draw, write_page);
    progress.finish();
    let pictures = pictures?;
    written?;
    print_summary(&plan, &outputs, &block, solved, &notes)?;
    if !pictures.is_empty() {
        say!("  pictures       {}", list(&pictures));
    }
    if let Some(path) = &report {
        say!("  report         {}", path.display());
    }
    if let Some(opinion) = &opinion {
        opinion.judgement.print();
        budget::print(&opinion.steps, plan.bench.distance_mm());
        opinion.finished.iter().for_each(Finished::print);
        opinion.seen.iter().for_each(|seen| seen.print(&plan.settings));
    }
    for warning in &block.summary.warnings {
        console::warn(warning);
    }
    console::result(json::Result::Design(Box::new(json::Design {
        files: json::texts(&outputs),
        pictures: json::texts(&[pictures, report.into_iter().collect()].concat()),
        block: json::Block::of(&plan, &block),
        bench: bench::to_json(&plan.scene()?, block.solid.entry_z_mm()),
        solver: solver_to_json(&plan, &block, solved),
        notes: plan.understood.line().map(|line| format!("picture: {line}")).into_iter().chain(notes).collect(),
        judgement: opinion.as_ref().map(|opinion| opinion.judgement.to_json()),
        budget: opinion.iter().flat_map(|opinion| &opinion.steps).map(json::BudgetStep::from).collect(),
        finished: opinion.as_ref().and_then(|opinion| opinion.finished.as_ref()).map(Finished::to_json),
        imperfect: opinion.as_ref().and_then(|opinion| opinion.seen.as_ref()).map(Seen::to_json),
        expected_memory: expected.0,
    })));
    let Some(Opinion { seen, finished, judgement, .. }) = opinion else { return Ok(()) };
    judgement.demand_agreement()?;
    match (seen, finished) {
        (Some(seen), _) => seen.demand(args.max_error),
        (None, Some(finished)) => finished.demand(args.max_error),
        (None, None) => judgement.demand(args.max_error),
    }
}

fn solver_to_json(plan: &Plan, block: &DesignedBlock, solved: Duration) -> json::Solver {
    json::Solver {
        name: name_of(plan.solver),
        iterations: block.summary.iterations(),
        seconds: solved.as_secs_f64(),
        levels_at_limit: levels_at_limit(block),
        notes: block.summary.notes.clone(),
    }
}

fn levels_at_limit(block: &DesignedBlock) -> usize {
    block.summary.levels.iter().filter(|level| level.termination == Termination::IterationLimit).count()
}

/// What is to be done.
struct Task {
    plan: Plan,
    outputs: Vec<PathBuf>,
    report: Option<PathBuf>,
}

fn task(args: &DesignArgs) -> Result<Task, Failure> {
    let (settings, picture) = Settings::of(&args.picture, &args.settings)?;
    let outputs =
        if args.output.is_empty() { vec![default_output(&args.picture, &picture)] } else { args.output.clone() };
    for output in &outputs {
        Format::from_path(output).map_err(Failure::refused)?;
    }
    for map in &args.height_map {
        HeightMapFormat::from_path(map).map_err(Failure::refused)?;
    }
    let outputs = [outputs, args.height_map.clone()].concat();
    let report = page::path(args.report.as_deref(), args.no_report, &outputs[0])?;
    let inputs = [&args.picture, &picture].map(PathBuf::as_path);
    let derived = files::derived(&outputs, &settings, args.is_verified());
    let written = outputs.iter().cloned().chain(derived).chain(report.clone());
    outputs::plan(inputs.into_iter().chain(settings.files()), written)?;
    let plan = Plan::new(picture, settings).map_err(|failure| toml_file::placed(failure, &args.picture))?;
    if let Some(cutter) = args.height_map_cutter {
        // Whether it fits onto the block; rows are the program's affair.
        Pass::finishing(cutter, cutter.radius_mm()).check(plan.bench.block()).map_err(Failure::refused)?;
    }
    Ok(Task { plan, outputs, report })
}

fn default_output(named: &Path, picture: &Path) -> PathBuf {
    // samples/camera/design.toml with target.png makes camera.stl: the folder tells more than the file.
    let stem = |path: &Path| path.file_stem().map(PathBuf::from);
    let folder = named.parent().and_then(Path::file_name).map(PathBuf::from);
    let name = if named == picture { stem(named) } else { folder.or_else(|| stem(named)) };
    name.unwrap_or_else(|| "block".into()).with_extension("stl")
}

/// Prints what was made.
fn print_summary(
    plan: &Plan,
    outputs: &[PathBuf],
    block: &DesignedBlock,
    solved: Duration,
    notes: &[String],
) -> Result<(), Failure> {
    let (solid, bench) = (&block.solid, &plan.bench);
    say!("{}", list(outputs));
    if let Some(line) = plan.understood.line() {
        say!("  picture        {line}");
    }
    say!(
        "  block          {:.2} x {:.2} mm, cut from a sheet of {} mm, {}",
        solid.surface().extent().width_mm,
        solid.surface().extent().height_mm,
        (solid.thickness_mm() * 1000.0).round() / 1000.0,
        exit_face_in_words(bench.exit_face())
    );
    say!(
        "  exit face      relief {:.2} mm, thinnest place {:.2} mm thick, {} x {} nodes",
        block.surface.relief_mm(),
        solid.thinnest_mm(),
        plan.nodes.0,
        plan.nodes.1
    );
    if let (Some(rim), Some(z)) = (solid.shape().rim, solid.rim_z_mm()) {
        let stock = solid.stock_extent();
        say!(
            "  rim            {} mm wide, its plane {:.2} mm above the entry face; {:.2} x {:.2} mm in all",
            rim.width_mm,
            z - solid.entry_z_mm(),
            stock.width_mm,
            stock.height_mm
        );
    }
    let skirt = 0.5 * (solid.surface().extent().width_mm - bench.block().width_mm);
    if skirt > 0.0 {
        say!(
            "  skirt          the exit face goes on {skirt:.2} mm beyond the {:.2} x {:.2} mm that draw, for the light from the side; \
             cover it for a picture without a glow around it",
            bench.block().width_mm,
            bench.block().height_mm
        );
    }
    if solid.shape().origin != Origin::Exit {
        say!("  origin         {}", solid.shape().origin.place());
    }
    say!("  light          {}", plan.light_in_words(solid.entry_z_mm())?);
    say!("  receiver       {}", receiver_in_words(bench, block.surface.range_mm().1));
    plan.intent.print();
    let stopped = levels_at_limit(block);
    let limit = if stopped > 0 {
        format!(", {stopped} of {} levels stopped at the iteration limit", block.summary.levels.len())
    } else {
        String::new()
    };
    say!(
        "  solver         {}, {} iterations, {:.2} s{limit}",
        name_of(plan.solver),
        block.summary.iterations(),
        solved.as_secs_f64()
    );
    for note in &block.summary.notes {
        say!("                 {note}");
    }
    for note in notes {
        say!("  {note}");
    }
    Ok(())
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
