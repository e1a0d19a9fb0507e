//! The ways of rays, and how they end.

use glam::{DVec2, DVec3};

/// How the way of a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// On the receiver plane, at this point, mm.
    Receiver(DVec2),
    /// At an interface, beyond the critical angle. (Traced as a full solid: after too many
    /// reflections inside.)
    TotallyReflected,
    /// At a side wall, or at the solid again after leaving it. (Traced as a full solid: anywhere
    /// but on the receiver.)
    Side,
    /// Past the solid without touching it; in a row, past a block behind the first.
    Beside,
    /// Nowhere: the tracer failed. Never happens with a sound solid.
    Lost,
}

/// Where a ray goes, following refraction wherever it is possible.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RayPath {
    /// How it ends.
    pub end: End,
    /// The part of its power that arrives there; the rest is reflected on the way.
    pub transmittance: f64,
    /// Its power for the rectangle of plan that it stands for, in units of the mean over the
    /// aperture: how bright the light is there. 0 where the face lies in its own shadow.
    pub power: f64,
    /// The block of a [row](crate::Row) at which it ends, counted from 0: of light that reaches the
    /// receiver the last one.
    pub block: u32,
    /// Rays of different signature took different kinds of ways: the map from aperture to receiver
    /// tears between them.
    pub(crate) signature: u32,
}

impl RayPath {
    /// No light.
    pub(crate) const DARK: Self = Self { power: 0.0, ..Self::ended(End::Side, 1.0) };

    pub(crate) const fn ended(end: End, transmittance: f64) -> Self {
        Self { end, transmittance, power: 1.0, block: 0, signature: 0 }
    }
}

/// What becomes of a ray that comes from any place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayEnd {
    /// It left the solid, and meets it no more.
    Left,
    /// It never met the solid.
    Missed,
    /// It is given up: after so many interfaces it is still in the glass, or still meets the solid.
    Trapped,
    /// Nowhere: the tracer failed. Never happens with a sound solid.
    Lost,
}

/// Where a ray that comes from any place leaves a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RayExit {
    /// How it ends.
    pub how: RayEnd,
    /// The last interface that it passed, or where it began, mm.
    pub point_mm: DVec3,
    /// Where it goes from there; of length 1.
    pub direction: DVec3,
    /// The part of its power that gets there, the rest being reflected on the way: 1 without
    /// Fresnel's equations.
    pub transmittance: f64,
    /// Interfaces that it met.
    pub interfaces: u32,
}
