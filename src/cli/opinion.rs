//! What the verifier says of the files of a design, and the pictures of it.

use super::{
    bench::scene_of,
    budget::{self, Judged, Step},
    error::Failure,
    finish::Finished,
    imperfect::Seen,
    judge::{self, Examiner, Judgement},
    plan::Plan,
    side_file::{self, BenchRecord, SideFile},
};
use glasswarp::{
    export::Format,
    pipeline::Block,
    report::{self, Exposure},
    solver::Progress,
    target::to_picture_order,
};
use glasswarp_verify::{Image, Mesh, PhotonPlan, Scene};
use image::GrayImage;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Photons that confirm the beams of a design: enough to find a fault, few enough not to be waited for.
const PHOTONS: u64 = 1 << 18;
/// Photons in spread light, of which beams know nothing.
const SPREAD_PHOTONS: u64 = 8_000_000;
/// Pixels across at which a design is judged, at most.
const PIXELS: usize = 1024;

/// What the verifier says of the files of a design.
pub(crate) struct Opinion {
    pub(crate) judgement: Judgement,
    pub(crate) steps: Vec<Step>,
    pub(crate) wanted: Image,
    /// The light after the finish that it was designed for.
    pub(crate) finished: Option<Finished>,
    /// The light that there is, if it is not perfect.
    pub(crate) seen: Option<Seen>,
}

/// The light of a design itself: nothing of it waits for a file.
pub(crate) struct Foreseen {
    scene: Scene,
    exact: budget::Exact,
}

impl Foreseen {
    /// Looks at a design on the bench of its plan.
    pub(crate) fn of(plan: &Plan, block: &Block) -> Result<Self, Failure> {
        Self::on(scene_of(&BenchRecord::of(&plan.bench).with(&block.solid), &plan.settings)?, plan, block)
    }

    fn on(scene: Scene, plan: &Plan, block: &Block) -> Result<Self, Failure> {
        let _span = tracing::info_span!("trace the design").entered();
        let examiner = Examiner::new(scene.clone(), Some(&plan.target), PIXELS);
        // What the solver saw after a finish is not the light of the face as it is.
        let own = block.light.as_ref().filter(|_| plan.settings.finish.is_none());
        Ok(Self { exact: budget::Exact::of(block, &plan.bench, own, &examiner)?, scene })
    }
}

impl Opinion {
    /// Judges the first STL, or without one the first output: what a shop would get. Then looks for the step that costs
    /// most.
    pub(crate) fn of(
        plan: &Plan,
        read_back: Vec<(PathBuf, Mesh)>,
        block: &Block,
        foreseen: Foreseen,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        progress.begin("tracing", 3);
        let stl = read_back.iter().position(|(path, _)| matches!(Format::from_path(path), Ok(Format::Stl)));
        let mut others = read_back;
        let (judged, mesh) = others.remove(stl.unwrap_or(0));
        // The bench as the side file gives it, which is what a stranger would have.
        let side = SideFile::read(&side_file::path_beside(&judged))?;
        let scene = scene_of(&side.bench, &side.design)?;
        let examiner = Examiner::new(scene.clone(), Some(&plan.target), PIXELS);
        let moved = |(path, mesh): (PathBuf, Mesh)| (mesh.moved(side.origin_of(&path)), path);
        let others: Vec<(Mesh, PathBuf)> = others.into_iter().map(moved).collect();
        let (mesh, judged) = moved((judged, mesh));
        let first = Judged::of(mesh, judged)?;
        let (judgement, views) = rayon::join(
            || judge::judge(&first.subject, &examiner, &PhotonPlan::new(PHOTONS, 1)),
            || first.views(&examiner),
        );
        let (judgement, views) = (judgement?, views?);
        // It was looked at before there was a side file.
        let foreseen = if foreseen.scene == scene { foreseen } else { Foreseen::on(scene.clone(), plan, block)? };
        progress.advance(1);
        let seen = (&first, views);
        let steps = budget::of_design((block, &plan.bench), foreseen.exact, seen, &others, &examiner, &judgement)?;
        let wanted = examiner.wanted().unwrap_or(&judgement.caustic).clone();
        progress.advance(2);
        let finish = plan.settings.finish;
        let finished = finish.map(|finish| Finished::of(finish, &first.subject, &examiner)).transpose()?;
        let plan_of_photons = PhotonPlan::new(SPREAD_PHOTONS, 1);
        let seen = Seen::of(&first.subject, &scene, &plan.intent, &plan.settings, &plan_of_photons)?;
        Ok(Self { judgement, steps, wanted, finished, seen })
    }

    /// Draws what was judged, beside the first output: the light alone, the panel of target, light and difference, the error
    /// budget, the isocontours of the exit face, and the block with its dimensions.
    pub(crate) fn draw(&self, plan: &Plan, output: &Path, block: &Block) -> Result<Vec<PathBuf>, Failure> {
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
        let mut pictures: Vec<(&str, Draw)> = vec![
            ("panel", Box::new(|| report::panel(&target, &caustic, exposure, &note))),
            ("caustic", Box::new(|| report::irradiance_picture(&caustic, exposure))),
            ("difference", Box::new(|| report::difference_picture(&target, &caustic, exposure))),
            ("budget", Box::new(|| budget::sheet(&self.steps, &self.wanted, exposure))),
            ("contours", Box::new(|| report::isocontours(block.solid.surface(), 1000))),
            ("drawing", Box::new(|| report::dimensioned_drawing(&block.solid, &plan.bench))),
        ];
        if let Some((image, note)) = &finished {
            pictures.push(("finished", Box::new(|| report::panel(&target, image, exposure, note))));
        }
        if let Some(([wanted, image], exposure, note)) = &seen {
            pictures.push(("seen", Box::new(|| report::panel(wanted, image, *exposure, note))));
        }
        pictures
            .par_iter()
            .map(|(kind, draw)| {
                let path = output.with_extension(format!("{kind}.png"));
                report::write_png(&path, &draw()).map_err(Failure::writing)?;
                Ok(path)
            })
            .collect()
    }
}

/// Draws the solver's own view of where the light will be wrong, if it has one.
pub(crate) fn draw_weakness(plan: &Plan, output: &Path, block: &Block) -> Result<Vec<PathBuf>, Failure> {
    let Some(light) = &block.light else { return Ok(Vec::new()) };
    let exposure = Exposure::of(&plan.target, plan.transfer.into());
    let wanted = plan.target.resampled(light.nx(), light.ny());
    let picture = report::difference_picture(&to_picture_order(wanted.cells()), &to_picture_order(light), exposure);
    let path = output.with_extension("weakness.png");
    report::write_png(&path, &picture).map_err(Failure::writing)?;
    Ok(vec![path])
}
