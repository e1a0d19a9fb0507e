use crate::block::Block;
use glam::DVec3;
use std::{fmt, sync::Arc};

/// A block that stands before the one that is looked at, in its own frame. Two are the same if they
/// stand alike and their heights are the same bits.
#[derive(Clone)]
pub struct Standing {
    /// The block.
    pub block: Arc<Block>,
    /// Its refractive index.
    pub ior: f64,
    /// The air from its mean exit plane to the entry face of the next block, mm.
    pub gap_mm: f64,
    /// How it stands beside its place.
    pub displaced: Displacement,
}

/// How a block stands beside its place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Displacement {
    /// By how much it is moved, mm.
    pub shift_mm: DVec3,
    /// How it is turned about the centre of its mean exit plane: a rotation vector, radians.
    pub turned: DVec3,
}

impl Standing {
    /// A number that blocks of other heights have not, but by chance (FNV-1a).
    fn fingerprint(&self) -> u64 {
        let numbers = self.block.heights_mm().iter().copied().chain([self.block.entry_z_mm()]);
        numbers.map(f64::to_bits).fold(0xcbf2_9ce4_8422_2325, |hash, bits| (hash ^ bits).wrapping_mul(0x100_0000_01b3))
    }
}

impl PartialEq for Standing {
    fn eq(&self, other: &Self) -> bool {
        (self.ior, self.gap_mm, self.displaced) == (other.ior, other.gap_mm, other.displaced)
            && (Arc::ptr_eq(&self.block, &other.block) || self.fingerprint() == other.fingerprint())
    }
}

/// Without its heights, which are millions.
impl fmt::Debug for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Standing")
            .field("block", &format_args!("{:016x}", self.fingerprint()))
            .field("ior", &self.ior)
            .field("gap_mm", &self.gap_mm)
            .field("displaced", &self.displaced)
            .finish()
    }
}
