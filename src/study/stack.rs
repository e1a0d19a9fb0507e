//! Plates in a row: each draws a picture of its own on one receiver, together with those before it.

use super::{
    behind,
    bench::{DISTANCE_MM, record_of},
    design::{NOMINAL_MM, Plan},
};
use crate::{
    failure::Failure,
    solver::Progress,
    spec::{Host, Length, Settings},
};
use std::path::PathBuf;

/// Nodes across of the drafts that tell how thick the plates are.
const DRAFT_NODES: usize = 129;

/// Most by which the height of plates may differ.
const MOST_UNLIKE: f64 = 0.01;

/// A plate that is to be designed.
#[derive(Clone, Debug)]
pub struct Plate {
    /// What it draws together with the plates before it.
    pub picture: PathBuf,
    /// Its settings, but for the file that it stands behind.
    pub settings: Settings,
    /// The air before it, mm; 0 of the first.
    pub gap_mm: f64,
}

/// The plates that draw these pictures, in the order of the light: `settings` are those of all of
/// them, with the distance from the last one. How far the receiver is from the others depends on how
/// thick those behind them are, which drafts tell.
///
/// # Errors
/// No gap to every plate but the first, or those of [`Plan::new`].
pub fn plates(
    pictures: &[PathBuf],
    gaps: &[Length],
    settings: &Settings,
    host: &dyn Host,
    progress: &dyn Progress,
) -> Result<Vec<Plate>, Failure> {
    let behind = pictures.len().saturating_sub(1);
    if behind == 0 || (gaps.len() != 1 && gaps.len() != behind) {
        return Err(Failure::Usage(format!(
            "there are {} pictures and {} gaps (`gap`): give one for all, or one before every plate but the first",
            pictures.len(),
            gaps.len()
        )));
    }
    if settings.is_mirror() {
        return Err(Failure::Usage("plates in a row are of glass: leave `mirror` out".into()));
    }
    behind::refuse_spread(settings)?;
    let gap_mm = |k: usize| if k == 0 { 0.0 } else { gaps[(k - 1).min(gaps.len() - 1)].mm };
    let distance_mm = settings.distance.map_or(DISTANCE_MM, |length| length.mm);
    let mut plates: Vec<Plate> = Vec::new();
    let mut before = behind::open(settings, host)?;
    let mut size = None;
    // From the entry face of every plate to its mean exit plane.
    let mut depths_mm = Vec::new();
    for (k, picture) in pictures.iter().enumerate() {
        // Its settings are here already; a later plate shall not get its light.
        let mut own = Settings { preset: None, ..settings.clone() };
        if k > 0 {
            (own.light, own.tilt, own.source_distance) = (None, None, None);
        }
        let further_mm: f64 = (k + 1..=behind).map(|k| gap_mm(k) + NOMINAL_MM).sum();
        let draft = Settings {
            nodes: Some(own.nodes.map_or(DRAFT_NODES, |nodes| nodes.min(DRAFT_NODES))),
            distance: Some(Length { mm: distance_mm + further_mm }),
            ..own.clone()
        };
        let plan = Plan::behind(picture.clone(), draft, before.clone(), host, progress)?;
        let block = plan.design(progress)?;
        if k > 0 {
            // As thick as the draft: plates before it are aimed past it.
            own.thickness = Some(Length { mm: block.solid.thickness_mm() });
        }
        let size_mm = plan.bench.block();
        let first = *size.get_or_insert(size_mm);
        if (size_mm.height_mm / first.height_mm - 1.0).abs() > MOST_UNLIKE {
            return Err(Failure::Usage(format!(
                "{} would make a plate of {:.1} x {:.1} mm behind one of {:.1} x {:.1} mm, and light would pass beside it: crop the pictures to the same aspect (`crop`)",
                picture.display(),
                size_mm.width_mm,
                size_mm.height_mm,
                first.width_mm,
                first.height_mm
            )));
        }
        depths_mm.push(-block.solid.entry_z_mm());
        if k < behind {
            before = before.and(record_of(&plan.bench), &block.solid, gap_mm(k + 1))?;
        }
        plates.push(Plate { picture: picture.clone(), settings: own, gap_mm: gap_mm(k) });
    }
    let mut distance_mm = distance_mm;
    for k in (0..=behind).rev() {
        plates[k].settings.distance = Some(Length { mm: distance_mm });
        // To a micrometre, which is less than drafts know.
        distance_mm = (1e3 * (distance_mm + depths_mm[k] + gap_mm(k))).round() / 1e3;
    }
    Ok(plates)
}
