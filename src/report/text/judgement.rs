//! What the light of a block does.

use super::put;
use crate::{
    irradiance::Ending,
    spec::Settings,
    study::{
        bench::{exit_face_in_words, exit_face_of},
        budget::{BudgetStep, Traced},
        finish::Finished,
        imperfect::{ImperfectView, SpreadPhotons, spread_in_words},
        judge::{Judgement, PictureJudgement, Subject},
        requirements::Requirements,
        verdict::seen_in_words,
        white::WhiteLight,
    },
};
use glasswarp_verify::{Flux, Scene, dispersion::LINES_NM};

/// What is looked at, and from where.
pub(crate) fn subject(name: &str, subject: &Subject, scene: &Scene, offset: Option<f64>) -> String {
    let size = subject.size_mm();
    let (what, from) = match subject {
        Subject::Block(_) => ("block", "the mean exit plane"),
        Subject::Solid(_) => ("solid, traced as its flat triangles", "z = 0"),
    };
    let mut text = String::new();
    put!(
        text,
        "{name}: {what}, {:.2} x {:.2} mm, {}, receiver {} mm from {from}, window {:.2} x {:.2} mm{}",
        size.x,
        size.y,
        exit_face_in_words(exit_face_of(scene)),
        scene.distance_mm,
        scene.window.size_mm.x,
        scene.window.size_mm.y,
        offset.map(|offset| format!(", offset {offset}")).unwrap_or_default()
    );
    text
}

/// What the light of all colours does, and where its picture is.
pub(crate) fn white(white: &WhiteLight, picture: &str) -> String {
    let ([red, blue], fringing) = (LINES_NM, &white.fringing);
    let mut text = String::new();
    put!(text, "\nIn white light ({}, designed for {} nm)", white.material, white.designed_nm);
    put!(
        text,
        "  colours part   {:.3} mm rms, {:.3} mm at most, between {red} nm (index {:.4}) and {blue} nm (index {:.4})",
        fringing.rms_mm,
        fringing.worst_mm,
        fringing.ior[0],
        fringing.ior[1]
    );
    put!(text, "  brightness     {:.4} relative RMS from the light of one colour", fringing.rel_rms);
    put!(text, "  picture        {picture}");
    text
}

/// Whether the light draws the picture, or where it goes.
pub(crate) fn judgement(judgement: &Judgement) -> String {
    let mut text = String::new();
    let (nx, ny) = (judgement.caustic.nx, judgement.caustic.ny);
    let millions = judgement.photon_count as f64 / 1e6;
    if let Some(PictureJudgement { metrics: m, .. }) = &judgement.picture {
        put!(text, "\nDoes the light draw the picture? (traced through the file as read back, {nx} x {ny} pixels)");
        put!(text, "  in words       {}", seen_in_words(m.ssim).1);
        put!(text, "  relative RMS   {:.4}", m.rel_rms);
        put!(text, "  PSNR           {:.1} dB", m.psnr_db);
        put!(text, "  SSIM           {:.4}", m.ssim);
        let [edge, edge_wanted] = m.edge_width_mm(judgement.window_mm.x / nx as f64);
        if edge_wanted.is_finite() {
            put!(text, "  edge width     {edge:.3} mm, {edge_wanted:.3} mm in the picture (10 % to 90 %)");
        }
        put!(text, "  black level    {:.4} of the mean, {:.4} in the picture", m.black_level, m.target_black_level);
        put!(text, "  contrast       {:.1}, {:.1} in the picture", m.contrast, m.target_contrast);
        put!(text, "  photons        {millions:.1} million {}", judgement.agreement_in_words());
    } else {
        put!(text, "\nWhere does the light go? ({nx} x {ny} pixels)");
        let differ = if judgement.flux.window > 0.0 {
            let (differ, error) = (judgement.between.rel_rms(), judgement.between.rel_rms_error());
            format!("image {differ:.4} +- {error:.4} relative RMS from that of the beams")
        } else {
            "none of them in the window".to_owned()
        };
        put!(text, "  photons        {millions:.1} million, {differ}; they {}", judgement.agreement_in_words());
    }
    text + &flux(&judgement.flux)
}

/// Where the light went, and how much outside of the window.
pub(crate) fn flux(flux: &Flux) -> String {
    let mut text = String::new();
    put!(text, "  light          {:.3} % in the window, {:.3} % beside it", 100.0 * flux.window, 100.0 * flux.missed);
    for (part, fate) in [
        (flux.totally_reflected, "is totally reflected inside"),
        (flux.side, "ends at a side wall or meets the solid again"),
        (flux.reflected, "is partially reflected"),
        (flux.beside, "passes beside the solid"),
        (flux.lost, "was LOST by the tracer"),
    ] {
        if part > 0.0 {
            put!(text, "                 {:.3} % {fate}", 100.0 * part);
        }
    }
    text
}

/// The steps as a table, and what the paper's assumption is worth.
pub(crate) fn budget(steps: &[BudgetStep], distance_mm: f64) -> String {
    let mut text = String::new();
    if steps.is_empty() {
        return text;
    }
    put!(text, "\nThe same block, step by step                            relative RMS     SSIM   moved by");
    for BudgetStep { name, traced } in steps {
        match traced {
            Some(Traced { likeness, moved, .. }) => {
                put!(text, "  {name:<53} {:>12.4} {:>8.4} {moved:>10.5}", likeness.rel_rms, likeness.ssim);
            }
            None => put!(text, "  {name}"),
        }
    }
    if let Some(plane) = BudgetStep::on_the_plane(steps) {
        put!(
            text,
            "\nOn this bench, {distance_mm} mm away, the paper's plane would be wrong by {:.1} %.",
            100.0 * plane.moved
        );
    }
    text
}

/// What the picture is then, and what it was designed to bear.
pub(crate) fn finished(finished: &Finished) -> String {
    let mut text = String::new();
    put!(text, "\nAfter the finish ({}), which it is designed for", finished.plan.in_words());
    put!(text, "  relative RMS   {:.4}", finished.view.metrics.rel_rms);
    put!(text, "  SSIM           {:.4}", finished.view.metrics.ssim);
    if let (Some(polish), Some([weaker, stronger])) = (finished.plan.polish, finished.off) {
        put!(text, "  if it is off   {weaker:.4} a tenth weaker, {stronger:.4} a tenth stronger");
        put!(
            text,
            "  noise limit    no wave is cut more than {} times as high as it shall be; those below {:.3} mm are given up",
            polish.most_gain(),
            polish.shortest_wave_mm()
        );
    }
    text
}

/// What is seen in the light that there is.
pub(crate) fn imperfect(view: &ImperfectView, settings: &Settings) -> String {
    let mut text = String::new();
    let light = spread_in_words(settings);
    put!(text, "\nIn the light that there is ({light}; {} x {} pixels)", view.image.nx, view.image.ny);
    match &view.photons {
        Some(SpreadPhotons { error, .. }) => {
            put!(text, "  relative RMS   {:.4} +- {:.4}", error.rel_rms(), error.rel_rms_error());
        }
        None => put!(text, "  relative RMS   {:.4}", view.likeness.rel_rms),
    }
    put!(text, "  SSIM           {:.4} (of the beams' light, spread on the receiver)", view.likeness.ssim);
    if let Some(photons) = &view.photons {
        let word = if photons.confirm() { "confirm" } else { "DO NOT confirm" };
        put!(
            text,
            "  photons        {:.1} million {word} that spread: relative RMS {:.4} +- {:.4} apart, less their noise of {:.3} of the mean",
            photons.count as f64 / 1e6,
            photons.between.rel_rms(),
            photons.between.rel_rms_error(),
            photons.noise
        );
    }
    text
}

/// The spread of the light, and what is corrected for.
pub(crate) fn requirements(requirements: &Requirements) -> String {
    let mut text = String::new();
    if let Some(psf) = &requirements.psf {
        let by = psf.deviation_mm();
        put!(
            text,
            "  spread         {:.3} mm along x, {:.3} mm along y (standard deviation on the receiver)",
            by.x,
            by.y
        );
    }
    if let Some(done) = &requirements.deconvolved {
        let ending = match done.ending {
            Ending::Agreed => "the picture is reached",
            Ending::Stalled => "more gain nothing",
            Ending::Rounds => "all that were asked for",
        };
        put!(
            text,
            "  deconvolution  {} rounds ({ending}): relative RMS {:.4} instead of {:.4} expected, {:.1} % of the light beside the window",
            done.rounds,
            done.error_after,
            done.error_before,
            100.0 * done.lost
        );
        put!(
            text,
            "                 contrast of the light to draw {:.0}, of the picture {:.0}",
            done.contrast_after,
            done.contrast_before
        );
    }
    if let Some(mesh) = &requirements.mesh {
        let ((nx, ny), (front, back)) = (mesh.size(), mesh.sides());
        put!(
            text,
            "  caustic mesh   {} x {} quads, {front} with their front to the block, {back} turned over",
            nx - 1,
            ny - 1
        );
    }
    text
}
