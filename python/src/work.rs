//! Work of the library on a thread of its own, with the interpreter free meanwhile: the thread that
//! asked hears signals, and tells Python how far the work is.

use glasswarp::solver::Event;
use pyo3::{exceptions::PyRuntimeError, prelude::*};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{
    collections::VecDeque,
    ops::ControlFlow,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

/// How often signals are looked for, and Python is told.
const OFTEN: Duration = Duration::from_millis(20);

/// What is told, and whether the work shall end.
pub(crate) struct Watch {
    cancelled: AtomicBool,
    /// Stage, steps done, of how many: one entry for every stage that Python has not heard of.
    said: Mutex<VecDeque<(String, usize, usize)>>,
    ended: Mutex<bool>,
    end: Condvar,
    began: Instant,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watch {
    fn new() -> Self {
        Self {
            cancelled: AtomicBool::new(false),
            said: Mutex::default(),
            ended: Mutex::new(false),
            end: Condvar::new(),
            began: Instant::now(),
        }
    }

    /// Hears what the library tells, and says whether to go on.
    pub(crate) fn hear(&self, event: Event<'_>) -> ControlFlow<()> {
        match event {
            Event::Stage { name, steps } => held(&self.said).push_back((name.to_owned(), 0, steps)),
            Event::Step { done } => {
                if let Some(last) = held(&self.said).back_mut() {
                    last.1 = done;
                }
            }
            _ => {}
        }
        if self.goes_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// Whether somebody still waits for the result.
    pub(crate) fn goes_on(&self) -> bool {
        !self.cancelled.load(Ordering::Relaxed)
    }

    /// What has not been told yet; the last stage stays, for it goes on.
    fn news(&self) -> Vec<(String, usize, usize)> {
        let mut said = held(&self.said);
        let news = said.iter().cloned().collect();
        let gone = said.len().saturating_sub(1);
        said.drain(..gone);
        news
    }

    /// Waits for the end of the work, and tells Python how far it is. Whatever is raised meanwhile
    /// cancels it.
    fn wait(&self, py: Python<'_>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let mut told = None;
        loop {
            let ended = py.detach(|| self.has_ended_within(OFTEN));
            if let Err(error) = py.check_signals().and_then(|()| self.tell(progress, &mut told)) {
                self.cancelled.store(true, Ordering::Relaxed);
                return Err(error);
            }
            if ended {
                return Ok(());
            }
        }
    }

    fn tell(&self, progress: Option<&Bound<'_, PyAny>>, told: &mut Option<(String, usize, usize)>) -> PyResult<()> {
        let Some(progress) = progress else { return Ok(()) };
        for news in self.news() {
            if told.as_ref() != Some(&news) {
                progress.call1(news.clone())?;
                *told = Some(news);
            }
        }
        Ok(())
    }

    fn has_ended_within(&self, time: Duration) -> bool {
        let ended = held(&self.ended);
        *self.end.wait_timeout_while(ended, time, |ended| !*ended).unwrap_or_else(PoisonError::into_inner).0
    }
}

impl glasswarp::solver::Progress for Watch {
    fn report(&self, event: Event<'_>) -> ControlFlow<()> {
        self.hear(event)
    }

    fn clock(&self) -> Duration {
        self.began.elapsed()
    }
}

/// Tells that the work has ended, however it ended.
struct Ends<'a>(&'a Watch);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        *held(&self.0.ended) = true;
        self.0.end.notify_all();
    }
}

/// Threads for one call. A thread that waits for a part of its own work takes up what else its pool has
/// to do: of one pool for all, a call would wait for another, and for ever if that waits for a lock which
/// it holds. A process that was forked has none of its parent's threads either.
fn pool() -> PyResult<ThreadPool> {
    ThreadPoolBuilder::new().build().map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

/// Does work while the interpreter is free. `progress` is called with the name of a stage, the steps
/// done, and how many there are. A signal, or an exception of `progress`, ends the call at once; the
/// work ends where it next asks its [`Watch`], and nobody hears of it.
///
/// # Errors
/// What the signal or `progress` raised.
pub(crate) fn done<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Arc<Watch>) -> T + Send + 'static,
) -> PyResult<T> {
    let (watch, pool) = (Arc::new(Watch::new()), pool()?);
    let worker = thread::Builder::new().spawn({
        let watch = Arc::clone(&watch);
        move || at_work(&pool, &watch, work)
    })?;
    watch.wait(py, progress)?;
    py.detach(|| worker.join()).map_err(|_| broken())
}

/// The same for work with what Python has lent, which ends before the call does: it must ask its
/// [`Watch`] often.
///
/// # Errors
/// What a signal raised.
pub(crate) fn done_within<T: Send>(py: Python<'_>, work: impl FnOnce(Arc<Watch>) -> T + Send) -> PyResult<T> {
    let (watch, pool) = (Arc::new(Watch::new()), pool()?);
    thread::scope(|scope| {
        let worker = thread::Builder::new().spawn_scoped(scope, {
            let watch = Arc::clone(&watch);
            move || at_work(&pool, &watch, work)
        })?;
        let waited = watch.wait(py, None);
        let outcome = py.detach(|| worker.join());
        waited.and_then(|()| outcome.map_err(|_| broken()))
    })
}

fn at_work<T: Send>(pool: &ThreadPool, watch: &Arc<Watch>, work: impl FnOnce(Arc<Watch>) -> T + Send) -> T {
    let _ends = Ends(watch);
    pool.install(|| work(Arc::clone(watch)))
}

fn broken() -> PyErr {
    PyRuntimeError::new_err("glasswarp has broken inside: this is a fault of it, please report it")
}
