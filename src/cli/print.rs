//! What was found out, as lines for a person.

use super::console::say;
use crate::{
    irradiance::Ending,
    spec::Settings,
    study::{
        budget::{BudgetStep, Traced},
        finish::Finished,
        imperfect::{ImperfectView, SpreadPhotons, spread_in_words},
        judge::{Judgement, PictureJudgement},
        requirements::Requirements,
        verdict::seen_in_words,
    },
};
use glasswarp_verify::Flux;

/// Prints the judgement for people.
pub(super) fn judgement(judgement: &Judgement) {
    let (nx, ny) = (judgement.caustic.nx, judgement.caustic.ny);
    let millions = judgement.photon_count as f64 / 1e6;
    if let Some(PictureJudgement { metrics: m, .. }) = &judgement.picture {
        say!("\nDoes the light draw the picture? (traced through the file as read back, {nx} x {ny} pixels)");
        say!("  in words       {}", seen_in_words(m.ssim).1);
        say!("  relative RMS   {:.4}", m.rel_rms);
        say!("  PSNR           {:.1} dB", m.psnr_db);
        say!("  SSIM           {:.4}", m.ssim);
        let [edge, edge_wanted] = m.edge_width_mm(judgement.window_mm.x / nx as f64);
        if edge_wanted.is_finite() {
            say!("  edge width     {edge:.3} mm, {edge_wanted:.3} mm in the picture (10 % to 90 %)");
        }
        say!("  black level    {:.4} of the mean, {:.4} in the picture", m.black_level, m.target_black_level);
        say!("  contrast       {:.1}, {:.1} in the picture", m.contrast, m.target_contrast);
        say!("  photons        {millions:.1} million {}", judgement.agreement_in_words());
    } else {
        say!("\nWhere does the light go? ({nx} x {ny} pixels)");
        let differ = if judgement.flux.window > 0.0 {
            let (differ, error) = (judgement.between.rel_rms(), judgement.between.rel_rms_error());
            format!("image {differ:.4} +- {error:.4} relative RMS from that of the beams")
        } else {
            "none of them in the window".to_owned()
        };
        say!("  photons        {millions:.1} million, {differ}; they {}", judgement.agreement_in_words());
    }
    flux(&judgement.flux);
}

/// Prints where the light went, and how much outside of the window.
pub(super) fn flux(flux: &Flux) {
    say!("  light          {:.3} % in the window, {:.3} % beside it", 100.0 * flux.window, 100.0 * flux.missed);
    for (part, fate) in [
        (flux.totally_reflected, "is totally reflected inside"),
        (flux.side, "ends at a side wall or meets the solid again"),
        (flux.reflected, "is partially reflected"),
        (flux.beside, "passes beside the solid"),
        (flux.lost, "was LOST by the tracer"),
    ] {
        if part > 0.0 {
            say!("                 {:.3} % {fate}", 100.0 * part);
        }
    }
}

/// Prints the steps as a table, and what the paper's assumption is worth.
pub(super) fn budget(steps: &[BudgetStep], distance_mm: f64) {
    if steps.is_empty() {
        return;
    }
    say!("\nThe same block, step by step                            relative RMS     SSIM   moved by");
    for BudgetStep { name, traced } in steps {
        match traced {
            Some(Traced { likeness, moved, .. }) => {
                say!("  {name:<53} {:>12.4} {:>8.4} {moved:>10.5}", likeness.rel_rms, likeness.ssim);
            }
            None => say!("  {name}"),
        }
    }
    if let Some(plane) = BudgetStep::on_the_plane(steps) {
        say!(
            "\nOn this bench, {distance_mm} mm away, the paper's plane would be wrong by {:.1} %.",
            100.0 * plane.moved
        );
    }
}

/// Prints what the picture is then, and what it was designed to bear.
pub(super) fn finished(finished: &Finished) {
    say!("\nAfter the finish ({}), which it is designed for", finished.plan.in_words());
    say!("  relative RMS   {:.4}", finished.view.metrics.rel_rms);
    say!("  SSIM           {:.4}", finished.view.metrics.ssim);
    if let (Some(polish), Some([weaker, stronger])) = (finished.plan.polish, finished.off) {
        say!("  if it is off   {weaker:.4} a tenth weaker, {stronger:.4} a tenth stronger");
        say!(
            "  noise limit    no wave is cut more than {} times as high as it shall be; those below {:.3} mm are given up",
            polish.most_gain(),
            polish.shortest_wave_mm()
        );
    }
}

/// Prints what is seen.
pub(super) fn imperfect(view: &ImperfectView, settings: &Settings) {
    let light = spread_in_words(settings);
    say!("\nIn the light that there is ({light}; {} x {} pixels)", view.image.nx, view.image.ny);
    match &view.photons {
        Some(SpreadPhotons { error, .. }) => {
            say!("  relative RMS   {:.4} +- {:.4}", error.rel_rms(), error.rel_rms_error());
        }
        None => say!("  relative RMS   {:.4}", view.likeness.rel_rms),
    }
    say!("  SSIM           {:.4} (of the beams' light, spread on the receiver)", view.likeness.ssim);
    if let Some(photons) = &view.photons {
        let word = if photons.confirm() { "confirm" } else { "DO NOT confirm" };
        say!(
            "  photons        {:.1} million {word} that spread: relative RMS {:.4} +- {:.4} apart, less their noise of {:.3} of the mean",
            photons.count as f64 / 1e6,
            photons.between.rel_rms(),
            photons.between.rel_rms_error(),
            photons.noise
        );
    }
}

/// Lines for people, on the spread and what is corrected for.
pub(super) fn requirements(requirements: &Requirements) {
    if let Some(psf) = &requirements.psf {
        let by = psf.deviation_mm();
        say!("  spread         {:.3} mm along x, {:.3} mm along y (standard deviation on the receiver)", by.x, by.y);
    }
    if let Some(done) = &requirements.deconvolved {
        let ending = match done.ending {
            Ending::Agreed => "the picture is reached",
            Ending::Stalled => "more gain nothing",
            Ending::Rounds => "all that were asked for",
        };
        say!(
            "  deconvolution  {} rounds ({ending}): relative RMS {:.4} instead of {:.4} expected, {:.1} % of the light beside the window",
            done.rounds,
            done.error_after,
            done.error_before,
            100.0 * done.lost
        );
        say!(
            "                 contrast of the light to draw {:.0}, of the picture {:.0}",
            done.contrast_after,
            done.contrast_before
        );
    }
    if let Some(mesh) = &requirements.mesh {
        let ((nx, ny), (front, back)) = (mesh.size(), mesh.sides());
        say!(
            "  caustic mesh   {} x {} quads, {front} with their front to the block, {back} turned over",
            nx - 1,
            ny - 1
        );
    }
}
