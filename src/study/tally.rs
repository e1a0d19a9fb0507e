//! Photons in parts: which belong together, and what they say in sum.

use super::judge::flux_document;
use crate::{failure::Failure, record::document};
use glasswarp_verify::{PhotonTally, Scene, UnbiasedError};

/// What was looked at, and how, in one line: equal for parts of one run, and for those alone.
pub fn bench_line(solid_sha256: &str, scene: &Scene) -> String {
    format!("solid sha256 {solid_sha256}, {scene:?}")
}

/// A part of a run: its tally and its [`bench_line`].
pub type Part = (PhotonTally, String);

/// The sum of parts, each with its name, and their bench.
///
/// # Errors
/// Parts of different benches, parts of different runs, none at all, or what reading them fails by.
pub fn merged(parts: impl IntoIterator<Item = Result<(String, Part), Failure>>) -> Result<Part, Failure> {
    let mut parts = parts.into_iter();
    let (first, (mut sum, bench)) =
        parts.next().unwrap_or_else(|| Err(Failure::Usage("there is nothing to merge".into())))?;
    for part in parts {
        let (name, (part, of_part)) = part?;
        if of_part != bench {
            return Err(Failure::Usage(format!(
                "{name} shows another bench than {first}: '{of_part}' is not '{bench}'"
            )));
        }
        sum = sum
            .merge(&part)
            .map_err(|error| Failure::Usage(format!("{name} cannot be added to the others: {error}")))?;
    }
    Ok((sum, bench))
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
