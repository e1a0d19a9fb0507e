/// What the structured face does to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExitFace {
    /// Light leaves glass of this refractive index (relative to the medium around it) into that
    /// medium.
    Refracts {
        /// Index of the block divided by that of its surroundings; above 1.
        ior: f64,
    },
    /// Light arrives from the receiver's side and is reflected back to it.
    Reflects,
}

impl ExitFace {
    /// The refractive index in front of the face over that behind it: the block's for glass, 1 for
    /// a mirror.
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
