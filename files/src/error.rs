//! Why a file is not written, and why a command must not begin.

use std::{io, path::PathBuf};

/// Why a file could not be written. Nothing is left behind, and what stood there before still does.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The path names no file.
    #[error("{} is not the name of a file to write", path.display())]
    NoFile {
        /// The path.
        path: PathBuf,
    },
    /// There is no such folder.
    #[error("cannot write {}: the folder {} does not exist", path.display(), folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The folder takes no new files.
    #[error("cannot write {}: the folder {} takes no new file: {source}", path.display(), folder.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not this program's to replace.
    #[error("{refusal}")]
    Refused {
        /// Why.
        refusal: Box<PlanError>,
    },
    /// Writing failed on the way: a full disk, for instance.
    #[error("writing {} failed: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Why a command must not begin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The command was cancelled before the file was written.
    #[error("{} is not written: the command was cancelled", path.display())]
    Unwanted {
        /// The file.
        path: PathBuf,
    },
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
