//! Where the light goes, counted exactly.

/// One ray's power in fixed point. Integers add up to the same sum in any order, so results do not
/// depend on the number of threads, and power is neither lost nor gained by rounding.
pub(crate) const UNIT: u64 = 1 << 32;

/// Where the light of the aperture goes, as parts of it; they sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Flux {
    /// Arrives in the window.
    pub window: f64,
    /// Reaches the receiver outside of the window.
    pub missed: f64,
    /// Is totally reflected inside.
    pub totally_reflected: f64,
    /// Meets a side wall before the exit face or behind it, or the solid again, or never reaches
    /// the receiver.
    pub side: f64,
    /// Is partially reflected on the way.
    pub reflected: f64,
    /// Passes beside the solid.
    pub beside: f64,
    /// Was lost by the tracer: 0, or the solid is not sound.
    pub lost: f64,
}

impl Flux {
    /// The sum of all parts: 1.
    pub fn total(&self) -> f64 {
        self.window + self.missed + self.totally_reflected + self.side + self.reflected + self.beside + self.lost
    }
}

/// Power by fate, in [`UNIT`]s; kept by each thread and added up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PowerTally {
    pub(crate) window: u128,
    pub(crate) missed: u128,
    pub(crate) totally_reflected: u128,
    pub(crate) side: u128,
    pub(crate) reflected: u128,
    pub(crate) beside: u128,
    pub(crate) lost: u128,
}

impl PowerTally {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            window: self.window + other.window,
            missed: self.missed + other.missed,
            totally_reflected: self.totally_reflected + other.totally_reflected,
            side: self.side + other.side,
            reflected: self.reflected + other.reflected,
            beside: self.beside + other.beside,
            lost: self.lost + other.lost,
        }
    }

    /// All power that was sent out.
    pub(crate) fn total(&self) -> u128 {
        self.window + self.missed + self.totally_reflected + self.side + self.reflected + self.beside + self.lost
    }

    /// As parts of all power.
    pub(crate) fn flux(&self) -> Flux {
        let total = self.total().max(1) as f64;
        let part = |units: u128| units as f64 / total;
        Flux {
            window: part(self.window),
            missed: part(self.missed),
            totally_reflected: part(self.totally_reflected),
            side: part(self.side),
            reflected: part(self.reflected),
            beside: part(self.beside),
            lost: part(self.lost),
        }
    }
}
