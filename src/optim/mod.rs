//! Optimisation that knows nothing of caustics: minimisers, what a run did, and how it ended.

mod conjugate_gradients;
#[cfg(test)]
mod gradient_check;
mod line_search;
mod summary;
mod vector;

pub use conjugate_gradients::{MinimiserOptions, Objective, OptionError, Outcome, minimise};
pub use summary::{Iteration, Level, Summary, Termination};

#[cfg(test)]
pub(crate) use gradient_check::check_gradient;
