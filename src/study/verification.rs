//! What the verifier says of the files of a design.

use super::{
    bench::scene_of,
    budget::{self, BudgetStep, Judged},
    design::Plan,
    finish::Finished,
    imperfect::ImperfectView,
    judge::{self, Examiner, Judgement},
    target_light::TargetLight,
};
use crate::{
    failure::Failure,
    pipeline::DesignedBlock,
    record::BenchRecord,
    spec::{Host, Settings},
};
use glasswarp_verify::{Image, Mesh, PhotonPlan};

/// Photons that confirm the beams of a design, one per pixel within these limits: enough to find a
/// fault, few enough not to be waited for.
const PHOTONS: [u64; 2] = [1 << 16, 1 << 18];
/// Photons in spread light, of which beams know nothing.
const SPREAD_PHOTONS: u64 = 8_000_000;
/// Pixels across at which a design is judged, at most.
const PIXELS: usize = 1024;

/// What the verifier says of the files of a design.
pub struct DesignVerification<'a> {
    judged: Judged<'a>,
    examiner: Examiner,
    /// The light of the file.
    pub judgement: Judgement,
    /// The error budget.
    pub steps: Vec<BudgetStep>,
    /// What it is judged by.
    pub target: Image,
    /// The light after the finish that it was designed for.
    pub finished: Option<Finished>,
    /// The light that there is, if it is not perfect.
    pub imperfect: Option<ImperfectView>,
}

impl<'a> DesignVerification<'a> {
    /// Judges a file of a design as soon as it is read back, and looks for the step that costs
    /// most. `bench` and `settings` are those of its side file, which is what a stranger will have;
    /// `mesh` waits for the file, and gives none if it could not be read.
    ///
    /// # Errors
    /// A file that holds no closed solid, files that cannot be read.
    pub fn of(
        plan: &Plan,
        target: &TargetLight,
        block: &DesignedBlock,
        (name, bench, settings): (&'a str, &BenchRecord, &Settings),
        mesh: impl FnOnce() -> Option<Mesh>,
        host: &dyn Host,
    ) -> Result<Option<Self>, Failure> {
        let scene = scene_of(bench, settings, host)?;
        let examiner = Examiner::new(scene.clone(), Some(target.in_perfect_light()), PIXELS);
        // What the solver saw after a finish is not the light of the face as it is.
        let own = block.light.first().filter(|_| plan.settings.finish.is_none());
        let own = budget::own_light(block, &plan.bench, own, &examiner);
        let Some(mesh) = mesh() else { return Ok(None) };
        let judged = Judged::of(mesh, name)?;
        let ((nx, ny), [least, most]) = (examiner.pixels(), PHOTONS);
        let photons = PhotonPlan::new(((nx * ny) as u64).clamp(least, most), 1);
        let (judgement, views) = rayon::join(
            || judge::judge(&judged.subject, &examiner, &photons),
            || budget::views(&judged.subject, &examiner),
        );
        let (judgement, views) = (judgement?, views?);
        let steps = budget::of_design(block, own, (&judged, views), &examiner, &judgement)?;
        let finish = plan.settings.finish;
        let finished = finish.map(|finish| Finished::of(finish, &judged.subject, &examiner)).transpose()?;
        let spread_photons = PhotonPlan::new(SPREAD_PHOTONS, 1);
        let imperfect = ImperfectView::of(&judged.subject, &scene, target, &plan.settings, &spread_photons, host)?;
        let target = examiner.target().unwrap_or(&judgement.caustic).clone();
        Ok(Some(Self { judged, examiner, judgement, steps, target, finished, imperfect }))
    }

    /// Adds what another file does to the light.
    ///
    /// # Errors
    /// A file that holds no closed solid.
    pub fn add(&mut self, name: &str, mesh: Mesh) -> Result<(), Failure> {
        let steps = budget::of_other(&self.judged, (name, mesh), &self.examiner, &self.judgement)?;
        self.steps.extend(steps);
        Ok(())
    }
}
