//! The report of a block that was found in a file: as it is, or after it was worked on in
//! simulation.

use super::common::{
    bench_facts, costs, difference_view, error_highlight, face_rows, highlight, in_words, judgement_facts,
    judgement_warnings, light_view, mm, pair, program, row, step_views, target_view, traffic_light,
};
use crate::{
    bench::Bench,
    fabricate::FaceShape,
    failure::Failure,
    grid::{Extent, Field},
    record::SideFile,
    report::{
        budget::{Cost, CostErrors},
        html::{Facts, FileRecord, Highlight, Model, MovingLight, Page, TrafficLight, View, render},
        isocontours::Isocontours,
        pictures::Exposure,
    },
    spec::Feed,
    study::{
        bench::{drawn_bench, light_in_words},
        budget::BudgetStep,
        face::surface_of,
        judge::{self, Examiner, Judgement, Subject},
        mill::{MillStep, MillStudy},
        stand::Stand,
        verdict::Verdict,
        workpiece::Workpiece,
    },
    surface::HeightField,
};
use glam::DVec2;
use glasswarp_verify::{
    Scene,
    metrics::{self, Likeness, Metrics},
};

/// What is said of a block from a file.
pub(crate) struct FoundPage<'a> {
    /// The name of the block.
    title: String,
    /// Its file.
    file: FileRecord,
    /// The command that wrote the report.
    command: String,
    side: Option<&'a SideFile>,
    scene: Scene,
    surface: HeightField,
    /// The entry face, from the mean plane of the exit face, mm.
    entry_z_mm: f64,
    about: String,
    verdict: Option<TrafficLight>,
    warnings: Vec<String>,
    exposure: Exposure,
    /// The picture as light, if there is one, and how well it is drawn.
    wanted: Option<(Field<f64>, Metrics)>,
    light: Field<f64>,
    caustic: View,
    others: Vec<(View, View)>,
    budget: Vec<Cost>,
    /// What was done, and what is to be known of it.
    maker: Vec<Facts>,
    facts: Vec<Facts>,
}

/// A block's file, as a report names it.
pub(crate) struct ReportedFile<'a> {
    /// As messages call it.
    pub(crate) name: &'a str,
    /// Without its extension.
    pub(crate) title: String,
    pub(crate) record: FileRecord,
    /// The command that writes the report.
    pub(crate) command: String,
}

/// The light of a block that was found, judged.
pub(crate) struct FoundLight<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) judgement: &'a Judgement,
    pub(crate) steps: &'a [BudgetStep],
    pub(crate) exposure: Exposure,
}

impl<'a> FoundPage<'a> {
    /// The report of a block as it was found.
    pub(crate) fn of_judgement(
        file: ReportedFile<'_>,
        side: Option<&'a SideFile>,
        subject: &Subject,
        examiner: &Examiner,
        FoundLight { scene, judgement, steps, exposure }: FoundLight<'a>,
        mut warnings: Vec<String>,
    ) -> Result<Self, Failure> {
        let Some(found) = subject.block() else {
            return Err(Failure::Usage(format!("{} is no block, and a report is about blocks", file.name)));
        };
        warnings.extend(judgement_warnings(judgement, side.map_or(0.0, |side| side.bench.skirt_share())));
        let light = judge::field_of(&judgement.caustic);
        let target = examiner.target().map(judge::field_of);
        let verdict = judgement.picture.as_ref();
        let note = verdict.map(|verdict| format!("{}.", in_words(&verdict.metrics))).unwrap_or_default();
        Ok(Self {
            about: format!("A block of glass as it was found in {}, and the light that comes through it.", file.name),
            title: file.title,
            file: file.record,
            command: file.command,
            side,
            scene: scene.clone(),
            surface: surface_of(found)?,
            entry_z_mm: found.entry_z_mm(),
            verdict: verdict.map(|picture| {
                let mut verdict = Verdict::default();
                verdict.say_picture(Likeness::from(&picture.metrics), ", as designed, in perfect light");
                traffic_light(&verdict, str::to_owned)
            }),
            warnings,
            exposure,
            others: target.as_ref().map(|target| step_views(steps, target, exposure)).unwrap_or_default(),
            wanted: target.zip(verdict.map(|verdict| verdict.metrics)),
            caustic: light_view("Simulated light", &light, exposure, format!("Traced through the file. {note}")),
            light,
            budget: costs(steps),
            maker: Vec::new(),
            facts: vec![judgement_facts(judgement, scene.window.size_mm.x / judgement.caustic.nx as f64)],
        })
    }

    /// The report of a block that was worked on in simulation, its light after every step. `feed`
    /// is that of the cutter.
    pub(crate) fn of_milling(
        file: ReportedFile<'_>,
        piece: &'a Workpiece,
        (study, verdict, in_flags): (&MillStudy, &Verdict, fn(&str) -> String),
        feed: Feed,
        exposure: Exposure,
    ) -> Result<Self, Failure> {
        let (last, before) = (study.last(), &study.steps[..study.steps.len() - 1]);
        let light = judge::field_of(&last.view.image);
        let target = piece.examiner.target().map_or_else(|| light.clone(), judge::field_of);
        let note = |step: &MillStep| format!("{}.", in_words(&step.view.metrics));
        let others = before
            .iter()
            .map(|step| pair(&step.name, &target, &judge::field_of(&step.view.image), exposure, note(step)))
            .collect();
        let costs = study.steps.iter().map(|step| {
            let moved = metrics::rel_rms(&step.view.image, &study.steps[0].view.image).map_err(Failure::refused)?;
            let Likeness { rel_rms, ssim } = (&step.view.metrics).into();
            Ok(Cost { name: step.name.clone(), errors: Some(CostErrors { rel_rms, ssim, moved }) })
        });
        let (pass, cost) = (&study.pass, &study.cost);
        let way = format!("{:.1} m, {:.0} min at {feed}", 1e-3 * cost.length_mm, cost.minutes(feed.mm_per_minute));
        let mut rows = vec![
            row("Cutter", pass.cutter.in_words()),
            row("Rows", format!("{} along {}, {} mm apart", cost.rows, pass.direction, mm(pass.step_over_mm))),
            row("Way", way),
        ];
        if let Some((scallop, _)) = &study.scallop {
            rows.push(row("Scallops", format!("{:.3} µm high, slope {:.5}", 1e3 * scallop.height_mm, scallop.slope)));
        }
        Ok(Self {
            about: format!(
                "{}, worked on in simulation: {}. The face is shown as designed, the light as it is after the work.",
                file.name, last.name
            ),
            title: file.title,
            file: file.record,
            command: file.command,
            side: Some(&piece.side),
            scene: piece.scene(),
            surface: piece.surface.clone(),
            entry_z_mm: piece.block.entry_z_mm(),
            verdict: Some(traffic_light(verdict, in_flags)),
            warnings: Vec::new(),
            exposure,
            caustic: light_view("Light after the work", &light, exposure, note(last)),
            others,
            budget: costs.collect::<Result<_, Failure>>()?,
            maker: vec![Facts { title: "Work".into(), rows }],
            facts: Vec::new(),
            wanted: Some((target, last.view.metrics)),
            light,
        })
    }

    /// The report, a page of HTML.
    ///
    /// # Errors
    /// A bench that cannot be.
    pub(crate) fn html(self) -> Result<String, Failure> {
        let face = self.surface.extent();
        let drawing = self.side.map_or(face, |side| Extent::new(side.bench.width_mm, side.bench.height_mm));
        let bench = drawn_bench(&self.scene, drawing, self.entry_z_mm)?;
        let light = light_in_words(&self.scene, self.entry_z_mm);
        let (shape, contours) = (FaceShape::of(&self.surface), Isocontours::of(&self.surface));
        let (extent, (low, high)) = (self.surface.extent(), self.surface.heights_mm().min_max());
        let half = 0.5 * extent.as_vec();
        let mut rows = vec![
            row(
                "Exit face",
                format!("{} × {} mm, relief {:.3} mm", mm(extent.width_mm), mm(extent.height_mm), high - low),
            ),
            row(
                "Thickness",
                format!("{} mm, {:.3} mm at the thinnest place", mm(high - self.entry_z_mm), low - self.entry_z_mm),
            ),
        ];
        rows.extend(face_rows(&shape));
        if let Some(work) = self.side.and_then(|side| side.work.as_ref()) {
            rows.push(row("Done so far", work.done.clone()));
        }
        let mut facts = vec![Facts { title: "Block".into(), rows }];
        let highlights = self.highlights(&bench);
        facts.extend(self.facts);
        let wanted = self.wanted.as_ref().map(|(wanted, _)| wanted);
        let page = Page {
            title: self.title,
            about: self.about,
            verdict: self.verdict,
            warnings: self.warnings,
            highlights,
            model: Model {
                surface: &self.surface,
                entry_z_mm: self.entry_z_mm,
                // What stands around the face of a found block is not looked for.
                outline: vec![-half, DVec2::new(half.x, -half.y), half, DVec2::new(-half.x, half.y)],
                rim_z_mm: None,
                bench: &bench,
                slope: shape.slope(),
                hollow_per_mm: shape.hollow_per_mm(),
                contours: &contours,
            },
            target: wanted.map(|wanted| target_view(wanted, self.exposure)),
            caustic: self.caustic,
            moving: MovingLight::of(
                Stand::of(
                    &self.surface,
                    (self.entry_z_mm, high),
                    drawing.as_vec(),
                    &self.scene,
                    self.side.map(|side| &side.design),
                ),
                self.exposure,
            ),
            difference: wanted.map(|wanted| difference_view(wanted, &self.light, self.exposure)),
            maker: self.maker.into_iter().chain([bench_facts(&bench, light, high)]).collect(),
            others: self.others,
            budget: self.budget,
            summary: None,
            drawing: None,
            facts,
            files: vec![self.file],
            command: self.command,
            program: program(),
        };
        Ok(render(&page))
    }

    fn highlights(&self, bench: &Bench) -> Vec<Highlight> {
        let (low, high) = self.surface.heights_mm().min_max();
        let mut highlights: Vec<Highlight> = Vec::new();
        if let Some((_, metrics)) = &self.wanted {
            highlights.push(error_highlight(metrics, "RMS, relative to the mean light"));
            let note = "SSIM; 1 is the picture itself".into();
            highlights.push(highlight("Likeness", format!("{:.4}", metrics.ssim), "", note));
        }
        highlights.extend([
            highlight("Thickness", mm(high - self.entry_z_mm), "mm", "at the highest place".into()),
            highlight("Relief", format!("{:.2}", high - low), "mm", "lowest to highest".into()),
            highlight("Thinnest place", format!("{:.2}", low - self.entry_z_mm), "mm", "of glass that is left".into()),
            highlight("Receiver", mm(bench.distance_mm()), "mm", "from the mean plane of the face".into()),
        ]);
        highlights
    }
}
