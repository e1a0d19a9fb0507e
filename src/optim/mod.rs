//! Optimisation that knows nothing of caustics: what a run did, and how it ended.

mod summary;

pub use summary::{Iteration, Level, Summary, Termination};
