//! What a command says: to a person on standard output, or to a program as one JSON document;
//! warnings, errors, progress and traces go to standard error either way. Colours only for
//! terminals, and never under NO_COLOR.

use super::outcome::{code, kind, with_flags};
use crate::{
    failure::Failure,
    record::document,
    study::verdict::{Answer, Verdict},
};
use anstyle::{AnsiColor, Style};
use std::{
    fmt,
    io::Write,
    process::ExitCode,
    sync::{Mutex, OnceLock, PoisonError},
};
use tracing_subscriber::{filter::LevelFilter, fmt::format::FmtSpan};

/// Who reads standard output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reader {
    Person,
    Program,
}

static READER: OnceLock<Reader> = OnceLock::new();
static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());
static RESULT: Mutex<Option<document::Result>> = Mutex::new(None);

static DETAILED: OnceLock<bool> = OnceLock::new();

/// Whether a person wants to read more than the few lines that matter most.
pub(crate) fn detailed() -> bool {
    *DETAILED.get().unwrap_or(&false)
}

/// Says whether a block will work, as the first line of all.
pub(crate) fn verdict(verdict: &Verdict) {
    let colour = match verdict.answer() {
        Answer::Yes => AnsiColor::Green,
        Answer::But | Answer::NotAsked => AnsiColor::Yellow,
        Answer::No => AnsiColor::Red,
    };
    line(format_args!("{} {}", coloured("Will it work?", colour), with_flags(&verdict.in_words())));
}

fn reader() -> Reader {
    *READER.get().unwrap_or(&Reader::Person)
}

/// Chooses the reader, and how much is told: 0 what a maker reads, 1 all of it and stages with their times, 2 and 3 more.
pub(crate) fn open(reader: Reader, verbosity: u8) {
    let _ = READER.set(reader);
    let _ = DETAILED.set(verbosity > 0);
    let level = match verbosity {
        0 => return,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let colour = anstream::AutoStream::choice(&std::io::stderr()) != anstream::ColorChoice::Never;
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_span_events(FmtSpan::CLOSE)
        .with_target(verbosity > 1)
        .with_ansi(colour)
        .with_writer(std::io::stderr)
        .with_timer(tracing_subscriber::fmt::time::uptime())
        .init();
}

/// Prints a line for a person. A reader that has gone away, such as `head`, has heard enough.
pub(crate) fn line(text: fmt::Arguments<'_>) {
    if reader() == Reader::Person {
        let _ = writeln!(anstream::stdout(), "{text}");
    }
}

/// Prints lines of the library for a person.
pub(crate) fn text(text: &str) {
    if reader() == Reader::Person {
        let _ = write!(anstream::stdout(), "{}", with_flags(text));
    }
}

/// A line for a person on standard output.
macro_rules! say {
    ($($words:tt)*) => { $crate::cli::console::line(format_args!($($words)*)) };
}

pub(crate) use say;

/// Text in a colour.
pub(crate) fn coloured(text: &str, colour: AnsiColor) -> String {
    let style = Style::new().fg_color(Some(colour.into())).bold();
    format!("{style}{text}{style:#}")
}

/// Warns; of the same thing once, however often it is met.
pub(crate) fn warn(text: impl fmt::Display) {
    let text = with_flags(&text.to_string());
    let mut warnings = WARNINGS.lock().unwrap_or_else(PoisonError::into_inner);
    if !warnings.contains(&text) {
        let _ = writeln!(anstream::stderr(), "{}: {text}", coloured("warning", AnsiColor::Yellow));
        warnings.push(text);
    }
}

/// Tells that a signal has ended the run.
pub(crate) fn interrupted() {
    let _ = writeln!(anstream::stderr(), "\ninterrupted; nothing half-written was left");
}

/// Keeps what a program will read.
pub(crate) fn result(result: document::Result) {
    *RESULT.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
}

/// Tells how the command ended.
pub(crate) fn close(command: &str, done: Result<(), Failure>) -> ExitCode {
    let code = done.as_ref().err().map_or(0, code);
    if let Err(failure) = &done {
        let mut text = format!("{}: {}", coloured("error", AnsiColor::Red), with_flags(&failure.to_string()));
        for cause in failure.causes() {
            text += &format!("\n  because: {}", with_flags(&cause));
        }
        let _ = writeln!(anstream::stderr(), "{text}");
    }
    if reader() == Reader::Program {
        let document = document::Document {
            schema: document::SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            exit_code: code,
            warnings: std::mem::take(&mut *WARNINGS.lock().unwrap_or_else(PoisonError::into_inner)),
            error: done.err().map(|failure| document::Fault {
                kind: kind(&failure),
                message: with_flags(&failure.to_string()),
                causes: failure.causes().iter().map(|cause| with_flags(cause)).collect(),
            }),
            result: RESULT.lock().unwrap_or_else(PoisonError::into_inner).take(),
        };
        match serde_json::to_string_pretty(&document) {
            Ok(text) => drop(writeln!(std::io::stdout(), "{text}")),
            Err(error) => drop(writeln!(std::io::stderr(), "error: the result cannot be written as JSON: {error}")),
        }
    }
    ExitCode::from(code)
}
