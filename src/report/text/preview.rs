//! A picture before it is designed.

use super::{list, put};
use crate::report::pages::{common::mm, preview::PreviewPage};
use std::path::PathBuf;

/// What a picture would become.
pub(crate) fn preview(page: &PreviewPage<'_>, files: &[PathBuf]) -> String {
    let mut text = String::new();
    let (plan, block, metrics) = (page.plan, page.block, &page.view.metrics);
    put!(text, "{}", list(files));
    if let Some(line) = plan.understood.line() {
        put!(text, "  picture        {line}");
    }
    put!(text, "  a preview      draft on {} x {} nodes, not to be made", plan.nodes.0, plan.nodes.1);
    put!(
        text,
        "  block          {:.2} x {:.2} mm, a sheet of {} mm, {:.2} mm at its thinnest place",
        plan.bench.block().width_mm,
        plan.bench.block().height_mm,
        mm(block.solid.thickness_mm()),
        block.solid.thinnest_mm()
    );
    put!(text, "  relief         {:.2} mm", block.surface.relief_mm());
    put!(
        text,
        "  expected error below that of this draft, {:.3} relative RMS (SSIM {:.3}): 'glasswarp design' comes nearer",
        metrics.rel_rms,
        metrics.ssim
    );
    text
}
