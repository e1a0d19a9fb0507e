//! Which photons to trace, and why not.

/// Which photons to trace.
///
/// The photons of a run are cut into [`replicates`](Self::replicates), independent scrambled nets
/// over the aperture. Each depends on nothing but the seed and its own number: shard `s` of `S`
/// traces those with number `s` modulo `S`, on any machine, and merging all shards gives exactly
/// the tally of the whole run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PhotonPlan {
    /// Photons asked for in the whole run; rounded up so that every replicate has a power of two.
    pub photons: u64,
    /// Selects the random numbers.
    pub seed: u64,
    /// Independent samples, at least 2: the spread between them is the standard error.
    pub replicates: u32,
    /// Which part of the run to trace, 0 up to `shards` - 1.
    pub shard: u32,
    /// Number of parts.
    pub shards: u32,
}

impl PhotonPlan {
    /// The whole of a run.
    pub fn new(photons: u64, seed: u64) -> Self {
        Self { photons, seed, replicates: 32, shard: 0, shards: 1 }
    }

    /// The same run in another number of independent samples.
    #[must_use]
    pub fn with_replicates(self, replicates: u32) -> Self {
        Self { replicates, ..self }
    }

    /// Part `shard`, counted from 0, of `shards` parts of the run.
    #[must_use]
    pub fn with_shard(self, shard: u32, shards: u32) -> Self {
        Self { shard, shards, ..self }
    }
}

/// Why photons cannot be traced or tallies not be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PhotonError {
    /// A plan that makes no sense.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Plan {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: u64,
        /// Least accepted value.
        least: u64,
        /// Greatest accepted value.
        greatest: u64,
    },
    /// Parts of different runs.
    #[error("the tallies belong to different runs: they differ in {0}")]
    Different(&'static str),
    /// A part counted twice.
    #[error("replicate {0} is in both tallies")]
    Twice(u32),
}
