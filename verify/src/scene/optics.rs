//! What a solid does to light.

/// What the exit face does to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Optics {
    /// Light enters the solid by its entry face and leaves it by the exit face.
    Refracts {
        /// Refractive index of the solid relative to its surroundings.
        ior: f64,
    },
    /// The exit face of a [`Block`](crate::Block) is a perfect front-surface mirror. Light comes
    /// from the receiver's side, travelling -z, and what is behind the face plays no part. The
    /// receiver does not shade the mirror.
    Reflects,
}

/// Whether interfaces reflect a part of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Fresnel {
    /// Everything that can be refracted is: a perfect coating.
    #[default]
    Off,
    /// Fresnel's equations for unpolarised light.
    On,
}
