//! Why a bench is refused.

use glam::DVec3;

/// Greatest tilt of parallel light and of the receiver against the axis, degrees.
pub(super) const GREATEST_TILT_DEG: f64 = 85.0;

/// Why a solid cannot be examined on a bench.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A number that no bench can have.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Value {
        /// Which number, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Least accepted value.
        least: f64,
        /// Greatest accepted value.
        greatest: f64,
    },
    /// The light does not come from the side that the optics ask for, or its direction has no
    /// length that can be told.
    #[error("the light direction ({}, {}, {}) does not travel along {towards}, or has no length from 1e-100 to 1e100", .direction.x, .direction.y, .direction.z)]
    Light {
        /// The direction.
        direction: DVec3,
        /// Where light has to travel: `+z` into glass, `-z` onto a mirror.
        towards: &'static str,
    },
    /// Something is tilted so far that light grazes it.
    #[error(
        "{what} is tilted by {degrees:.2} degrees against the axis; at most {} degrees are accepted",
        GREATEST_TILT_DEG
    )]
    Tilt {
        /// What: the light, the receiver.
        what: &'static str,
        /// By how much, degrees.
        degrees: f64,
    },
    /// The source is inside of the block, or on the wrong side of it.
    #[error(
        "the light source at z = {z_mm} mm must lie {side} z = {limit_mm:.3} mm, where the block ends: move it away from the block"
    )]
    Source {
        /// Its place along the axis, mm.
        z_mm: f64,
        /// On which side of the limit it must lie.
        side: &'static str,
        /// The limit, mm.
        limit_mm: f64,
    },
    /// The receiver passes through the solid.
    #[error("the receiver at z = {distance_mm} mm is not beyond the solid, which reaches z = {top_mm} mm")]
    Receiver {
        /// Position of the receiver, mm.
        distance_mm: f64,
        /// Highest point of the solid, mm.
        top_mm: f64,
    },
    /// The turned receiver passes through the solid.
    #[error(
        "the turned receiver at z = {distance_mm} mm cuts the solid, which reaches {by_mm:.3} mm beyond it: move it away or turn it less"
    )]
    ReceiverCuts {
        /// Where the receiver meets the axis, mm.
        distance_mm: f64,
        /// How far the solid reaches through it, mm.
        by_mm: f64,
    },
    /// Two blocks of a row are in one place.
    #[error(
        "block {first} of the row reaches {by_mm:.3} mm beyond the nearest point of the next: a gap of more than {least_mm:.3} mm parts them"
    )]
    Meet {
        /// Which block, counted from 1.
        first: usize,
        /// By how much it reaches too far along the axis, mm.
        by_mm: f64,
        /// The gap that parts them, mm.
        least_mm: f64,
    },
    /// A plane on the way of the light passes through a block, or lies before the first.
    #[error(
        "the plane at z = {z_mm} mm is not in air behind a block: block {block} of the row is from {from_mm:.3} to {to_mm:.3} mm"
    )]
    Plane {
        /// The plane, mm.
        z_mm: f64,
        /// Which block it meets or comes before, counted from 1.
        block: usize,
        /// Least z of that block, mm.
        from_mm: f64,
        /// Greatest z of it, mm.
        to_mm: f64,
    },
    /// A table of intensities that is none.
    #[error(
        "row {row} of the table of intensities: angles must ascend within 0 and pi, intensities must not be negative, and one must be positive"
    )]
    Table {
        /// Which row, counted from 0; the number of rows if it is the whole that gives no light.
        row: usize,
    },
    /// A picture of a beam that is none.
    #[error(
        "the beam's picture has the value {value} at column {column}, row {row}: irradiance is finite and not negative"
    )]
    Profile {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// No light at all.
    #[error("no light falls on the solid: the source, its axis or the beam's picture leaves it in the dark")]
    Dark,
    /// The choice needs more than this solid has.
    #[error("{0}")]
    Needs(&'static str),
}

/// Refuses a number that is not in its range.
pub(crate) fn in_range(what: &'static str, value: f64, least: f64, greatest: f64) -> Result<(), SceneError> {
    if (least..=greatest).contains(&value) { Ok(()) } else { Err(SceneError::Value { what, value, least, greatest }) }
}
