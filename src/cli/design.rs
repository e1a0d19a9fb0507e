//! `glasswarp design`: from a picture to files, and a judgement of what was written.

use super::{
    error::Failure,
    judge::{self, Judgement},
    progress::TerminalProgress,
    settings::{QualityName, Settings, SolverName, TransferName, name_of},
    side_file::{self, BenchRecord},
};
use glasswarp::{
    bench::{Bench, ExitFace},
    export::{self, Design, ExportError, Format},
    grid::Extent,
    materials,
    optim::Termination,
    pipeline::{self, Block, DesignError},
    report::{self, Exposure},
    solid::Stock,
    solver::Solver,
    surface::HeightField,
    target::{Picture, PictureError, TargetIrradiance, Transfer},
    transport::{Options, Quality, Transport},
    warp::{Warping, WarpingPaper},
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

#[derive(clap::Args)]
pub(crate) struct DesignArgs {
    /// The picture (PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR), or a design file (.toml) that names it
    picture: PathBuf,

    /// A file to write; its extension is the format: .stl, .obj or .glb. May be given several times [default: the picture's
    /// name with .stl, in the working folder]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    #[command(flatten)]
    settings: Settings,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR")]
    max_error: Option<f64>,

    /// Do not trace the exported file, and draw no pictures
    #[arg(long)]
    no_verify: bool,
}

/// What the settings mean, validated.
struct Plan {
    picture: PathBuf,
    outputs: Vec<PathBuf>,
    target: TargetIrradiance,
    bench: Bench,
    nodes: (usize, usize),
    stock: Stock,
    solver: SolverName,
    transfer: TransferName,
    /// The settings with every default filled in that must not change when the block is made again.
    settings: Settings,
}

pub(crate) fn run(args: &DesignArgs) -> Result<(), Failure> {
    let plan = plan(args)?;
    let progress = TerminalProgress::new();
    let start = Instant::now();
    let solver = solver(&plan)?;
    let block = pipeline::design(&plan.target, &plan.bench, plan.nodes, solver.as_ref(), plan.stock, &progress);
    progress.finish();
    let block = block.map_err(Failure::refused)?;
    let solved = start.elapsed();
    write_files(&plan, &block)?;
    let judgement = if args.no_verify { None } else { Some(judge_output(&plan)?) };
    let pictures = match &judgement {
        Some(judgement) => write_pictures(&plan, &block.surface, judgement)?,
        None => Vec::new(),
    };
    print_summary(&plan, &block, solved, judgement.as_ref(), &pictures);
    match (judgement, args.max_error) {
        (Some(judgement), limit) => judgement.demand(limit),
        (None, _) => Ok(()),
    }
}

/// The solver that was chosen, with its options.
fn solver(plan: &Plan) -> Result<Box<dyn Solver>, Failure> {
    let Settings { quality, min_radius, .. } = plan.settings;
    if plan.solver != SolverName::Transport && (quality.is_some() || min_radius.is_some()) {
        return Err(Failure::Usage(format!(
            "--quality and --min-radius are options of the transport solver; the {} solver has none",
            name_of(plan.solver)
        )));
    }
    Ok(match plan.solver {
        SolverName::Transport => {
            let options = Options {
                quality: match quality.unwrap_or_default() {
                    QualityName::Draft => Quality::Draft,
                    QualityName::Normal => Quality::Normal,
                    QualityName::Fine => Quality::Fine,
                },
                min_radius_mm: min_radius.map(|length| length.mm),
                ..Options::default()
            };
            options.validate().map_err(Failure::refused)?;
            Box::new(Transport { options })
        }
        SolverName::Warping => Box::new(Warping::default()),
        SolverName::WarpingPaper => Box::new(WarpingPaper::default()),
    })
}

fn plan(args: &DesignArgs) -> Result<Plan, Failure> {
    let is_design = args.picture.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let mut settings = args.settings.clone();
    let picture = if is_design {
        settings = settings.or(Settings::read(&args.picture)?);
        settings.picture.clone().ok_or_else(|| {
            Failure::Usage(format!(
                "{} names no picture: add picture = \"...\" to its [design]",
                args.picture.display()
            ))
        })?
    } else {
        args.picture.clone()
    };
    let outputs =
        if args.output.is_empty() { vec![default_output(&args.picture, &picture)] } else { args.output.clone() };
    for output in &outputs {
        Format::from_path(output).map_err(Failure::refused)?;
        export::probe(output).map_err(Failure::writing)?;
    }
    let values = open_picture(&picture, settings.transfer.map(Transfer::from))?;
    let offset = settings.offset.unwrap_or(0.1);
    let target = TargetIrradiance::from_picture(&values, offset).map_err(Failure::refused)?;
    let (nx, ny) = (target.cells().nx(), target.cells().ny());
    let width_mm = settings.size.map_or(100.0, |length| length.mm);
    let ior = match (&settings.material, settings.ior) {
        (Some(name), _) => materials::by_name(name).map(|material| material.ior).ok_or_else(|| {
            Failure::Usage(format!(
                "there is no material '{name}'; `glasswarp materials` lists those known, --ior takes any index"
            ))
        })?,
        (None, ior) => ior.unwrap_or(1.5),
    };
    let block = Extent::new(width_mm, width_mm * ny as f64 / nx as f64);
    let distance_mm = settings.distance.map_or(250.0, |length| length.mm);
    let bench = Bench::new(block, distance_mm, ExitFace::Refracts { ior }).map_err(Failure::refused)?;
    let across = settings.nodes.unwrap_or_else(|| pipeline::default_nodes(nx));
    let nodes = pipeline::node_grid(block, across).map_err(Failure::refused)?;
    let mut stock = settings.thickness.map_or_else(Stock::thinnest_sheet, |length| Stock::of_thickness(length.mm));
    if let Some(least) = settings.min_thickness {
        stock = stock.leaving_at_least(least.mm);
    }
    stock.check().map_err(|error| Failure::refused(DesignError::from(error)))?;
    (settings.nodes, settings.offset) = (Some(across), Some(offset));
    let is_exr = picture.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let transfer = settings.transfer.unwrap_or(if is_exr { TransferName::Linear } else { TransferName::Srgb });
    let solver = settings.solver.unwrap_or_default();
    Ok(Plan { picture, outputs, target, bench, nodes, stock, solver, transfer, settings })
}

/// Reads a picture, with the failure's kind: a file that cannot be read is another matter than one that makes no target.
pub(crate) fn open_picture(path: &Path, transfer: Option<Transfer>) -> Result<Picture, Failure> {
    Picture::open(path, transfer).map_err(|error| match error {
        PictureError::Io(_) | PictureError::Decode(_) | PictureError::Exr(_) => {
            Failure::Io { what: format!("{} is not a readable picture", path.display()), source: error.into() }
        }
        PictureError::Value { .. } | PictureError::Size { .. } => Failure::refused(error),
    })
}

fn default_output(named: &Path, picture: &Path) -> PathBuf {
    // samples/camera/design.toml with target.png makes camera.stl: the folder tells more than the file.
    let stem = |path: &Path| path.file_stem().map(PathBuf::from);
    let folder = named.parent().and_then(Path::file_name).map(PathBuf::from);
    let name = if named == picture { stem(named) } else { folder.or_else(|| stem(named)) };
    name.unwrap_or_else(|| "block".into()).with_extension("stl")
}

fn write_files(plan: &Plan, block: &Block) -> Result<(), Failure> {
    let name = plan.picture.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let design = Design { name, exit_face: plan.bench.exit_face(), distance_mm: plan.bench.distance_mm() };
    let mut sets: BTreeMap<PathBuf, Vec<&Path>> = BTreeMap::new();
    for output in &plan.outputs {
        export::export(output, &block.solid, &design).map_err(|error| match error {
            ExportError::Write(error) => Failure::writing(error),
            refused => Failure::refused(refused),
        })?;
        sets.entry(side_file::path_beside(output)).or_default().push(output);
    }
    let bench = BenchRecord {
        width_mm: plan.bench.block().width_mm,
        height_mm: plan.bench.block().height_mm,
        entry_z_mm: block.solid.entry_z_mm(),
        relief_mm: block.surface.relief_mm(),
        thinnest_mm: block.solid.thinnest_mm(),
        distance_mm: plan.bench.distance_mm(),
        window_width_mm: plan.bench.window().width_mm,
        window_height_mm: plan.bench.window().height_mm,
        ior: 1.0 / plan.bench.exit_face().eta(),
    };
    for (path, outputs) in &sets {
        side_file::write(
            path,
            &side_file::Record {
                picture: &plan.picture,
                settings: &plan.settings,
                bench: &bench,
                solver: plan.solver,
                transfer: plan.transfer,
                outputs,
            },
        )?;
    }
    Ok(())
}

/// Judges the first STL, or without one the first output: what a shop would get.
fn judge_output(plan: &Plan) -> Result<Judgement, Failure> {
    let first = &plan.outputs[0];
    let output = plan.outputs.iter().find(|path| matches!(Format::from_path(path), Ok(Format::Stl))).unwrap_or(first);
    let side = side_file::SideFile::read(&side_file::path_beside(output))?;
    judge::judge(output, &side.bench, &plan.target, judge::Look::default())
}

/// Prints what was made and how good it is.
fn print_summary(plan: &Plan, block: &Block, solved: Duration, judgement: Option<&Judgement>, pictures: &[PathBuf]) {
    let list = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
    let (solid, bench) = (&block.solid, &plan.bench);
    println!("{}", list(&plan.outputs));
    println!(
        "  block          {:.2} x {:.2} mm, cut from a sheet of {} mm, index {}",
        bench.block().width_mm,
        bench.block().height_mm,
        (solid.thickness_mm() * 1000.0).round() / 1000.0,
        1.0 / bench.exit_face().eta()
    );
    println!(
        "  exit face      relief {:.2} mm, thinnest place {:.2} mm thick, {} x {} nodes",
        block.surface.relief_mm(),
        solid.thinnest_mm(),
        plan.nodes.0,
        plan.nodes.1
    );
    println!("  light          parallel, straight onto the planar entry face");
    println!(
        "  receiver       {} mm from the mean plane of the exit face ({:.2} mm from its highest point), picture {:.2} x {:.2} mm",
        bench.distance_mm(),
        bench.distance_mm() - block.surface.heights_mm().min_max().1,
        bench.window().width_mm,
        bench.window().height_mm
    );
    let stopped = block.summary.levels.iter().filter(|level| level.termination == Termination::IterationLimit).count();
    let limit = if stopped > 0 {
        format!(", {stopped} of {} levels stopped at the iteration limit", block.summary.levels.len())
    } else {
        String::new()
    };
    println!(
        "  solver         {}, {} iterations, {:.1} s{limit}",
        name_of(plan.solver),
        block.summary.iterations(),
        solved.as_secs_f64()
    );
    if !pictures.is_empty() {
        println!("  pictures       {}", list(pictures));
    }
    if let Some(judgement) = judgement {
        judgement.print();
    }
    for warning in &block.summary.warnings {
        eprintln!("warning: {warning}");
    }
}

/// Draws what was judged, beside the first output: the light alone, the panel of target, light and difference, and the
/// isocontours of the exit face.
fn write_pictures(plan: &Plan, surface: &HeightField, judgement: &Judgement) -> Result<Vec<PathBuf>, Failure> {
    let exposure = Exposure::of(&plan.target, plan.transfer.into());
    let [target, caustic] = [&judgement.target, &judgement.caustic].map(|image| {
        let field = judge::field_of(image);
        let mean = field.mean();
        field.map(|v| v / mean)
    });
    let note = format!("(relative RMS {:.4})", judgement.metrics.rel_rms);
    let pictures = [
        ("panel", report::panel(&target, &caustic, exposure, &note)),
        ("caustic", report::irradiance_picture(&caustic, exposure)),
        ("difference", report::difference_picture(&target, &caustic, exposure)),
        ("contours", report::isocontours(surface, 1000)),
    ];
    pictures
        .iter()
        .map(|(kind, picture)| {
            let path = plan.outputs[0].with_extension(format!("{kind}.png"));
            report::write_png(&path, picture).map_err(Failure::writing)?;
            Ok(path)
        })
        .collect()
}
