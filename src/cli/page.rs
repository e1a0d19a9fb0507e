//! What the report of a block says: the facts and words that every such page shares, and the page of a design.

use super::{
    bench::receiver_in_words,
    budget::Step,
    error::Failure,
    judge::{self, Judgement},
    opinion::Opinion,
    plan::Plan,
    settings::name_of,
    side_file::{self, SideFile, file_name},
};
use glasswarp::{
    bench::{Bench, ExitFace},
    export::{Format, HeightMapFormat},
    fabricate::FaceShape,
    grid::Field,
    irradiance::to_picture_order,
    materials,
    pipeline::DesignedBlock,
    report::{self, Cost, Exposure, Facts, FileRecord, Highlight, Isocontours, Model, Page, View},
    solid::Solid,
    surface::SurfaceSpline,
};
use glasswarp_verify::metrics::{Likeness, Metrics};
use image::GrayImage;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};

/// Where the report goes, if anywhere: beside the first output unless it is named.
pub(crate) fn path(named: Option<&Path>, off: bool, first: &Path) -> Result<Option<PathBuf>, Failure> {
    if off {
        return Ok(None);
    }
    let path = named.map_or_else(|| first.with_extension("report.html"), Path::to_path_buf);
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html") || e.eq_ignore_ascii_case("htm")) {
        return Err(Failure::Usage(format!("{}: the report is a page of HTML, name it .html", path.display())));
    }
    Ok(Some(path))
}

/// The command as it was given, for a shell.
pub(crate) fn command() -> String {
    let arguments = std::env::args_os().skip(1).map(|argument| quoted(&argument.to_string_lossy()));
    std::iter::once("glasswarp".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

/// An argument that a POSIX shell takes as it is.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

/// The program and its version.
pub(crate) fn program() -> String {
    format!("glasswarp {}", env!("CARGO_PKG_VERSION"))
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
pub(crate) fn error_highlight(metrics: &Metrics, note: &str) -> Highlight {
    highlight("Error of the light", format!("{:.2}", 100.0 * metrics.rel_rms), "%", note.into())
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

/// The wanted light as a view.
pub(crate) fn target_view(wanted: &Field<f64>, exposure: Exposure) -> View {
    View {
        alt: "The picture that the light shall draw, in shades of grey".into(),
        ..light_view("Target", wanted, exposure, "The picture as light, with its offset.".into())
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
pub(crate) fn step_views(steps: &[Step], wanted: &Field<f64>, exposure: Exposure) -> Vec<(View, View)> {
    let seen = steps.iter().filter_map(|step| step.seen.as_ref().map(|seen| (&step.name, seen)));
    seen.filter(|(_, seen)| seen.moved > 0.0)
        .map(|(name, seen)| {
            pair(name, wanted, &judge::field_of(&seen.image), exposure, format!("{}.", in_words(seen.likeness)))
        })
        .collect()
}

/// The steps of a budget as what they cost.
pub(crate) fn costs(steps: &[Step]) -> Vec<Cost> {
    let errors = |step: &Step| step.seen.as_ref().map(|seen| (seen.likeness.rel_rms, seen.moved));
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
fn material(bench: &Bench, named: Option<&str>) -> String {
    match (bench.exit_face(), named.and_then(materials::by_name)) {
        (ExitFace::Reflects, _) => "a mirror".into(),
        (ExitFace::Refracts { ior }, Some(material)) => {
            format!("{} ({}), refractive index {ior}", material.name, material.description)
        }
        (ExitFace::Refracts { ior }, None) => format!("refractive index {ior}"),
    }
}

/// A designed block to turn and zoom.
pub(crate) fn model<'a>(solid: &'a Solid, bench: &'a Bench, shape: &'a FaceShape, contours: &'a Isocontours) -> Model<'a> {
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

/// What the verifier found.
pub(crate) fn judgement_facts(judgement: &Judgement, pixel_mm: f64) -> Facts {
    let caustic = &judgement.caustic;
    let mut rows = vec![row("Judged at", format!("{} × {} pixels of the receiver", caustic.nx, caustic.ny))];
    if let Some(verdict) = &judgement.verdict {
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

/// What is suspicious about a judgement. `skirt` is the share of the face beyond the part that draws: its light is meant to fall
/// elsewhere.
pub(crate) fn judgement_warnings(judgement: &Judgement, skirt: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if judgement.is_contradicted() {
        warnings.push(format!("photons and beams {}", judgement.agreement_in_words()));
    }
    let flux = &judgement.flux;
    let astray = 1.0 - flux.window;
    if astray > skirt + 0.01 {
        warnings.push(format!(
            "{:.1} % of the light does not reach the picture ({:.1} % lands beside it, {:.1} % is totally reflected)",
            100.0 * astray,
            100.0 * flux.missed,
            100.0 * flux.totally_reflected
        ));
    }
    warnings
}

/// Files with what they are, their lengths and hashes, which side files know already.
pub(crate) fn file_records(outputs: &[PathBuf]) -> Result<Vec<FileRecord>, Failure> {
    let mut sides: Vec<PathBuf> = outputs.iter().map(|path| side_file::path_beside(path)).collect();
    sides.dedup();
    let known: Vec<_> = sides.iter().filter_map(|side| SideFile::read(side).ok()).collect();
    let recorded = |path: &Path| known.iter().find_map(|side| side.files.get(&file_name(path)).cloned());
    outputs.iter().chain(&sides).map(|path| file_record(path, recorded(path))).collect()
}

/// A file, with its hash if that is known.
pub(crate) fn file_record(path: &Path, sha256: Option<String>) -> Result<FileRecord, Failure> {
    let failed = |source| Failure::reading(path, source);
    let bytes = std::fs::metadata(path).map_err(failed)?.len();
    let sha256 = sha256.map_or_else(|| side_file::sha256(path), Ok).map_err(failed)?;
    Ok(FileRecord { name: file_name(path), what: kind(path).into(), bytes, sha256 })
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

/// What is drawn of a block alone: nothing of it waits for a file.
pub(crate) struct Portrait {
    pub(crate) shape: FaceShape,
    pub(crate) drawing: GrayImage,
    pub(crate) contours: Isocontours,
}

impl Portrait {
    pub(crate) fn of(block: &DesignedBlock, bench: &Bench) -> Self {
        let (solid, surface) = (&block.solid, block.solid.surface());
        let spline = SurfaceSpline::through(surface);
        let (shape, (drawing, contours)) = rayon::join(
            || FaceShape::of_spline(surface, &spline),
            || rayon::join(|| report::dimensioned_drawing(solid, bench), || Isocontours::of_spline(surface, &spline)),
        );
        Self { shape, drawing, contours }
    }
}

/// Everything that a design's report is made of.
pub(crate) struct DesignPage<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) outputs: &'a [PathBuf],
    pub(crate) block: &'a DesignedBlock,
    pub(crate) portrait: &'a Portrait,
    /// What the verifier says, unless it was not asked.
    pub(crate) opinion: Option<&'a Opinion<'a>>,
    /// What there is to say of the files.
    pub(crate) notes: &'a [String],
    pub(crate) solved: Duration,
}

impl DesignPage<'_> {
    /// Writes the report.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let Portrait { shape, drawing, contours } = self.portrait;
        let exposure = Exposure::of(&plan.target, plan.transfer.into());
        let (wanted, light) = self.lights();
        let mut warnings = block.summary.warnings.clone();
        let skirt = 1.0 - block.surface.contour().area_mm2() / solid.surface().contour().area_mm2();
        warnings.extend(self.opinion.iter().flat_map(|opinion| judgement_warnings(&opinion.judgement, skirt)));
        let (size, thickness) = (solid.stock_extent(), mm(solid.thickness_mm()));
        let page = Page {
            title: self.outputs[0].file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            about: format!(
                "A block of {} × {} × {thickness} mm, {}, whose curved face sends light to a receiver {} mm away so that the light itself draws the picture.",
                mm(size.width_mm),
                mm(size.height_mm),
                material(bench, plan.settings.material.as_deref()),
                mm(bench.distance_mm())
            ),
            warnings,
            highlights: self.highlights(),
            model: model(solid, bench, shape, contours),
            target: Some(target_view(&wanted, exposure)),
            caustic: self.caustic(&light, exposure),
            difference: Some(difference_view(&wanted, &light, exposure)),
            others: self.others(&wanted, exposure),
            budget: self.opinion.map(|opinion| costs(&opinion.steps)).unwrap_or_default(),
            summary: Some(&block.summary),
            drawing: Some(drawing.clone()),
            facts: self.facts(shape)?,
            files: file_records(self.outputs)?,
            command: command(),
            program: program(),
        };
        report::write_html(path, &page).map_err(Failure::writing)
    }

    /// The wanted light and the one that is drawn, in picture order: the verifier's, or the solver's own.
    fn lights(&self) -> (Field<f64>, Field<f64>) {
        match (self.opinion, self.block.light.first()) {
            (Some(opinion), _) => (judge::field_of(&opinion.wanted), judge::field_of(&opinion.judgement.caustic)),
            (None, Some(light)) => {
                let wanted = self.plan.target.resampled(light.nx(), light.ny());
                (to_picture_order(wanted.cells()), to_picture_order(light))
            }
            (None, None) => {
                let wanted = to_picture_order(self.plan.target.cells());
                (wanted.clone(), wanted)
            }
        }
    }

    fn caustic(&self, light: &Field<f64>, exposure: Exposure) -> View {
        let note = match (self.opinion.map(|opinion| opinion.judgement.verdict.as_ref()), self.block.light.first()) {
            (Some(Some(verdict)), _) => {
                format!("Traced through the file as read back. {}.", in_words(&verdict.metrics))
            }
            (None, None) => "Not traced (--no-verify): this is the target.".into(),
            _ => "As the solver itself sees it; no exported file was traced (--no-verify).".into(),
        };
        light_view("Simulated light", light, exposure, note)
    }

    fn others(&self, wanted: &Field<f64>, exposure: Exposure) -> Vec<(View, View)> {
        let Some(opinion) = self.opinion else { return Vec::new() };
        let mut views = step_views(&opinion.steps, wanted, exposure);
        if let Some(finished) = &opinion.finished {
            let note = format!("{}.", in_words(&finished.view.metrics));
            let light = judge::field_of(&finished.view.image);
            views.insert(0, pair("After the finish", wanted, &light, exposure, note));
        }
        views
    }

    fn highlights(&self) -> Vec<Highlight> {
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let metrics =
            self.opinion.and_then(|opinion| opinion.judgement.verdict.as_ref()).map(|verdict| &verdict.metrics);
        let finished =
            self.opinion.and_then(|opinion| opinion.finished.as_ref()).map(|finished| &finished.view.metrics);
        let mut highlights = Vec::new();
        if let Some(metrics) = finished {
            highlights.push(error_highlight(metrics, "RMS, relative to the mean, after the finish"));
        } else if let Some(metrics) = metrics {
            highlights.push(error_highlight(metrics, "RMS, relative to the mean light"));
        }
        if let Some(metrics) = finished.or(metrics) {
            highlights.push(highlight(
                "Likeness",
                format!("{:.4}", metrics.ssim),
                "",
                "SSIM; 1 is the picture itself".into(),
            ));
        }
        let (size, stock) = (bench.block(), solid.stock_extent());
        highlights.extend([
            highlight(
                "Stock",
                mm(solid.thickness_mm()),
                "mm",
                format!("thick, {} × {} mm", mm(stock.width_mm), mm(stock.height_mm)),
            ),
            highlight(
                "Relief",
                format!("{:.2}", block.surface.relief_mm()),
                "mm",
                format!("on {} × {} mm, lowest to highest", mm(size.width_mm), mm(size.height_mm)),
            ),
            highlight("Thinnest place", format!("{:.2}", solid.thinnest_mm()), "mm", "of glass that is left".into()),
            highlight("Receiver", mm(bench.distance_mm()), "mm", "from the mean plane of the face".into()),
        ]);
        highlights
    }

    fn facts(&self, shape: &FaceShape) -> Result<Vec<Facts>, Failure> {
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let (stock, size, origin) = (solid.stock_extent(), bench.block(), solid.origin_mm());
        let (low, high) = block.surface.range_mm();
        let spacing = size.node_spacing(plan.nodes.0, plan.nodes.1);
        let mut rows = vec![
            row("Stock", format!("{} × {} × {} mm", mm(stock.width_mm), mm(stock.height_mm), mm(solid.thickness_mm()))),
            row("Material", material(bench, plan.settings.material.as_deref())),
            row("Exit face", format!("{} × {} mm, relief {:.3} mm", mm(size.width_mm), mm(size.height_mm), high - low)),
            row("Thinnest place", format!("{:.3} mm", solid.thinnest_mm())),
        ];
        let whole = solid.extent();
        if whole != size {
            let rest = format!(
                "the face goes on to {} × {} mm, for light from the side",
                mm(whole.width_mm),
                mm(whole.height_mm)
            );
            rows.push(row("Skirt", rest));
        }
        rows.extend(face_rows(shape));
        rows.push(row(
            "Nodes",
            format!("{} × {}, {:.4} × {:.4} mm apart", plan.nodes.0, plan.nodes.1, spacing.x, spacing.y),
        ));
        if let (Some(rim), Some(z)) = (solid.shape().rim, solid.rim_z_mm()) {
            rows.push(row(
                "Rim",
                format!(
                    "{} mm wide, its plane {} mm above the entry face",
                    mm(rim.width_mm),
                    mm(z - solid.entry_z_mm())
                ),
            ));
            if let Some(mark) = rim.mark_mm {
                rows.push(row("Mark", format!("{} mm cut off the corner at +x, +y: the picture’s top left", mm(mark))));
            }
        }
        let z = |of_bench: f64| format!("z = {} mm", mm(of_bench - origin.z));
        let frame = vec![
            row("Units", "millimetres, z up; GLB: metres, y up"),
            row("Origin", solid.shape().origin.place()),
            row("Entry face, planar", z(solid.entry_z_mm())),
            row("Exit face", format!("{} to {}, mean plane {}", z(low), z(high), z(0.0))),
            row("Receiver", z(bench.distance_mm())),
            row("Faces", "the curved face looks towards +z, to the receiver"),
        ];
        let mut picture = vec![
            row("File", file_name(&plan.picture)),
            row("SHA-256", side_file::sha256(&plan.picture).map_err(|e| Failure::reading(&plan.picture, e))?),
            row("Pixels", format!("{} × {}", plan.target.cells().nx(), plan.target.cells().ny())),
            row("Offset", format!("{} of white, added to the light", plan.settings.offset.unwrap_or_default())),
        ];
        picture.extend(picture_rows(plan));
        let mut solver = vec![
            row("Solver", name_of(plan.solver)),
            row("Iterations", block.summary.iterations().to_string()),
            row("Time", format!("{:.2} s", self.solved.as_secs_f64())),
        ];
        solver.extend(block.summary.notes.iter().map(|note| row("Note", note.clone())));
        solver.extend(self.notes.iter().map(|note| row("Note", note.clone())));
        let mut facts = vec![
            Facts { title: "Block".into(), rows },
            Facts { title: "Frame of the files".into(), rows: frame },
            bench_facts(bench, plan.light_in_words(solid.entry_z_mm())?, high),
            Facts { title: "Picture".into(), rows: picture },
        ];
        if let Some(opinion) = self.opinion {
            let pixel_mm = bench.window().width_mm / opinion.judgement.caustic.nx as f64;
            facts.push(judgement_facts(&opinion.judgement, pixel_mm));
        }
        facts.push(Facts { title: "Solver".into(), rows: solver });
        Ok(facts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_quoted_where_a_shell_would_take_them_apart() {
        assert_eq!(quoted("--rim=10mm,-4mm"), "--rim=10mm,-4mm");
        assert_eq!(quoted("my picture.png"), "'my picture.png'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
