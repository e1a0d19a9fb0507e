//! `glasswarp preview`: what a picture would become, before a design is waited for.

use super::{
    console,
    design::placed,
    machine::{Machine, has_extension},
    memory::MemoryArgs,
    outputs,
    progress::TerminalProgress,
    report_files,
};
use crate::{
    failure::Failure,
    record::document,
    report::{pages::preview::PreviewPage, text, write_png},
    spec::{self, QualityName, Settings, SolverName},
    study::{bench::bench_document, budget::double_precision, design::Plan, fits, judge::Examiner, workpiece::view_of},
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
    fits::preview(&plan, args.memory.free())?;
    let block = plan.design(&progress);
    progress.finish();
    let block = block?;
    let target = plan.target_light(&Machine)?;
    let examiner = Examiner::new(plan.scene.clone(), Some(target.in_perfect_light()), PIXELS);
    let view = view_of(&examiner, &double_precision(&block)?)?;
    let command = report_files::command();
    console::light("irradiance", &view.image);
    console::light("target", examiner.target().unwrap_or(&view.image));
    let page = PreviewPage { plan: &plan, block: &block, examiner: &examiner, view: &view, command };
    for output in &outputs {
        if has_extension(output, "png") {
            write_png(output, &page.panel()).map_err(Failure::writing)?;
        } else {
            report_files::write(output, &page.html())?;
        }
    }
    console::text(&text::preview::preview(&page, &outputs));
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
