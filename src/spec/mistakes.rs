//! Mistakes in TOML files that people write: each is told with its line, its column, and what may
//! have been meant.

use super::{quantity::hint, settings::Settings};
use crate::failure::Failure;
use serde::de::DeserializeOwned;
use std::{fmt::Write as _, ops::Range, path::Path};
use toml::de::{DeTable, DeValue};

/// A table of a file whose keys are all known, or an array of such tables.
pub(crate) struct Known {
    pub(crate) table: &'static str,
    /// With underscores.
    pub(crate) keys: &'static [&'static str],
}

impl Known {
    /// The `[design]` of design files and side files.
    pub(crate) const DESIGN: Self = Self { table: "design", keys: Settings::NAMES };

    /// Refuses a key that is not known.
    fn check(&self, text: &str, path: &Path, what: &str) -> Result<(), Failure> {
        let Ok(document) = DeTable::parse(text) else { return Ok(()) };
        let Some((_, value)) = document.get_ref().iter().find(|(key, _)| key.get_ref() == self.table) else {
            return Ok(());
        };
        let tables: Vec<&DeTable<'_>> = match value.get_ref() {
            DeValue::Table(table) => vec![table],
            DeValue::Array(array) => array
                .iter()
                .filter_map(|item| if let DeValue::Table(table) = item.get_ref() { Some(table) } else { None })
                .collect(),
            _ => Vec::new(),
        };
        let known: Vec<String> = self.keys.iter().map(|name| name.replace('_', "-")).collect();
        let unknown =
            tables.iter().flat_map(|table| table.keys()).filter(|key| !known.iter().any(|k| k == key.get_ref()));
        let Some(first) = unknown.min_by_key(|key| key.span().start) else { return Ok(()) };
        let mut says = format!("{} is no {what}: unknown field '{}'", path.display(), first.get_ref());
        says += &shown(text, path, first.span());
        says += &hint(first.get_ref(), known.iter().map(String::as_str));
        Err(Failure::Usage(says))
    }
}

/// Whether a file is one of settings, by its name.
pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Reads a file from memory; `path` is its name, and `what` says what it should be.
pub(crate) fn parse<T: DeserializeOwned>(text: &str, path: &Path, what: &str, known: &Known) -> Result<T, Failure> {
    known.check(text, path, what)?;
    toml::from_str(text).map_err(|error| {
        // A hint stands in lines of its own, behind the place.
        let (message, hint) = error.message().split_once('\n').unwrap_or((error.message(), ""));
        let mut says = format!("{} is no {what}: {message}", path.display());
        if let Some(span) = error.span() {
            says += &shown(text, path, span);
        }
        if !hint.is_empty() {
            says += &format!("\n{hint}");
        }
        Failure::Usage(says)
    })
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

/// A refusal with the lines of the design file that it speaks of.
pub(crate) fn placed(refusal: Failure, text: &str, path: &Path) -> Failure {
    let places = places(text, path, &refusal.to_string());
    refusal.with_places(&places)
}

/// The settings of a `[design]` table that a message speaks of, each with its place: a value that
/// is well written and yet makes no sense.
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
    use crate::spec::settings::DesignFile;

    fn said(text: &str) -> String {
        parse::<DesignFile>(text, Path::new("a.toml"), "design file", &Known::DESIGN)
            .err()
            .map(|error| error.to_string())
            .unwrap()
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
