use glam::DVec3;

/// The light that arrives at the structured face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light.
    Parallel {
        /// Unit vector along which it travels as it arrives at the structured face (for a block of
        /// glass: inside of it).
        direction: DVec3,
    },
    /// Light from a point.
    Point {
        /// The source, mm in the bench's frame: in front of the entry face of glass, in front of a
        /// mirror.
        position_mm: DVec3,
        /// From the planar entry face of glass to the mean exit plane, mm: the entry face lies at
        /// `z = -thickness_mm`. A mirror has no use for it.
        thickness_mm: f64,
        /// How the source emits.
        intensity: Intensity,
    },
}

/// How a point source emits: its flux per solid angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Intensity {
    /// The same in every direction.
    #[default]
    Isotropic,
    /// As the cosine of the angle to the bench's axis: a small flat emitter that faces the block.
    Lambertian,
}
