//! Photons: a stochastic estimate that knows its own error, in parts that can be computed anywhere
//! and added up.

mod agreement;
mod file;
mod plan;
mod shoot;
mod sobol;
mod tally;

pub use agreement::{PhotonAgreement, UnbiasedError};
pub use file::TallyError;
pub use plan::{PhotonError, PhotonPlan};
pub use shoot::photons;
pub use tally::PhotonTally;
