//! What the verifier says of the files of a design.

use super::{
    bench::scene_of,
    budget::{self, BudgetStep, Judged},
    changed::changed_bench,
    design::Plan,
    finish::Finished,
    imperfect::{ImperfectView, blurred, spread_in_words},
    judge::{self, Examiner, Judgement, Subject},
    requirements::psf_of,
    target_light::TargetLight,
    verdict::Verdict,
};
use crate::{
    failure::Failure,
    pipeline::DesignedBlock,
    record::BenchRecord,
    spec::{Host, Settings},
};
use glasswarp_verify::{
    Geometry, Image, Mesh, Optics, PhotonPlan, Scene, Surface,
    metrics::{self, Likeness},
    reference::resampled,
};

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
    /// What the eye gets: of the face after its finish, in the light that there is.
    pub seen: Option<Seen>,
    /// What small faults of the bench make of the relative RMS error.
    pub faults: Vec<Fault>,
}

/// What the eye gets of a picture.
pub struct Seen {
    /// How alike it is to the picture.
    pub likeness: Likeness,
    /// Of which face, in which light: words that go on a sentence; none as designed, in perfect light.
    pub what: String,
    /// Irradiance on the receiver.
    pub image: Image,
    /// The picture at its pixels.
    pub target: Image,
}

/// A small fault of the bench, and what it does.
pub struct Fault {
    /// What is off, and by how much.
    pub name: &'static str,
    /// Relative RMS error then.
    pub rel_rms: f64,
}

/// The index of a batch is known to about this, where nobody has measured it.
const INDEX_OFF: f64 = 0.01;
/// A receiver stands to about this part of its distance.
const DISTANCE_OFF: f64 = 0.02;
/// Pixels across at which faults are looked at, at most.
const FAULT_PIXELS: usize = 256;

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
        let scene = scene_of(bench, settings, &plan.before, host)?;
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
        let seen = seen(plan, target, &judgement, finished.as_ref(), imperfect.as_ref(), host)?;
        let faults = faults(plan, &judged.subject, &scene, target, host)?;
        let target = examiner.target().unwrap_or(&judgement.caustic).clone();
        Ok(Some(Self { judged, examiner, judgement, steps, target, finished, imperfect, seen, faults }))
    }

    /// Whether the eye gets something else than perfect light through the face as designed.
    pub fn is_seen_otherwise(&self) -> bool {
        self.finished.is_some() || self.imperfect.is_some()
    }

    /// Whether the block will work, as far as a design is asked.
    pub fn verdict(&self, plan: &Plan, block: &DesignedBlock) -> Verdict {
        let mut verdict = Verdict::default();
        if let Some(Seen { likeness, what, .. }) = &self.seen {
            verdict.say_picture(*likeness, what);
        }
        if let Some(picture) = &self.judgement.picture {
            verdict.say_contrast(picture.metrics.target_contrast, plan.settings.offset.unwrap_or_default());
        }
        verdict.say_judgement(&self.judgement, block.skirt_share());
        plan.say_open(&mut verdict);
        verdict
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

/// What the eye gets.
fn seen(
    plan: &Plan,
    target: &TargetLight,
    judgement: &Judgement,
    finished: Option<&Finished>,
    imperfect: Option<&ImperfectView>,
    host: &dyn Host,
) -> Result<Option<Seen>, Failure> {
    let finish = finished.map(|finished| format!(", after the finish ({})", finished.plan.in_words()));
    let light = imperfect.map(|_| format!(", in the light that there is ({})", spread_in_words(&plan.settings)));
    let what = [finish, light].into_iter().flatten().collect();
    let resampled = |image: &Image| resampled(&target.picture, image.nx, image.ny);
    let (image, target, likeness) = match (finished, imperfect) {
        // Photons saw the face before its finish.
        (Some(finished), Some(_)) => {
            let image = &finished.view.image;
            let psf = psf_of(&plan.settings, &plan.bench, (image.nx, image.ny), host)?;
            let image = psf.as_ref().map_or_else(|| image.clone(), |psf| blurred(image, psf));
            let target = resampled(&image);
            let likeness = metrics::likeness(&image, &target).map_err(Failure::refused)?;
            (image, target, likeness)
        }
        (None, Some(imperfect)) => (imperfect.smooth.clone(), imperfect.target.clone(), imperfect.likeness()),
        (Some(Finished { view, .. }), None) => {
            (view.image.clone(), resampled(&view.image), Likeness::from(&view.metrics))
        }
        (None, None) => {
            let Some(picture) = &judgement.picture else { return Ok(None) };
            let image = judgement.caustic.clone();
            let target = resampled(&image);
            (image, target, Likeness::from(&picture.metrics))
        }
    };
    Ok(Some(Seen { likeness, what, image, target }))
}

/// What an index and a distance that are a little off do to the picture, in the light that there is.
fn faults(
    plan: &Plan,
    subject: &Subject,
    scene: &Scene,
    target: &TargetLight,
    host: &dyn Host,
) -> Result<Vec<Fault>, Failure> {
    let Some(block) = subject.block() else { return Ok(Vec::new()) };
    let examiner = Examiner::new(scene.clone(), Some(&target.picture), FAULT_PIXELS);
    let psf = psf_of(&plan.settings, &plan.bench, examiner.pixels(), host)?;
    let error = |ior: Option<f64>, distance_mm: Option<f64>| -> Result<f64, Failure> {
        let changed = changed_bench(scene.clone(), Some(block), ior, distance_mm)?;
        let image = examiner.on(changed).trace(subject, Surface::Spline, Geometry::Displaced)?.image;
        let image = psf.as_ref().map_or_else(|| image.clone(), |psf| blurred(&image, psf));
        Ok(examiner.likeness(&image)?.map_or(f64::NAN, |likeness| likeness.rel_rms))
    };
    let mut faults = Vec::new();
    if let Optics::Refracts { ior } = scene.optics {
        faults.push(Fault { name: "an index 0.01 higher", rel_rms: error(Some(ior + INDEX_OFF), None)? });
    }
    let further_mm = (1.0 + DISTANCE_OFF) * scene.distance_mm;
    faults.push(Fault { name: "a receiver 2 % further away", rel_rms: error(None, Some(further_mm))? });
    Ok(faults)
}
