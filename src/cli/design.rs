//! `glasswarp design`: from a picture to files, and a judgement of what was written.

use super::{
    bench::{exit_face_in_words, light_in_words, receiver_in_words},
    budget,
    console::{self, say},
    error::Failure,
    finish::Finished,
    imperfect::Seen,
    json, judge, memory,
    opinion::{Foreseen, Opinion, draw_weakness},
    page::{self, DesignPage},
    plan::Plan,
    progress::TerminalProgress,
    settings::{Settings, name_of},
    side_file::{self, BenchRecord},
    toml_file,
};
use glasswarp::{
    export::{self, Design, Format, HeightMap, HeightMapError, HeightMapFormat},
    fabricate::{Cutter, Pass},
    optim::Termination,
    pipeline::Block,
    report,
    solid::Origin,
    solver::Progress,
};
use glasswarp_verify::Mesh;
use rayon::prelude::*;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

#[derive(clap::Args)]
pub(crate) struct DesignArgs {
    /// The picture (PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR), or a design file (.toml) that names it
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
    height_map_cutter: Option<Cutter>,

    #[command(flatten)]
    settings: Settings,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR")]
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
    let (plan, outputs) = plan(args)?;
    let expected = memory::check(&plan, &outputs, args)?;
    let report = page::path(args.report.as_deref(), args.no_report, &outputs[0])?;
    let progress = TerminalProgress::new();
    let start = Instant::now();
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let solved = start.elapsed();
    progress.begin("writing files", 0);
    // Files are made on one core, and wait for the disk.
    let foresee = || if args.no_verify { Ok(None) } else { Foreseen::of(&plan, &block).map(Some) };
    let (files, foreseen) = rayon::join(|| write_files(&plan, &outputs, &block, args), foresee);
    let (Files { notes, read_back }, foreseen) = (files?, foreseen?);
    let judge = |foreseen| Opinion::of(&plan, read_back, &block, foreseen, &progress);
    let opinion = foreseen.map(judge).transpose()?;
    progress.begin("drawing", 0);
    let draw = || match &opinion {
        Some(opinion) => opinion.draw(&plan, &outputs[0], &block),
        None => draw_weakness(&plan, &outputs[0], &block),
    };
    let write_page = || {
        let opinion = opinion.as_ref();
        let page = DesignPage { plan: &plan, outputs: &outputs, block: &block, opinion, notes: &notes, solved };
        report.as_ref().map_or(Ok(()), |path| page.write(path))
    };
    let (pictures, written) = rayon::join(draw, write_page);
    progress.finish();
    let pictures = pictures?;
    written?;
    print_summary(&plan, &outputs, &block, solved, &notes);
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
        bench: json::Bench::of(&plan.bench),
        solver: solver_to_json(&plan, &block, solved),
        notes,
        judgement: opinion.as_ref().map(|opinion| opinion.judgement.to_json()),
        budget: opinion.iter().flat_map(|opinion| &opinion.steps).map(json::BudgetStep::from).collect(),
        finished: opinion.as_ref().and_then(|opinion| opinion.finished.as_ref()).map(Finished::to_json),
        imperfect: opinion.as_ref().and_then(|opinion| opinion.seen.as_ref()).map(Seen::to_json),
        expected_memory: expected.0,
    })));
    opinion.map_or(Ok(()), |opinion| match (&opinion.seen, &opinion.finished) {
        (Some(seen), _) => seen.demand(args.max_error),
        (None, Some(finished)) => finished.demand(args.max_error),
        (None, None) => opinion.judgement.demand(args.max_error),
    })
}

fn solver_to_json(plan: &Plan, block: &Block, solved: Duration) -> json::Solver {
    json::Solver {
        name: name_of(plan.solver),
        iterations: block.summary.iterations(),
        seconds: solved.as_secs_f64(),
        levels_at_limit: levels_at_limit(block),
        notes: block.summary.notes.clone(),
    }
}

fn levels_at_limit(block: &Block) -> usize {
    block.summary.levels.iter().filter(|level| level.termination == Termination::IterationLimit).count()
}

fn plan(args: &DesignArgs) -> Result<(Plan, Vec<PathBuf>), Failure> {
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
    for output in &outputs {
        export::probe(output).map_err(Failure::writing)?;
        side_file::may_write(&side_file::path_beside(output)).map_err(Failure::refused)?;
    }
    let plan = Plan::new(picture, settings).map_err(|failure| toml_file::placed(failure, &args.picture))?;
    if let Some(cutter) = args.height_map_cutter {
        // Whether it fits onto the block; rows are the program's affair.
        Pass::finishing(cutter, cutter.radius_mm()).check(plan.bench.block()).map_err(Failure::refused)?;
    }
    Ok((plan, outputs))
}

fn default_output(named: &Path, picture: &Path) -> PathBuf {
    // samples/camera/design.toml with target.png makes camera.stl: the folder tells more than the file.
    let stem = |path: &Path| path.file_stem().map(PathBuf::from);
    let folder = named.parent().and_then(Path::file_name).map(PathBuf::from);
    let name = if named == picture { stem(named) } else { folder.or_else(|| stem(named)) };
    name.unwrap_or_else(|| "block".into()).with_extension("stl")
}

/// The files of a design.
struct Files {
    /// What there is to say of them.
    notes: Vec<String>,
    /// Those that are judged, as read back from disk.
    read_back: Vec<(PathBuf, Mesh)>,
}

/// Writes every file and the side files, and reads back what is judged.
fn write_files(plan: &Plan, outputs: &[PathBuf], block: &Block, args: &DesignArgs) -> Result<Files, Failure> {
    let cutter = args.height_map_cutter;
    let name = plan.picture.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let design = Design { name, exit_face: plan.bench.exit_face(), distance_mm: plan.bench.distance_mm() };
    let mut sets: BTreeMap<PathBuf, Vec<(&Path, String)>> = BTreeMap::new();
    let wants_map = outputs.iter().any(|output| HeightMapFormat::from_path(output).is_ok());
    let height_map = wants_map.then(|| match cutter {
        Some(cutter) => HeightMap::of_tips(&block.solid, cutter),
        None => HeightMap::of(&block.solid),
    });
    // Text is made on one core; several files take turns.
    let write = |output: &PathBuf| match (Format::from_path(output), &height_map) {
        (Ok(Format::Step), _) => write_step(plan, output, block, &design).map(Some),
        (Err(_), Some(map)) => {
            map.write(output).map(|()| Some(height_map_note(output, map))).map_err(|error| match error {
                HeightMapError::Write(error) => Failure::writing(error),
                refused => Failure::refused(refused),
            })
        }
        _ => export::export(output, &block.solid, &design).map(|()| None).map_err(Failure::exporting),
    };
    // The way of a tip is no face that light could be traced through.
    let is_judged = |path: &Path| !args.no_verify && (cutter.is_none() || HeightMapFormat::from_path(path).is_err());
    // A file is hashed and read back while the next is written.
    let written = |output: &PathBuf| -> Result<_, Failure> {
        let (note, hash) = (write(output)?, side_file::hash_of(output)?);
        let mesh = is_judged(output).then(|| judge::read(output)).transpose()?;
        Ok((note, hash, mesh.map(|mesh| (output.clone(), mesh))))
    };
    // Text takes longest, and begins.
    let is_text = |k: usize| matches!(Format::from_path(&outputs[k]), Ok(Format::Obj | Format::Step));
    let mut order: Vec<usize> = (0..outputs.len()).collect();
    order.sort_by_key(|&k| !is_text(k));
    let in_order = order.into_par_iter().with_max_len(1).map(|k| Ok((k, written(&outputs[k])?)));
    let mut written: Vec<_> = in_order.collect::<Result<_, Failure>>()?;
    written.sort_by_key(|(k, _)| *k);
    let (mut notes, mut hashes, mut read_back) = (Vec::new(), Vec::new(), Vec::new());
    for (_, (note, hash, mesh)) in written {
        notes.extend(note);
        hashes.push(hash);
        read_back.extend(mesh);
    }
    if let Some((map, mask)) = height_map.as_ref().and_then(|map| Some((map, map.mask()?))) {
        let maps = outputs.iter().filter(|output| HeightMapFormat::from_path(output).is_ok());
        let masks: BTreeSet<PathBuf> = maps.map(|output| output.with_extension("mask.png")).collect();
        for path in masks {
            report::write_png(&path, &mask).map_err(Failure::writing)?;
            notes.push(format!("{}: white where the block is; beyond it {} goes on", path.display(), map.subject()));
        }
    }
    for (output, hash) in outputs.iter().zip(hashes) {
        sets.entry(side_file::path_beside(output)).or_default().push((output, hash));
    }
    let bench = BenchRecord::of(&plan.bench).with(&block.solid);
    for (path, outputs) in &sets {
        side_file::write(
            path,
            &side_file::Record {
                picture: &plan.picture,
                settings: &plan.settings,
                bench: &bench,
                solver: plan.solver,
                transfer: plan.transfer,
                solid: &block.solid,
                height_map: height_map.as_ref(),
                done: None,
                outputs,
            },
        )?;
    }
    Ok(Files { notes, read_back })
}

/// Writes a STEP file; returns how near its face is.
fn write_step(plan: &Plan, output: &Path, block: &Block, design: &Design) -> Result<String, Failure> {
    let fit = export::choose_net(block.solid.surface(), plan.step, design).map_err(Failure::refused)?;
    export::write_atomically(output, |writer| export::write_step(writer, &block.solid, &fit.net, design))
        .map_err(Failure::writing)?;
    let (points, nodes) = (fit.net.points(), plan.nodes);
    let kind = if points == nodes { "the spline through all nodes" } else { "a fit to the nodes" };
    Ok(format!(
        "{}: {} x {} control points, {kind}; at most {:.5} um from the heights, rms {:.5} um, slope {:.3} urad rms",
        output.display(),
        points.0,
        points.1,
        1e3 * fit.error.greatest_mm,
        1e3 * fit.error.rms_mm,
        1e6 * fit.error.slope_rms
    ))
}

fn height_map_note(output: &Path, map: &HeightMap) -> String {
    let (low, high) = map.range_mm();
    let (pitch, size) = (map.pitch_mm(), map.picture_size_mm());
    format!(
        "{}: {:.6} x {:.6} mm per pixel, {:.3} x {:.3} mm, black {low:.4} mm, white {high:.4} mm ({:.4} mm deep)",
        output.display(),
        pitch.x,
        pitch.y,
        size.x,
        size.y,
        high - low
    )
}

/// Prints what was made.
fn print_summary(plan: &Plan, outputs: &[PathBuf], block: &Block, solved: Duration, notes: &[String]) {
    let (solid, bench) = (&block.solid, &plan.bench);
    say!("{}", list(outputs));
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
    say!("  light          {}", light_in_words(bench));
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
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
