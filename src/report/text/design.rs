//! What a design has become.

use super::{judgement::requirements, list, put};
use crate::{
    export::{HeightMap, NetFit},
    pipeline::DesignedBlock,
    solid::Origin,
    spec::name_of,
    study::{
        bench::{exit_face_in_words, receiver_in_words},
        design::Plan,
        order::StockOrder,
        verdict::seen_in_words,
        verification::{DesignVerification, Seen},
    },
};
use std::{
    path::{Path, PathBuf},
    time::Duration,
};

/// The few lines that a maker reads: what will be seen, what to send and what lies beside it, what
/// to order, what to watch.
pub(crate) fn for_maker(
    plan: &Plan,
    (files, beside): (&[PathBuf], &[&PathBuf]),
    block: &DesignedBlock,
    verification: Option<&DesignVerification<'_>>,
) -> String {
    let mut text = String::new();
    if let Some(Seen { likeness, what, .. }) = verification.and_then(|verification| verification.seen.as_ref()) {
        let (_, words) = seen_in_words(likeness.ssim);
        put!(text, "  seen     {words}: relative RMS {:.4}, SSIM {:.4}{what}", likeness.rel_rms, likeness.ssim);
    }
    put!(text, "  send     {}, with {}", list(files), list(beside));
    put!(text, "  order    {}", StockOrder::of_design(&block.solid, &plan.settings).in_words());
    let faults = verification.map(|verification| verification.faults.as_slice()).unwrap_or_default();
    if !faults.is_empty() {
        let faults: Vec<_> =
            faults.iter().map(|fault| format!("{} makes it {:.3}", fault.name, fault.rel_rms)).collect();
        put!(text, "  watch    relative RMS: {}", faults.join(", "));
    }
    text
}

/// What was made.
pub(crate) fn summary(
    plan: &Plan,
    files: &[PathBuf],
    block: &DesignedBlock,
    solved: Duration,
    notes: &[String],
) -> String {
    let mut text = String::new();
    let (solid, bench) = (&block.solid, &plan.bench);
    put!(text, "{}", list(files));
    if let Some(line) = plan.understood.line() {
        put!(text, "  picture        {line}");
    }
    put!(
        text,
        "  block          {:.2} x {:.2} x {} mm, {}",
        solid.surface().extent().width_mm,
        solid.surface().extent().height_mm,
        (solid.thickness_mm() * 1000.0).round() / 1000.0,
        exit_face_in_words(bench.exit_face())
    );
    put!(
        text,
        "  exit face      relief {:.2} mm, thinnest place {:.2} mm thick, {} x {} nodes",
        block.surface.relief_mm(),
        solid.thinnest_mm(),
        plan.nodes.0,
        plan.nodes.1
    );
    if let (Some(rim), Some(z)) = (solid.shape().rim, solid.rim_z_mm()) {
        let stock = solid.stock_extent();
        put!(
            text,
            "  rim            {} mm wide, its plane {:.2} mm above the entry face; {:.2} x {:.2} mm in all",
            rim.width_mm,
            z - solid.entry_z_mm(),
            stock.width_mm,
            stock.height_mm
        );
    }
    let skirt = 0.5 * (solid.surface().extent().width_mm - bench.block().width_mm);
    if skirt > 0.0 {
        put!(
            text,
            "  skirt          the exit face goes on {skirt:.2} mm beyond the {:.2} x {:.2} mm that draw, for the light from the side; \
             cover it for a picture without a glow around it",
            bench.block().width_mm,
            bench.block().height_mm
        );
    }
    if solid.shape().origin != Origin::Exit {
        put!(text, "  origin         {}", solid.shape().origin.place());
    }
    put!(text, "  light          {}", plan.light_in_words(solid.entry_z_mm()));
    put!(text, "  receiver       {}", receiver_in_words(bench, block.surface.range_mm().1));
    text += &requirements(&plan.requirements);
    let stopped = block.summary.levels_at_limit();
    let limit = if stopped > 0 {
        format!(", {stopped} of {} levels stopped at the iteration limit", block.summary.levels.len())
    } else {
        String::new()
    };
    put!(
        text,
        "  solver         {}, {} iterations, {:.2} s{limit}",
        name_of(plan.solver),
        block.summary.iterations(),
        solved.as_secs_f64()
    );
    for note in &block.summary.notes {
        put!(text, "                 {note}");
    }
    for note in notes {
        put!(text, "  {note}");
    }
    text
}

/// How near the face of a STEP file is to that of `nodes`.
pub(crate) fn step_note(file: &Path, fit: &NetFit, nodes: (usize, usize)) -> String {
    let points = fit.net.points();
    let (name, error) = (file.display(), &fit.error);
    if points == nodes {
        return format!("{name}: {} x {} control points, the spline through all nodes", points.0, points.1);
    }
    format!(
        "{name}: {} x {} control points, a fit to the nodes; at most {:.5} um from the heights, rms {:.5} um, slope {:.3} urad rms",
        points.0,
        points.1,
        1e3 * error.greatest_mm,
        1e3 * error.rms_mm,
        1e6 * error.slope_rms
    )
}

/// What the pixels of a height map stand for.
pub(crate) fn height_map_note(file: &Path, map: &HeightMap) -> String {
    let (low, high) = map.range_mm();
    let (pitch, size) = (map.pitch_mm(), map.picture_size_mm());
    format!(
        "{}: {:.6} x {:.6} mm per pixel, {:.3} x {:.3} mm, black {low:.4} mm, white {high:.4} mm ({:.4} mm deep)",
        file.display(),
        pitch.x,
        pitch.y,
        size.x,
        size.y,
        high - low
    )
}
