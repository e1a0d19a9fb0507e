//! What may be wrong with a block that draws another picture than it should, or none.

use super::{
    changed::follow_picture,
    judge::{Examiner, Judgement, Subject},
};
use crate::{failure::Failure, record::BenchRecord};
use glam::DVec2;
use glasswarp_verify::{Block, Image, Optics, Scene, Tracer, Traversal, Window, beams, metrics, reference::resampled};

/// Below this relative RMS error nothing is looked for.
const SUSPECT: f64 = 0.05;
/// An explanation must take away at least half of the error.
const EXPLAINS: f64 = 0.5;
/// Lengths may differ from the side file's by this part: f32 in metres, far from the origin.
const SIZE_TOLERANCE: f64 = 1e-4;

/// Exit faces below this size, mm, are hardly meant: metres or inches without their unit look so.
const LEAST_SIZE_MM: f64 = 6.0;

/// What does not fit a block and its side file, or is odd about one without.
pub fn of_block(block: &Block, bench: Option<&BenchRecord>) -> Vec<String> {
    bench.map_or_else(|| of_size(block), |bench| of_dimensions(block, bench))
}

/// What is odd about the size of a block without a side file.
fn of_size(block: &Block) -> Vec<String> {
    let size = block.size_mm();
    let width = size.max_element();
    if width >= LEAST_SIZE_MM {
        return Vec::new();
    }
    let unit = if width < 1.0 { (1000.0, "metres") } else { (25.4, "inches") };
    let meant = unit.0 * size;
    vec![format!(
        "the block measures {:.5} x {:.5} mm: if its numbers are {}, it is {:.2} x {:.2} mm large, and has to be scaled by {}",
        size.x, size.y, unit.1, meant.x, meant.y, unit.0
    )]
}

/// What the numbers of a block look like that is this many times as large as it should be, with
/// that factor.
pub fn unit_of(ratio: DVec2) -> Option<(f64, &'static str)> {
    const UNITS: [(f64, &str); 6] = [
        (1.0 / 25.4, "inches taken for millimetres"),
        (25.4, "millimetres taken for inches"),
        (0.1, "centimetres taken for millimetres"),
        (10.0, "millimetres taken for centimetres"),
        (0.001, "metres taken for millimetres"),
        (1000.0, "millimetres taken for metres"),
    ];
    UNITS.into_iter().find(|(factor, _)| (ratio / *factor - 1.0).abs().max_element() < 1e-3)
}

/// What does not fit between the dimensions of a block and its side file.
fn of_dimensions(block: &Block, bench: &BenchRecord) -> Vec<String> {
    let size = block.size_mm();
    let ratio = size / bench.face_mm();
    if (ratio - 1.0).abs().max_element() <= SIZE_TOLERANCE {
        let (mean, entry) = (block.mean_exit_z_mm(), block.entry_z_mm());
        // Everything is measured from the mean exit plane: a shift along z moves the receiver.
        // The mean is 0 without the skirt, which a file does not tell from the rest.
        let off = if bench.face_mm().x > bench.width_mm { 0.0 } else { mean.abs() };
        let shift = off.max((entry - bench.entry_z_mm).abs());
        return if shift > 1e-3 * bench.width_mm {
            vec![format!(
                "the block is not where its side file says: its mean exit plane is at z = {mean:.3} mm instead of 0, its entry \
                 face at {entry:.3} mm instead of {:.3}",
                bench.entry_z_mm
            )]
        } else {
            Vec::new()
        };
    }
    let unit = unit_of(ratio).map(|(_, unit)| format!(": {unit}?")).unwrap_or_default();
    vec![format!(
        "the block measures {:.3} x {:.3} mm, {:.5} and {:.5} times what its side file says{unit}",
        size.x, size.y, ratio.x, ratio.y
    )]
}

/// Which pixel of the caustic is looked at in place of the one in this column and row.
type PixelAt<'a> = &'a dyn Fn(usize, usize) -> usize;

/// What would explain the error of a block's caustic: a mirrored picture, another distance or
/// index.
fn of_picture(
    block: &Block,
    scene: &Scene,
    target: &Image,
    caustic: &Image,
    wanted: &Image,
    rel_rms: f64,
) -> Result<Vec<String>, Failure> {
    if rel_rms < SUSPECT {
        return Ok(Vec::new());
    }
    let (nx, ny) = (caustic.nx, caustic.ny);
    let seen = |pixel: PixelAt<'_>| {
        let values = (0..nx * ny).map(|k| caustic.values[pixel(k % nx, k / nx)]).collect();
        metrics::rel_rms(&Image::new(nx, ny, values), wanted).map_err(Failure::refused)
    };
    let turns: [(&str, PixelAt<'_>); 7] = [
        ("mirrored left to right", &|i, j| j * nx + nx - 1 - i),
        ("mirrored top to bottom", &|i, j| (ny - 1 - j) * nx + i),
        ("turned by 180 degrees", &|i, j| (ny - 1 - j) * nx + nx - 1 - i),
        // These are for squares.
        ("turned by 90 degrees to the right", &|i, j| i * nx + nx - 1 - j),
        ("turned by 90 degrees to the left", &|i, j| (nx - 1 - i) * nx + j),
        ("mirrored and turned by 90 degrees", &|i, j| i * nx + j),
        ("mirrored and turned by 90 degrees", &|i, j| (nx - 1 - i) * nx + nx - 1 - j),
    ];
    for (name, pixel) in turns.into_iter().take(if nx == ny { 7 } else { 3 }) {
        let turned = seen(pixel)?;
        if turned < EXPLAINS * rel_rms {
            return Ok(vec![format!(
                "the picture is {name}: seen so, its relative RMS error is {turned:.4} instead of {rel_rms:.4}"
            )]);
        }
    }
    elsewhere(block, scene, target)
}

/// Looks for a distance at which the picture is much better than where the receiver stands.
fn elsewhere(block: &Block, scene: &Scene, target: &Image) -> Result<Vec<String>, Failure> {
    let (nx, ny) = (scene.window.nx.min(128), scene.window.ny.min(128));
    let wanted = resampled(target, nx, ny);
    let seen_at = |factor: f64| -> Result<f64, Failure> {
        let to = Scene { distance_mm: factor * scene.distance_mm, ..scene.clone() };
        let there = follow_picture((block, scene), (block, to))?.scene;
        let there = Scene { window: Window { nx, ny, ..there.window }, ..there };
        let tracer = Tracer::for_block(block, &there).map_err(Failure::refused)?;
        let seen = metrics::compare(&beams(&tracer, 2 * nx, 2 * ny).image, &wanted);
        Ok(seen.map_err(Failure::refused)?.rel_rms)
    };
    // A receiver that cuts the block, or beyond all light, is no candidate.
    let error_at = |factor: f64| seen_at(factor).unwrap_or(f64::INFINITY);
    let here = error_at(1.0);
    let mut best = (1.0, here);
    for step in (28..=60).filter(|&step| step != 40) {
        let factor = f64::from(step) / 40.0;
        let error = error_at(factor);
        if error < best.1 {
            best = (factor, error);
        }
    }
    let (factor, error) = best;
    if error.is_infinite() || error > EXPLAINS * here {
        return Ok(Vec::new());
    }
    // To first order light is bent by (n - 1) times the slope: a factor of the distance is one of n
    // - 1.
    let (or_index, or_the_index) = match scene.optics {
        Optics::Refracts { ior } => (
            format!(", or with an index of about {:.3} instead of {ior}", 1.0 + (ior - 1.0) * factor),
            ", or the index",
        ),
        Optics::Reflects => (String::new(), ""),
    };
    Ok(vec![format!(
        "the picture is much better at {:.0} mm instead of {} mm{or_index}: relative RMS \
         error {error:.3} instead of {here:.3} (at {nx} pixels); is the distance wrong by a factor of {factor:.2}{or_the_index}?",
        factor * scene.distance_mm,
        scene.distance_mm,
    )])
}

/// What may be wrong with a block that was not designed as it lies here. Nothing for another solid,
/// or without a picture.
///
/// # Errors
/// A bench that cannot be.
pub fn of_judgement(
    subject: &Subject,
    examiner: &Examiner,
    target: Option<&Image>,
    judgement: &Judgement,
) -> Result<Vec<String>, Failure> {
    let (Some(block), Some(target), Some(resampled), Some(verdict)) =
        (subject.block(), target, examiner.target(), &judgement.picture)
    else {
        return Ok(Vec::new());
    };
    let scene = Scene { traversal: Traversal::Grid, ..examiner.scene_for(subject) };
    of_picture(block, &scene, target, &judgement.caustic, resampled, verdict.metrics.rel_rms)
}
