//! What glass does to white light: every colour has its own index, and so its own caustic.

mod colour;

pub use colour::colour_matching;

use super::{beams::beams, metrics};
use crate::{
    block::Block,
    image::Image,
    scene::{Optics, Scene, SceneError},
    trace::{End, Row, Tracer},
};
use glam::DVec2;
use rayon::prelude::*;

/// The blue F line of hydrogen and the red C line, nm: between them dispersion is told by custom.
pub const LINES_NM: [f64; 2] = [486.1, 656.3];
/// Wavelengths that make up white, nm: from the first, so many, so far apart.
const WHITE: (f64, usize, f64) = (410.0, 15, 20.0);
/// Rays along each side of the block whose landing points are compared.
const RAYS: usize = 256;

/// The caustic of white light.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Dispersed {
    /// Linear red, green and blue with the primaries of sRGB. The even light of the aperture spread
    /// over the window is (1, 1, 1), whatever lamp it comes from: the eye, or a camera, is taken to
    /// be balanced to it. Colours beyond the primaries have negative parts.
    pub rgb: [Image; 3],
    /// How bright it looks: CIE's luminance of white light, 1 for even light.
    pub luminance: Image,
    /// By how much colours part.
    pub fringing: Fringing,
}

/// By how much colours part.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fringing {
    /// Indices at the [lines](LINES_NM), blue and red.
    pub ior: [f64; 2],
    /// Root of the mean square distance between the points where the blue and the red of one ray
    /// land, mm.
    pub rms_mm: f64,
    /// The greatest such distance, mm.
    pub worst_mm: f64,
    /// Relative RMS difference between the luminance of white light and the light of the scene's
    /// own index: how much the picture loses of its sharpness.
    pub rel_rms: f64,
}

/// Traces a block in white light of equal energy, whose index by wavelength (nm) is `ior_at`; the
/// scene's own index is that of the design. `beams_across` rays along x and y are traced for each
/// of fifteen wavelengths, as by [`beams`].
///
/// # Errors
/// A mirror, which does not disperse; a bench that cannot be with one of the indices; no light.
pub fn disperse(
    block: &Block,
    scene: &Scene,
    ior_at: &(dyn Fn(f64) -> f64 + Sync),
    beams_across: (usize, usize),
) -> Result<Dispersed, SceneError> {
    disperse_row(&Row::of(block), scene, &|_, wavelength| ior_at(wavelength), beams_across)
}

/// The same of blocks in a row: `ior_at` is told which block, counted from 0, and the wavelength;
/// the row's own indices are those of the design. [`Fringing::ior`] is that of the first block.
///
/// # Errors
/// As of [`disperse`].
pub fn disperse_row(
    row: &Row<'_>,
    scene: &Scene,
    ior_at: &(dyn Fn(usize, f64) -> f64 + Sync),
    beams_across: (usize, usize),
) -> Result<Dispersed, SceneError> {
    if scene.optics == Optics::Reflects {
        return Err(SceneError::Needs("a mirror reflects all colours alike: there is no dispersion to look at"));
    }
    let tracer = |wavelength: f64| Tracer::for_row(&row.with_iors(|block| ior_at(block, wavelength)), scene);
    let (nx, ny) = (scene.window.nx, scene.window.ny);
    let seen = |tracer: &Tracer| beams(tracer, beams_across.0, beams_across.1).image;
    let (first, count, step) = WHITE;
    let mut xyz = [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; nx * ny]);
    let mut white = [0.0; 3];
    for wavelength in (0..count).map(|k| first + step * k as f64) {
        let image = seen(&tracer(wavelength)?);
        for ((sum, white), weight) in xyz.iter_mut().zip(&mut white).zip(colour_matching(wavelength)) {
            sum.iter_mut().zip(&image.values).for_each(|(sum, v)| *sum += weight * v);
            *white += weight;
        }
    }
    let balance = colour::linear_rgb(white);
    let pixel = |k: usize| {
        let rgb = colour::linear_rgb([xyz[0][k], xyz[1][k], xyz[2][k]]);
        [rgb[0] / balance[0], rgb[1] / balance[1], rgb[2] / balance[2]]
    };
    let rgb = [0, 1, 2].map(|c| Image::new(nx, ny, (0..nx * ny).map(|k| pixel(k)[c]).collect()));
    let luminance = Image::new(nx, ny, xyz[1].iter().map(|y| y / white[1]).collect());
    let rel_rms = metrics::rel_rms(&luminance, &seen(&Tracer::for_row(row, scene)?)).map_err(|_| SceneError::Dark)?;
    let ior = LINES_NM.map(|line| ior_at(0, line));
    let (rms_mm, worst_mm) = parting(&tracer(LINES_NM[0])?, &tracer(LINES_NM[1])?);
    Ok(Dispersed { rgb, luminance, fringing: Fringing { ior, rms_mm, worst_mm, rel_rms } })
}

/// Root of the mean square distance, and the greatest, between landing points of the same rays by
/// two tracers, mm. In oblique or spreading light rays are the same where they light the same
/// points of the exit face.
fn parting(blue: &Tracer, red: &Tracer) -> (f64, f64) {
    let (lower, upper) = blue.aperture_mm();
    let apart = |k: usize| {
        let place = (DVec2::new((k % RAYS) as f64, (k / RAYS) as f64) + 0.5) / RAYS as f64;
        let at = lower + place * (upper - lower);
        match (blue.path_at(at).end, red.path_at(at).end) {
            (End::Receiver(a), End::Receiver(b)) => Some(a.distance_squared(b)),
            _ => None,
        }
    };
    let squares: Vec<Option<f64>> = (0..RAYS * RAYS).into_par_iter().map(apart).collect();
    let landed = squares.iter().flatten();
    let (sum, count) = landed.clone().fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    let worst = landed.fold(0.0, |worst: f64, &square| worst.max(square));
    ((sum / f64::from(count.max(1))).sqrt(), worst.sqrt())
}
