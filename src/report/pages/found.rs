//! The report of a block that was found in a file: as it is, or after it was worked on in simulation.

use super::common::{
    bench_facts, difference_view, error_highlight, face_rows, highlight, mm, program, row, target_view,
};
use crate::{
    bench::Bench,
    fabricate::FaceShape,
    failure::Failure,
    grid::{Extent, Field},
    record::SideFile,
    report::{
        html::{Cost, Facts, FileRecord, Highlight, Model, Page, View, write_html},
        isocontours::Isocontours,
        pictures::Exposure,
    },
    study::bench::{drawn_bench, light_in_words},
    surface::HeightField,
};
use glam::DVec2;
use glasswarp_verify::{Scene, metrics::Metrics};
use std::path::Path;

/// What is said of a block from a file.
pub(crate) struct FoundPage<'a> {
    /// The name of the block.
    pub(crate) title: String,
    /// Its file.
    pub(crate) file: FileRecord,
    /// The command that wrote the report.
    pub(crate) command: String,
    pub(crate) side: Option<&'a SideFile>,
    pub(crate) scene: &'a Scene,
    pub(crate) surface: &'a HeightField,
    /// The entry face, from the mean plane of the exit face, mm.
    pub(crate) entry_z_mm: f64,
    pub(crate) about: String,
    pub(crate) warnings: Vec<String>,
    pub(crate) exposure: Exposure,
    /// The picture as light, if there is one, and how well it is drawn.
    pub(crate) wanted: Option<(Field<f64>, Metrics)>,
    pub(crate) light: Field<f64>,
    pub(crate) caustic: View,
    pub(crate) others: Vec<(View, View)>,
    pub(crate) budget: Vec<Cost>,
    pub(crate) facts: Vec<Facts>,
}

impl FoundPage<'_> {
    /// Writes the report.
    pub(crate) fn write(self, path: &Path) -> Result<(), Failure> {
        let face = self.surface.extent();
        let drawing = self.side.map_or(face, |side| Extent::new(side.bench.width_mm, side.bench.height_mm));
        let bench = drawn_bench(self.scene, drawing, self.entry_z_mm)?;
        let light = light_in_words(self.scene, self.entry_z_mm);
        let (shape, contours) = (FaceShape::of(self.surface), Isocontours::of(self.surface));
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
        let mut facts = vec![Facts { title: "Block".into(), rows }, bench_facts(&bench, light, high)];
        let highlights = self.highlights(&bench);
        facts.extend(self.facts);
        let wanted = self.wanted.as_ref().map(|(wanted, _)| wanted);
        let page = Page {
            title: self.title,
            about: self.about,
            warnings: self.warnings,
            highlights,
            model: Model {
                surface: self.surface,
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
            difference: wanted.map(|wanted| difference_view(wanted, &self.light, self.exposure)),
            others: self.others,
            budget: self.budget,
            summary: None,
            drawing: None,
            facts,
            files: vec![self.file],
            command: self.command,
            program: program(),
        };
        write_html(path, &page).map_err(Failure::writing)
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
