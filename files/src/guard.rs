//! What the plan that is in force lets be written, file by file.

use crate::{
    error::{PlanError, WriteError},
    identity::{Identity, Stamp, stamp},
    record::{self, Known},
};
use std::{
    collections::HashMap,
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

const FOREIGN: &str = "was not written by glasswarp";
const CHANGED: &str = "has been changed since glasswarp wrote it";
const PROTECTED: &str = "is write-protected";

/// Says whether anybody still waits for what is written.
pub(crate) type Wanted = Arc<dyn Fn() -> bool + Send + Sync>;

/// What an approved plan lets be written.
pub(crate) struct Guard {
    pub(crate) inputs: Vec<(Identity, PathBuf)>,
    pub(crate) force: bool,
    /// Files that were there and may be replaced, as they were.
    pub(crate) examined: HashMap<PathBuf, Stamp>,
    /// Whether anybody still waits for the files.
    pub(crate) wanted: Option<Wanted>,
}

impl Guard {
    fn is_wanted(&self) -> bool {
        self.wanted.as_ref().is_none_or(|wanted| wanted())
    }
}

static GUARD: Mutex<Option<Guard>> = Mutex::new(None);

pub(crate) fn guard() -> MutexGuard<'static, Option<Guard>> {
    GUARD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Refuses to replace a file of somebody's own; `target` is where it really lies.
pub(crate) fn check_owner(path: &Path, target: &Path) -> Result<(), PlanError> {
    let owned = |what| PlanError::Owned { path: path.into(), what };
    let failed = |source: io::Error| PlanError::Write(WriteError::Io { path: path.into(), source });
    let found = match fs::metadata(target) {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(error)),
    };
    match record::look_up(target).map_err(failed)? {
        Known::Foreign => Err(owned(FOREIGN)),
        Known::Changed => Err(owned(CHANGED)),
        Known::Own if found.permissions().readonly() => Err(owned(PROTECTED)),
        Known::Own => Ok(()),
    }
}

/// Whether a file may be written in the place of what is there, by the plan that is in force.
/// Without one everything may.
///
/// # Errors
/// An input, or a file of somebody's own.
pub fn may_replace(path: &Path) -> Result<(), PlanError> {
    let guard = guard();
    let Some(in_force) = &*guard else { return Ok(()) };
    if !in_force.is_wanted() {
        return Err(PlanError::Unwanted { path: path.into() });
    }
    let Guard { inputs, force, examined, .. } = in_force;
    let identity = Identity::of(path);
    if let Some((_, input)) = inputs.iter().find(|(input, _)| input.is(&identity)) {
        return Err(PlanError::Input { output: path.into(), input: input.clone() });
    }
    let now = stamp(path);
    if *force || now.is_none() || examined.get(&identity.path) == now.as_ref() {
        return Ok(());
    }
    check_owner(path, &identity.path)
}

/// Records a file that another program has written in the service of this one, if a plan is in
/// force.
///
/// # Errors
/// A file that cannot be read, a record that cannot be written.
pub fn enter(path: &Path) -> Result<(), WriteError> {
    let failed = |source| WriteError::Io { path: path.into(), source };
    let target = path.canonicalize().map_err(failed)?;
    about_to_take(&target, &target).map_err(failed)
}

/// Records that `target` will have the content of `content`, if a plan is in force.
pub(crate) fn about_to_take(target: &Path, content: &Path) -> io::Result<()> {
    match &*guard() {
        None => return Ok(()),
        Some(in_force) if !in_force.is_wanted() => return Err(ErrorKind::Interrupted.into()),
        Some(_) => {}
    }
    record::enter(target, content)
}
