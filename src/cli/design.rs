//! `glasswarp design`: from a picture to files, and a judgement of what was written.

use super::{
    console::{self, say},
    files::{self, Files},
    machine::Machine,
    memory::{self, MemoryArgs},
    outcome::{error_limit, unless_within, with_flags},
    outputs, program,
    progress::TerminalProgress,
    report_files::{self, file_record},
    side_files::{self, file_name, hash_of, open_workpiece, path_beside, stem},
};
use crate::{
    export::{Format, HeightMapFormat},
    fabricate::{Cutter, Pass},
    failure::Failure,
    pipeline::DesignedBlock,
    record::document,
    report::{
        BlockDrawings, DesignPage, FileRecord,
        pages::drawn::{self, WEAKNESS},
        text, write_png,
    },
    spec::{
        self, Length, PassArgs, Settings,
        mistakes::{self, is_toml},
        name_of,
    },
    study::{
        bench::bench_document,
        budget::BudgetStep,
        check::FaceForm,
        design::Plan,
        finish::Finished,
        fits,
        imperfect::ImperfectView,
        judge::Judgement,
        placement::{Placing, origin_of},
        program::ProgramPlan,
        verification::DesignVerification,
    },
};
use glasswarp_verify::load;
use image::GrayImage;
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::LazyLock,
    time::{Duration, Instant},
};

#[derive(clap::Args, Clone)]
pub(crate) struct DesignArgs {
    /// The picture, or a design file (.toml) that names it
    ///
    /// PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR, or SVG.
    pub(super) picture: PathBuf,

    /// A file to write (.stl .step .3mf .obj .glb .ply, or .ngc), several times if need be
    ///
    /// Its extension is the format [default: the picture's name with .stl, in the working folder]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,

    /// Write the exit face as a picture of heights for a router too: .png (16-bit) or .exr (32-bit,
    /// mm). May be given several times
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub(super) height_map: Vec<PathBuf>,

    /// Offset the height maps for this cutter, ball:d6mm (its diameter) or ball:r3mm (its radius),
    /// flat:d12mm or bull:d12mm,r1mm: they then tell where its tip goes. For programs that move the
    /// tool to the heights of the picture
    #[arg(long, value_name = "CUTTER", requires = "height_map", hide_short_help = true)]
    height_map_cutter: Option<Cutter>,

    /// Make one more plate, which stands behind and draws this picture together with those before it,
    /// on the same receiver. May be given several times: stack.stl becomes stack.1.stl, stack.2.stl, ...
    #[arg(long, value_name = "PICTURE", hide_short_help = true)]
    pub(super) then: Vec<PathBuf>,

    /// The air before every plate but the first, from the mean exit plane of the one before to its
    /// entry face; several times if they differ [default: 30mm]
    #[arg(long, value_name = "LENGTH", requires = "then", hide_short_help = true)]
    pub(super) gap: Vec<Length>,

    #[command(flatten)]
    pub(super) settings: Settings,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR", conflicts_with = "no_verify", value_parser = error_limit, hide_short_help = true)]
    max_error: Option<f64>,

    #[command(flatten)]
    memory: MemoryArgs,

    /// Do not trace the exported file; of the pictures, draw only where the solver itself expects
    /// the light to be wrong
    #[arg(long, hide_short_help = true)]
    no_verify: bool,

    /// Write the pictures of the report as files too (.png)
    ///
    /// Beside the first file: panel, caustic, difference, budget, contours, drawing.
    #[arg(long)]
    pictures: bool,

    /// Write everything into this folder, with all pictures
    ///
    /// It is made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub(super) out_dir: Option<PathBuf>,

    /// The report, a page of HTML for the people who will make the block [default: beside the first
    /// file, .report.html]
    #[arg(long, value_name = "FILE", conflicts_with = "no_report", hide_short_help = true)]
    pub(super) report: Option<PathBuf>,

    /// Write no report
    #[arg(long, hide_short_help = true)]
    no_report: bool,

    #[command(flatten)]
    pass: PassArgs,
}

/// Pixels across at which a program is judged, as a file of the design is.
const PROGRAM_PIXELS: usize = 1024;

pub(crate) fn run(args: &DesignArgs) -> Result<(), Failure> {
    make(args, &mut |design| console::result(document::Result::Design(Box::new(design))))
}

/// Makes a block, and hands over what there is to say of it for programs.
pub(super) fn make(args: &DesignArgs, keep: &mut dyn FnMut(document::Design)) -> Result<(), Failure> {
    let progress = TerminalProgress::new();
    let Task { plan, outputs, programs, report, with_pictures } = task(args, &progress)?;
    // First of all, since they may change what is wanted.
    progress.finish();
    plan.warnings().iter().for_each(console::warn);
    let read_back = (!args.no_verify).then(|| memory::read_back(&outputs));
    let expected = fits::design(&plan, read_back, args.memory.free())?;
    // Before hours are spent on a picture that is read in two ways.
    let target = if args.no_verify { None } else { Some(plan.target_light(&Machine)?) };
    let start = Instant::now();
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let solved = start.elapsed();
    progress.begin("writing files and tracing", 0);
    let task = files::Task {
        plan: &plan,
        block: &block,
        outputs: &outputs,
        tip: args.height_map_cutter,
        verified: !args.no_verify,
    };
    let drawings = LazyLock::new(|| BlockDrawings::of(&block, &plan));
    let first = files::first(&outputs);
    let name = file_name(&outputs[first]);
    let (Files { notes, others, side }, verification) = files::make(&task, first, |first| {
        if report.is_some() || !args.no_verify {
            // Before there is a file to look at.
            LazyLock::force(&drawings);
        }
        let Some(target) = &target else { return Ok(None) };
        let mesh = || first.mesh().map(|mesh| mesh.moved(origin_of(first.side, first.path)));
        let side = (name.as_str(), &first.side.bench, &first.side.design);
        DesignVerification::of(&plan, target, &block, side, mesh, &Machine)
    })?;
    let mut verification = verification?;
    if let Some(verification) = &mut verification {
        for (path, mesh) in others {
            let mesh = mesh.moved(origin_of(&side, &path));
            verification.add(&file_name(&path), mesh)?;
        }
    }
    let verdict = match &verification {
        Some(verification) => verification.verdict(&plan, &block),
        None => plan.unverified(),
    };
    progress.begin("drawing", 0);
    let draw = || {
        if !with_pictures {
            return Ok(Vec::new());
        }
        let write = |kind: &'static str, picture: &GrayImage| write_picture(&outputs[0], kind, picture);
        match &verification {
            Some(verification) => drawn::draw(&plan, verification, &drawings, write),
            None => drawn::weakness(&plan, &block).iter().map(|picture| write(WEAKNESS, picture)).collect(),
        }
    };
    let write_page = || {
        let Some(path) = &report else { return Ok(()) };
        let page = DesignPage {
            plan: &plan,
            title: stem(&outputs[0]),
            picture: (file_name(&plan.picture), hash_of(&plan.picture)?),
            files: file_records(&outputs)?,
            command: report_files::command(),
            block: &block,
            drawings: &drawings,
            verification: verification.as_ref(),
            verdict: &verdict,
            in_flags: with_flags,
            notes: &notes,
            solved,
        };
        report_files::write(path, &page.html())
    };
    let (pictures, written) = rayon::join(draw, write_page);
    progress.finish();
    let pictures = pictures?;
    written?;
    console::verdict(&verdict);
    let beside: BTreeSet<PathBuf> = outputs.iter().map(|output| path_beside(output)).collect();
    let beside: Vec<&PathBuf> = beside.iter().chain(&report).collect();
    console::text(&text::design::for_maker(&plan, (&outputs, &beside), &block, verification.as_ref()));
    if console::detailed() {
        say!("");
        console::text(&text::design::summary(&plan, &outputs, &block, solved, &notes));
        if !pictures.is_empty() {
            say!("  pictures       {}", text::list(&pictures));
        }
        if let Some(verification) = &verification {
            console::text(&text::judgement::judgement(&verification.judgement));
            console::text(&text::judgement::budget(&verification.steps, plan.bench.distance_mm()));
            let (finished, imperfect) = (&verification.finished, &verification.imperfect);
            finished.iter().for_each(|finished| console::text(&text::judgement::finished(finished)));
            imperfect.iter().for_each(|view| console::text(&text::judgement::imperfect(view, &plan.settings)));
        }
    }
    block.summary.warnings.iter().for_each(console::warn);
    let (judged, drawn) = (&outputs[first], ProgramPlan::of(&args.pass));
    let programs = match programs.as_slice() {
        [] => Vec::new(),
        programs => {
            let piece = open_workpiece(judged, None, Placing::Righted, (None, None), PROGRAM_PIXELS, &progress)?;
            let polish = plan.settings.finish.and_then(|finish| finish.polish);
            program::write(programs, &piece, &drawn, (&path_beside(judged), polish), &progress)?
        }
    };
    let checked = verification.as_ref();
    keep(document::Design {
        verdict: verdict.document(with_flags),
        files: document::texts(&outputs),
        pictures: document::texts(&[pictures, report.into_iter().collect()].concat()),
        block: plan.document(&block),
        bench: bench_document(&plan.scene, block.solid.entry_z_mm()),
        solver: solver_document(&plan, &block, solved),
        notes: plan.understood.line().map(|line| format!("picture: {line}")).into_iter().chain(notes).collect(),
        judgement: checked.map(|verification| verification.judgement.document()),
        budget: checked.iter().flat_map(|verification| &verification.steps).map(BudgetStep::document).collect(),
        finished: checked.and_then(|verification| verification.finished.as_ref()).map(Finished::document),
        imperfect: checked.and_then(|verification| verification.imperfect.as_ref()).map(ImperfectView::document),
        expected_memory: expected.0,
        programs,
    });
    let Some(DesignVerification { imperfect, finished, judgement, .. }) = &verification else { return Ok(()) };
    demand(judgement, finished.as_ref(), imperfect.as_ref(), args.max_error)
}

/// Writes a picture beside the first output.
fn write_picture(output: &Path, kind: &str, picture: &GrayImage) -> Result<PathBuf, Failure> {
    let path = files::picture_of(output, kind);
    write_png(&path, picture).map_err(Failure::writing)?;
    Ok(path)
}

/// Fails if photons and beams contradict each other, or the error in the light that there is, after
/// the finish or else in perfect light exceeds a limit.
pub(super) fn demand(
    judgement: &Judgement,
    finished: Option<&Finished>,
    imperfect: Option<&ImperfectView>,
    limit: Option<f64>,
) -> Result<(), Failure> {
    judgement.demand_agreement()?;
    let (error, when) = match (imperfect, finished, &judgement.picture) {
        (Some(view), ..) => (view.likeness().rel_rms, " in the light that there is"),
        (None, Some(finished), _) => (finished.view.metrics.rel_rms, " after the finish"),
        (None, None, Some(verdict)) => (verdict.metrics.rel_rms, ""),
        (None, None, None) => return Ok(()),
    };
    unless_within(limit, error, "the caustic's", when)
}

fn solver_document(plan: &Plan, block: &DesignedBlock, solved: Duration) -> document::Solver {
    document::Solver {
        name: name_of(plan.solver),
        iterations: block.summary.iterations(),
        seconds: solved.as_secs_f64(),
        levels_at_limit: block.summary.levels_at_limit(),
        notes: block.summary.notes.clone(),
    }
}

/// What is to be done.
struct Task {
    plan: Plan,
    outputs: Vec<PathBuf>,
    programs: Vec<PathBuf>,
    report: Option<PathBuf>,
    with_pictures: bool,
}

fn task(args: &DesignArgs, progress: &TerminalProgress) -> Result<Task, Failure> {
    let named = args.picture.display();
    if load::Format::from_path(&args.picture).is_ok_and(|format| FaceForm::of_file(format) != FaceForm::Heights) {
        return Err(Failure::Usage(format!(
            "{named} is a block and no picture: 'glasswarp verify {named}' judges it, 'glasswarp ready {named}' asks whether to make it"
        )));
    }
    let (settings, picture) = spec::settings(&args.picture, &args.settings, &Machine)?;
    let (programs, outputs): (Vec<PathBuf>, Vec<PathBuf>) =
        outputs(args, &args.picture, &picture).into_iter().partition(|output| program::is_program(output));
    for output in &outputs {
        Format::from_path(output).map_err(Failure::refused)?;
    }
    for map in &args.height_map {
        HeightMapFormat::from_path(map).map_err(Failure::refused)?;
    }
    let within = |path: &PathBuf| args.within(path);
    let outputs: Vec<PathBuf> = outputs.iter().chain(&args.height_map).map(within).collect();
    let programs: Vec<PathBuf> = programs.iter().map(within).collect();
    let report = args.report.as_ref().map(within);
    let report = report_files::path(report.as_deref(), args.no_report, &outputs[0])?;
    let inputs = [&args.picture, &picture].map(PathBuf::as_path);
    let with_pictures = args.pictures || args.out_dir.is_some();
    let derived = files::derived(&outputs, &settings, (!args.no_verify, with_pictures));
    args.make_folder()?;
    let written = outputs.iter().chain(&programs).cloned().chain(derived).chain(report.clone());
    outputs::plan(inputs.into_iter().chain(settings.files()), written)?;
    let plan = Plan::new(picture, settings, &Machine, progress).map_err(|failure| placed(failure, &args.picture))?;
    if let Some(cutter) = args.height_map_cutter {
        // Whether it fits onto the block; rows are the program's affair.
        Pass::finishing(cutter, cutter.radius_mm()).check(plan.bench.block()).map_err(Failure::refused)?;
    }
    Ok(Task { plan, outputs, programs, report, with_pictures })
}

/// A refusal with the lines of the design file that it speaks of, if `named` is one.
pub(super) fn placed(refusal: Failure, named: &Path) -> Failure {
    let text = if is_toml(named) { std::fs::read_to_string(named).unwrap_or_default() } else { String::new() };
    mistakes::placed(refusal, &text, named)
}

/// Files with what they are, their lengths and hashes, which side files know already.
fn file_records(outputs: &[PathBuf]) -> Result<Vec<FileRecord>, Failure> {
    let mut sides: Vec<PathBuf> = outputs.iter().map(|path| path_beside(path)).collect();
    sides.dedup();
    let known: Vec<_> = sides.iter().filter_map(|side| side_files::find(side, Some(side)).ok().flatten()).collect();
    let recorded = |path: &Path| known.iter().find_map(|side| side.files.get(&file_name(path)).cloned());
    outputs.iter().chain(&sides).map(|path| file_record(path, recorded(path))).collect()
}

/// What is asked for, a file of the block first, which there always is.
pub(super) fn outputs(args: &DesignArgs, named: &Path, picture: &Path) -> Vec<PathBuf> {
    let mut outputs = args.output.clone();
    outputs.sort_by_key(|output| program::is_program(output));
    match outputs.first() {
        // A program is read back over the block that it is for.
        Some(first) if program::is_program(first) => outputs.insert(0, first.with_extension("stl")),
        Some(_) => {}
        None => outputs.push(default_output(named, picture)),
    }
    outputs
}

impl DesignArgs {
    /// Where an output lies.
    pub(super) fn within(&self, output: &Path) -> PathBuf {
        self.out_dir.as_ref().map_or_else(|| output.to_path_buf(), |folder| folder.join(output))
    }

    /// Makes the folder of all files, if there is to be one.
    pub(super) fn make_folder(&self) -> Result<(), Failure> {
        self.out_dir.as_ref().map_or(Ok(()), |folder| {
            std::fs::create_dir_all(folder).map_err(|source| Failure::Io {
                what: format!("the folder {} cannot be made", folder.display()),
                source: source.into(),
            })
        })
    }
}

fn default_output(named: &Path, picture: &Path) -> PathBuf {
    // samples/camera/design.toml with target.png makes camera.stl: the folder tells more than the
    // file.
    let stem = |path: &Path| path.file_stem().map(PathBuf::from);
    let folder = named.parent().and_then(Path::file_name).map(PathBuf::from);
    let name = if named == picture { stem(named) } else { folder.or_else(|| stem(named)) };
    name.unwrap_or_else(|| "block".into()).with_extension("stl")
}
