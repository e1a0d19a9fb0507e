//! Figures of accuracy, held to what was measured when they were written down. They are the same
//! bits for any number of threads; a tenth is left for other compilers and mathematical libraries.

#![allow(dead_code, reason = "every user of this file takes its own part")]

use std::fmt::Display;

/// Asserts that a figure is what was measured, within a tenth: a worse one is a regression, a
/// better one is to be written down.
#[track_caller]
pub(crate) fn within_tenth_of(measured: f64, found: f64, what: impl Display) {
    assert!((found - measured).abs() <= 0.1 * measured, "{what}: {found:.4e}, and {measured:.4e} was measured");
}

/// Asserts that one of many figures, of which the worst was measured, is not worse than that by
/// more than a tenth.
#[track_caller]
pub(crate) fn at_worst(measured: f64, found: f64, what: impl Display) {
    assert!(found <= 1.1 * measured, "{what}: {found:.4e}, and {measured:.4e} was measured at worst");
}

/// Asserts that what must be nought is nought but for the rounding of some thousand steps in double
/// precision.
#[track_caller]
pub(crate) fn nothing_but_rounding(found: f64, what: impl Display) {
    assert!(found.abs() <= 1e-12, "{what}: {found:.4e}, which is more than rounding");
}

/// [`at_worst`] for the difference of two figures that commands print with four decimals: a unit of
/// the last one is left for rounding.
#[track_caller]
pub(crate) fn prints_at_worst(measured: f64, found: f64, what: impl Display) {
    let most = 1.1 * measured + 1.0001e-4;
    assert!(found <= most, "{what}: {found:.4}, and {measured:.4} was measured at worst");
}

/// [`within_tenth_of`] for a figure that was read from what a command prints with four decimals: a
/// unit of the last one is left for rounding.
#[track_caller]
pub(crate) fn prints_within_tenth_of(measured: f64, found: f64, what: impl Display) {
    let off = 0.1 * measured + 1.0001e-4;
    assert!((found - measured).abs() <= off, "{what}: {found:.4}, and {measured:.4} was measured");
}
