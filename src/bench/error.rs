use super::limits::{GREATEST_INCIDENCE_DEG, GREATEST_LEAN_DEG, IOR_LIMITS};
use crate::light::{PassageError, ProfileError};
use glam::{DVec2, DVec3};

/// Why a bench cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// A length outside of what the numerics and any workshop can handle.
    #[error("{what} is {value_mm} mm; it must lie between {least_mm} mm and {greatest_mm} mm")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its value, mm.
        value_mm: f64,
        /// Least accepted value, mm.
        least_mm: f64,
        /// Greatest accepted value, mm.
        greatest_mm: f64,
    },
    /// Corners that do not fit the block.
    #[error(
        "corners with a radius of {radius_mm} mm do not fit a block of {width_mm} x {height_mm} mm; take at least {least_mm:.2} mm and at most {greatest_mm:.2} mm, half of the shorter side, or a circle"
    )]
    Corners {
        /// The refused radius, mm.
        radius_mm: f64,
        /// Width of the block, mm.
        width_mm: f64,
        /// Height of the block, mm.
        height_mm: f64,
        /// Least accepted radius, mm.
        least_mm: f64,
        /// Greatest accepted radius, mm.
        greatest_mm: f64,
    },
    /// Light does not come through what stands before the block.
    #[error(transparent)]
    Passage(#[from] PassageError),
    /// Known faces before a mirror.
    #[error("a mirror has no faces before its own: take a block of glass")]
    FacesBeforeMirror,
    /// The last of the known faces does not begin the block.
    #[error("behind the last of the known faces the index is {index}; it must be that of the block, {wanted}")]
    IndexBehind {
        /// Index behind the last face; not a number if there is none.
        index: f64,
        /// Index of the block.
        wanted: f64,
    },
    /// The index does not bend light, or is not that of a transparent solid.
    #[error("the refractive index is {ior}; it must lie between {} and {} (acrylic 1.49, window glass 1.52)", IOR_LIMITS.0, IOR_LIMITS.1)]
    Index {
        /// The refused index.
        ior: f64,
    },
    /// The light does not travel towards the structured face.
    #[error("the light direction ({}, {}, {}) does not reach the exit face", direction.x, direction.y, direction.z)]
    Direction {
        /// The refused direction.
        direction: DVec3,
    },
    /// The source lies in the block, behind the mirror, or so close to it that it touches.
    #[error("the light source at z = {z_mm} mm must lie {side} z = {limit_mm} mm, {face}: move it away from the block")]
    SourcePlace {
        /// Its place on the bench's axis, mm.
        z_mm: f64,
        /// On which side of the limit it must lie.
        side: &'static str,
        /// The limit, mm.
        limit_mm: f64,
        /// What the limit is.
        face: &'static str,
    },
    /// Some part of the block is lit at a grazing angle.
    #[error(
        "light from the source meets the block at {angle_deg:.1} degrees to its axis at x = {:.2} mm, y = {:.2} mm; at most {} degrees are accepted: move the source further away, or closer to the axis",
        at_mm.x, at_mm.y, GREATEST_INCIDENCE_DEG
    )]
    Grazing {
        /// Where on the block, mm.
        at_mm: DVec2,
        /// Angle to the axis, in air, degrees.
        angle_deg: f64,
    },
    /// The receiver leans so far that it is seen from its edge.
    #[error("the receiver leans by {angle_deg:.1} degrees; at most {} degrees are accepted", GREATEST_LEAN_DEG)]
    Lean {
        /// Angle between its normal and the axis, degrees.
        angle_deg: f64,
    },
    /// The receiver passes through the block.
    #[error(
        "the receiver cuts the block: the corner of its mean exit plane at x = {:.1} mm, y = {:.1} mm lies {:.1} mm behind it; move the receiver further away or let it lean less",
        at_mm.x, at_mm.y, -gap_mm
    )]
    ReceiverCuts {
        /// The corner, mm.
        at_mm: DVec2,
        /// Its distance in front of the receiver, mm.
        gap_mm: f64,
    },
    /// The undisturbed light does not reach the receiver.
    #[error("light along ({:.3}, {:.3}, {:.3}) goes past the receiver: tilt the light or the receiver less", direction.x, direction.y, direction.z)]
    PastReceiver {
        /// Its direction behind a flat face.
        direction: DVec3,
    },
    /// The light cannot be used.
    #[error(transparent)]
    Profile(#[from] ProfileError),
}
