//! What a command says: to a person on standard output, or to a program as one JSON document;
//! warnings, errors, progress and traces go to standard error either way. Colours only for
//! terminals, and never under NO_COLOR. A [`Caller`] within the same process is told everything, and
//! nothing is printed.

use super::outcome::{code, kind, with_flags};
use crate::{
    failure::Failure,
    record::document,
    solver::Event,
    study::verdict::{Answer, Verdict},
};
use anstyle::{AnsiColor, Style};
use glasswarp_verify::Image;
use std::{
    ffi::OsString,
    fmt,
    io::Write,
    ops::ControlFlow,
    sync::{Arc, Mutex, PoisonError, RwLock},
};
use tracing_subscriber::{filter::LevelFilter, fmt::format::FmtSpan};

/// Who asks from within the process of the command, such as a module of Python.
pub trait Caller: Send + Sync {
    /// Hears how far the work is, and says whether to go on.
    fn report(&self, event: Event<'_>) -> ControlFlow<()>;

    /// Is shown light on the receiver: irradiance, by the name of what it is.
    fn light(&self, name: &str, image: &Image);
}

/// Who is told what a command says.
#[derive(Clone)]
pub(crate) enum Reader {
    /// Whoever reads standard output.
    Person,
    /// What reads it as one JSON document.
    Program,
    /// Whoever asks from within.
    Caller(Arc<dyn Caller>),
}

/// The command that runs; there is one at a time.
struct Session {
    reader: Reader,
    /// Its words, after the program's own name.
    words: Vec<OsString>,
    detailed: bool,
    warnings: Mutex<Vec<String>>,
    result: Mutex<Option<document::Result>>,
}

static SESSION: RwLock<Option<Arc<Session>>> = RwLock::new(None);

fn session() -> Option<Arc<Session>> {
    SESSION.read().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Whether a person wants to read more than the few lines that matter most.
pub(crate) fn detailed() -> bool {
    session().is_some_and(|session| session.detailed)
}

/// The words of the command, after the program's own name.
pub(crate) fn words() -> Vec<OsString> {
    session().map(|session| session.words.clone()).unwrap_or_default()
}

/// Who asks from within, if anybody does.
pub(crate) fn caller() -> Option<Arc<dyn Caller>> {
    match &session()?.reader {
        Reader::Caller(caller) => Some(Arc::clone(caller)),
        Reader::Person | Reader::Program => None,
    }
}

/// Shows light to whoever asks from within.
pub(crate) fn light(name: &str, image: &Image) {
    if let Some(caller) = caller() {
        caller.light(name, image);
    }
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

fn a_person_reads() -> bool {
    session().is_none_or(|session| matches!(session.reader, Reader::Person))
}

/// Chooses the reader of a command, and how much is told: 0 what a maker reads, 1 all of it and stages with their times, 2 and 3 more.
pub(crate) fn open(reader: Reader, words: Vec<OsString>, verbosity: u8) {
    let session =
        Session { reader, words, detailed: verbosity > 0, warnings: Mutex::default(), result: Mutex::default() };
    *SESSION.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(session));
    let level = match verbosity {
        0 => return,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let colour = anstream::AutoStream::choice(&std::io::stderr()) != anstream::ColorChoice::Never;
    let traces = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_span_events(FmtSpan::CLOSE)
        .with_target(verbosity > 1)
        .with_ansi(colour)
        .with_writer(std::io::stderr)
        .with_timer(tracing_subscriber::fmt::time::uptime());
    // A process that asks again has them already.
    let _ = traces.try_init();
}

/// Prints a line for a person. A reader that has gone away, such as `head`, has heard enough.
pub(crate) fn line(text: fmt::Arguments<'_>) {
    if a_person_reads() {
        let _ = writeln!(anstream::stdout(), "{text}");
    }
}

/// Prints lines of the library for a person.
pub(crate) fn text(text: &str) {
    if a_person_reads() {
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
    let Some(session) = session() else { return print_warning(&text) };
    let mut warnings = session.warnings.lock().unwrap_or_else(PoisonError::into_inner);
    if !warnings.contains(&text) {
        if !matches!(session.reader, Reader::Caller(_)) {
            print_warning(&text);
        }
        warnings.push(text);
    }
}

fn print_warning(text: &str) {
    let _ = writeln!(anstream::stderr(), "{}: {text}", coloured("warning", AnsiColor::Yellow));
}

/// Tells that a signal has ended the run.
pub(crate) fn interrupted() {
    let _ = writeln!(anstream::stderr(), "\ninterrupted; nothing half-written was left");
}

/// Keeps what a program will read.
pub(crate) fn result(result: document::Result) {
    if let Some(session) = session() {
        *session.result.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    }
}

/// A failure for programs.
pub fn fault(failure: &Failure) -> document::Fault {
    document::Fault {
        kind: kind(failure),
        message: with_flags(&failure.to_string()),
        causes: failure.causes().iter().map(|cause| with_flags(cause)).collect(),
    }
}

/// Ends the command, and tells how it ended.
pub(crate) fn close(command: &str, done: Result<(), Failure>) -> document::Document {
    let session = SESSION.write().unwrap_or_else(PoisonError::into_inner).take();
    let reader = session.as_ref().map_or(Reader::Person, |session| session.reader.clone());
    let code = done.as_ref().err().map_or(0, code);
    if let (Err(failure), Reader::Person | Reader::Program) = (&done, &reader) {
        let mut text = format!("{}: {}", coloured("error", AnsiColor::Red), with_flags(&failure.to_string()));
        for cause in failure.causes() {
            text += &format!("\n  because: {}", with_flags(&cause));
        }
        let _ = writeln!(anstream::stderr(), "{text}");
    }
    let taken = |session: &Session| {
        let warnings = std::mem::take(&mut *session.warnings.lock().unwrap_or_else(PoisonError::into_inner));
        (warnings, session.result.lock().unwrap_or_else(PoisonError::into_inner).take())
    };
    let (warnings, result) = session.as_deref().map(taken).unwrap_or_default();
    let document = document::Document {
        schema: document::SCHEMA,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: command.to_owned(),
        exit_code: code,
        warnings,
        error: done.err().map(|failure| fault(&failure)),
        result,
    };
    if let Reader::Program = reader {
        match serde_json::to_string_pretty(&document) {
            Ok(text) => drop(writeln!(std::io::stdout(), "{text}")),
            Err(error) => drop(writeln!(std::io::stderr(), "error: the result cannot be written as JSON: {error}")),
        }
    }
    document
}
