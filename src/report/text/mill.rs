//! A block that is milled and polished.

use super::put;
use crate::{
    spec::Feed,
    study::{
        bench::{exit_face, exit_face_in_words},
        cutters::CutterTrial,
        mill::{MillStep, MillStudy},
        workpiece::Workpiece,
    },
};

/// What stands above the [trials](trial) of cutters.
pub(crate) fn trial_header() -> String {
    format!("  {:<28} {:>10} {:>10} {:>10} {:>9}\n", "cutter", "step-over", "error", "way m", "minutes")
}

/// The best that a cutter can do.
pub(crate) fn trial(CutterTrial { name, best }: &CutterTrial) -> String {
    let mut text = String::new();
    match best {
        Some(best) => put!(
            text,
            "  {name:<28} {:>10} {:>10.4} {:>10.1} {:>9.0}",
            best.pass.step_over_mm,
            best.error,
            1e-3 * best.length_mm,
            best.minutes
        ),
        None => put!(text, "  {name:<28} {:>10}", "none"),
    }
    text
}

/// The work, and the picture after every step of it.
pub(crate) fn steps(name: &str, piece: &Workpiece, study: &MillStudy, feed: Feed) -> String {
    let mut text = String::new();
    let (extent, bench) = (piece.surface.extent(), &piece.side.bench);
    put!(
        text,
        "{name}: {:.2} x {:.2} mm, {}, receiver {} mm from the mean exit plane",
        extent.width_mm,
        extent.height_mm,
        exit_face_in_words(exit_face(bench)),
        bench.distance_mm
    );
    let cost = &study.cost;
    put!(
        text,
        "  rows           {} along {}, {:.1} m in all, {:.0} min at {} (without acceleration)",
        cost.rows,
        study.pass.direction,
        1e-3 * cost.length_mm,
        cost.minutes(feed.mm_per_minute),
        feed
    );
    if let Some((scallop, deflection_mm)) = &study.scallop {
        put!(
            text,
            "  scallops       {:.3} um high, slope {:.5}, which throws light {deflection_mm:.3} mm to either side",
            1e3 * scallop.height_mm,
            scallop.slope
        );
    }
    if let Some(unreached) = &study.unreached {
        put!(text, "  rim            {}", unreached.in_words());
    }
    let (nx, ny) = piece.examiner.pixels();
    text + &steps_table(&study.steps, &format!(" ({nx} x {ny} pixels)"))
}

/// What every step of the work leaves of the picture.
pub(super) fn steps_table(steps: &[MillStep], pixels: &str) -> String {
    let mut text = String::new();
    put!(
        text,
        "\n{:<55} {:>12} {:>8} {:>12}",
        format!("The picture after every step{pixels}"),
        "relative RMS",
        "SSIM",
        "nodes"
    );
    for MillStep { name, surface, view, .. } in steps {
        let nodes = format!("{} x {}", surface.heights_mm().nx(), surface.heights_mm().ny());
        put!(text, "  {name:<53} {:>12.4} {:>8.4} {nodes:>12}", view.metrics.rel_rms, view.metrics.ssim);
    }
    text
}
