//! `glasswarp mill`: a block milled and polished in simulation, and its picture after every step.

use super::{
    bench::exit_face_in_words,
    console::{self, say},
    cutters::{self, Wish},
    error::{Failure, error_limit},
    found_page::FoundPage,
    json, judge,
    length::Length,
    otherwise::thrown_mm,
    outputs, page, plan,
    progress::TerminalProgress,
    side_file::{self, BenchRecord},
    workpiece::{View, Workpiece, look_at_scallops},
};
use glasswarp::{
    export::{self, Design, Format},
    fabricate::{Cutter, Direction, Milled, Pass, Scallop},
    report::{self, Captioned, Cost, Facts},
    solid::{Shape, Solid, Stock},
    surface::{HeightField, Polish},
};
use glasswarp_verify::metrics;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

#[derive(clap::Args)]
pub(crate) struct MillArgs {
    /// The block: .stl, .obj, .glb or .ply, with its side file
    block: PathBuf,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// The cutter and its radii: ball:3mm, flat:6mm or bull:6mm,1mm [default: ball:3mm]
    #[arg(long, value_name = "CUTTER", conflicts_with = "cutters")]
    cutter: Option<Cutter>,

    /// From row to row [default: 0.1mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, conflicts_with = "cutters")]
    step_over: Option<Length>,

    /// Direction of the rows: x, y or an angle such as 45deg
    #[arg(long, value_name = "DIRECTION", default_value = "x", allow_hyphen_values = true)]
    direction: Direction,

    /// What the pass leaves on the face, along its normal: 0 for finishing, the allowance for finishing of a roughing pass
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    allowance: Length,

    /// Polish the milled face: the standard deviation of the Gaussian that blurs its heights
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    polish: Option<Length>,

    /// Feed of the cutter, per minute: gives the time
    #[arg(long, value_name = "LENGTH", default_value = "2000mm", allow_hyphen_values = true)]
    feed: Length,

    /// Find the cheapest cutter and step-over of a list (TOML) that keep to --want-error
    #[arg(long, value_name = "FILE", requires = "want_error", help_heading = "Choosing a cutter")]
    cutters: Option<PathBuf>,

    /// The relative RMS error of the picture that is wanted, after milling and polishing
    #[arg(long, value_name = "ERROR", requires = "cutters", help_heading = "Choosing a cutter", value_parser = error_limit)]
    want_error: Option<f64>,

    /// Pixels across at which to judge, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Write the block as it is in the end (.stl, .obj, .glb), or the pictures of all steps (.png). May be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Write a report on the work, a page of HTML
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,

    /// Fail (exit code 3) if the relative RMS error of the picture exceeds this in the end
    #[arg(long, value_name = "ERROR", value_parser = error_limit)]
    max_error: Option<f64>,
}

/// A step of the work, and the light after it.
struct Step {
    name: String,
    surface: HeightField,
    view: View,
}

impl Step {
    fn to_json(&self) -> json::MillStep {
        let heights = self.surface.heights_mm();
        json::MillStep {
            name: self.name.clone(),
            rel_rms: json::finite(self.view.metrics.rel_rms),
            ssim: json::finite(self.view.metrics.ssim),
            nodes: [heights.nx(), heights.ny()],
        }
    }
}

pub(crate) fn run(args: &MillArgs) -> Result<(), Failure> {
    for output in &args.output {
        if !is_picture(output) {
            Format::from_path(output).map_err(Failure::refused)?;
        }
    }
    let report = page::path(args.report.as_deref(), args.report.is_none(), &args.block)?;
    let blocks = || args.output.iter().filter(|output| !is_picture(output));
    let side_files: BTreeSet<PathBuf> = blocks().map(|output| side_file::path_beside(output)).collect();
    let inputs = side_file::inputs(&args.block, args.bench.as_deref())?;
    let lists = args.cutters.iter().chain(&inputs).map(PathBuf::as_path);
    outputs::plan(lists, args.output.iter().cloned().chain(side_files).chain(report.clone()))?;
    let polish = args.polish.map(|length| Polish::new(length.mm)).transpose().map_err(Failure::refused)?;
    if args.feed.mm.is_nan() || args.feed.mm <= 0.0 {
        return Err(Failure::Usage(format!("the feed is {} per minute; it must be above 0 mm", args.feed)));
    }
    let piece = Workpiece::open(&args.block, args.bench.as_deref(), (None, None), args.pixels as usize)?;
    let pass = match (&args.cutters, args.want_error) {
        (Some(list), Some(error)) => {
            let wish = Wish { error, direction: args.direction, allowance_mm: args.allowance.mm, polish };
            cutters::cheapest(list, &piece, &wish)?
        }
        _ => Pass {
            cutter: args.cutter.map_or_else(|| Cutter::ball(3.0).map_err(Failure::refused), Ok)?,
            step_over_mm: args.step_over.map_or(0.1, |length| length.mm),
            direction: args.direction,
            allowance_mm: args.allowance.mm,
        },
    };
    pass.check(piece.surface.extent()).map_err(Failure::refused)?;
    let steps = work(&piece, &pass, polish)?;
    print(args, &piece, &pass, &steps)?;
    for output in args.output.iter().filter(|output| is_picture(output)) {
        report::write_png(output, &sheet(&piece, &steps)).map_err(Failure::writing)?;
    }
    let blocks: Vec<&Path> = blocks().map(PathBuf::as_path).collect();
    if !blocks.is_empty() {
        write_blocks(args, &piece, &pass, polish, &steps[steps.len() - 1], &blocks)?;
    }
    if let Some(path) = &report {
        write_report(args, &piece, &pass, &steps, path)?;
        say!("\n  report         {}", path.display());
    }
    let cost = pass.cost(&piece.surface.contour());
    console::result(json::Result::Mill(json::Mill {
        file: args.block.display().to_string(),
        cutter: pass.cutter.to_string(),
        step_over_mm: pass.step_over_mm,
        rows: cost.rows,
        length_mm: cost.length_mm,
        minutes: cost.minutes(args.feed.mm),
        steps: steps.iter().map(Step::to_json).collect(),
        files: json::texts(&args.output),
    }));
    let error = steps[steps.len() - 1].view.metrics.rel_rms;
    Failure::unless_within(args.max_error, error, "the", " in the end")
}

/// Writes the report: the face as designed, the light after every step.
fn write_report(args: &MillArgs, piece: &Workpiece, pass: &Pass, steps: &[Step], path: &Path) -> Result<(), Failure> {
    let Some(wanted) = piece.examiner.wanted().map(judge::field_of) else { return Ok(()) };
    let (last, before) = (&steps[steps.len() - 1], &steps[..steps.len() - 1]);
    let light = judge::field_of(&last.view.image);
    let note = |step: &Step| format!("{}.", page::in_words(&step.view.metrics));
    let others = before
        .iter()
        .map(|step| page::pair(&step.name, &wanted, &judge::field_of(&step.view.image), piece.exposure, note(step)));
    let costs = steps.iter().map(|step| {
        let moved = metrics::rel_rms(&step.view.image, &steps[0].view.image).map_err(Failure::refused)?;
        Ok(Cost { name: step.name.clone(), errors: Some((step.view.metrics.rel_rms, moved)) })
    });
    let cost = pass.cost(&piece.surface.contour());
    let mut rows = vec![
        page::row("Cutter", pass.cutter.to_string()),
        page::row("Rows", format!("{} along {}, {} mm apart", cost.rows, pass.direction, page::mm(pass.step_over_mm))),
        page::row(
            "Way",
            format!(
                "{:.1} m, {:.0} min at {} per minute",
                1e-3 * cost.length_mm,
                cost.minutes(args.feed.mm),
                args.feed
            ),
        ),
    ];
    if let Some(scallop) = Scallop::of(pass.cutter, pass.step_over_mm) {
        rows.push(page::row("Scallops", format!("{:.3} µm high, slope {:.5}", 1e3 * scallop.height_mm, scallop.slope)));
    }
    FoundPage {
        block: &args.block,
        side: Some(&piece.side),
        scene: &piece.scene(),
        surface: &piece.surface,
        entry_z_mm: piece.block.entry_z_mm(),
        about: format!(
            "{}, worked on in simulation: {}. The face is shown as designed, the light as it is after the work.",
            args.block.display(),
            last.name
        ),
        warnings: Vec::new(),
        exposure: piece.exposure,
        caustic: page::light_view("Light after the work", &light, piece.exposure, note(last)),
        others: others.collect(),
        budget: costs.collect::<Result<_, Failure>>()?,
        facts: vec![Facts { title: "Work".into(), rows }],
        wanted: Some((wanted, last.view.metrics)),
        light,
    }
    .write(path)
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
}

fn work(piece: &Workpiece, pass: &Pass, polish: Option<Polish>) -> Result<Vec<Step>, Failure> {
    let progress = TerminalProgress::new();
    progress.begin("milling and tracing", 2 + 2 * usize::from(polish.is_some()));
    let step = |name: &str, surface: HeightField| -> Result<Step, Failure> {
        Ok(Step { name: name.into(), view: piece.look(&surface)?, surface })
    };
    let mut steps = vec![step("as designed", piece.surface.clone())?];
    progress.advance(1);
    let milled = mill(&piece.surface, pass)?;
    let name = format!("milled with {}, rows {} mm apart", pass.cutter, pass.step_over_mm);
    let (view, surface) = look_at_scallops(&piece.examiner, &piece.block, &piece.surface, milled)?;
    steps.push(Step { name, view, surface });
    progress.advance(2);
    if let Some(polish) = polish {
        let name = format!("and polished, sigma {} mm", polish.sigma_mm());
        steps.push(step(&name, polished(&steps[1].surface, &piece.surface, polish))?);
        progress.advance(3);
        // The same polish without scallops tells what costs what.
        steps.insert(
            1,
            step(&format!("polished alone, sigma {} mm", polish.sigma_mm()), polish.polished(&piece.surface))?,
        );
        progress.advance(4);
    }
    progress.finish();
    Ok(steps)
}

/// The face that a pass leaves.
pub(crate) fn mill(surface: &HeightField, pass: &Pass) -> Result<Milled, Failure> {
    Milled::of(surface, *pass).map_err(Failure::refused)
}

/// A milled face after its polish, on no more nodes than it then needs and on no fewer than the design has: at a spacing of half the
/// standard deviation the polish has left 3e-9 of the shortest wave that the nodes hold.
pub(crate) fn polished(milled: &HeightField, design: &HeightField, polish: Polish) -> HeightField {
    let (fine, coarse) = (milled.heights_mm(), design.heights_mm());
    let polished = polish.polished(milled);
    let enough = |size: f64, fine: usize, coarse: usize| {
        let cells = 2.0 * size / polish.sigma_mm();
        (1 + cells.ceil().clamp(0.0, 1e9) as usize).max(coarse).min(fine)
    };
    let extent = milled.extent();
    let (nx, ny) = (enough(extent.width_mm, fine.nx(), coarse.nx()), enough(extent.height_mm, fine.ny(), coarse.ny()));
    if (nx, ny) == (fine.nx(), fine.ny()) { polished } else { polished.resampled(nx, ny) }
}

fn print(args: &MillArgs, piece: &Workpiece, pass: &Pass, steps: &[Step]) -> Result<(), Failure> {
    let (extent, bench) = (piece.surface.extent(), &piece.side.bench);
    say!(
        "{}: {:.2} x {:.2} mm, {}, receiver {} mm from the mean exit plane",
        args.block.display(),
        extent.width_mm,
        extent.height_mm,
        exit_face_in_words(bench.exit_face()),
        bench.distance_mm
    );
    let cost = pass.cost(&piece.surface.contour());
    say!(
        "  rows           {} along {}, {:.1} m in all, {:.0} min at {} per minute (without acceleration)",
        cost.rows,
        pass.direction,
        1e-3 * cost.length_mm,
        cost.minutes(args.feed.mm),
        args.feed
    );
    if let Some(scallop) = Scallop::of(pass.cutter, pass.step_over_mm) {
        say!(
            "  scallops       {:.3} um high, slope {:.5}, which throws light {:.3} mm to either side",
            1e3 * scallop.height_mm,
            scallop.slope,
            thrown_mm(&piece.block, &piece.scene(), scallop.slope, &[pass.direction.unit().perp()])?
        );
    }
    let (nx, ny) = piece.examiner.pixels();
    say!("\nThe picture after every step ({nx} x {ny} pixels)             relative RMS     SSIM        nodes");
    for Step { name, surface, view } in steps {
        let nodes = format!("{} x {}", surface.heights_mm().nx(), surface.heights_mm().ny());
        say!("  {name:<53} {:>12.4} {:>8.4} {nodes:>12}", view.metrics.rel_rms, view.metrics.ssim);
    }
    Ok(())
}

fn sheet(piece: &Workpiece, steps: &[Step]) -> image::GrayImage {
    let captioned = |name: String, image: &glasswarp_verify::Image| Captioned {
        caption: name,
        picture: report::irradiance_picture(&judge::field_of(image), piece.exposure),
    };
    let mut pictures: Vec<Captioned> =
        piece.examiner.wanted().into_iter().map(|wanted| captioned("target".into(), wanted)).collect();
    for step in steps {
        let caption = format!("{}: {:.4}, ssim {:.4}", step.name, step.view.metrics.rel_rms, step.view.metrics.ssim);
        pictures.push(captioned(caption, &step.view.image));
    }
    report::contact_sheet(&pictures, 3, 420)
}

/// A file of this many nodes has a gigabyte as STL.
const MOST_FILE_NODES: usize = 10_000_000;

/// Writes the block as it is in the end, and its side files, on the nodes of the design where these hold it: after a polish that leaves nothing of the
/// scallops.
fn write_blocks(
    args: &MillArgs,
    piece: &Workpiece,
    pass: &Pass,
    polish: Option<Polish>,
    last: &Step,
    outputs: &[&Path],
) -> Result<(), Failure> {
    let smooth = polish.is_some_and(|polish| polish.sigma_mm() >= pass.step_over_mm);
    let (nx, ny) = (piece.surface.heights_mm().nx(), piece.surface.heights_mm().ny());
    let surface = if smooth { last.surface.resampled(nx, ny) } else { last.surface.clone() };
    let nodes = surface.heights_mm().as_slice().len();
    if nodes > MOST_FILE_NODES {
        return Err(Failure::Usage(format!(
            "a file with every scallop takes {nodes} nodes, more than {MOST_FILE_NODES}: take a larger step-over, or polish with at least --polish {}mm, after which the design's own nodes hold the face",
            pass.step_over_mm
        )));
    }
    // The entry face stays where it is, and so does what stands around the exit face, which has its skirt already.
    let shape = Shape { skirt_mm: 0.0, ..plan::shape(&piece.side.design)? };
    let rise_mm = shape.rim.map_or(0.0, |rim| rim.rise_mm.max(0.0));
    let thickness_mm = Solid::highest_mm(&surface) + rise_mm - piece.block.entry_z_mm();
    let stock = Stock::of_thickness(thickness_mm).leaving_at_least(Stock::LIMITS_MM.0);
    let solid = Solid::shaped(&surface, stock, shape).map_err(Failure::refused)?;
    let name = args.block.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let before = &piece.side.bench;
    let design =
        Design { name: format!("{name} milled"), exit_face: before.exit_face(), distance_mm: before.distance_mm };
    let mut sets: BTreeMap<PathBuf, Vec<(&Path, String)>> = BTreeMap::new();
    for output in outputs {
        export::export(output, &solid, &design).map_err(Failure::exporting)?;
        sets.entry(side_file::path_beside(output)).or_default().push((output, side_file::hash_of(output)?));
    }
    let bench = BenchRecord {
        entry_z_mm: solid.entry_z_mm(),
        relief_mm: surface.relief_mm(),
        thinnest_mm: solid.thinnest_mm(),
        ..piece.side.bench.clone()
    };
    let allowance = if pass.allowance_mm > 0.0 { format!(", leaving {} mm", pass.allowance_mm) } else { String::new() };
    let polished = polish.map(|p| format!(", polished with sigma {} mm", p.sigma_mm())).unwrap_or_default();
    let before = piece.side.work.as_ref().map(|work| format!("{}; ", work.done)).unwrap_or_default();
    let done = format!(
        "{before}milled in simulation with {}, rows {} mm apart along {}{allowance}{polished}",
        pass.cutter, pass.step_over_mm, pass.direction
    );
    let settings = &piece.side.design;
    let record = |outputs| side_file::Record {
        picture: settings.picture.as_deref().unwrap_or(Path::new("")),
        settings,
        bench: &bench,
        solver: settings.solver.unwrap_or_default(),
        solid: &solid,
        height_map: None,
        done: Some(&done),
        outputs,
    };
    sets.iter().try_for_each(|(path, outputs)| side_file::write(path, &record(outputs)))
}
