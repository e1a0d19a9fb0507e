//! Numbers encoded for a screen, and light.

/// How the numbers in a picture become light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// Numbers are encoded for a screen (IEC 61966-2-1); the wall looks like the picture on that
    /// screen.
    Srgb,
    /// Numbers are light already.
    Linear,
}

impl Transfer {
    /// Light of an encoded value, both on a 0..1 scale.
    pub fn to_linear(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Srgb if value <= 0.04045 => value / 12.92,
            Self::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    }

    /// The inverse of [`to_linear`](Self::to_linear).
    pub fn from_linear(self, light: f64) -> f64 {
        match self {
            Self::Linear => light,
            Self::Srgb if light <= 0.003_130_8 => light * 12.92,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
        }
    }
}
