//! Figures of accuracy, held to what was measured when they were written down. They are the same bits for any number of threads; a
//! tenth is left for other compilers and mathematical libraries.

use std::fmt::Display;

/// Asserts that a figure is what was measured, within a tenth: a worse one is a regression, a better one is to be written down.
#[track_caller]
pub(crate) fn within_tenth_of(measured: f64, found: f64, what: impl Display) {
    assert!((found - measured).abs() <= 0.1 * measured, "{what}: {found:.4e}, and {measured:.4e} was measured");
}

/// The same for a figure that was read from what a command prints with four decimals: a unit of the last one is left for rounding.
#[track_caller]
pub(crate) fn prints_within_tenth_of(measured: f64, found: f64, what: impl Display) {
    let off = 0.1 * measured + 1.0001e-4;
    assert!((found - measured).abs() <= off, "{what}: {found:.4}, and {measured:.4} was measured");
}
