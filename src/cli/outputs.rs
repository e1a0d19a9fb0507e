//! What a command reads and writes, said before it begins: the one place that decides what may be
//! written over.

use super::console;
use crate::{failure::Failure, solver::Event};
use glasswarp_files::{Plan, PlanError};
use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

/// Waits until no other command of this process is at work: a plan holds for all of it.
pub(super) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

static FORCE: AtomicBool = AtomicBool::new(false);

/// Lets files of others be replaced (`--force`).
pub(crate) fn force(force: bool) {
    FORCE.store(force, Ordering::Relaxed);
}

/// Examines the files of a command: its inputs, and everything that it will write. Nothing has been
/// touched if it is refused.
///
/// # Errors
/// An output over an input or over a file of somebody's own, two outputs that are one file, a name
/// that cannot be recorded, a place that takes no file.
pub(crate) fn plan<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = PathBuf>,
) -> Result<(), Failure> {
    let caller = console::caller();
    plan_while(
        move || caller.as_ref().is_none_or(|caller| caller.report(Event::Iteration).is_continue()),
        inputs,
        outputs,
    )
}

/// The same for files that are written only as long as they are `wanted`.
///
/// # Errors
/// Those of [`plan`].
pub(super) fn plan_while<'a>(
    wanted: impl Fn() -> bool + Send + Sync + 'static,
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = PathBuf>,
) -> Result<(), Failure> {
    let plan = Plan::new(FORCE.load(Ordering::Relaxed)).as_long_as(wanted);
    let plan = inputs.into_iter().fold(plan, Plan::reads);
    let plan = outputs.into_iter().fold(plan, Plan::writes);
    plan.approve().map_err(|error| match error {
        PlanError::Write(error) => Failure::writing(error),
        refused => Failure::refused(refused),
    })
}
