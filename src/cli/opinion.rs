//! What the verifier says of the files of a design, and the pictures of it.

use super::{
    bench::scene_of,
    budget::{self, Judged, Step},
    error::Failure,
    files::First,
    finish::Finished,
    imperfect::Seen,
    judge::{self, Examiner, Judgement},
    page::Portrait,
    plan::Plan,
    reference::Wanted,
    settings::Settings,
    side_file::SideFile,
};
use glasswarp::{
    irradiance::to_picture_order,
    pipeline::DesignedBlock,
    report::{self, Exposure},
};
use glasswarp_verify::{Image, Mesh, PhotonPlan};
use image::GrayImage;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Photons that confirm the beams of a design, one per pixel within these limits: enough to find a fault, few enough not to be waited
/// for.
const PHOTONS: [u64; 2] = [1 << 16, 1 << 18];
/// Photons in spread light, of which beams know nothing.
const SPREAD_PHOTONS: u64 = 8_000_000;
/// Pixels across at which a design is judged, at most.
const PIXELS: usize = 1024;

/// The pictures that are drawn of a design with these settings, by their names behind that of the first output.
pub(crate) fn pictures(settings: &Settings, verified: bool) -> Vec<&'static str> {
    if !verified {
        return vec![WEAKNESS];
    }
    let finished = settings.finish.map(|_| FINISHED);
    let spread = settings.source_size.is_some() || settings.roughness.is_some() || settings.psf.is_some();
    ALWAYS.into_iter().chain(finished).chain(spread.then_some(SEEN)).collect()
}

/// Where a picture of a design lies.
pub(crate) fn picture_of(output: &Path, kind: &str) -> PathBuf {
    output.with_extension(format!("{kind}.png"))
}

/// What is drawn of every design that is judged.
const ALWAYS: [&str; 6] = ["panel", "caustic", "difference", "budget", "contours", "drawing"];
/// After a finish, and in light that is not perfect.
const FINISHED: &str = "finished";
const SEEN: &str = "seen";
/// Of a design that is not judged.
const WEAKNESS: &str = "weakness";

/// What the verifier says of the files of a design.
pub(crate) struct Opinion<'a> {
    judged: Judged<'a>,
    side: SideFile,
    examiner: Examiner,
    pub(crate) judgement: Judgement,
    pub(crate) steps: Vec<Step>,
    pub(crate) wanted: Image,
    /// The light after the finish that it was designed for.
    pub(crate) finished: Option<Finished>,
    /// The light that there is, if it is not perfect.
    pub(crate) seen: Option<Seen>,
}

impl<'a> Opinion<'a> {
    /// Judges the first file as soon as it is read back, and looks for the step that costs most. `None` if it could not be read.
    pub(crate) fn of(
        plan: &Plan,
        intended: &Wanted,
        block: &DesignedBlock,
        first: First<'a>,
    ) -> Result<Option<Self>, Failure> {
        // The bench as the side file gives it, which is what a stranger will have.
        let scene = scene_of(&first.side.bench, &first.side.design)?;
        let examiner = Examiner::new(scene.clone(), Some(intended.in_perfect_light()), PIXELS);
        // What the solver saw after a finish is not the light of the face as it is.
        let own = block.light.first().filter(|_| plan.settings.finish.is_none());
        let own = budget::own_light(block, &plan.bench, own, &examiner);
        let Some(mesh) = first.mesh() else { return Ok(None) };
        let judged = Judged::of(mesh.moved(first.side.origin_of(first.path)), first.path)?;
        let ((nx, ny), [least, most]) = (examiner.pixels(), PHOTONS);
        let photons = PhotonPlan::new(((nx * ny) as u64).clamp(least, most), 1);
        let (judgement, views) = rayon::join(
            || judge::judge(&judged.subject, &examiner, &photons),
            || budget::views(&judged.subject, &examiner),
        );
        let (judgement, views) = (judgement?, views?);
        let steps = budget::of_design(block, own, (&judged, views), &examiner, &judgement)?;
        let wanted = examiner.wanted().unwrap_or(&judgement.caustic).clone();
        let finish = plan.settings.finish;
        let finished = finish.map(|finish| Finished::of(finish, &judged.subject, &examiner)).transpose()?;
        let plan_of_photons = PhotonPlan::new(SPREAD_PHOTONS, 1);
        let seen = Seen::of(&judged.subject, &scene, intended, &plan.settings, &plan_of_photons)?;
        Ok(Some(Self { judged, side: first.side, examiner, judgement, steps, wanted, finished, seen }))
    }

    /// Adds what the other files do to the light.
    pub(crate) fn add(&mut self, others: Vec<(PathBuf, Mesh)>) -> Result<(), Failure> {
        for (path, mesh) in others {
            let other = (path.as_path(), mesh.moved(self.side.origin_of(&path)));
            let step = budget::of_other(&self.judged, other, &self.examiner, &self.judgement)?;
            self.steps.extend(step);
        }
        Ok(())
    }

    /// Draws what was judged, beside the first output: the light alone, the panel of target, light and difference, the error
    /// budget, the isocontours of the exit face, and the block with its dimensions.
    pub(crate) fn draw(&self, plan: &Plan, output: &Path, portrait: &Portrait) -> Result<Vec<PathBuf>, Failure> {
        let exposure = Exposure::of(&plan.target, plan.transfer.into());
        let [target, caustic] = [&self.wanted, &self.judgement.caustic].map(judge::field_of);
        let error = self.judgement.verdict.as_ref().map_or(f64::NAN, |verdict| verdict.metrics.rel_rms);
        let note = format!("(relative RMS {error:.4})");
        let finished = self.finished.as_ref().map(|finished| {
            let note = format!("after the finish (relative RMS {:.4})", finished.view.metrics.rel_rms);
            (judge::field_of(&finished.view.image), note)
        });
        let seen = self.seen.as_ref().map(|seen| {
            let note = format!("in the light that there is (relative RMS {:.4})", seen.rel_rms());
            let exposure = Exposure::of(&plan.intent.wanted, plan.transfer.into());
            ([&seen.wanted, &seen.image].map(judge::field_of), exposure, note)
        });
        type Draw<'a> = Box<dyn Fn() -> GrayImage + Sync + 'a>;
        let always: [Draw; ALWAYS.len()] = [
            Box::new(|| report::panel(&target, &caustic, exposure, &note)),
            Box::new(|| report::irradiance_picture(&caustic, exposure)),
            Box::new(|| report::difference_picture(&target, &caustic, exposure)),
            Box::new(|| budget::sheet(&self.steps, &self.wanted, exposure)),
            Box::new(|| portrait.contours.sheet()),
            Box::new(|| portrait.drawing.clone()),
        ];
        let mut pictures: Vec<(&str, Draw)> = ALWAYS.into_iter().zip(always).collect();
        if let Some((image, note)) = &finished {
            pictures.push((FINISHED, Box::new(|| report::panel(&target, image, exposure, note))));
        }
        if let Some(([wanted, image], exposure, note)) = &seen {
            pictures.push((SEEN, Box::new(|| report::panel(wanted, image, *exposure, note))));
        }
        pictures
            .par_iter()
            .map(|(kind, draw)| {
                let path = picture_of(output, kind);
                report::write_png(&path, &draw()).map_err(Failure::writing)?;
                Ok(path)
            })
            .collect()
    }
}

/// Draws the solver's own view of where the light will be wrong, if it has one.
pub(crate) fn draw_weakness(plan: &Plan, output: &Path, block: &DesignedBlock) -> Result<Vec<PathBuf>, Failure> {
    let Some(light) = block.light.first() else { return Ok(Vec::new()) };
    let exposure = Exposure::of(&plan.target, plan.transfer.into());
    let wanted = plan.target.resampled(light.nx(), light.ny());
    let picture = report::difference_picture(&to_picture_order(wanted.cells()), &to_picture_order(light), exposure);
    let path = picture_of(output, WEAKNESS);
    report::write_png(&path, &picture).map_err(Failure::writing)?;
    Ok(vec![path])
}
