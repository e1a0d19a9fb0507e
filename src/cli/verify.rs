//! `glasswarp verify`: opens a solid as a stranger would and judges the light that comes through it.

use super::{
    bench::{self, exit_face_in_words, exit_face_of, scene_of},
    budget,
    console::{self, say},
    diagnosis,
    error::{Failure, error_limit},
    finish::Finished,
    found_page::FoundPage,
    imperfect::{self, Intent, Seen},
    json,
    judge::{self, Examiner, Judgement, Subject},
    length::Length,
    otherwise::seen_otherwise,
    outputs, page,
    placed::{Opened, Placing},
    plan::open_target,
    progress::TerminalProgress,
    reference::Wanted,
    settings::{Settings, TransferName},
    shards::{self, MergeArgs, Shard},
    side_file::{self, SideFile},
    sweep::{self, Range},
    white,
    workpiece::surface_of,
};
use clap::{Args, Subcommand, ValueEnum};
use glam::DVec2;
use glasswarp::{irradiance::Transfer, report::Exposure};
use glasswarp_verify::{Fresnel, Image, PhotonPlan, Scene, Surface, Traversal, Window, picture};
use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct VerifyArgs {
    #[command(subcommand)]
    action: Option<Action>,

    #[command(flatten)]
    look: LookArgs,
}

#[derive(Subcommand)]
enum Action {
    /// Add up the photon tallies of a run's parts (see --shard)
    Merge(MergeArgs),
}

#[derive(Args)]
pub(crate) struct LookArgs {
    /// The block, or any closed solid: .stl, .obj, .glb, .gltf, .ply, .off, .3mf, .step, or a height map in .png or .exr
    #[arg(required = true)]
    block: Option<PathBuf>,

    #[command(flatten)]
    placing: Placing,

    /// The picture that its light shall draw [default: the one named in the side file]
    #[arg(long, value_name = "PICTURE")]
    target: Option<PathBuf>,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// From z = 0 (of a block the mean plane of the exit face) to the receiver, on which the window stays where the light of a flat
    /// block falls [default: the side file's]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    distance: Option<Length>,

    /// Refractive index [default: the side file's]
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// Window on the receiver, around the axis: its width, or WIDTHxHEIGHT [default: the side file's, or the size of the
    /// solid]
    #[arg(long, value_name = "SIZE")]
    window: Option<WindowSize>,

    /// Constant added to the light of the picture [default: the side file's]
    #[arg(long, value_name = "LIGHT")]
    offset: Option<f64>,

    /// How numbers in the picture become light [default: the side file's]
    #[arg(long, value_name = "CURVE")]
    transfer: Option<TransferName>,

    /// How the surface between the vertices is understood [default: spline for a block, facets for another solid]
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

    /// Independent samples into which the photons are cut, at least 4: their spread is the noise, and a run has at most as many parts
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(4..), help_heading = "Photons")]
    replicates: u32,

    /// Trace photons only, and write their exact sums to this file (OpenEXR)
    #[arg(long, value_name = "FILE", help_heading = "Photons")]
    tally: Option<PathBuf>,

    /// Trace only part K of N of the run; 'glasswarp verify merge' adds the tallies up
    #[arg(long, value_name = "K/N", requires = "tally", help_heading = "Photons")]
    shard: Option<Shard>,

    /// Design the block anew along a range, and look at every one: distance, size, thickness, index or nodes, as in
    /// distance=60..1000
    #[arg(long, value_name = "WHAT=FROM..TO", help_heading = "Sweep", conflicts_with_all = ["tally", "max_error"])]
    sweep: Option<Range>,

    /// Number of places along the range, in equal ratios
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=1000), help_heading = "Sweep")]
    steps: u32,

    /// Do not design anew: look at this very block away from its bench (distance and index only)
    #[arg(long, requires = "sweep", help_heading = "Sweep")]
    as_built: bool,

    /// Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear). Of a sweep: .csv, .exr (all
    /// images as layers) or .png (the curves)
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Look at the block in white light too, of which its material bends every colour otherwise, and write that picture: .png
    /// (sRGB) or .exr (linear, the primaries of sRGB)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tally", "sweep"])]
    white: Option<PathBuf>,

    /// Write a report on the block, a page of HTML
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tally", "sweep"])]
    report: Option<PathBuf>,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR", value_parser = error_limit)]
    max_error: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SurfaceName {
    /// The smooth surface through the vertices of a block
    Spline,
    /// Flat triangles with interpolated normals, as renderers shade
    Smooth,
    /// Flat triangles to the letter
    Facets,
}

impl From<SurfaceName> for Surface {
    fn from(name: SurfaceName) -> Self {
        match name {
            SurfaceName::Spline => Self::Spline,
            SurfaceName::Smooth => Self::Smooth,
            SurfaceName::Facets => Self::Facets,
        }
    }
}

/// Size of the window: its height follows the target or the solid unless it is given.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WindowSize {
    width: Length,
    height: Option<Length>,
}

impl FromStr for WindowSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('x') {
            Some((width, height)) => Ok(Self { width: width.parse()?, height: Some(height.parse()?) }),
            None => Ok(Self { width: text.parse()?, height: None }),
        }
    }
}

pub(crate) fn run(args: &VerifyArgs) -> Result<(), Failure> {
    match (&args.action, &args.look.block) {
        (Some(Action::Merge(merge)), _) => shards::merge(merge),
        (None, Some(block)) => look(block, &args.look),
        (None, None) => Err(Failure::Usage("name a block to verify".into())),
    }
}

fn look(block: &Path, args: &LookArgs) -> Result<(), Failure> {
    if args.sweep.is_none() {
        args.output.iter().chain(&args.white).try_for_each(|output| IrradianceFile::of(output).map(drop))?;
    }
    let side = SideFile::find(block, args.bench.as_deref())?;
    if side.is_none() && (args.sweep.is_some() || args.ior.is_none() || args.distance.is_none()) {
        return Err(no_side_file(block));
    }
    if args.placing.as_placed && args.sweep.is_some() {
        return Err(Failure::Usage("--as-placed is about one look at a file, not about a sweep".into()));
    }
    let report = page::path(args.report.as_deref(), args.report.is_none(), block)?;
    let inputs = side_file::inputs(block, args.bench.as_deref())?;
    let written = args.output.iter().chain(&args.white).chain(&args.tally).chain(&report);
    outputs::plan(inputs.iter().chain(&args.target).map(PathBuf::as_path), written.cloned())?;
    if let (Some(range), Some(side)) = (&args.sweep, &side) {
        let place = args.as_built.then_some(block);
        let side = (side, args.bench.as_deref());
        return sweep::run(range, args.steps as usize, side, place, args.pixels as usize, &args.output);
    }
    let mut warnings = side.as_ref().map(|side| warnings(block, args, side)).unwrap_or_default();
    let (wanted, offset) = wanted(args, side.as_ref())?;
    let target = wanted.as_ref().map(Wanted::in_perfect_light);
    if args.max_error.is_some() && target.is_none() {
        return Err(Failure::Usage("--max-error needs a picture: name one with --target".into()));
    }
    let opened = Opened::open(block, side.as_ref(), args.placing)?;
    let scene = scene(block, args, side.as_ref(), &opened.subject, target)?;
    let (subject, moves) = opened.upright(block, &scene, target)?;
    warnings.extend(moves);
    if report.is_some() && matches!(subject, Subject::Solid(_)) {
        return Err(Failure::Usage(format!(
            "{} is no block, and a report (--report) is about blocks",
            block.display()
        )));
    }
    let fresnel = if args.fresnel { Fresnel::On } else { Fresnel::Off };
    let examiner =
        Examiner::new(scene.clone(), target, args.pixels as usize).seeing(args.surface.map(Surface::from), fresnel);
    let shard = args.shard.unwrap_or(Shard { index: 0, of: 1 });
    let plan = PhotonPlan {
        photons: args.photons,
        seed: args.seed,
        replicates: args.replicates,
        shard: shard.index,
        shards: shard.of,
    };
    for warning in &warnings {
        console::warn(warning);
    }
    if let Some(path) = &args.tally {
        // Photons see the light that there is.
        let (scene, seen) = match (&wanted, &side) {
            (Some(wanted), Some(side)) => (imperfect::spread(scene, &side.design), Some(&wanted.picture)),
            _ => (scene, target),
        };
        let examiner =
            Examiner::new(scene, seen, args.pixels as usize).seeing(args.surface.map(Surface::from), fresnel);
        let tracer = subject.tracer(&examiner.scene_for(&subject))?;
        let error = shards::trace(block, &tracer, &plan, path, examiner.wanted())?;
        return shards::demand(error, args.max_error);
    }
    let progress = TerminalProgress::new();
    progress.begin("tracing", 3);
    let judgement = judge::judge(&subject, &examiner, &plan)?;
    progress.advance(1);
    for suspicion in suspicions(&subject, &examiner, target, &judgement)? {
        console::warn(&suspicion);
        warnings.push(suspicion);
    }
    let steps = budget::of_file(&subject, &examiner, &judgement)?;
    progress.finish();
    let size = subject.size_mm();
    let what = match &subject {
        Subject::Block(_) => "block",
        Subject::Solid(_) => "solid, traced as its flat triangles",
    };
    say!(
        "{}: {what}, {:.2} x {:.2} mm, {}, receiver {} mm from {}, window {:.2} x {:.2} mm{}",
        block.display(),
        size.x,
        size.y,
        exit_face_in_words(exit_face_of(&scene)),
        scene.distance_mm,
        if matches!(subject, Subject::Block(_)) { "the mean exit plane" } else { "z = 0" },
        scene.window.size_mm.x,
        scene.window.size_mm.y,
        offset.map(|offset| format!(", offset {offset}")).unwrap_or_default()
    );
    judgement.print();
    budget::print(&steps, scene.distance_mm);
    // A block that has not been finished yet is judged as it will be.
    let finish = side.as_ref().filter(|side| side.work.is_none()).and_then(|side| side.design.finish);
    let finished = finish
        .filter(|_| examiner.wanted().is_some())
        .map(|finish| Finished::of(finish, &subject, &examiner))
        .transpose()?;
    finished.iter().for_each(Finished::print);
    let seen = match (&side, &wanted) {
        (Some(side), Some(wanted)) => Seen::of(&subject, &scene, wanted, &side.design, &plan)?,
        _ => None,
    };
    if let (Some(seen), Some(side)) = (&seen, &side) {
        seen.print(&side.design);
    }
    let white = args.white.as_ref().map(|output| {
        let pixels = examiner.scene_for(&subject);
        white::look(&subject, &pixels, side.as_ref().map(|side| &side.design), examiner.beams(), output)
    });
    let white = white.transpose()?;
    console::result(json::Result::Verify(Box::new(json::Verify {
        file: block.display().to_string(),
        kind: if matches!(subject, Subject::Block(_)) { "block" } else { "solid" }.to_owned(),
        size_mm: size.to_array(),
        bench: bench::to_json(&scene, subject.entry_z_mm()),
        offset,
        judgement: judgement.to_json(),
        budget: steps.iter().map(json::BudgetStep::from).collect(),
        finished: finished.as_ref().map(Finished::to_json),
        imperfect: seen.as_ref().map(Seen::to_json),
        white: white.as_ref().map(json::White::of),
        files: json::texts(&args.output),
    })));
    // White is the brightest target, as on the wall.
    let brightest = seen.as_ref().map(|seen| &seen.wanted).or(examiner.wanted()).unwrap_or(&judgement.caustic);
    let peak = brightest.values.iter().copied().fold(0.0, f64::max);
    for output in &args.output {
        let image = seen.as_ref().map_or(&judgement.caustic, |seen| &seen.image);
        IrradianceFile::of(output)?.write(output, image, peak)?;
    }
    if let (Some(path), Subject::Block(found)) = (&report, &subject) {
        warnings
            .extend(page::judgement_warnings(&judgement, side.as_ref().map_or(0.0, |side| side.bench.skirt_share())));
        let transfer = args.transfer.or(side.as_ref().and_then(|side| side.design.transfer)).map(Transfer::from);
        let exposure = Exposure { white: peak / brightest.mean(), transfer: transfer.unwrap_or(Transfer::Srgb) };
        let light = judge::field_of(&judgement.caustic);
        let wanted = examiner.wanted().map(judge::field_of);
        let verdict = judgement.verdict.as_ref();
        let note = verdict.map(|verdict| format!("{}.", page::in_words(&verdict.metrics))).unwrap_or_default();
        let caustic = page::light_view("Simulated light", &light, exposure, format!("Traced through the file. {note}"));
        FoundPage {
            block,
            side: side.as_ref(),
            scene: &scene,
            surface: &surface_of(found)?,
            entry_z_mm: found.entry_z_mm(),
            about: format!(
                "A block of glass as it was found in {}, and the light that comes through it.",
                block.display()
            ),
            warnings,
            exposure,
            others: wanted.as_ref().map(|wanted| page::step_views(&steps, wanted, exposure)).unwrap_or_default(),
            wanted: wanted.zip(verdict.map(|verdict| verdict.metrics)),
            light,
            caustic,
            budget: page::costs(&steps),
            facts: vec![page::judgement_facts(&judgement, scene.window.size_mm.x / judgement.caustic.nx as f64)],
        }
        .write(path)?;
        say!("  report         {}", path.display());
    }
    judgement.demand_agreement()?;
    match (seen, finished) {
        (Some(seen), _) => seen.demand(args.max_error),
        (None, Some(finished)) => finished.demand(args.max_error),
        (None, None) => judgement.demand(args.max_error),
    }
}

fn no_side_file(block: &Path) -> Failure {
    side_file::missing(block, ", or give --ior and --distance")
}

/// What the light is judged by, and the constant in it. Without a side file a picture need not be named.
fn wanted(args: &LookArgs, side: Option<&SideFile>) -> Result<(Option<Wanted>, Option<f64>), Failure> {
    let design = side.map(|side| side.design.clone()).unwrap_or_default();
    let settings = Settings {
        picture: args.target.clone().or(design.picture.clone()),
        transfer: args.transfer.or(design.transfer),
        offset: Some(args.offset.or(design.offset).unwrap_or(0.0)),
        ..design
    };
    let Some(picture) = &settings.picture else {
        return match side {
            Some(_) => Err(Failure::Usage("the side file names no picture: give one with --target".into())),
            None => Ok((None, None)),
        };
    };
    let offset = settings.offset.unwrap_or(0.0);
    let read = open_target(picture, &settings.picture_options(), offset, settings.framing()?)?;
    let wanted = match side {
        Some(side) => {
            let (intent, bench) = Intent::of_side(read, side)?;
            Wanted::of(picture, &settings, &intent, &bench)?
        }
        None => Wanted::plain(picture, &settings, &read)?,
    };
    Ok((Some(wanted), Some(offset)))
}

/// The bench: what the side file says, and flags say otherwise.
fn scene(
    block: &Path,
    args: &LookArgs,
    side: Option<&SideFile>,
    subject: &Subject,
    target: Option<&Image>,
) -> Result<Scene, Failure> {
    let distance = args.distance.map(|length| length.mm);
    let mut scene = match (side, args.ior, distance) {
        (Some(side), ..) => scene_of(&side.bench, &side.design)?,
        (None, Some(ior), Some(distance_mm)) => {
            let window = Window { size_mm: subject.size_mm(), centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
            Scene::new(ior, distance_mm, window)
        }
        _ => return Err(no_side_file(block)),
    };
    scene = seen_otherwise(scene, subject.block(), args.ior, distance)?;
    if let Some(window) = args.window {
        let natural = scene.window.size_mm;
        let aspect = target.map_or(natural.y / natural.x, |target| target.ny as f64 / target.nx as f64);
        let width = window.width.mm;
        scene.window.size_mm = DVec2::new(width, window.height.map_or(width * aspect, |height| height.mm));
    }
    Ok(scene)
}

/// What may be wrong with a block that was not designed as it lies here.
fn suspicions(
    subject: &Subject,
    examiner: &Examiner,
    target: Option<&Image>,
    judgement: &Judgement,
) -> Result<Vec<String>, Failure> {
    let Subject::Block(block) = subject else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    if let (Some(target), Some(wanted), Some(verdict)) = (target, examiner.wanted(), &judgement.verdict) {
        let scene = Scene { traversal: Traversal::Grid, ..examiner.scene_for(subject) };
        let error = verdict.metrics.rel_rms;
        found.extend(diagnosis::of_picture(block, &scene, target, &judgement.caustic, wanted, error)?);
    }
    Ok(found)
}

/// What does not fit together between the side file and what lies on the disk.
fn warnings(block: &Path, args: &LookArgs, side: &SideFile) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = block.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match (side.files.get(&name), side_file::sha256(block)) {
        (Some(recorded), Ok(found)) if *recorded != found => warnings
            .push(format!("{name} is not the file that was written with its side file: its content has changed since")),
        _ => {}
    }
    if let Some(picture) = &args.target
        && let Ok(found) = side_file::sha256(picture)
        && found != side.picture.sha256
    {
        warnings.push(format!("{} is not the picture that the block was made from", picture.display()));
    }
    warnings
}

/// A file of irradiance, by its extension.
pub(crate) enum IrradianceFile {
    Exr,
    Png,
}

impl IrradianceFile {
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: irradiance is written as .exr (32-bit) or .png (16-bit), both linear",
                path.display()
            ))),
        }
    }

    /// Writes an image; in a PNG `peak` becomes white.
    pub(crate) fn write(&self, path: &Path, image: &Image, peak: f64) -> Result<(), Failure> {
        let written = match self {
            Self::Exr => picture::write_exr(path, image),
            Self::Png => picture::write_png(path, image, peak),
        };
        written.map_err(Failure::writing)
    }
}
