use super::console::{self, Caller};
use crate::solver::{Event, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::{
    cell::RefCell,
    io::IsTerminal,
    ops::ControlFlow,
    sync::Arc,
    time::{Duration, Instant},
};

/// Progress on standard error: a bar with the time left for each stage, nothing at all off a
/// terminal. Whoever asks from within is told instead, and may end the work.
pub(crate) struct TerminalProgress {
    caller: Option<Arc<dyn Caller>>,
    bar: RefCell<Option<ProgressBar>>,
    began: Instant,
}

impl TerminalProgress {
    pub(crate) fn new() -> Self {
        Self { caller: console::caller(), bar: RefCell::new(None), began: Instant::now() }
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for TerminalProgress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Progress for TerminalProgress {
    fn report(&self, event: Event<'_>) -> ControlFlow<()> {
        if let Some(caller) = &self.caller {
            return caller.report(event);
        }
        match event {
            Event::Stage { name, steps } => self.begin(name, steps),
            Event::Step { done } => self.advance(done),
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn clock(&self) -> Duration {
        self.began.elapsed()
    }
}

impl TerminalProgress {
    pub(crate) fn begin(&self, stage: &str, steps: usize) {
        if let Some(caller) = &self.caller {
            // Whoever wants no more is heard where the work is watched.
            let _ = caller.report(Event::Stage { name: stage, steps });
            return;
        }
        self.finish();
        tracing::debug!(stage, steps, "begins");
        if !std::io::stderr().is_terminal() {
            return;
        }
        let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::stderr_with_hz(10));
        // What has no steps has no end that could be foretold.
        let template = match steps {
            0 => "{msg:<34} {spinner} {elapsed}",
            _ => "{msg:<34} [{bar:30}] {pos}/{len}  {eta} left",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(stage.to_owned());
        bar.enable_steady_tick(Duration::from_millis(500));
        self.bar.replace(Some(bar));
    }

    pub(crate) fn advance(&self, done: usize) {
        if let Some(caller) = &self.caller {
            let _ = caller.report(Event::Step { done });
        }
        if let Some(bar) = self.bar.borrow().as_ref() {
            bar.set_position(done as u64);
        }
    }
}
