//! The optical bench: how light arrives, what the exit face does to it, and where the receiver stands.

use crate::grid::Extent;
use glam::{DVec2, DVec3};

/// What the structured face does to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExitFace {
    /// Light leaves glass of this refractive index (relative to the medium around it) into that medium.
    Refracts {
        /// Index of the block divided by that of its surroundings; above 1.
        ior: f64,
    },
    /// Light arrives from the receiver's side and is reflected back to it.
    Reflects,
}

impl ExitFace {
    /// The refractive index in front of the face over that behind it: the block's for glass, 1 for a mirror.
    pub fn ior(self) -> f64 {
        match self {
            Self::Refracts { ior } => ior,
            Self::Reflects => 1.0,
        }
    }

    /// The quotient `n_b / n_a` of section 2.2 of the paper: 1/ior for glass, 1 for a mirror.
    pub fn eta(self) -> f64 {
        1.0 / self.ior()
    }
}

/// Why a bench cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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
    /// The index does not bend light, or is not that of a transparent solid.
    #[error("the refractive index is {ior}; it must lie between {} and {} (acrylic 1.49, window glass 1.52)", Bench::IOR_LIMITS.0, Bench::IOR_LIMITS.1)]
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
}

/// A validated bench. See the [frame](crate#frame-units-signs).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bench {
    block: Extent,
    window: Extent,
    window_centre_mm: DVec2,
    distance_mm: f64,
    exit_face: ExitFace,
    light_direction: DVec3,
}

impl Bench {
    /// Accepted sizes of block and window, mm.
    pub const SIZE_LIMITS_MM: (f64, f64) = (1.0, 10_000.0);
    /// Accepted distances from the mean exit plane to the receiver, mm.
    pub const DISTANCE_LIMITS_MM: (f64, f64) = (1.0, 1_000_000.0);
    /// Accepted refractive indices. Below the lower one the relief would be deeper than any block.
    pub const IOR_LIMITS: (f64, f64) = (1.01, 4.0);

    /// A bench with parallel light along the axis and a receiver window as large as the block.
    ///
    /// # Errors
    /// A length or index outside of its limits.
    pub fn new(block: Extent, distance_mm: f64, exit_face: ExitFace) -> Result<Self, BenchError> {
        length("the width of the block", block.width_mm, Self::SIZE_LIMITS_MM)?;
        length("the height of the block", block.height_mm, Self::SIZE_LIMITS_MM)?;
        length("the distance to the receiver", distance_mm, Self::DISTANCE_LIMITS_MM)?;
        let light_direction = match exit_face {
            ExitFace::Refracts { ior } => {
                if !(Self::IOR_LIMITS.0..=Self::IOR_LIMITS.1).contains(&ior) {
                    return Err(BenchError::Index { ior });
                }
                DVec3::Z
            }
            ExitFace::Reflects => DVec3::NEG_Z,
        };
        Ok(Self { block, window: block, window_centre_mm: DVec2::ZERO, distance_mm, exit_face, light_direction })
    }

    /// The same bench with the picture drawn on another part of the receiver.
    ///
    /// # Errors
    /// A size outside of its limits.
    pub fn with_window(mut self, window: Extent, centre_mm: DVec2) -> Result<Self, BenchError> {
        length("the width of the window", window.width_mm, Self::SIZE_LIMITS_MM)?;
        length("the height of the window", window.height_mm, Self::SIZE_LIMITS_MM)?;
        let reach = Self::DISTANCE_LIMITS_MM.1;
        length("the shift of the window along x", centre_mm.x, (-reach, reach))?;
        length("the shift of the window along y", centre_mm.y, (-reach, reach))?;
        self.window = window;
        self.window_centre_mm = centre_mm;
        Ok(self)
    }

    /// The same bench with the light travelling along `direction` as it arrives at the structured face (for a block of
    /// glass: inside of it). Need not be normalised.
    ///
    /// # Errors
    /// A direction that is not finite or does not reach the face from its own side.
    pub fn with_light_direction(mut self, direction: DVec3) -> Result<Self, BenchError> {
        let unit = direction.normalize_or_zero();
        let towards = match self.exit_face {
            ExitFace::Refracts { .. } => unit.z,
            ExitFace::Reflects => -unit.z,
        };
        if !unit.is_finite() || towards.is_nan() || towards < 1e-3 {
            return Err(BenchError::Direction { direction });
        }
        self.light_direction = unit;
        Ok(self)
    }

    /// Size of the exit face.
    pub fn block(&self) -> Extent {
        self.block
    }

    /// Size of the picture on the receiver.
    pub fn window(&self) -> Extent {
        self.window
    }

    /// Centre of the picture on the receiver, mm from the axis of the block.
    pub fn window_centre_mm(&self) -> DVec2 {
        self.window_centre_mm
    }

    /// From the mean exit plane to the receiver, mm.
    pub fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// What the structured face does.
    pub fn exit_face(&self) -> ExitFace {
        self.exit_face
    }

    /// Unit vector along which the light travels as it arrives at the structured face.
    pub fn light_direction(&self) -> DVec3 {
        self.light_direction
    }
}

fn length(what: &'static str, value_mm: f64, (least_mm, greatest_mm): (f64, f64)) -> Result<(), BenchError> {
    if (least_mm..=greatest_mm).contains(&value_mm) {
        Ok(())
    } else {
        Err(BenchError::Length { what, value_mm, least_mm, greatest_mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: Extent = Extent::new(100.0, 80.0);

    #[test]
    fn absurd_benches_are_refused_with_the_value_and_its_limit() {
        for distance in [0.0, -5.0, f64::NAN, f64::INFINITY] {
            let error = Bench::new(BLOCK, distance, ExitFace::Reflects).unwrap_err().to_string();
            assert!(error.contains("distance") && error.contains("between 1 mm"), "{error}");
        }
        for ior in [1.0, 0.5, f64::NAN, 9.0] {
            let error = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior }).unwrap_err();
            assert!(matches!(error, BenchError::Index { .. }));
        }
        let bench = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
        assert!(bench.with_light_direction(DVec3::NEG_Z).is_err());
        assert!(bench.with_light_direction(DVec3::NAN).is_err());
    }
}
