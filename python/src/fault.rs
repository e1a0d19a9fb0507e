//! Failures of the library as exceptions of the package, which makes them of plain words.

use clap::error::ContextKind;
use glasswarp::{cli, failure::Failure, record::document::FaultKind};
use pyo3::{call::PyCallArgs, prelude::*};

fn by_package<'py>(py: Python<'py>, maker: &str, words: impl PyCallArgs<'py>) -> PyErr {
    let exception = py.import("glasswarp._errors").and_then(|errors| errors.getattr(maker)?.call1(words));
    exception.map_or_else(|error| error, PyErr::from_value)
}

/// The exception of a failure.
pub(crate) fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    let fault = cli::fault(failure);
    let kind = match fault.kind {
        FaultKind::File => "file",
        FaultKind::Refused => "refused",
        FaultKind::FellShort => "fell-short",
        FaultKind::InvalidMesh => "invalid-mesh",
    };
    by_package(py, "exception_of", (kind, fault.message, fault.causes))
}

/// A request that makes no sense.
pub(crate) fn refused(py: Python<'_>, message: String) -> PyErr {
    raised(py, &Failure::Usage(message))
}

/// Words that are no command, or a value that is none of its setting.
pub(crate) fn misused(py: Python<'_>, error: &clap::Error) -> PyErr {
    let of = |kind| error.get(kind).map(ToString::to_string);
    let (flag, value) = (of(ContextKind::InvalidArg), of(ContextKind::InvalidValue));
    by_package(py, "misuse_of", (error.to_string(), flag, value))
}
