//! What the plan that is in force lets be written, file by file.

use crate::{
    error::{PlanError, WriteError},
    record::{self, Known},
};
use std::{
    collections::HashMap,
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::SystemTime,
};

const FOREIGN: &str = "was not written by glasswarp";
const CHANGED: &str = "has been changed since glasswarp wrote it";
const PROTECTED: &str = "is write-protected";

/// Which file a path means, however it is spelt.
#[derive(Clone, Debug)]
pub(crate) struct Identity {
    /// With every link followed, as far as it is there.
    pub(crate) path: PathBuf,
    /// Device and number: hard links are one file.
    number: Option<(u64, u64)>,
}

impl Identity {
    pub(crate) fn of(path: &Path) -> Self {
        let number = fs::metadata(path).ok().and_then(|found| number(&found));
        let path = path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Some(folder.canonicalize().ok()?.join(path.file_name()?))
        });
        Self { path: path.unwrap_or_default(), number }
    }

    pub(crate) fn is(&self, other: &Self) -> bool {
        (self.number.is_some() && self.number == other.number)
            || (!self.path.as_os_str().is_empty() && self.path == other.path)
    }

    pub(crate) fn differs_in_case_only(&self, other: &Self) -> bool {
        let folded = |identity: &Self| identity.path.to_string_lossy().to_lowercase();
        self.path != other.path && folded(self) == folded(other)
    }
}

#[cfg(unix)]
fn number(found: &fs::Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn number(_: &fs::Metadata) -> Option<(u64, u64)> {
    None
}

/// What an approved plan lets be written.
pub(crate) struct Guard {
    pub(crate) inputs: Vec<(Identity, PathBuf)>,
    pub(crate) force: bool,
    /// Files that were there and may be replaced, as they were.
    pub(crate) examined: HashMap<PathBuf, Stamp>,
}

/// Length and time of the last change: a file that keeps them has not been touched since it was examined.
pub(crate) type Stamp = (u64, Option<SystemTime>);

static GUARD: Mutex<Option<Guard>> = Mutex::new(None);

pub(crate) fn guard() -> MutexGuard<'static, Option<Guard>> {
    GUARD.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(crate) fn stamp(path: &Path) -> Option<Stamp> {
    fs::metadata(path).ok().map(|found| (found.len(), found.modified().ok()))
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

/// Whether a file may be written in the place of what is there, by the plan that is in force. Without one everything may.
///
/// # Errors
/// An input, or a file of somebody's own.
pub fn may_replace(path: &Path) -> Result<(), PlanError> {
    let guard = guard();
    let Some(Guard { inputs, force, examined }) = &*guard else { return Ok(()) };
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

/// Records a file that another program has written in the service of this one, if a plan is in force.
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
    if guard().is_none() { Ok(()) } else { record::enter(target, content) }
}
