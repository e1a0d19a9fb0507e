//! The pictures that are drawn of a design.

use super::{common::costs, design::BlockDrawings};
use crate::{
    failure::Failure,
    irradiance::to_picture_order,
    pipeline::DesignedBlock,
    report::{
        budget_sheet::budget_sheet,
        pictures::{Exposure, difference_picture, irradiance_picture},
        sheet::panel,
    },
    spec::Settings,
    study::{
        budget::BudgetStep,
        design::Plan,
        judge,
        verification::{DesignVerification, Seen},
    },
};
use glasswarp_verify::Image;
use image::GrayImage;
use rayon::prelude::*;

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
