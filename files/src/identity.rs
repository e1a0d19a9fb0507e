//! Which file a path means, and whether it has been touched.

use std::{
    fs,
    path::{Path, PathBuf},
    time::SystemTime,
};

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
        Self { path: location(path), number }
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

/// Length and time of the last change: a file that keeps them has not been touched since it was
/// examined.
pub(crate) type Stamp = (u64, Option<SystemTime>);

pub(crate) fn stamp(path: &Path) -> Option<Stamp> {
    fs::metadata(path).ok().map(|found| (found.len(), found.modified().ok()))
}
