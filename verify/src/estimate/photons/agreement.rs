//! What photons say of a target or of another image, with their own error.

/// An estimate against a target, with the noise's own part taken out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct UnbiasedError {
    /// Mean square error without bias: the noise does not add to it, and so it can be negative.
    pub mean_square: f64,
    /// Standard error of `mean_square`.
    pub mean_square_error: f64,
}

impl UnbiasedError {
    /// Relative RMS error; 0 where nothing rises above the noise.
    pub fn rel_rms(&self) -> f64 {
        self.mean_square.max(0.0).sqrt()
    }

    /// Standard error of [`rel_rms`](Self::rel_rms): no error below this may be claimed.
    pub fn rel_rms_error(&self) -> f64 {
        // d(sqrt m) = dm / (2 sqrt m), which for m near 0 turns into sqrt(dm).
        let rms = self.rel_rms();
        let spread = self.mean_square_error;
        if rms * rms > spread { 0.5 * spread / rms } else { spread.sqrt() }
    }
}

/// How far photons are from an image that should be the same light.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PhotonAgreement {
    /// Mean square difference of the photons from the image, less their noise.
    pub difference: f64,
    /// Its standard error if both show the same light.
    pub standard_error: f64,
}

impl PhotonAgreement {
    /// The difference in standard errors, without its sign. If both show the same light it is
    /// distributed as the magnitude of a standard normal variable: beyond 2 once in 22 cases,
    /// beyond 4 once in 16 000.
    pub fn standard_errors(&self) -> f64 {
        if self.difference == 0.0 { 0.0 } else { (self.difference / self.standard_error).abs() }
    }
}
