//! The page of a preview.

use super::common::{
    bench_facts, difference_view, error_highlight, face_rows, highlight, in_words, light_view, mm, model, moving_light,
    picture_rows, program, row, target_view,
};
use crate::{
    fabricate::FaceShape,
    grid::Field,
    pipeline::DesignedBlock,
    report::{
        html::{Facts, Page, render},
        isocontours::Isocontours,
        pictures::Exposure,
        sheet::panel,
    },
    study::{
        design::Plan,
        judge::{self, Examiner},
        workpiece::JudgedImage,
    },
};
use image::GrayImage;

/// A draft, and the light that it casts.
pub(crate) struct PreviewPage<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) block: &'a DesignedBlock,
    pub(crate) examiner: &'a Examiner,
    pub(crate) view: &'a JudgedImage,
    /// The command that made it.
    pub(crate) command: String,
}

impl PreviewPage<'_> {
    /// Target and light, in picture order.
    fn lights(&self) -> (Field<f64>, Field<f64>, Exposure) {
        let light = judge::field_of(&self.view.image);
        let target = self.examiner.target().map_or_else(|| light.clone(), judge::field_of);
        (target, light, Exposure::of(&self.plan.target, self.plan.transfer.into()))
    }

    /// Target, light and difference.
    pub(crate) fn panel(&self) -> GrayImage {
        let (target, light, exposure) = self.lights();
        panel(&target, &light, exposure, &format!("draft (relative RMS {:.4})", self.view.metrics.rel_rms))
    }

    /// The page to turn the block on.
    pub(crate) fn html(&self) -> String {
        let (target, light, exposure) = self.lights();
        let (plan, block) = (self.plan, self.block);
        let (solid, bench) = (&block.solid, &plan.bench);
        let (shape, contours) = (FaceShape::of(solid.surface()), Isocontours::of(solid.surface()));
        let (_, high) = block.surface.range_mm();
        let (nx, ny) = plan.nodes;
        let mut rows = vec![
            row("Relief", format!("{:.2} mm", block.surface.relief_mm())),
            row(
                "Stock",
                format!("{} mm thick, {:.2} mm at its thinnest place", mm(solid.thickness_mm()), solid.thinnest_mm()),
            ),
        ];
        rows.extend(face_rows(&shape));
        let picture = Facts { title: "Picture".into(), rows: picture_rows(plan) };
        let page = Page {
            title: plan.picture.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            about: format!(
                "A preview: a draft on {nx} × {ny} nodes, solved in a moment and not to be made. Relief and thickness are close to those of the block; its light is only roughly right, and the design itself comes nearer to the picture."
            ),
            verdict: None,
            warnings: self.warnings(),
            highlights: vec![
                error_highlight(&self.view.metrics, "RMS of this draft; a design comes nearer"),
                highlight("Stock", mm(solid.thickness_mm()), "mm", "thick".into()),
                highlight("Relief", format!("{:.2}", block.surface.relief_mm()), "mm", "lowest to highest".into()),
                highlight(
                    "Thinnest place",
                    format!("{:.2}", solid.thinnest_mm()),
                    "mm",
                    "of glass that is left".into(),
                ),
            ],
            model: model(solid, bench, &shape, &contours),
            target: Some(target_view(&target, exposure)),
            caustic: light_view("Light of the draft", &light, exposure, format!("{}.", in_words(&self.view.metrics))),
            moving: moving_light(solid, &plan.scene, &plan.settings, exposure),
            difference: Some(difference_view(&target, &light, exposure)),
            maker: vec![
                Facts { title: "Draft".into(), rows },
                bench_facts(bench, plan.light_in_words(solid.entry_z_mm()), high),
            ],
            others: Vec::new(),
            budget: Vec::new(),
            summary: None,
            drawing: None,
            facts: vec![picture],
            files: Vec::new(),
            command: self.command.clone(),
            program: program(),
        };
        render(&page)
    }

    /// What a draft warns of.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.block.summary.warnings.iter().map(|warning| format!("in this draft, {warning}")).collect()
    }
}
