//! Whether a block can be made, and what tolerances do to its picture.

use super::put;
use crate::study::{
    bench::{exit_face_in_words, exit_face_of},
    check::{Makeable, Shop},
    tolerance::{Focus, ToleranceCase, ToleranceStudy},
};

/// What is checked, and for which cutter.
pub(crate) fn subject(name: &str, subject: &Makeable, shop: &Shop) -> String {
    let extent = subject.surface.extent();
    let mut text = String::new();
    put!(
        text,
        "{name}: {:.2} x {:.2} mm, {}, receiver at {} mm{}; {}, rows {} mm apart",
        extent.width_mm,
        extent.height_mm,
        exit_face_in_words(exit_face_of(&subject.scene)),
        subject.scene.distance_mm,
        if subject.assumed { ", straight light assumed without a side file" } else { "" },
        shop.cutter.in_words(),
        shop.step_over_mm
    );
    text
}

/// What tolerances do to the picture, and how far the receiver may be off.
pub(crate) fn tolerances(study: &ToleranceStudy) -> String {
    let ToleranceStudy { designed, cases, left_out, focus, distance_mm, .. } = study;
    let mut text = String::new();
    put!(text, "\nTolerances, each traced through the displaced surface      relative RMS     SSIM   moved by");
    put!(text, "  {:<55} {:>12.4} {:>8.4}", "as designed", designed.metrics.rel_rms, designed.metrics.ssim);
    for ToleranceCase { name, view, place, .. } in cases {
        match view {
            Some((view, moved)) => put!(
                text,
                "  {name:<55} {:>12.4} {:>8.4} {moved:>10.4}{}",
                view.metrics.rel_rms,
                view.metrics.ssim,
                place.in_words()
            ),
            None => put!(text, "  {name:<55} none of the light falls into the window{}", place.in_words()),
        }
    }
    for what in left_out {
        put!(text, "  left out: {what}");
    }
    if let Ok(focus) = focus {
        text += &depth_of_focus(focus, *distance_mm);
    }
    text
}

fn depth_of_focus(focus: &Focus, distance_mm: f64) -> String {
    let mut text = String::new();
    let end = |mm: Option<f64>| mm.map_or("beyond".into(), |mm| format!("{mm:.2} mm"));
    put!(
        text,
        "\nDepth of focus (relative RMS error up to {:.4}): from {} to {}",
        focus.limit,
        end(focus.near_mm),
        end(focus.far_mm)
    );
    if let (Some(near), Some(far)) = (focus.near_mm, focus.far_mm) {
        put!(
            text,
            "  {:.2} mm, {:.2} mm nearer and {:.2} mm further than designed",
            far - near,
            distance_mm - near,
            far - distance_mm
        );
    }
    text
}
