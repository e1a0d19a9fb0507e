//! `glasswarp preview`: what a picture would become, before a design is waited for.

use super::{
    bench,
    budget::double_precision,
    console::{self, say},
    error::Failure,
    json,
    judge::{self, Examiner},
    outputs,
    page::{self, bench_facts, command, error_highlight, face_rows, highlight, in_words, mm, program, row},
    plan::Plan,
    progress::TerminalProgress,
    settings::{QualityName, Settings, SolverName},
    toml_file,
    workpiece::{View as Seen, look_at},
};
use glasswarp::{
    fabricate::FaceShape,
    pipeline::DesignedBlock,
    report::{self, Exposure, Facts, Isocontours, Page},
};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct PreviewArgs {
    /// The picture, or a design file (.toml) that names it
    picture: PathBuf,

    /// Where to: .html (the page to turn the block on) or .png (target, light and difference). May be given several times
    /// [default: the picture's name with .preview.html, in the working folder]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    #[command(flatten)]
    settings: Settings,
}

/// Height nodes across: enough for a draft of a photograph, few enough for a fraction of a second.
const NODES: usize = 257;
/// Pixels across at which the light is looked at, at most.
const PIXELS: usize = 384;

pub(crate) fn run(args: &PreviewArgs) -> Result<(), Failure> {
    let (mut settings, picture) = Settings::of(&args.picture, &args.settings)?;
    settings.nodes = settings.nodes.or(Some(NODES));
    if settings.solver.unwrap_or_default() == SolverName::Transport {
        settings.quality = settings.quality.or(Some(QualityName::Draft));
    }
    let stem = PathBuf::from(picture.file_stem().unwrap_or_default());
    let outputs = if args.output.is_empty() { vec![stem.with_extension("preview.html")] } else { args.output.clone() };
    for output in &outputs {
        if !is(output, "html") && !is(output, "png") {
            return Err(Failure::Usage(format!("{}: a preview is written as .html or .png", output.display())));
        }
    }
    let inputs = [&args.picture, &picture].map(PathBuf::as_path);
    outputs::plan(inputs.into_iter().chain(settings.files()), outputs.iter().cloned())?;
    let plan = Plan::new(picture, settings).map_err(|failure| toml_file::placed(failure, &args.picture))?;
    let progress = TerminalProgress::new();
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let scene = plan.scene()?;
    let examiner = Examiner::new(scene.clone(), Some(plan.wanted()?.in_perfect_light()), PIXELS);
    let seen = look_at(&examiner, &double_precision(&block)?)?;
    let made = Preview { plan: &plan, block: &block, examiner: &examiner, seen: &seen };
    for output in &outputs {
        made.write(output)?;
    }
    made.print(&outputs);
    console::result(json::Result::Preview(json::Preview {
        files: json::texts(&outputs),
        block: json::Block::of(&plan, &block),
        bench: bench::to_json(&scene, block.solid.entry_z_mm()),
        rel_rms: json::finite(seen.metrics.rel_rms),
        ssim: json::finite(seen.metrics.ssim),
    }));
    for warning in made.warnings() {
        console::warn(warning);
    }
    Ok(())
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

struct Preview<'a> {
    plan: &'a Plan,
    block: &'a DesignedBlock,
    examiner: &'a Examiner,
    seen: &'a Seen,
}

impl Preview<'_> {
    fn write(&self, output: &Path) -> Result<(), Failure> {
        let exposure = Exposure::of(&self.plan.target, self.plan.transfer.into());
        let light = judge::field_of(&self.seen.image);
        let wanted = self.examiner.wanted().map_or_else(|| light.clone(), judge::field_of);
        if is(output, "png") {
            let note = format!("draft (relative RMS {:.4})", self.seen.metrics.rel_rms);
            return report::write_png(output, &report::panel(&wanted, &light, exposure, &note))
                .map_err(Failure::writing);
        }
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let (shape, contours) = (FaceShape::of(solid.surface()), Isocontours::of(solid.surface()));
        let (_, high) = block.surface.range_mm();
        let (nx, ny) = plan.nodes;
        let mut rows = vec![
            row("Relief", format!("{:.2} mm", block.surface.relief_mm())),
            row(
                "Stock",
                format!("{} mm thick, {:.2} mm at its thinnest place", mm(solid.thickness_mm()), solid.thinnest_mm()),
            ),
        ];
        rows.extend(face_rows(&shape));
        let picture = Facts { title: "Picture".into(), rows: page::picture_rows(plan) };
        let page = Page {
            title: plan.picture.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            about: format!(
                "A preview: a draft on {nx} × {ny} nodes, solved in a moment and not to be made. Relief and thickness are close to those of the block; its light is only roughly right, and the design itself comes nearer to the picture."
            ),
            warnings: self.warnings(),
            highlights: vec![
                error_highlight(&self.seen.metrics, "RMS of this draft; a design comes nearer"),
                highlight("Stock", mm(solid.thickness_mm()), "mm", "thick".into()),
                highlight("Relief", format!("{:.2}", block.surface.relief_mm()), "mm", "lowest to highest".into()),
                highlight(
                    "Thinnest place",
                    format!("{:.2}", solid.thinnest_mm()),
                    "mm",
                    "of glass that is left".into(),
                ),
            ],
            model: page::model(solid, bench, &shape, &contours),
            target: Some(page::target_view(&wanted, exposure)),
            caustic: page::light_view(
                "Light of the draft",
                &light,
                exposure,
                format!("{}.", in_words(&self.seen.metrics)),
            ),
            difference: Some(page::difference_view(&wanted, &light, exposure)),
            others: Vec::new(),
            budget: Vec::new(),
            summary: None,
            drawing: None,
            facts: vec![
                Facts { title: "Draft".into(), rows },
                bench_facts(bench, plan.light_in_words(solid.entry_z_mm())?, high),
                picture,
            ],
            files: Vec::new(),
            command: command(),
            program: program(),
        };
        report::write_html(output, &page).map_err(Failure::writing)
    }

    fn warnings(&self) -> Vec<String> {
        self.block.summary.warnings.iter().map(|warning| format!("in this draft, {warning}")).collect()
    }

    fn print(&self, outputs: &[PathBuf]) {
        let (plan, block, metrics) = (self.plan, self.block, &self.seen.metrics);
        let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
        say!("{}", names.join(", "));
        if let Some(line) = plan.understood.line() {
            say!("  picture        {line}");
        }
        say!("  a preview      draft on {} x {} nodes, not to be made", plan.nodes.0, plan.nodes.1);
        say!(
            "  block          {:.2} x {:.2} mm, a sheet of {} mm, {:.2} mm at its thinnest place",
            plan.bench.block().width_mm,
            plan.bench.block().height_mm,
            mm(block.solid.thickness_mm()),
            block.solid.thinnest_mm()
        );
        say!("  relief         {:.2} mm", block.surface.relief_mm());
        say!(
            "  expected error below that of this draft, {:.3} relative RMS (SSIM {:.3}): 'glasswarp design' comes nearer",
            metrics.rel_rms,
            metrics.ssim
        );
    }
}
