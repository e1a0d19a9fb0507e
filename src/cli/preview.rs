//! `glasswarp preview`: what a picture would become, before a design is waited for.

use super::{
    console::{self, say},
    design::placed,
    machine::{Machine, has_extension},
    memory::{self, MemoryArgs},
    outputs,
    progress::TerminalProgress,
    report_files,
};
use crate::{
    failure::Failure,
    record::document,
    report::{
        pages::{common::mm, preview::PreviewPage},
        write_png,
    },
    spec::{self, QualityName, Settings, SolverName},
    study::{bench::bench_document, budget::double_precision, design::Plan, judge::Examiner, workpiece::view_of},
};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct PreviewArgs {
    /// The picture, or a design file (.toml) that names it
    picture: PathBuf,

    /// Where to: .html (the page to turn the block on) or .png (target, light and difference). May
    /// be given several times [default: the picture's name with .preview.html, in the working
    /// folder]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    #[command(flatten)]
    memory: MemoryArgs,

    #[command(flatten)]
    settings: Settings,
}

/// Height nodes across: enough for a draft of a photograph, few enough for a fraction of a second.
const NODES: usize = 257;
/// Pixels across at which the light is looked at, at most.
const PIXELS: usize = 384;

pub(crate) fn run(args: &PreviewArgs) -> Result<(), Failure> {
    let (mut settings, picture) = spec::settings(&args.picture, &args.settings, &Machine)?;
    settings.nodes = settings.nodes.or(Some(NODES));
    if settings.solver.unwrap_or_default() == SolverName::Transport {
        settings.quality = settings.quality.or(Some(QualityName::Draft));
    }
    let stem = PathBuf::from(picture.file_stem().unwrap_or_default());
    let outputs = if args.output.is_empty() { vec![stem.with_extension("preview.html")] } else { args.output.clone() };
    for output in &outputs {
        if !has_extension(output, "html") && !has_extension(output, "png") {
            return Err(Failure::Usage(format!("{}: a preview is written as .html or .png", output.display())));
        }
    }
    let inputs = [&args.picture, &picture].map(PathBuf::as_path);
    outputs::plan(inputs.into_iter().chain(settings.files()), outputs.iter().cloned())?;
    let progress = TerminalProgress::new();
    let plan = Plan::new(picture, settings, &Machine, &progress).map_err(|failure| placed(failure, &args.picture))?;
    memory::check_preview(&plan, args.memory)?;
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let target = plan.target_light(&Machine)?;
    let examiner = Examiner::new(plan.scene.clone(), Some(target.in_perfect_light()), PIXELS);
    let view = view_of(&examiner, &double_precision(&block)?)?;
    let command = report_files::command();
    let page = PreviewPage { plan: &plan, block: &block, examiner: &examiner, view: &view, command };
    for output in &outputs {
        if has_extension(output, "png") {
            write_png(output, &page.panel()).map_err(Failure::writing)?;
        } else {
            page.write(output)?;
        }
    }
    print(&page, &outputs);
    console::result(document::Result::Preview(document::Preview {
        files: document::texts(&outputs),
        block: plan.document(&block),
        bench: bench_document(&plan.scene, block.solid.entry_z_mm()),
        rel_rms: document::finite(view.metrics.rel_rms),
        ssim: document::finite(view.metrics.ssim),
    }));
    page.warnings().into_iter().for_each(console::warn);
    Ok(())
}

fn print(page: &PreviewPage<'_>, outputs: &[PathBuf]) {
    let (plan, block, metrics) = (page.plan, page.block, &page.view.metrics);
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
