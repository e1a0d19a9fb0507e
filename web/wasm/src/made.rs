//! What a block looks like on its bench: the figures and pictures that a page shows.

use crate::{files::sha256, reply::Reply, settings, shop::plain_words};
use glasswarp::{
    fabricate::FaceShape,
    failure::Failure,
    glam::DVec2,
    pipeline::DesignedBlock,
    record::document,
    report::{BlockDrawings, DesignPage, Exposure, FileRecord},
    spec::{Host, Settings},
    study::{
        bench::{bench_document, receiver_in_words},
        budget::double_precision,
        design::Plan,
        judge::{self, Examiner, Subject, flux_document},
        order::StockOrder,
        stand::Stand,
        verdict::seen_in_words,
        verification::DesignVerification,
    },
    surface::SurfaceSpline,
};
use glasswarp_verify::{Geometry, Surface};
use js_sys::{Float32Array, Float64Array};
use serde::Serialize;
use std::time::Duration;

/// A block that was designed, and what is known of it.
pub(crate) struct Made {
    pub(crate) plan: Plan,
    pub(crate) block: DesignedBlock,
    pub(crate) subject: Subject,
    pub(crate) examiner: Examiner,
    /// What the solver took.
    pub(crate) solved: Duration,
}

/// What a page shows of a block.
#[derive(Serialize)]
pub(crate) struct Facts {
    picture: Option<String>,
    warnings: Vec<String>,
    block: document::Block,
    bench: document::Bench,
    receiver: String,
    light: document::Light,
    rel_rms: Option<f64>,
    ssim: Option<f64>,
    seen: &'static str,
    /// Radius of the sharpest hollow; none where the face bulges everywhere.
    least_radius_mm: Option<f64>,
    steepest_degrees: f64,
    order: String,
    pixels: [usize; 2],
    solver_notes: Vec<String>,
    iterations: usize,
    levels_at_limit: usize,
    settings: Settings,
    command: String,
    design_toml: String,
    /// Irradiance that becomes white in the pictures.
    white: f64,
    stand: Stand,
}

impl Made {
    /// Takes a block, to be looked at with so many pixels across at most.
    pub(crate) fn of(plan: Plan, (block, solved): (DesignedBlock, Duration), pixels: usize) -> Result<Self, Failure> {
        let subject = double_precision(&block)?;
        let target = judge::image_of(plan.target.cells());
        let examiner = Examiner::new(plan.scene.clone(), Some(&target), pixels);
        Ok(Self { plan, block, subject, examiner, solved })
    }

    /// Figures and pictures.
    pub(crate) fn facts(&self, reply: &mut Reply, mesh: usize) -> Result<Facts, Failure> {
        let Self { plan, block, subject, examiner, .. } = self;
        let solid = &block.solid;
        let seen = examiner.trace(subject, Surface::Spline, Geometry::Displaced)?;
        let likeness = examiner.likeness(&seen.image)?;
        let target = examiner.target().unwrap_or(&seen.image);
        reply.compared(&seen.image, target, self.exposure());
        let spline = SurfaceSpline::through(solid.surface());
        let shape = FaceShape::of_spline(solid.surface(), &spline);
        reply.array("mesh", mesh_of(&spline, mesh));
        let settings = Settings { picture: Some(plan.picture.clone()), ..plan.settings.clone() };
        Ok(Facts {
            picture: plan.understood.line(),
            warnings: block.summary.warnings.clone(),
            block: plan.document(block),
            bench: bench_document(&plan.scene, solid.entry_z_mm()),
            receiver: receiver_in_words(&plan.bench, block.surface.range_mm().1),
            light: flux_document(&seen.flux),
            rel_rms: likeness.and_then(|likeness| document::finite(likeness.rel_rms)),
            ssim: likeness.and_then(|likeness| document::finite(likeness.ssim)),
            seen: seen_in_words(likeness.map_or(f64::NAN, |likeness| likeness.ssim)).1,
            least_radius_mm: document::finite(shape.sharpest().radius_mm),
            steepest_degrees: shape.steepest().1.atan().to_degrees(),
            order: StockOrder::of_design(solid, &plan.settings).in_words(),
            pixels: [seen.image.nx, seen.image.ny],
            solver_notes: block.summary.notes.clone(),
            iterations: block.summary.iterations(),
            levels_at_limit: block.summary.levels_at_limit(),
            command: settings::command(&plan.settings, &plan.picture),
            design_toml: settings::to_toml(&settings)?,
            white: self.exposure().white,
            stand: Stand::of_design(solid, &plan.scene, &plan.settings),
            settings,
        })
    }

    /// That of the target.
    pub(crate) fn exposure(&self) -> Exposure {
        Exposure::of(&self.plan.target, self.plan.transfer.into())
    }

    /// The report, with what the verifier says, if it was asked. The picture is hashed as `host` has
    /// it.
    ///
    /// # Errors
    /// A picture that is gone.
    pub(crate) fn report(
        &self,
        verification: Option<&DesignVerification<'_>>,
        (title, files): (String, Vec<FileRecord>),
        host: &dyn Host,
    ) -> Result<String, Failure> {
        let Self { plan, block, .. } = self;
        let verdict = match verification {
            Some(verification) => verification.verdict(plan, block),
            None => plan.unverified(),
        };
        let page = DesignPage {
            plan,
            title,
            picture: (plan.picture.to_string_lossy().into_owned(), sha256(&host.bytes(&plan.picture)?)),
            files,
            command: settings::command(&plan.settings, &plan.picture),
            block,
            drawings: &BlockDrawings::of(block, plan),
            verification,
            verdict: &verdict,
            in_flags: plain_words,
            notes: &[],
            solved: self.solved,
        };
        Ok(page.html())
    }

    /// Heights of the exit face, mm, rows along +y.
    pub(crate) fn heights(&self) -> Float64Array {
        Float64Array::from(self.block.solid.surface().heights_mm().as_slice())
    }
}

/// The face for the light that moves: x, y, height and slopes along both at `across` x `across`
/// places, rows along +y.
fn mesh_of(spline: &SurfaceSpline, across: usize) -> Float32Array {
    let extent = spline.extent();
    let mut values = Vec::with_capacity(5 * across * across);
    for j in 0..across {
        for i in 0..across {
            let at: DVec2 = extent.node(i, j, across, across);
            let face = spline.sample(at);
            values.extend([at.x, at.y, face.height_mm, face.slope.x, face.slope.y].map(|value| value as f32));
        }
    }
    Float32Array::from(values.as_slice())
}
