//! `glasswarp verify`: opens a solid as a stranger would and judges the light that comes through
//! it.

use super::{
    console::{self, say},
    design::demand,
    machine::{IrradianceFile, Machine, read_mesh},
    memory::MemoryArgs,
    outcome::{error_limit, with_flags},
    outputs, program,
    progress::TerminalProgress,
    report_files::{self, command, file_record},
    shards::{self, MergeArgs},
    side_files::{self, expected, stem},
    stack, sweep,
};
use crate::{
    failure::Failure,
    irradiance::Transfer,
    record::{SideFile, document},
    report::{
        Exposure,
        pages::found::{FoundLight, FoundPage, ReportedFile},
        text,
    },
    spec::{Length, ProgramArgs, Range, Settings, Shard, SurfaceName, TransferName, WindowSize},
    study::{
        before::Before,
        behind,
        bench::bench_document,
        budget::{self, BudgetStep},
        changed::{scene_of_file, with_window},
        diagnosis,
        finish::Finished,
        fits,
        imperfect::{ImperfectView, spread},
        judge::{self, Examiner, Subject},
        placement::{Opened, Placing},
        target_light::TargetLight,
        white::WhiteLight,
    },
};
use clap::{Args, Subcommand};
use glasswarp_verify::{Fresnel, Image, PhotonPlan, Scene, Surface};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct VerifyArgs {
    #[command(subcommand)]
    action: Option<Action>,

    #[command(flatten)]
    file: FileArgs,
}

#[derive(Subcommand)]
enum Action {
    /// Add up the photon tallies of a run's parts (see --shard)
    Merge(MergeArgs),
}

#[derive(Args)]
pub(crate) struct FileArgs {
    /// The block, or any closed solid: .stl, .obj, .glb, .gltf, .ply, .off, .3mf, .step, or a
    /// height map in .png or .exr; or the program that a machine shall cut it by (.ngc, .nc, .tap,
    /// .gcode, .cnc)
    #[arg(required = true)]
    block: Option<PathBuf>,

    #[command(flatten)]
    placing: PlacingArgs,

    /// The picture that its light shall draw [default: the one named in the side file]
    #[arg(long, value_name = "PICTURE")]
    target: Option<PathBuf>,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// From z = 0 (of a block the mean plane of the exit face) to the receiver, on which the window
    /// stays where the light of a flat block falls [default: the side file's]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    distance: Option<Length>,

    /// Refractive index [default: the side file's]
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// Window on the receiver, around the axis: its width, or WIDTHxHEIGHT [default: the side
    /// file's, or the size of the solid]
    #[arg(long, value_name = "SIZE")]
    window: Option<WindowSize>,

    /// Constant added to the light of the picture [default: the side file's]
    #[arg(long, value_name = "LIGHT")]
    offset: Option<f64>,

    /// How numbers in the picture become light [default: the side file's]
    #[arg(long, value_name = "CURVE")]
    transfer: Option<TransferName>,

    /// How the surface between the vertices is understood [default: spline for a block, facets for
    /// another solid]
    #[arg(long, value_name = "NAME")]
    surface: Option<SurfaceName>,

    /// Count the light that is partially reflected at both faces (Fresnel, unpolarised)
    #[arg(long)]
    fresnel: bool,

    /// Pixels across at which to judge, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Photons that confirm the beams and account for all light
    #[arg(long, value_name = "N", default_value_t = 4_000_000, help_heading = "Photons")]
    photons: u64,

    /// Seed of the photons
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Photons")]
    seed: u64,

    /// Independent samples into which the photons are cut, at least 4: their spread is the noise,
    /// and a run has at most as many parts
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(4..), help_heading = "Photons")]
    replicates: u32,

    /// Trace photons only, and write their exact sums to this file (OpenEXR)
    #[arg(long, value_name = "FILE", help_heading = "Photons")]
    tally: Option<PathBuf>,

    /// Trace only part K of N of the run; 'glasswarp verify merge' adds the tallies up
    #[arg(long, value_name = "K/N", requires = "tally", help_heading = "Photons")]
    shard: Option<Shard>,

    /// Design the block anew along a range, and look at every one: distance, size, thickness, index
    /// or nodes, as in distance=60..1000
    #[arg(long, value_name = "WHAT=FROM..TO", help_heading = "Sweep", conflicts_with_all = ["tally", "max_error"])]
    sweep: Option<Range>,

    /// Number of places along the range, in equal ratios
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=1000), help_heading = "Sweep")]
    steps: u32,

    /// Do not design anew: look at this very block away from its bench (distance and index only)
    #[arg(long, requires = "sweep", help_heading = "Sweep")]
    as_built: bool,

    /// Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear). Of a
    /// sweep: .csv, .exr (all images as layers) or .png (the curves)
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Look at the block in white light too, of which its material bends every colour otherwise,
    /// and write that picture: .png (sRGB) or .exr (linear, the primaries of sRGB)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tally", "sweep"])]
    white: Option<PathBuf>,

    /// Write a report on the block, a page of HTML
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tally", "sweep"])]
    report: Option<PathBuf>,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR", value_parser = error_limit)]
    max_error: Option<f64>,

    #[command(flatten)]
    program: ProgramArgs,

    #[command(flatten)]
    memory: MemoryArgs,
}

impl FileArgs {
    /// A flag that means nothing for a program, if there is one.
    fn meaningless_for_programs(&self) -> Option<&'static str> {
        [
            (self.placing.as_placed, "--as-placed"),
            (self.target.is_some(), "--target"),
            (self.window.is_some(), "--window"),
            (self.offset.is_some(), "--offset"),
            (self.transfer.is_some(), "--transfer"),
            (self.surface.is_some(), "--surface"),
            (self.fresnel, "--fresnel"),
            (self.tally.is_some(), "--tally"),
            (self.sweep.is_some(), "--sweep"),
            (self.white.is_some(), "--white"),
            (self.report.is_some(), "--report"),
        ]
        .into_iter()
        .find_map(|(given, flag)| given.then_some(flag))
    }
}

/// How a file's coordinates are understood.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(super) struct PlacingArgs {
    /// Take the block exactly as it stands in its file, wherever and however that is. Otherwise it
    /// is brought where its bench has it, with a warning
    #[arg(long)]
    pub(super) as_placed: bool,
}

impl PlacingArgs {
    pub(super) fn placing(self) -> Placing {
        if self.as_placed { Placing::AsPlaced } else { Placing::Righted }
    }
}

pub(crate) fn run(args: &VerifyArgs) -> Result<(), Failure> {
    match (&args.action, &args.file.block) {
        (Some(Action::Merge(merge)), _) => shards::merge(merge),
        (None, Some(block)) => match stack::plates(block)? {
            Some(plates) => verify_stack(&plates, &args.file),
            None => verify(block, &args.file, &mut |found| {
                console::result(document::Result::Verify(Box::new(found)));
            }),
        },
        (None, None) => Err(Failure::Usage("name a block to verify".into())),
    }
}

/// Looks at every plate of a stack with those before it.
fn verify_stack(plates: &[PathBuf], args: &FileArgs) -> Result<(), Failure> {
    let alone = [
        (!args.output.is_empty(), "--output"),
        (args.report.is_some(), "--report"),
        (args.white.is_some(), "--white"),
        (args.tally.is_some(), "--tally"),
        (args.sweep.is_some(), "--sweep"),
        (args.target.is_some(), "--target"),
        (args.bench.is_some(), "--bench"),
        (args.distance.is_some(), "--distance"),
    ];
    if let Some((_, flag)) = alone.into_iter().find(|(given, _)| *given) {
        return Err(Failure::Usage(format!(
            "{flag} is about one block: give it with the file of a plate of this stack"
        )));
    }
    let mut found = Vec::new();
    let short = stack::each(plates, PathBuf::as_path, |_, plate| verify(plate, args, &mut |seen| found.push(seen)))?;
    console::result(document::Result::StackLight(Box::new(document::StackLight { plates: found })));
    short.map_or(Ok(()), Err)
}

fn verify(block: &Path, args: &FileArgs, keep: &mut dyn FnMut(document::Verify)) -> Result<(), Failure> {
    if program::is_program(block) {
        if let Some(flag) = args.meaningless_for_programs() {
            return Err(Failure::Usage(format!(
                "{flag} is about a block's file, and {} is a program",
                block.display()
            )));
        }
        let look = program::Look {
            machine: &args.program,
            bench: args.bench.as_deref(),
            changed: (args.ior, args.distance.map(|length| length.mm)),
            pixels: args.pixels as usize,
            output: &args.output,
            max_error: args.max_error,
        };
        return program::verify(block, &look);
    }
    if args.program.is_given() {
        return Err(Failure::Usage(format!(
            "{} is no program (.ngc, .nc, .tap, .gcode, .cnc), and --tool, --origin, --stock and what goes with them are about programs",
            block.display()
        )));
    }
    if args.sweep.is_none() {
        args.output.iter().chain(&args.white).try_for_each(|output| IrradianceFile::of(output).map(drop))?;
    }
    let side = side_files::find(block, args.bench.as_deref())?;
    if side.is_none() && (args.sweep.is_some() || args.ior.is_none() || args.distance.is_none()) {
        return Err(no_side_file(block));
    }
    if args.placing.as_placed && args.sweep.is_some() {
        return Err(Failure::Usage("--as-placed is about one look at a file, not about a sweep".into()));
    }
    let report = report_files::path(args.report.as_deref(), args.report.is_none(), block)?;
    let inputs = side_files::inputs(block, args.bench.as_deref())?;
    let written = args.output.iter().chain(&args.white).chain(&args.tally).chain(&report);
    outputs::plan(inputs.iter().chain(&args.target).map(PathBuf::as_path), written.cloned())?;
    if let (Some(range), Some(side)) = (&args.sweep, &side) {
        let place = args.as_built.then_some(block);
        let side = (side, args.bench.as_deref());
        return sweep::run(range, args.steps as usize, side, place, (args.pixels as usize, args.memory), &args.output);
    }
    let mut warnings = side.as_ref().map(|side| warnings(block, args, side)).unwrap_or_default();
    let progress = TerminalProgress::new();
    let before = behind::of_side(side.as_ref(), &Machine)?;
    let known = side.as_ref().map(|side| (side, &before));
    let (target_light, offset) = target_light(args, known, &progress)?;
    let target = target_light.as_ref().map(TargetLight::in_perfect_light);
    if args.max_error.is_some() && target.is_none() {
        return Err(Failure::Usage("--max-error needs a picture: name one with --target".into()));
    }
    let name = block.display().to_string();
    let opened = Opened::of(read_mesh(block)?, &name, expected(side.as_ref(), block), args.placing.placing())?;
    let scene = scene(block, args, known, &opened.subject, target)?;
    let (subject, moves) = opened.upright(&name, &scene, target)?;
    warnings.extend(moves);
    if report.is_some() && matches!(subject, Subject::Solid(_)) {
        return Err(Failure::Usage(format!("{name} is no block, and a report (--report) is about blocks")));
    }
    if args.white.is_some() {
        // Before minutes of tracing.
        WhiteLight::material(&subject, &scene, side.as_ref().map(|side| &side.design))?;
    }
    let fresnel = if args.fresnel { Fresnel::On } else { Fresnel::Off };
    let surface = args.surface.map(Surface::from);
    let examiner = Examiner::new(scene.clone(), target, args.pixels as usize).with_surface(surface, fresnel);
    fits::pixels(&examiner, args.memory.free())?;
    let shard = args.shard.unwrap_or(Shard { index: 0, of: 1 });
    let plan =
        PhotonPlan::new(args.photons, args.seed).with_replicates(args.replicates).with_shard(shard.index, shard.of);
    warnings.iter().for_each(console::warn);
    if let Some(path) = &args.tally {
        // Photons see the light that there is.
        let (scene, picture) = match (&target_light, &side) {
            (Some(target), Some(side)) => (spread(scene, &side.design), Some(&target.picture)),
            _ => (scene, target),
        };
        let examiner = Examiner::new(scene, picture, args.pixels as usize).with_surface(surface, fresnel);
        let tracer = subject.tracer(&examiner.scene_for(&subject))?;
        let error = shards::trace(block, &tracer, &plan, path, examiner.target())?;
        return shards::demand(error, args.max_error);
    }
    progress.begin("tracing", 3);
    let judgement = judge::judge(&subject, &examiner, &plan)?;
    progress.advance(1);
    for suspicion in diagnosis::of_judgement(&subject, &examiner, target, &judgement)? {
        console::warn(&suspicion);
        warnings.push(suspicion);
    }
    let steps = budget::of_file(&subject, &examiner, &judgement)?;
    progress.finish();
    console::text(&text::judgement::subject(&name, &subject, &scene, offset));
    console::text(&text::judgement::judgement(&judgement));
    console::text(&text::judgement::budget(&steps, scene.distance_mm));
    // A block that has not been finished yet is judged as it will be.
    let finish = side.as_ref().filter(|side| side.work.is_none()).and_then(|side| side.design.finish);
    let finished = finish
        .filter(|_| examiner.target().is_some())
        .map(|finish| Finished::of(finish, &subject, &examiner))
        .transpose()?;
    finished.iter().for_each(|finished| console::text(&text::judgement::finished(finished)));
    let imperfect = match (&side, &target_light) {
        (Some(side), Some(target)) => ImperfectView::of(&subject, &scene, target, &side.design, &plan, &Machine)?,
        _ => None,
    };
    if let (Some(view), Some(side)) = (&imperfect, &side) {
        console::text(&text::judgement::imperfect(view, &side.design));
    }
    let white = args.white.as_ref().map(|output| white(output, &subject, &examiner, side.as_ref())).transpose()?;
    keep(document::Verify {
        file: name.clone(),
        kind: if matches!(subject, Subject::Block(_)) { "block" } else { "solid" }.to_owned(),
        size_mm: subject.size_mm().to_array(),
        bench: bench_document(&scene, subject.entry_z_mm()),
        offset,
        judgement: judgement.document(),
        budget: steps.iter().map(BudgetStep::document).collect(),
        finished: finished.as_ref().map(Finished::document),
        imperfect: imperfect.as_ref().map(ImperfectView::document),
        white: white.as_ref().map(WhiteLight::document),
        files: document::texts(&args.output),
    });
    // White is the brightest target, as on the wall.
    let brightest = imperfect.as_ref().map(|view| &view.target).or(examiner.target()).unwrap_or(&judgement.caustic);
    let peak = brightest.values.iter().copied().fold(0.0, f64::max);
    let image = imperfect.as_ref().map_or(&judgement.caustic, |view| &view.image);
    console::light("irradiance", image);
    if let Some(target) = imperfect.as_ref().map(|view| &view.target).or(examiner.target()) {
        console::light("target", target);
    }
    for output in &args.output {
        IrradianceFile::of(output)?.write(output, image, peak)?;
    }
    if let Some(path) = &report {
        let exposure = exposure(args, side.as_ref(), peak / brightest.mean());
        let file =
            ReportedFile { name: &name, title: stem(block), record: file_record(block, None)?, command: command() };
        let shown = FoundLight { scene: &scene, judgement: &judgement, steps: &steps, exposure };
        let warnings = warnings.iter().map(|warning| with_flags(warning)).collect();
        let page = FoundPage::of_judgement(file, side.as_ref(), &subject, &examiner, shown, warnings)?;
        report_files::write(path, &page.html()?)?;
        say!("  report         {}", path.display());
    }
    demand(&judgement, finished.as_ref(), imperfect.as_ref(), args.max_error)
}

/// How light is shown as a picture whose brightest is `white`, in means.
fn exposure(args: &FileArgs, side: Option<&SideFile>, white: f64) -> Exposure {
    let transfer = args.transfer.or(side.and_then(|side| side.design.transfer)).map(Transfer::from);
    Exposure { white, transfer: transfer.unwrap_or(Transfer::Srgb) }
}

fn no_side_file(block: &Path) -> Failure {
    side_files::missing(block, ", or give --ior and --distance")
}

/// Looks at a block in white light, and writes its picture.
fn white(
    output: &Path,
    subject: &Subject,
    examiner: &Examiner,
    side: Option<&SideFile>,
) -> Result<WhiteLight, Failure> {
    let scene = examiner.scene_for(subject);
    let white = WhiteLight::of(subject, &scene, side.map(|side| &side.design), examiner.beams())?;
    for (name, light) in ["red", "green", "blue"].into_iter().zip(&white.rgb) {
        console::light(name, light);
    }
    IrradianceFile::of(output)?.write_rgb(output, &white.rgb)?;
    console::text(&text::judgement::white(&white, &output.display().to_string()));
    Ok(white)
}

/// What the light is judged by, and the constant in it. Without a side file a picture need not be
/// named.
fn target_light(
    args: &FileArgs,
    side: Option<(&SideFile, &Before)>,
    progress: &TerminalProgress,
) -> Result<(Option<TargetLight>, Option<f64>), Failure> {
    let design = side.map(|(side, _)| side.design.clone()).unwrap_or_default();
    let settings = Settings {
        picture: args.target.clone().or(design.picture.clone()),
        transfer: args.transfer.or(design.transfer),
        offset: Some(args.offset.or(design.offset).unwrap_or(0.0)),
        ..design
    };
    match (&settings.picture, side) {
        (Some(_), _) => Ok((Some(TargetLight::of_file(&settings, side, &Machine, progress)?), settings.offset)),
        (None, Some(_)) => Err(Failure::Usage("the side file names no picture: give one with --target".into())),
        (None, None) => Ok((None, None)),
    }
}

/// The bench: what the side file says, and flags say otherwise.
fn scene(
    block: &Path,
    args: &FileArgs,
    side: Option<(&SideFile, &Before)>,
    subject: &Subject,
    target: Option<&Image>,
) -> Result<Scene, Failure> {
    let distance = args.distance.map(|length| length.mm);
    let missing = |_: &str| no_side_file(block);
    let scene = scene_of_file(subject.block(), subject.size_mm(), side, (args.ior, distance), &Machine, missing)?;
    Ok(match args.window {
        Some(WindowSize { width, height }) => with_window(scene, width.mm, height.map(|height| height.mm), target),
        None => scene,
    })
}

/// What does not fit together between the side file and what lies on the disk.
fn warnings(block: &Path, args: &FileArgs, side: &SideFile) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = block.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match (side.files.get(&name), glasswarp_files::sha256(block)) {
        (Some(recorded), Ok(found)) if *recorded != found => warnings
            .push(format!("{name} is not the file that was written with its side file: its content has changed since")),
        _ => {}
    }
    if let Some(picture) = &args.target
        && let Ok(found) = glasswarp_files::sha256(picture)
        && found != side.picture.sha256
    {
        warnings.push(format!("{} is not the picture that the block was made from", picture.display()));
    }
    if let (Some(before), Some(recorded)) = (&side.design.behind, &side.picture.behind_sha256)
        && let Ok(found) = glasswarp_files::sha256(&before.path)
        && found != *recorded
    {
        let path = before.path.display();
        warnings
            .push(format!("{path} is not the block that this one was designed behind: its content has changed since"));
    }
    warnings
}
