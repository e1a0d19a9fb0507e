//! Work of the library on a thread of its own, with the interpreter free meanwhile: the thread that
//! asked hears signals, and tells Python how far the work is.

use glasswarp::solver::Event;
use pyo3::{exceptions::PyRuntimeError, prelude::*};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{
    collections::VecDeque,
    mem,
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

/// The threads of this process. A process that was forked has none of its parent's.
fn pool() -> Result<Arc<ThreadPool>, rayon::ThreadPoolBuildError> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = held(&POOL);
    let own = std::process::id();
    if let Some((of, pool)) = &*pool
        && *of == own
    {
        return Ok(Arc::clone(pool));
    }
    let made = Arc::new(ThreadPoolBuilder::new().build()?);
    // What was inherited has no threads that could be ended.
    mem::forget(pool.replace((own, Arc::clone(&made))));
    Ok(made)
}

/// Does work, which a [`Watch`] may end, while the interpreter is free. `progress` is called with the
/// name of a stage, the steps done, and how many there are.
///
/// # Errors
/// What a signal or `progress` raised: then the work was ended.
pub(crate) fn done<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Arc<Watch>) -> T + Send,
) -> PyResult<T> {
    let pool = pool().map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let watch = Arc::new(Watch::new());
    let (theirs, ours) = (Arc::clone(&watch), Arc::clone(&watch));
    let (outcome, raised) = thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let _ends = Ends(&theirs);
            pool.install(|| work(Arc::clone(&theirs)))
        });
        let mut raised = None;
        let mut told = None;
        while !py.detach(|| ours.has_ended_within(OFTEN)) {
            if raised.is_none()
                && let Err(error) = py.check_signals().and_then(|()| tell(progress, &ours, &mut told))
            {
                ours.cancelled.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
        }
        (py.detach(|| worker.join()), raised)
    });
    if let Some(error) = raised {
        return Err(error);
    }
    tell(progress, &watch, &mut None)?;
    outcome.map_err(|_| PyRuntimeError::new_err("glasswarp has broken inside: this is a fault of it, please report it"))
}

fn tell(
    progress: Option<&Bound<'_, PyAny>>,
    watch: &Watch,
    told: &mut Option<(String, usize, usize)>,
) -> PyResult<()> {
    let Some(progress) = progress else { return Ok(()) };
    for news in watch.news() {
        if told.as_ref() != Some(&news) {
            progress.call1(news.clone())?;
            *told = Some(news);
        }
    }
    Ok(())
}
