//! Figures of accuracy, held to what was measured when they were written down. They are the same bits for any number of threads; a
//! tenth is left for other compilers and mathematical libraries.

/// Asserts that a figure is what was measured, within a tenth: a worse one is a regression, a better one is to be written down.
#[track_caller]
pub(crate) fn within_tenth_of(measured: f64, found: f64, what: impl std::fmt::Display) {
    within_share_of(0.1, measured, found, what);
}

/// The same with another margin, as a share, for figures with noise in them.
#[track_caller]
pub(crate) fn within_share_of(share: f64, measured: f64, found: f64, what: impl std::fmt::Display) {
    let range = measured / (1.0 + share)..=measured * (1.0 + share);
    assert!(range.contains(&found), "{what}: {found:.4e}, and {measured:.4e} was measured");
}
