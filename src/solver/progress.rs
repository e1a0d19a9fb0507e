use super::SolveError;
use std::{ops::ControlFlow, time::Duration};

/// What a solver tells while it works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A new stage begins.
    Stage {
        /// What it is called, for people.
        name: &'a str,
        /// How many steps it has.
        steps: usize,
    },
    /// Steps of the stage are done.
    Step {
        /// How many, of all.
        done: usize,
    },
    /// An iteration within a step begins, also one of a linear system.
    Iteration,
}

/// Watches a long computation, and may end it. Calls come from the thread that started it.
pub trait Progress {
    /// Hears what happens, and says whether to go on. Solvers ask at every iteration, also of their
    /// linear systems, and end with [`SolveError::Cancelled`] where the answer is
    /// [`ControlFlow::Break`]. It needs no thread: a caller with a clock or a flag of its own
    /// answers by that.
    fn report(&self, event: Event<'_>) -> ControlFlow<()>;

    /// Time since any fixed moment, by the caller's clock: solvers have none, and time the levels
    /// of their [`Summary`](crate::optim::Summary) by this one. Where it stands still, as by
    /// default, their times are 0.
    fn clock(&self) -> Duration {
        Duration::ZERO
    }
}

impl dyn Progress + '_ {
    /// Tells what happens, and ends a computation that was cancelled.
    ///
    /// # Errors
    /// [`SolveError::Cancelled`].
    pub(crate) fn tell(&self, event: Event<'_>) -> Result<(), SolveError> {
        if self.report(event).is_break() { Err(SolveError::Cancelled) } else { Ok(()) }
    }
}

/// Watches nothing, and always goes on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _event: Event<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
