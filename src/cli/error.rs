use super::{json, remedies::Advised};
use glasswarp::export::ExportError;
use std::{error::Error, io, path::Path};

/// A limit of an error, as a person writes it: one that could hold.
pub(crate) fn error_limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit.is_finite() && limit >= 0.0 => Ok(limit),
        Ok(limit) => Err(format!("a limit of {limit} says nothing; it must be a number from 0 up")),
        Err(_) => Err(format!("'{text}' is no number")),
    }
}

/// What ends a command early. The kind decides the exit code.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// A file could not be written.
    #[error(transparent)]
    Write(Box<dyn Error + Send + Sync>),
    /// A file could not be read, or something broke inside.
    #[error("{what}")]
    Io {
        what: String,
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
    /// A check or verification fell short of what was asked.
    #[error("{0}")]
    FellShort(String),
    /// The mesh is no closed, oriented solid.
    #[error("{what}")]
    InvalidMesh {
        what: String,
        #[source]
        source: Option<Box<dyn Error + Send + Sync>>,
    },
}

impl Failure {
    pub(crate) fn reading(path: &Path, source: io::Error) -> Self {
        Self::Io { what: format!("{} cannot be read", path.display()), source: source.into() }
    }

    pub(crate) fn writing(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Write(error.into())
    }

    pub(crate) fn refused(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Refused(Advised::by_flag(error.into()))
    }

    /// An export that failed: the disk's fault or the request's.
    pub(crate) fn exporting(error: ExportError) -> Self {
        match error {
            ExportError::Write(error) => Self::writing(error),
            refused => Self::refused(refused),
        }
    }

    /// Fails if a relative RMS error exceeds the limit that the user set with --max-error; `which` names it.
    pub(crate) fn unless_within(limit: Option<f64>, error: f64, which: &str, when: &str) -> Result<(), Self> {
        match limit {
            Some(limit) if error.is_nan() || error > limit => Err(Self::FellShort(format!(
                "{which} relative RMS error is {error:.4}{when}, above the limit of {limit} (--max-error)"
            ))),
            _ => Ok(()),
        }
    }

    /// The exit code: 1 input, output or internal, 2 usage, 3 fell short, 4 mesh.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Io { .. } | Self::Write(_) | Self::Unreadable(_) => 1,
            Self::Usage(_) | Self::Refused(_) => 2,
            Self::FellShort(_) => 3,
            Self::InvalidMesh { .. } => 4,
        }
    }

    /// The kind, for programs.
    pub(crate) fn kind(&self) -> json::FaultKind {
        match self {
            Self::Io { .. } | Self::Write(_) | Self::Unreadable(_) => json::FaultKind::File,
            Self::Usage(_) | Self::Refused(_) => json::FaultKind::Refused,
            Self::FellShort(_) => json::FaultKind::FellShort,
            Self::InvalidMesh { .. } => json::FaultKind::InvalidMesh,
        }
    }

    /// Why it happened, the nearest cause first.
    pub(crate) fn causes(&self) -> Vec<String> {
        let mut causes = Vec::new();
        let mut cause = self.source();
        while let Some(error) = cause {
            causes.push(error.to_string());
            cause = error.source();
        }
        causes
    }

    /// The same failure with more to read after its own words, such as the places that it speaks of.
    pub(crate) fn with_places(self, places: &str) -> Self {
        match self {
            Self::Usage(what) => Self::Usage(what + places),
            Self::Refused(error) if !places.is_empty() => Self::Usage(format!("{error}{places}")),
            other => other,
        }
    }
}
