//! TOML files that people write: a mistake is told with its line, its column, and what may have been meant.

use super::error::Failure;
use serde::de::DeserializeOwned;
use std::{fmt::Write as _, ops::Range, path::Path};
use toml::de::{DeTable, DeValue};

/// Reads a file; `what` is what it should be.
pub(crate) fn read<T: DeserializeOwned>(path: &Path, what: &str) -> Result<T, Failure> {
    let text = std::fs::read_to_string(path).map_err(|source| Failure::reading(path, source))?;
    parse(&text, path, what)
}

/// The same from memory; `path` is its name.
pub(crate) fn parse<T: DeserializeOwned>(text: &str, path: &Path, what: &str) -> Result<T, Failure> {
    toml::from_str(text).map_err(|error| {
        let mut says = format!("{} is no {what}: ", path.display());
        let (message, hint) = explained(error.message());
        says += &message;
        if let Some(span) = error.span() {
            says += &shown(text, path, span);
        }
        says += &hint;
        Failure::Usage(says)
    })
}

/// The message without its list of everything that is known, and a hint at what may have been meant.
fn explained(message: &str) -> (String, String) {
    let quoted = |text: &str| text.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let Some((what, known)) = message.split_once(", expected ") else { return (message.to_owned(), String::new()) };
    let (found, known) = (quoted(what), quoted(known));
    let ([found], [_, ..]) = (&found[..], &known[..]) else { return (message.to_owned(), String::new()) };
    let hint = match nearest(found, known.iter().map(String::as_str)) {
        Some(near) => format!("\ndid you mean '{near}'?"),
        None => format!("\nknown are {}", known.join(", ")),
    };
    (what.replace('`', "'"), hint)
}

/// What is most like a word, if anything is.
pub(crate) fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |other: &str| strsim::damerau_levenshtein(&word.to_lowercase(), &other.to_lowercase());
    let (near, distance) = known.map(|other| (other, distance(other))).min_by_key(|(_, distance)| *distance)?;
    (distance <= 1 + word.chars().count() / 4).then_some(near)
}

/// A place in a file: its line and column, the line itself, and marks under it.
fn shown(text: &str, path: &Path, span: Range<usize>) -> String {
    let start = span.start.min(text.len());
    let before = text.get(..start).unwrap_or_default();
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    let number = before.matches('\n').count() + 1;
    let column = before[line_start..].chars().count() + 1;
    let line = text[line_start..].lines().next().unwrap_or_default();
    let marked = text.get(start..span.end.min(line_start + line.len())).map_or(1, |part| part.chars().count().max(1));
    let margin = " ".repeat(number.to_string().len());
    let mut shown = format!("\n{margin} --> {}:{number}:{column}", path.display());
    let _ = write!(shown, "\n{number} | {line}\n{margin} | {}{}", " ".repeat(column - 1), "^".repeat(marked));
    shown
}

/// A refusal with the lines of the design file that it speaks of, if `named` is one.
pub(crate) fn placed(refusal: Failure, named: &Path) -> Failure {
    let is_design = named.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let text = if is_design { std::fs::read_to_string(named).unwrap_or_default() } else { String::new() };
    let places = places(&text, named, &refusal.to_string());
    refusal.with_places(&places)
}

/// The settings of a `[design]` table that a message speaks of, each with its place: a value that is well written and yet
/// makes no sense.
fn places(text: &str, path: &Path, message: &str) -> String {
    let Ok(document) = DeTable::parse(text) else { return String::new() };
    let design = document.get_ref().iter().find(|(key, _)| key.get_ref() == "design");
    let Some(DeValue::Table(design)) = design.map(|(_, value)| value.get_ref()) else { return String::new() };
    let words: Vec<String> = message
        .split(|c: char| !c.is_alphanumeric() && c != '-')
        .map(|word| word.trim_matches('-').to_lowercase())
        .collect();
    let said = |key: &str| {
        words.iter().any(|word| word == key) || key.contains('-') && message.contains(&key.replace('-', " "))
    };
    let mut spans: Vec<Range<usize>> = design
        .iter()
        .filter(|(key, _)| said(key.get_ref()))
        .map(|(key, value)| key.span().start..value.span().end)
        .collect();
    spans.sort_by_key(|span| span.start);
    spans.into_iter().map(|span| shown(text, path, span)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::settings::DesignFile;

    fn said(text: &str) -> String {
        parse::<DesignFile>(text, Path::new("a.toml"), "design file").err().map(|error| error.to_string()).unwrap()
    }

    #[test]
    fn mistakes_are_told_with_line_column_and_what_may_have_been_meant() {
        for (text, words) in [
            (
                "[design]\ndistanse = 250",
                &["a.toml:2:1", "distanse = 250\n  | ^^^^^^^^", "did you mean 'distance'?"][..],
            ),
            ("[design]\n\n  solver = \"transprot\"", &["a.toml:3:12", "did you mean 'transport'?"]),
            ("[design]\nsize = \"10 furlongs\"", &["a.toml:2:8", "unknown unit 'furlongs'"]),
            ("[design]\nnodes = \"many\"", &["a.toml:2:9", "expected usize"]),
            ("[design\nnodes = 3", &["a.toml:1:"]),
            ("[desing]\nnodes = 65", &["missing field `design`"]),
            ("[design]\nwhatsoever = 1", &["known are picture, "]),
        ] {
            let said = said(text);
            for word in words {
                assert!(said.contains(word), "{word:?} is not in\n{said}");
            }
        }
    }

    #[test]
    fn a_value_that_makes_no_sense_is_found_by_the_words_of_its_refusal() {
        let text = "[design]\nsize = 100\ndistance = -5 # mm\nmin-radius = 2";
        let found = places(text, Path::new("a.toml"), "the distance is -5 mm; move the receiver");
        assert_eq!(found, "\n  --> a.toml:3:1\n3 | distance = -5 # mm\n  | ^^^^^^^^^^^^^");
        assert!(places(text, Path::new("a.toml"), "the least min radius is 3 mm").contains("a.toml:4:1"));
    }
}
