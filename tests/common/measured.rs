//! Figures of accuracy, held to what was measured when they were written down. They are the same bits for any number of threads; a
//! tenth is left for other compilers and mathematical libraries.
#![allow(dead_code, reason = "every test binary uses its own part")]

use std::fmt::Display;

/// Asserts that a figure is what was measured, within a tenth: a worse one is a regression, a better one is to be written down.
#[track_caller]
pub(crate) fn within_tenth_of(measured: f64, found: f64, what: impl Display) {
    within_share_of(0.1, measured, found, what);
}

/// The same with another margin, as a share, for figures with noise in them.
#[track_caller]
pub(crate) fn within_share_of(share: f64, measured: f64, found: f64, what: impl Display) {
    let range = measured / (1.0 + share)..=measured * (1.0 + share);
    if std::env::var_os("MEASURE").is_some() { use std::io::Write; let _ = writeln!(std::io::stderr(), "MEASURED {} {what}: {found:.4e} ({measured:.4e})", std::panic::Location::caller()); return; }
    assert!(range.contains(&found), "{what}: {found:.4e}, and {measured:.4e} was measured");
}

/// The same as [`within_tenth_of`] for a figure that was read from what a command prints with four decimals: a unit of the last one is left
/// for rounding.
#[track_caller]
pub(crate) fn prints_within_tenth_of(measured: f64, found: f64, what: impl Display) {
    let off = 0.1 * measured + 1.0001e-4;
    assert!((found - measured).abs() <= off, "{what}: {found:.4}, and {measured:.4} was measured");
}
