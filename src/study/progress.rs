//! Telling how far a study is, and ending one that was cancelled.

use crate::{
    failure::Failure,
    solver::{Event, Progress},
};

/// A stage of so many steps begins.
pub(super) fn begin(progress: &dyn Progress, name: &str, steps: usize) -> Result<(), Failure> {
    progress.tell(Event::Stage { name, steps }).map_err(Failure::refused)
}

/// So many steps of it are done.
pub(super) fn advance(progress: &dyn Progress, done: usize) -> Result<(), Failure> {
    progress.tell(Event::Step { done }).map_err(Failure::refused)
}
