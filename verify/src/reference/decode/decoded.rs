//! What a decoder gives.

use crate::reference::{colour::Meaning, error::ReferenceError, icc, raster::Raster};

/// A picture as it is stored.
pub(in crate::reference) struct Decoded {
    pub(in crate::reference) raster: Raster,
    /// Of EXIF or TIFF, 1 to 8.
    pub(in crate::reference) orientation: u8,
    /// What the file says of its numbers; refused only if nobody says otherwise.
    pub(in crate::reference) meaning: Result<Meaning, ReferenceError>,
    /// Light without a white of its own: its brightest pixel is white.
    pub(in crate::reference) scaled_to_peak: bool,
    /// Two right decoders may differ by a level.
    pub(in crate::reference) lossy: bool,
}

impl Decoded {
    /// Upright, lossless, and what the profile says, else `otherwise`.
    pub(super) fn new(raster: Raster, profile: Option<&[u8]>, otherwise: Meaning) -> Self {
        let meaning = Ok(profile.and_then(|profile| icc::read(profile, raster.inks)).unwrap_or(otherwise));
        Self { raster, orientation: 1, meaning, scaled_to_peak: false, lossy: false }
    }
}

/// Refuses sizes that are none, or that no file of this length can have: `per_byte` pixels are the
/// most that a byte can stand for.
pub(super) fn believe(width: usize, height: usize, length: usize, per_byte: usize) -> Result<(), ReferenceError> {
    /// What is held for granted: a small file may be one of few colours.
    const GRANTED: usize = 1 << 16;
    if width == 0 || height == 0 {
        return Err(ReferenceError::Empty { width, height });
    }
    let most = GRANTED + length.saturating_mul(per_byte);
    match width.checked_mul(height) {
        Some(pixels) if pixels <= most => Ok(()),
        _ => Err(ReferenceError::Claims { width, height, length, most }),
    }
}
