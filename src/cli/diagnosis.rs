//! What may be wrong with a block that draws another picture than it should, or none.

use super::{error::Failure, side_file::BenchRecord};
use glasswarp_verify::{Block, Image, Scene, SceneError, Tracer, Window, beams, metrics, reference::resampled};

/// Below this relative RMS error nothing is looked for.
const SUSPECT: f64 = 0.05;
/// An explanation must take away at least half of the error.
const EXPLAINS: f64 = 0.5;
/// Lengths may differ from the side file's by this part: f32 in metres, far from the origin.
const SIZE_TOLERANCE: f64 = 1e-4;

/// What does not fit between the dimensions of a block and its side file.
pub(crate) fn of_dimensions(block: &Block, bench: &BenchRecord) -> Vec<String> {
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
    let measures = format!(
        "the block measures {:.3} x {:.3} mm, {:.5} and {:.5} times what its side file says",
        size.x, size.y, ratio.x, ratio.y
    );
    let units = [
        (1.0 / 25.4, "written in inches and read as millimetres?"),
        (25.4, "written in millimetres and taken for inches on the way?"),
        (0.1, "centimetres taken for millimetres?"),
        (10.0, "millimetres taken for centimetres?"),
        (0.001, "metres taken for millimetres?"),
        (1000.0, "millimetres taken for metres?"),
    ];
    let unit = units.iter().find(|(factor, _)| (ratio / *factor - 1.0).abs().max_element() < 1e-3);
    vec![unit.map_or_else(|| measures.clone(), |(_, question)| format!("{measures}: {question}"))]
}

/// Which pixel of the caustic is looked at in place of the one in this column and row.
type PixelAt<'a> = &'a dyn Fn(usize, usize) -> usize;

/// What would explain the error of a block's caustic: a mirrored picture, another distance or index.
pub(crate) fn of_picture(
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
    let turns: [(&str, PixelAt<'_>); 3] = [
        ("mirrored left to right", &|i, j| j * nx + nx - 1 - i),
        ("mirrored top to bottom", &|i, j| (ny - 1 - j) * nx + i),
        ("turned by 180 degrees", &|i, j| (ny - 1 - j) * nx + nx - 1 - i),
    ];
    for (name, pixel) in turns {
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
    let error_at = |factor: f64| {
        let distance_mm = factor * scene.distance_mm;
        let scene = Scene { distance_mm, window: Window { nx, ny, ..scene.window }, ..scene.clone() };
        match Tracer::for_block(block, &scene) {
            Ok(tracer) => {
                // A receiver beyond all light is no candidate.
                let seen = metrics::compare(&beams(&tracer, 2 * nx, 2 * ny).image, &wanted);
                Ok(seen.map_or(f64::INFINITY, |m| m.rel_rms))
            }
            Err(SceneError::Receiver { .. }) => Ok(f64::INFINITY),
            Err(error) => Err(Failure::refused(error)),
        }
    };
    let here = error_at(1.0)?;
    let mut best = (1.0, here);
    for step in (28..=60).filter(|&step| step != 40) {
        let factor = f64::from(step) / 40.0;
        let error = error_at(factor)?;
        if error < best.1 {
            best = (factor, error);
        }
    }
    let (factor, error) = best;
    if error > EXPLAINS * here {
        return Ok(Vec::new());
    }
    // To first order light is bent by (n - 1) times the slope: a factor of the distance is one of n - 1.
    Ok(vec![format!(
        "the picture is much better at {:.0} mm instead of {} mm, or with an index of about {:.3} instead of {}: relative RMS \
         error {error:.3} instead of {here:.3} (at {nx} pixels); is the distance wrong by a factor of {factor:.2}, or the index?",
        factor * scene.distance_mm,
        scene.distance_mm,
        1.0 + (scene.ior() - 1.0) * factor,
        scene.ior()
    )])
}
