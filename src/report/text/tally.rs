//! Photons that were counted, in parts or at once.

use super::{judgement::flux, put};
use glasswarp_verify::{Image, PhotonTally, UnbiasedError, metrics::Metrics};

/// How many, how noisy, and where they went.
pub(crate) fn photons(tally: &PhotonTally) -> String {
    let complete = if tally.is_complete() { "the whole run" } else { "a part of the run" };
    let mut text = String::new();
    put!(text, "  photons        {:.6} million, {complete}", tally.photons() as f64 / 1e6);
    put!(text, "  noise          {:.5} of the mean irradiance (root mean square over pixels)", tally.noise());
    text + &flux(&tally.flux())
}

/// Whether they draw the picture.
pub(crate) fn judgement(wanted: &Image, m: &Metrics, error: UnbiasedError) -> String {
    let mut text = String::new();
    put!(text, "\nDoes the light draw the picture? (by photons, {} x {} pixels)", wanted.nx, wanted.ny);
    put!(
        text,
        "  relative RMS   {:.5} +- {:.5}, less the noise; {:.5} with it",
        error.rel_rms(),
        error.rel_rms_error(),
        m.rel_rms
    );
    put!(text, "  PSNR           {:.2} dB, with the noise", m.psnr_db);
    put!(text, "  SSIM           {:.4}, with the noise", m.ssim);
    put!(text, "  black level    {:.4} of the mean, {:.4} in the picture", m.black_level, m.target_black_level);
    put!(text, "  contrast       {:.1}, {:.1} in the picture", m.contrast, m.target_contrast);
    text
}
