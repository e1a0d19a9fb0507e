//! Optimisation that knows nothing of caustics: minimisers, what a run did, and how it ended.

mod conjugate_gradients;
mod gradient_check;
mod line_search;
mod summary;
mod vector;

pub use conjugate_gradients::{Objective, OptionError, Options, Outcome, minimise};
pub use gradient_check::{GradientCheck, check_gradient};
pub use summary::{Iteration, Level, Summary, Termination};
