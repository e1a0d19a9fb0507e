//! What a renderer sees and what the verifier sees.

use super::put;
use glasswarp_verify::crosscheck::{Distances, ImageAgreement, MapAgreement, PERCENTILES};

/// How far landing points are apart.
pub(crate) fn map(agreement: &MapAgreement, quantum_mm: f64) -> String {
    let um = |mm: &f64| format!(" {:>8.2}", 1e3 * mm);
    let percentiles: String = PERCENTILES.iter().map(|p| format!(" {:>8}", format!("{p} %"))).collect();
    let mut text = String::new();
    put!(text, "  rays           {} land by both, {} by one of them only", agreement.rays, agreement.contested);
    put!(text, "\nDistance between landing points, um     rms{percentiles}    worst");
    let rows = [("same normals, interpolated", &agreement.smooth), ("the spline surface", &agreement.spline)];
    for (name, Distances { rms_mm, percentiles_mm, worst_mm, .. }) in rows {
        let percentiles: String = percentiles_mm.iter().map(um).collect();
        put!(text, "  {name:<32}{}{percentiles}{}", um(rms_mm), um(worst_mm));
    }
    let shift = 1e3 * agreement.smooth.shift_mm;
    put!(text, "  mean shift of the renderer's picture: ({:.3}, {:.3}) um", shift.x, shift.y);
    if quantum_mm > 0.0 {
        put!(text, "  the renderer's picture has steps of {:.2} um", 1e3 * quantum_mm);
    }
    text
}

/// How far the caustics are apart.
pub(crate) fn image(agreement: &ImageAgreement) -> String {
    let mut text = String::new();
    put!(text, "\nRelative RMS difference    one run   its noise   without noise");
    for level in &agreement.levels {
        let pixels = format!("at {} pixels across", level.pixels);
        put!(text, "  {pixels:<24} {:>8.4} {:>11.4} {:>15.4}", level.rel_rms, level.noise, level.without_noise);
    }
    put!(text, "  over the inner nine tenths of the window, all images normalised to the mean 1");
    if agreement.black > 0 {
        put!(
            text,
            "  {} of {} pixels are black in the renderer's picture only, and were left out",
            agreement.black,
            agreement.pixels
        );
    }
    text
}
