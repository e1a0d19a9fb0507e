//! What other renderers, and photons in parts, say of a block, for programs.

use super::judge::flux_document;
use crate::record::document;
use glasswarp_verify::{
    PhotonTally, UnbiasedError,
    crosscheck::{Distances, ImageAgreement, ImageLevel, MapAgreement},
};

/// How landing points agree, for programs.
pub fn map_document(agreement: &MapAgreement) -> document::MapAgreement {
    let distances = |d: &Distances| document::Distances {
        rms_mm: document::finite(d.rms_mm),
        worst_mm: document::finite(d.worst_mm),
    };
    document::MapAgreement {
        rays: agreement.rays,
        contested: agreement.contested,
        smooth: distances(&agreement.smooth),
        spline: distances(&agreement.spline),
    }
}

/// How caustics agree at every number of pixels, for programs.
pub fn levels_document(agreement: &ImageAgreement) -> Vec<document::ImageLevel> {
    let level = |level: &ImageLevel| document::ImageLevel {
        pixels: level.pixels,
        rel_rms: document::finite(level.rel_rms),
        noise: document::finite(level.noise),
        without_noise: document::finite(level.without_noise),
    };
    agreement.levels.iter().map(level).collect()
}

/// Photons traced, for programs.
pub fn tally_document(tally: &PhotonTally, error: Option<UnbiasedError>) -> document::Tally {
    document::Tally {
        photons: tally.photons(),
        complete: tally.is_complete(),
        noise: document::finite(tally.noise()),
        light: flux_document(&tally.flux()),
        rel_rms: error.and_then(|error| document::finite(error.rel_rms())),
        rel_rms_error: error.and_then(|error| document::finite(error.rel_rms_error())),
    }
}
