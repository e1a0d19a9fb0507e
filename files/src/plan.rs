//! What a command reads and writes, said and examined before it begins.

use crate::{
    atomic::{self, WriteError},
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

/// Why a command must not begin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A name that cannot be recorded, or that a person would not see as it is.
    #[error(
        "the name {shown} {what}: side files, reports and JSON could not name it as it is; give the file another name"
    )]
    Name {
        /// The name, with what cannot be shown escaped.
        shown: String,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Two outputs would be one file.
    #[error("{} and {} are the same file, and one would replace the other: give one of them another name", first.display(), second.display())]
    Same {
        /// The one.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Two outputs whose names differ in case only.
    #[error(
        "{} and {} differ in upper and lower case only, and many disks take them for one file: give one of them another name",
        first.display(), second.display()
    )]
    Case {
        /// The one.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// An output would replace what is read.
    #[error("writing {} would replace {}, which this command reads: write to another name", output.display(), input.display())]
    Input {
        /// The output.
        output: PathBuf,
        /// The input, which stays as it is.
        input: PathBuf,
    },
    /// An output would replace a file of somebody's own.
    #[error("{} {what}: write to another name, or replace it with --force", path.display())]
    Owned {
        /// The file that stays as it is.
        path: PathBuf,
        /// Why it is not this program's to replace.
        what: &'static str,
    },
    /// A file that cannot be written for another reason.
    #[error(transparent)]
    Write(#[from] WriteError),
}

const FOREIGN: &str = "was not written by glasswarp";
const CHANGED: &str = "has been changed since glasswarp wrote it";
const PROTECTED: &str = "is write-protected";

/// Which file a path means, however it is spelt.
#[derive(Clone, Debug)]
struct Identity {
    /// With every link followed, as far as it is there.
    path: PathBuf,
    /// Device and number: hard links are one file.
    number: Option<(u64, u64)>,
}

impl Identity {
    fn of(path: &Path) -> Self {
        let number = fs::metadata(path).ok().and_then(|found| number(&found));
        Self { path: location(path), number }
    }

    fn is(&self, other: &Self) -> bool {
        (self.number.is_some() && self.number == other.number)
            || (!self.path.as_os_str().is_empty() && self.path == other.path)
    }

    fn differs_in_case_only(&self, other: &Self) -> bool {
        let folded = |identity: &Self| identity.path.to_string_lossy().to_lowercase();
        self.path != other.path && folded(self) == folded(other)
    }
}

/// Where a file lies or will lie, with every link followed; nothing if there is no such place.
pub(crate) fn location(path: &Path) -> PathBuf {
    let location = path.canonicalize().ok().or_else(|| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    });
    location.unwrap_or_default()
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

/// The files that a command reads, and all that it will write.
#[derive(Clone, Debug, Default)]
#[must_use = "a plan holds once it is approved"]
pub struct Plan {
    inputs: Vec<PathBuf>,
    outputs: Vec<PathBuf>,
    force: bool,
}

/// What an approved plan lets be written.
struct Guard {
    inputs: Vec<(Identity, PathBuf)>,
    force: bool,
    /// Files that were there and may be replaced, as they were.
    examined: HashMap<PathBuf, Stamp>,
}

/// Length and time of the last change: a file that keeps them has not been touched since it was examined.
pub(crate) type Stamp = (u64, Option<SystemTime>);

static GUARD: Mutex<Option<Guard>> = Mutex::new(None);

fn guard() -> MutexGuard<'static, Option<Guard>> {
    GUARD.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(crate) fn stamp(path: &Path) -> Option<Stamp> {
    fs::metadata(path).ok().map(|found| (found.len(), found.modified().ok()))
}

impl Plan {
    /// A plan that replaces files of others only with `force`. Inputs are never replaced.
    pub fn new(force: bool) -> Self {
        Self { force, ..Self::default() }
    }

    /// Adds a file that is read.
    pub fn reads(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Adds a file that will be written.
    pub fn writes(mut self, path: impl Into<PathBuf>) -> Self {
        self.outputs.push(path.into());
        self
    }

    /// Examines the plan. From then on files are recorded, and files that were not foreseen here are held to the same rule as
    /// they are written.
    ///
    /// # Errors
    /// The first output that must not or cannot be written; nothing has been touched then.
    pub fn approve(self) -> Result<(), PlanError> {
        self.inputs.iter().chain(&self.outputs).try_for_each(|path| check_name(path))?;
        let inputs: Vec<(Identity, PathBuf)> =
            self.inputs.into_iter().map(|path| (Identity::of(&path), path)).collect();
        let mut outputs: Vec<(Identity, &PathBuf)> = Vec::new();
        for path in &self.outputs {
            let identity = Identity::of(path);
            if let Some((_, input)) = inputs.iter().find(|(input, _)| input.is(&identity)) {
                return Err(PlanError::Input { output: path.clone(), input: input.clone() });
            }
            for (other, first) in &outputs {
                let (first, second) = ((*first).clone(), path.clone());
                if other.is(&identity) {
                    return Err(PlanError::Same { first, second });
                }
                if other.differs_in_case_only(&identity) {
                    return Err(PlanError::Case { first, second });
                }
            }
            outputs.push((identity, path));
        }
        let mut examined = HashMap::new();
        for (identity, path) in outputs {
            atomic::probe(path)?;
            if let Some(stamp) = stamp(path) {
                if !self.force {
                    check_owner(path, &identity.path)?;
                }
                examined.insert(identity.path, stamp);
            }
        }
        *guard() = Some(Guard { inputs, force: self.force, examined });
        Ok(())
    }
}

/// Names go into side files, JSON and pages, and come back from there.
fn check_name(path: &Path) -> Result<(), PlanError> {
    let what = match path.to_str() {
        None => "is no UTF-8",
        Some(text) if text.chars().any(char::is_control) => "holds a line break or another control character",
        Some(_) => return Ok(()),
    };
    Err(PlanError::Name { shown: format!("{path:?}"), what })
}

/// Refuses to replace a file of somebody's own; `target` is where it really lies.
fn check_owner(path: &Path, target: &Path) -> Result<(), PlanError> {
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
