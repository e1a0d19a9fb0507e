//! The report of a design.

use super::common::{
    bench_facts, costs, difference_view, error_highlight, face_rows, highlight, in_words, judgement_facts,
    judgement_warnings, light_view, material, mm, model, moving_light, pair, picture_rows, program, row, step_views,
    stock_facts, target_view, traffic_light,
};
use crate::{
    fabricate::FaceShape,
    grid::Field,
    irradiance::to_picture_order,
    pipeline::DesignedBlock,
    report::{
        drawing::Drawing,
        html::{Facts, FileRecord, Highlight, Page, View, render},
        isocontours::Isocontours,
        pictures::Exposure,
    },
    spec::name_of,
    study::{
        design::Plan,
        judge,
        order::StockOrder,
        verdict::{Verdict, seen_in_words},
        verification::DesignVerification,
    },
    surface::SurfaceSpline,
};
use std::time::Duration;

const WHAT_THE_EYE_GETS: &str = "What the eye gets";

/// What is drawn of a block alone: nothing of it waits for a file.
pub struct BlockDrawings {
    /// What the face asks of a cutter.
    pub shape: FaceShape,
    /// With dimensions.
    pub drawing: Drawing,
    /// What to order.
    pub order: StockOrder,
    /// Lines of equal height.
    pub contours: Isocontours,
}

impl BlockDrawings {
    /// Those of a block.
    pub fn of(block: &DesignedBlock, plan: &Plan) -> Self {
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
pub struct DesignPage<'a> {
    /// What was asked for.
    pub plan: &'a Plan,
    /// The name of the block.
    pub title: String,
    /// The name and hash of the picture.
    pub picture: (String, String),
    /// The files.
    pub files: Vec<FileRecord>,
    /// The command that made it.
    pub command: String,
    /// The block.
    pub block: &'a DesignedBlock,
    /// What is drawn of it.
    pub drawings: &'a BlockDrawings,
    /// What the verifier says, unless it was not asked.
    pub verification: Option<&'a DesignVerification<'a>>,
    /// Whether it will work.
    pub verdict: &'a Verdict,
    /// Settings in messages as a person writes them.
    pub in_flags: fn(&str) -> String,
    /// What there is to say of the files.
    pub notes: &'a [String],
    /// What the solver took.
    pub solved: Duration,
}

impl DesignPage<'_> {
    /// The report, a page of HTML.
    pub fn html(&self) -> String {
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
        render(&page)
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
