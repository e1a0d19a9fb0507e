//! What ends a study early: one error for files, requests, thresholds and meshes.

mod remedies;

use crate::{export::ExportError, irradiance::PictureError};
use remedies::Advised;
use std::{error::Error, io, path::Path};

/// What ends a study, or a command, early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// A file could not be written.
    #[error(transparent)]
    Write(Box<dyn Error + Send + Sync>),
    /// A file could not be read, or something broke inside.
    #[error("{what}")]
    Io {
        /// What could not be done.
        what: String,
        /// Why.
        #[source]
        source: Box<dyn Error + Send + Sync>,
    },
    /// A file holds what cannot be used: all that there is to say.
    #[error("{0}")]
    Unreadable(String),
    /// The request makes no sense, or physics forbids it.
    #[error("{0}")]
    Usage(String),
    /// The request makes no sense, or physics forbids it: the library's own words.
    #[error(transparent)]
    Refused(Box<dyn Error + Send + Sync>),
    /// A check or verification found less than what was asked for.
    #[error("{0}")]
    BelowThreshold(String),
    /// The mesh is no closed, oriented solid.
    #[error("{what}")]
    InvalidMesh {
        /// Which, and what is wrong with it.
        what: String,
        /// Why, where there is more to say.
        #[source]
        source: Option<Box<dyn Error + Send + Sync>>,
    },
}

impl Failure {
    /// A file that cannot be read.
    pub fn reading(path: &Path, source: io::Error) -> Self {
        Self::Io { what: format!("{} cannot be read", path.display()), source: source.into() }
    }

    /// A file that cannot be written.
    pub fn writing(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Write(error.into())
    }

    /// A request that another part of the library refuses.
    pub fn refused(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Refused(Advised::by_setting(error.into()))
    }

    /// An export that failed: the disk's fault or the request's.
    pub fn exporting(error: ExportError) -> Self {
        match error {
            ExportError::Write(error) => Self::writing(error),
            refused => Self::refused(refused),
        }
    }

    /// A picture that cannot be read, or that makes no target.
    pub fn of_picture(path: &Path, error: PictureError) -> Self {
        match error {
            PictureError::Io(error) => Self::reading(path, error),
            error if error.is_of_the_file() => {
                let why = remedies::in_words(&error);
                Self::Unreadable(format!("{} is not a readable picture: {why}", path.display()))
            }
            refused => Self::refused(refused),
        }
    }

    /// Why it happened, the nearest cause first.
    pub fn causes(&self) -> Vec<String> {
        let mut causes = Vec::new();
        let mut cause = self.source();
        while let Some(error) = cause {
            causes.push(error.to_string());
            cause = error.source();
        }
        causes
    }

    /// The same failure with more to read after its own words, such as the places that it speaks
    /// of.
    pub fn with_places(self, places: &str) -> Self {
        match self {
            Self::Usage(what) => Self::Usage(what + places),
            Self::Refused(error) if !places.is_empty() => Self::Usage(format!("{error}{places}")),
            other => other,
        }
    }
}
