//! The report of a design, and the pictures that are drawn of it.

use super::common::{
    bench_facts, costs, difference_view, error_highlight, face_rows, highlight, in_words, judgement_facts,
    judgement_warnings, light_view, material, mm, model, moving_light, pair, picture_rows, program, row, step_views,
    stock_facts, target_view, traffic_light,
};
use crate::{
    fabricate::FaceShape,
    failure::Failure,
    grid::Field,
    irradiance::to_picture_order,
    pipeline::DesignedBlock,
    report::{
        budget::budget_sheet,
        drawing::Drawing,
        html::{Facts, FileRecord, Highlight, Page, View, write_html},
        isocontours::Isocontours,
        pictures::{Exposure, difference_picture, irradiance_picture},
        sheet::panel,
    },
    spec::{Settings, name_of},
    study::{
        budget::BudgetStep,
        design::Plan,
        judge,
        order::StockOrder,
        verdict::{Verdict, seen_in_words},
        verification::{DesignVerification, Seen},
    },
    surface::SurfaceSpline,
};
use glasswarp_verify::Image;
use image::GrayImage;
use rayon::prelude::*;
use std::{path::Path, time::Duration};

const WHAT_THE_EYE_GETS: &str = "What the eye gets";

/// What is drawn of a block alone: nothing of it waits for a file.
pub(crate) struct BlockDrawings {
    pub(crate) shape: FaceShape,
    pub(crate) drawing: Drawing,
    pub(crate) order: StockOrder,
    pub(crate) contours: Isocontours,
}

impl BlockDrawings {
    pub(crate) fn of(block: &DesignedBlock, plan: &Plan) -> Self {
        let order = StockOrder::of_design(&block.solid, &plan.settings);
        let notes = order.notes();
        let (solid, surface) = (&block.solid, block.solid.surface());
        let spline = SurfaceSpline::through(surface);
        let (shape, (drawing, contours)) = rayon::join(
            || FaceShape::of_spline(surface, &spline),
            || rayon::join(|| Drawing::of(solid, &plan.bench, &notes), || Isocontours::of_spline(surface, &spline)),
        );
        Self { shape, drawing, order, contours }
    }
}

/// Everything that a design's report is made of.
pub(crate) struct DesignPage<'a> {
    pub(crate) plan: &'a Plan,
    /// The name of the block.
    pub(crate) title: String,
    /// The name and hash of the picture.
    pub(crate) picture: (String, String),
    /// The files.
    pub(crate) files: Vec<FileRecord>,
    /// The command that made it.
    pub(crate) command: String,
    pub(crate) block: &'a DesignedBlock,
    pub(crate) drawings: &'a BlockDrawings,
    /// What the verifier says, unless it was not asked.
    pub(crate) verification: Option<&'a DesignVerification<'a>>,
    /// Whether it will work.
    pub(crate) verdict: &'a Verdict,
    /// Settings in messages as a person writes them.
    pub(crate) in_flags: fn(&str) -> String,
    /// What there is to say of the files.
    pub(crate) notes: &'a [String],
    pub(crate) solved: Duration,
}

impl DesignPage<'_> {
    /// Writes the report.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let BlockDrawings { shape, drawing, order, contours } = self.drawings;
        let exposure = Exposure::of(&plan.requirements.perceived, plan.transfer.into());
        let (wanted, light) = self.lights();
        let mut warnings = block.summary.warnings.clone();
        warnings.extend(
            self.verification
                .iter()
                .flat_map(|verification| judgement_warnings(&verification.judgement, block.skirt_share())),
        );
        let (size, thickness) = (solid.stock_extent(), mm(solid.thickness_mm()));
        let page = Page {
            title: self.title.clone(),
            about: format!(
                "A block of {} × {} × {thickness} mm, {}, whose curved face sends light to a receiver {} mm away so that the light itself draws the picture.",
                mm(size.width_mm),
                mm(size.height_mm),
                material(bench, plan.settings.material.as_deref()),
                mm(bench.distance_mm())
            ),
            verdict: Some(traffic_light(self.verdict, self.in_flags)),
            warnings: warnings.iter().map(|warning| (self.in_flags)(warning)).collect(),
            highlights: self.highlights(),
            model: model(solid, bench, shape, contours),
            target: Some(target_view(&wanted, exposure)),
            caustic: self.caustic(&light, exposure),
            moving: moving_light(solid, &plan.scene, &plan.settings, exposure),
            maker: vec![
                stock_facts(order),
                bench_facts(bench, plan.light_in_words(solid.entry_z_mm()), block.surface.range_mm().1),
            ],
            difference: Some(difference_view(&wanted, &light, exposure)),
            others: self.others(),
            budget: self.verification.map(|verification| costs(&verification.steps)).unwrap_or_default(),
            summary: Some(&block.summary),
            drawing: Some(drawing.clone()),
            facts: self.facts(shape),
            files: self.files.clone(),
            command: self.command.clone(),
            program: program(),
        };
        write_html(path, &page).map_err(Failure::writing)
    }

    /// The picture and what the eye gets of it, in picture order: by the verifier, or the solver's
    /// own view.
    fn lights(&self) -> (Field<f64>, Field<f64>) {
        match (self.verification.and_then(|verification| verification.seen.as_ref()), self.block.light.first()) {
            (Some(seen), _) => (judge::field_of(&seen.target), judge::field_of(&seen.image)),
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
        let (title, note) = match (self.verification.map(|v| v.seen.as_ref()), self.block.light.first()) {
            (Some(Some(seen)), _) => (
                WHAT_THE_EYE_GETS,
                format!(
                    "Traced through the file as read back{}: {}. {}.",
                    seen.what,
                    seen_in_words(seen.likeness.ssim).1,
                    in_words(seen.likeness)
                ),
            ),
            (None, None) => ("Target", "Not traced: this is the target.".into()),
            _ => ("Simulated light", "As the solver itself sees it; no exported file was traced.".into()),
        };
        light_view(title, light, exposure, note)
    }

    /// In perfect light, and step by step.
    fn others(&self) -> Vec<(View, View)> {
        let Some(verification) = self.verification else { return Vec::new() };
        let exposure = Exposure::of(&self.plan.target, self.plan.transfer.into());
        let wanted = judge::field_of(&verification.target);
        let mut views = step_views(&verification.steps, &wanted, exposure);
        if let (true, Some(picture)) = (verification.is_seen_otherwise(), &verification.judgement.picture) {
            let note = format!("{}; what is to be drawn there is not the picture itself.", in_words(&picture.metrics));
            let light = judge::field_of(&verification.judgement.caustic);
            views.insert(0, pair("As designed, in perfect light", &wanted, &light, exposure, note));
        }
        views
    }

    fn highlights(&self) -> Vec<Highlight> {
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let mut highlights = Vec::new();
        if let Some(seen) = self.verification.and_then(|verification| verification.seen.as_ref()) {
            highlights.push(error_highlight(seen.likeness, "RMS, relative to the mean light"));
            highlights.push(highlight(
                "Likeness",
                format!("{:.3}", seen.likeness.ssim),
                "",
                format!("SSIM: {}", seen_in_words(seen.likeness.ssim).1),
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

    fn facts(&self, shape: &FaceShape) -> Vec<Facts> {
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
            row("File", self.picture.0.clone()),
            row("SHA-256", self.picture.1.clone()),
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
            Facts { title: "Picture".into(), rows: picture },
        ];
        if let Some(verification) = self.verification {
            let pixel_mm = bench.window().width_mm / verification.judgement.caustic.nx as f64;
            facts.push(judgement_facts(&verification.judgement, pixel_mm));
        }
        facts.push(Facts { title: "Solver".into(), rows: solver });
        facts
    }
}

/// The pictures that are drawn of a design with these settings, by their names behind that of the
/// first output.
pub(crate) fn pictures(settings: &Settings, verified: bool) -> Vec<&'static str> {
    if !verified {
        return vec![WEAKNESS];
    }
    let otherwise = settings.finish.is_some() || settings.has_spread();
    ALWAYS.into_iter().chain(otherwise.then_some(PERFECT)).collect()
}

/// What is drawn of every design that is judged.
const ALWAYS: [&str; 6] = ["panel", "caustic", "difference", "budget", "contours", "drawing"];
/// As designed, in perfect light, where that is not what the eye gets.
const PERFECT: &str = "perfect";
/// Of a design that is not judged.
pub(crate) const WEAKNESS: &str = "weakness";

/// Draws a design that was judged: the panel of picture, what the eye gets, and the difference; that
/// light alone; the difference; the error budget; the isocontours of the exit face; the block with its
/// dimensions; and where the eye gets something else than perfect light through the face as designed,
/// a panel of that. Every picture is given to `write` with its kind.
///
/// # Errors
/// Those of `write`.
pub(crate) fn draw<T: Send>(
    plan: &Plan,
    verification: &DesignVerification<'_>,
    drawings: &BlockDrawings,
    write: impl Fn(&'static str, &GrayImage) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let exposure = |target| Exposure::of(target, plan.transfer.into());
    let (seen, perfect) = (exposure(&plan.requirements.perceived), exposure(&plan.target));
    let judgement = &verification.judgement;
    let error = judgement.picture.as_ref().map_or(f64::NAN, |picture| picture.metrics.rel_rms);
    let in_perfect_light = [&verification.target, &judgement.caustic].map(judge::field_of);
    let ([target, caustic], note) = match &verification.seen {
        Some(Seen { likeness, what, image, target }) => {
            ([target, image].map(judge::field_of), format!("relative RMS {:.4}{what}", likeness.rel_rms))
        }
        None => (in_perfect_light.clone(), format!("relative RMS {error:.4}")),
    };
    type Draw<'a> = Box<dyn Fn() -> GrayImage + Sync + 'a>;
    let always: [Draw; ALWAYS.len()] = [
        Box::new(|| panel(&target, &caustic, seen, &note)),
        Box::new(|| irradiance_picture(&caustic, seen)),
        Box::new(|| difference_picture(&target, &caustic, seen)),
        Box::new(|| steps_sheet(&verification.steps, &verification.target, perfect)),
        Box::new(|| drawings.contours.sheet()),
        Box::new(|| drawings.drawing.sheet().raster()),
    ];
    let mut pictures: Vec<(&str, Draw)> = ALWAYS.into_iter().zip(always).collect();
    if verification.is_seen_otherwise() {
        let [target, light] = &in_perfect_light;
        let note = format!("relative RMS {error:.4}, as designed, in perfect light");
        pictures.push((PERFECT, Box::new(move || panel(target, light, perfect, &note))));
    }
    pictures.par_iter().map(|(kind, draw)| write(kind, &draw())).collect()
}

/// The solver's own view of where the light will be wrong, if it has one.
pub(crate) fn weakness(plan: &Plan, block: &DesignedBlock) -> Option<GrayImage> {
    let light = block.light.first()?;
    let exposure = Exposure::of(&plan.target, plan.transfer.into());
    let target = plan.target.resampled(light.nx(), light.ny());
    Some(difference_picture(&to_picture_order(target.cells()), &to_picture_order(light), exposure))
}

/// The steps of an error budget as a sheet of bars and small pictures.
fn steps_sheet(steps: &[BudgetStep], target: &Image, exposure: Exposure) -> GrayImage {
    let lights = steps.iter().map(|step| step.traced.as_ref().map(|traced| judge::field_of(&traced.image)));
    let rows: Vec<_> = costs(steps).into_iter().zip(lights).collect();
    budget_sheet(&judge::field_of(target), &rows, exposure)
}
