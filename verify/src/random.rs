//! Random numbers that depend on nothing but a key and the number of a photon.

use glam::DVec2;
use std::f64::consts::TAU;

/// Random numbers of one photon, besides the two that the net gives it: any number of them, always
/// the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhotonRandom {
    /// Of the replicate.
    pub(crate) key: u64,
    /// Number of the photon.
    pub(crate) photon: u64,
}

/// What a pair of random numbers is for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    Light,
    /// The finish of a face, by its number: that of the exit face of the first block is 0.
    Finish(u32),
}

impl Purpose {
    fn code(self) -> u64 {
        match self {
            Self::Light => 1,
            Self::Finish(face) => 2 + u64::from(face),
        }
    }
}

impl PhotonRandom {
    /// Two independent numbers between 0 and 1, never 0.
    pub(crate) fn pair(&self, purpose: Purpose) -> [f64; 2] {
        let photon = mix(self.key ^ mix(self.photon));
        [0, 1].map(|k| {
            let bits = mix(photon ^ mix(2 * purpose.code() + k));
            ((bits >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        })
    }

    /// Two independent normal deviates (Box and Muller).
    pub(crate) fn normal_pair(&self, purpose: Purpose) -> DVec2 {
        let [u, v] = self.pair(purpose);
        (-2.0 * u.ln()).sqrt() * DVec2::from_angle(TAU * v)
    }
}

/// The finaliser of SplitMix64: a bijection whose output bits all depend on all input bits.
pub(crate) fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
