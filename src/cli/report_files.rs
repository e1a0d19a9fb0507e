//! The report of a command: where it lies, and what it says of the files and of the command itself.

use super::{
    console,
    machine::has_extension,
    side_files::{file_name, hash_of},
};
use crate::{export::write_atomically, failure::Failure, report::FileRecord};
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

/// Where the report goes, if anywhere: beside the first output unless it is named.
pub(super) fn path(named: Option<&Path>, off: bool, first: &Path) -> Result<Option<PathBuf>, Failure> {
    if off {
        return Ok(None);
    }
    let path = named.map_or_else(|| first.with_extension("report.html"), Path::to_path_buf);
    if !(has_extension(&path, "html") || has_extension(&path, "htm")) {
        return Err(Failure::Usage(format!("{}: the report is a page of HTML, name it .html", path.display())));
    }
    Ok(Some(path))
}

/// Writes a page. The file appears whole or not at all.
pub(super) fn write(path: &Path, page: &str) -> Result<(), Failure> {
    write_atomically(path, |out| out.write_all(page.as_bytes())).map_err(Failure::writing)
}

/// The command as it was given, for a shell.
pub(super) fn command() -> String {
    let quoted = |argument: std::ffi::OsString| {
        let text = argument.to_string_lossy().into_owned();
        shlex::try_quote(&text).map_or_else(|_| text.clone(), std::borrow::Cow::into_owned)
    };
    std::iter::once("glasswarp".to_owned())
        .chain(console::words().into_iter().map(quoted))
        .collect::<Vec<_>>()
        .join(" ")
}

/// A file, with its hash if that is known.
pub(super) fn file_record(path: &Path, sha256: Option<String>) -> Result<FileRecord, Failure> {
    let failed = |source| Failure::reading(path, source);
    let bytes = std::fs::metadata(path).map_err(failed)?.len();
    let sha256 = sha256.map_or_else(|| hash_of(path), Ok)?;
    Ok(FileRecord::new(file_name(path), bytes, sha256))
}
