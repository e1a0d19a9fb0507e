//! A picture as its decoder leaves it.

/// The numbers, pixel by pixel, row 0 on top as it is stored.
pub(super) enum Samples {
    Bits8(Vec<u8>),
    Bits16(Vec<u16>),
    /// Between 0 and 1.
    Float(Vec<f32>),
}

/// What mixes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inks {
    Grey,
    Rgb,
    /// 1 is all of an ink.
    Cmyk,
}

impl Inks {
    pub(super) fn count(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb => 3,
            Self::Cmyk => 4,
        }
    }
}

/// The last channel, if it is not colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    None,
    Straight,
    /// The colours, as they are stored, have been multiplied by it.
    Premultiplied,
}

pub(super) struct Raster {
    pub(super) nx: usize,
    pub(super) ny: usize,
    pub(super) inks: Inks,
    pub(super) alpha: Alpha,
    pub(super) samples: Samples,
}

impl Raster {
    pub(super) fn channels(&self) -> usize {
        self.inks.count() + usize::from(self.alpha != Alpha::None)
    }

    /// Whether there are as many samples as pixels ask for.
    pub(super) fn is_whole(&self) -> bool {
        let held = match &self.samples {
            Samples::Bits8(samples) => samples.len(),
            Samples::Bits16(samples) => samples.len(),
            Samples::Float(samples) => samples.len(),
        };
        held == self.nx * self.ny * self.channels()
    }
}
