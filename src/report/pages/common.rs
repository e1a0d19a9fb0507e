//! The facts and words that the pages of all reports share.

use crate::{
    bench::{Bench, ExitFace},
    export::{Format, HeightMapFormat},
    fabricate::FaceShape,
    grid::Field,
    irradiance::{TargetIrradiance, Transfer},
    materials,
    report::{
        budget::{Cost, CostErrors},
        html::{Facts, FileRecord, Highlight, Model, MovingLight, TrafficLight, View},
        isocontours::Isocontours,
        pictures::{self as report, Exposure},
    },
    solid::Solid,
    spec::Settings,
    study::{
        bench::receiver_in_words,
        budget::BudgetStep,
        design::Plan,
        judge::{self, Judgement},
        order::StockOrder,
        stand::Stand,
        verdict::{Answer, Verdict},
        workpiece::Workpiece,
    },
};
use glasswarp_verify::{Scene, metrics::Likeness};
use std::path::Path;

/// The program and its version.
pub(super) fn program() -> String {
    format!("glasswarp {}", env!("CARGO_PKG_VERSION"))
}

/// An answer as a traffic light.
pub(super) fn light_of(question: &str, answer: Answer, says: String) -> TrafficLight {
    let class = match answer {
        Answer::Yes => "yes",
        Answer::But => "but",
        Answer::NotAsked => "open",
        Answer::No => "no",
    };
    TrafficLight { question: question.into(), answer: answer.word(), class, says }
}

/// Whether a block will work, in a line.
pub(super) fn traffic_light(verdict: &Verdict, in_flags: fn(&str) -> String) -> TrafficLight {
    light_of("Will it work?", verdict.answer(), in_flags(&verdict.in_words()))
}

/// A length without the digits that only rounding errors fill.
pub(crate) fn mm(value: f64) -> String {
    // The sign of mathematics, not a hyphen.
    format!("{}", (value * 1000.0).round() / 1000.0 + 0.0).replace('-', "−")
}

pub(crate) fn highlight(label: &str, value: String, unit: &str, note: String) -> Highlight {
    Highlight { label: label.into(), value, unit: unit.into(), note }
}

/// How near the light is to the picture, as the first of the key figures.
pub(crate) fn error_highlight(likeness: impl Into<Likeness>, note: &str) -> Highlight {
    highlight("Error of the light", format!("{:.2}", 100.0 * likeness.into().rel_rms), "%", note.into())
}

/// What the relative RMS error and the similarity are, in a line.
pub(crate) fn in_words(likeness: impl Into<Likeness>) -> String {
    let Likeness { rel_rms, ssim } = likeness.into();
    format!("Relative RMS error {rel_rms:.4}, SSIM {ssim:.4}")
}

/// Light on the receiver as a view.
pub(crate) fn light_view(title: &str, light: &Field<f64>, exposure: Exposure, note: String) -> View {
    View {
        title: title.into(),
        note,
        alt: format!("{title}: the light on the receiver as a picture in shades of grey"),
        picture: report::irradiance_picture(light, exposure),
    }
}

/// The target irradiance as a view.
pub(crate) fn target_view(wanted: &Field<f64>, exposure: Exposure) -> View {
    View {
        alt: "The picture that the light shall draw, in shades of grey".into(),
        ..light_view(
            "The picture",
            wanted,
            exposure,
            "As it shall be seen: the picture as light, with its offset.".into(),
        )
    }
}

/// The difference of the two as the paper prints it.
pub(crate) fn difference_view(wanted: &Field<f64>, light: &Field<f64>, exposure: Exposure) -> View {
    View {
        title: "Difference × 4".into(),
        note: "Inverted: white where both agree, black where they differ by a quarter of the scale or more.".into(),
        alt: "Four times the difference between target and simulated light, inverted: white where they agree".into(),
        picture: report::difference_picture(wanted, light, exposure),
    }
}

/// How the light of a block is shown as a picture where this light is to be seen.
pub fn exposure_of(target: &TargetIrradiance, piece: &Workpiece) -> Exposure {
    let transfer = piece.side.design.transfer.map(Transfer::from);
    Exposure::of(target, transfer.unwrap_or(Transfer::Srgb))
}

/// Light with its difference from what is wanted.
pub(crate) fn pair(
    title: &str,
    wanted: &Field<f64>,
    light: &Field<f64>,
    exposure: Exposure,
    note: String,
) -> (View, View) {
    let difference = difference_view(wanted, light, exposure);
    let alt = format!("{title}: four times its difference from the target, inverted");
    (light_view(title, light, exposure, note), View { alt, ..difference })
}

/// The steps of a budget as pictures, but for the one that is the judged light itself.
pub(crate) fn step_views(steps: &[BudgetStep], wanted: &Field<f64>, exposure: Exposure) -> Vec<(View, View)> {
    let traced = steps.iter().filter_map(|step| step.traced.as_ref().map(|traced| (&step.name, traced)));
    traced
        .filter(|(_, seen)| seen.moved > 0.0)
        .map(|(name, seen)| {
            pair(name, wanted, &judge::field_of(&seen.image), exposure, format!("{}.", in_words(seen.likeness)))
        })
        .collect()
}

/// The steps of a budget as what they cost.
pub(crate) fn costs(steps: &[BudgetStep]) -> Vec<Cost> {
    let errors = |step: &BudgetStep| {
        let traced = step.traced.as_ref()?;
        let Likeness { rel_rms, ssim } = traced.likeness;
        Some(CostErrors { rel_rms, ssim, moved: traced.moved })
    };
    steps.iter().map(|step| Cost { name: step.name.clone(), errors: errors(step) }).collect()
}

/// Name and value of a row.
pub(crate) fn row(name: &str, value: impl Into<String>) -> (String, String) {
    (name.into(), value.into())
}

/// The picture as it was understood.
pub(crate) fn picture_rows(plan: &Plan) -> Vec<(String, String)> {
    plan.understood.rows().into_iter().map(|(name, value)| row(name, value)).collect()
}

/// What to order.
pub(super) fn stock_facts(order: &StockOrder) -> Facts {
    let rows = vec![
        row("Material", order.material.clone()),
        row("Sheet", order.sheet_in_words()),
        row("Saw to", format!("{} × {} mm", order.sawn_mm.x, order.sawn_mm.y)),
        row(
            "Finished block",
            format!("{} × {} × {} mm", mm(order.block_mm.x), mm(order.block_mm.y), mm(order.thickness_mm)),
        ),
        row("Face off the top", format!("{} mm, or what the sheet has too much", mm(order.facing_mm))),
    ];
    Facts { title: "Stock to order".into(), rows }
}

/// What a face asks of a workshop.
pub(crate) fn face_rows(shape: &FaceShape) -> Vec<(String, String)> {
    let (at, slope) = shape.steepest();
    let hollow = shape.sharpest();
    let place = |at: glam::DVec2| format!("x = {} mm, y = {} mm", mm(at.x), mm(at.y));
    let sharpest = if hollow.radius_mm.is_finite() {
        format!("{} mm radius at {}: a ball cutter must be smaller to reach it", mm(hollow.radius_mm), place(hollow.at))
    } else {
        "none: the face bulges everywhere".to_owned()
    };
    vec![
        row("Steepest place", format!("{:.2}° at {}", slope.atan().to_degrees(), place(at))),
        row("Sharpest hollow", sharpest),
    ]
}

/// Light, in words, and receiver.
pub(crate) fn bench_facts(bench: &Bench, light: String, highest_mm: f64) -> Facts {
    let rows = vec![
        row("Light", light),
        row("Receiver", receiver_in_words(bench, highest_mm).replace(" x ", " × ")),
        row("Seen", "on the receiver from the block’s side: left is +x, top is +y"),
    ];
    Facts { title: "Bench".into(), rows }
}

/// What glass it is.
pub(super) fn material(bench: &Bench, named: Option<&str>) -> String {
    match (bench.exit_face(), named.and_then(materials::by_name)) {
        (ExitFace::Reflects, _) => "a mirror".into(),
        (ExitFace::Refracts { ior }, Some(material)) => {
            format!("{} ({}), refractive index {ior}", material.name, material.description)
        }
        (ExitFace::Refracts { ior }, None) => format!("refractive index {ior}"),
    }
}

/// A designed block to turn and zoom.
pub(crate) fn model<'a>(
    solid: &'a Solid,
    bench: &'a Bench,
    shape: &'a FaceShape,
    contours: &'a Isocontours,
) -> Model<'a> {
    Model {
        surface: solid.surface(),
        entry_z_mm: solid.entry_z_mm(),
        outline: solid.shape().outline(solid.extent()),
        rim_z_mm: solid.rim_z_mm(),
        bench,
        slope: shape.slope(),
        hollow_per_mm: shape.hollow_per_mm(),
        contours,
    }
}

/// The light of a designed block, to be moved by hand.
pub(crate) fn moving_light(
    solid: &Solid,
    scene: &Scene,
    settings: &Settings,
    exposure: Exposure,
) -> Result<MovingLight, &'static str> {
    MovingLight::of(Stand::of_design(solid, scene, settings), exposure)
}

/// What the verifier found.
pub(crate) fn judgement_facts(judgement: &Judgement, pixel_mm: f64) -> Facts {
    let caustic = &judgement.caustic;
    let mut rows = vec![row("Judged at", format!("{} × {} pixels of the receiver", caustic.nx, caustic.ny))];
    if let Some(verdict) = &judgement.picture {
        let m = &verdict.metrics;
        rows.extend([
            row("Relative RMS error", format!("{:.4} of the mean light", m.rel_rms)),
            row("PSNR", format!("{:.1} dB", m.psnr_db)),
            row("SSIM", format!("{:.4}", m.ssim)),
            row("Black level", format!("{:.4} of the mean, {:.4} in the picture", m.black_level, m.target_black_level)),
            row("Contrast", format!("{:.1}, {:.1} in the picture", m.contrast, m.target_contrast)),
        ]);
        let [edge, wanted] = m.edge_width_mm(pixel_mm);
        if wanted.is_finite() {
            rows.push(row("Edge width, 10 % to 90 %", format!("{edge:.3} mm, {wanted:.3} mm in the picture")));
        }
        rows.push(row(
            "Photons",
            format!("{:.1} million {}", judgement.photon_count as f64 / 1e6, judgement.agreement_in_words()),
        ));
    }
    let flux = &judgement.flux;
    rows.push(row(
        "Light in the window",
        format!("{:.3} %, {:.3} % beside it", 100.0 * flux.window, 100.0 * flux.missed),
    ));
    Facts { title: "Judgement, from the file as read back".into(), rows }
}

/// What is suspicious about a judgement. `skirt` is the share of the face beyond the part that
/// draws: its light is meant to fall elsewhere.
pub(crate) fn judgement_warnings(judgement: &Judgement, skirt: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if judgement.is_contradicted() {
        warnings.push(format!("photons and beams {}", judgement.agreement_in_words()));
    }
    warnings.extend(judgement.astray_in_words(skirt));
    warnings
}

impl FileRecord {
    /// A file of this name, with its length and hash.
    pub fn new(name: String, bytes: u64, sha256: String) -> Self {
        Self { what: kind(Path::new(&name)).into(), name, bytes, sha256 }
    }
}

/// What a file of this name is.
fn kind(path: &Path) -> &'static str {
    match (Format::from_path(path), HeightMapFormat::from_path(path)) {
        (Ok(Format::Stl), _) => "mesh, mm, z up",
        (Ok(Format::Obj), _) => "mesh with normals, mm, z up",
        (Ok(Format::Glb), _) => "mesh for viewers, m, y up",
        (Ok(Format::Step), _) => "B-spline solid for CAD and CAM, mm, z up",
        (Ok(Format::ThreeMf), _) => "mesh, mm, z up",
        (Ok(Format::Ply), _) => "mesh, mm, z up",
        (_, Ok(_)) => "heights of the exit face for a router",
        _ => "side file: bench, units, frame, hashes",
    }
}
