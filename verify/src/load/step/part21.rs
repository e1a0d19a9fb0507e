//! The exchange structure of ISO 10303-21: numbered entities and their parameters.

use super::fault::malformed;
use crate::load::error::LoadError;
use std::{borrow::Cow, collections::HashMap};

/// A parameter of an entity.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value<'a> {
    Reference(u64),
    Number(f64),
    /// Between points.
    Word(&'a str),
    Text,
    List(Vec<Value<'a>>),
    /// `$` or `*`: not given, or derived.
    Nothing,
}

/// The entities of a file by number, as text.
#[derive(Default)]
pub(super) struct Entities<'a> {
    by_number: HashMap<u64, &'a str>,
}

impl<'a> Entities<'a> {
    /// Finds the entities of the first data section.
    pub(super) fn parse(text: &'a str) -> Result<Self, LoadError> {
        if !text.trim_start().starts_with("ISO-10303-21") {
            return Err(malformed("it does not begin with ISO-10303-21"));
        }
        let mut by_number = HashMap::new();
        let (mut rest, mut within, mut ended) = (text, false, false);
        while let Some(end) = statement_end(rest) {
            let statement = rest[..end].trim();
            rest = &rest[end + 1..];
            match statement {
                "DATA" => within = true,
                "ENDSEC" if within => {
                    ended = true;
                    break;
                }
                _ if within => {
                    let (number, entity) = statement
                        .strip_prefix('#')
                        .and_then(|s| s.split_once('='))
                        .and_then(|(number, entity)| Some((number.trim().parse().ok()?, entity.trim())))
                        .ok_or_else(|| malformed(format!("'{}' is no entity", shortened(statement))))?;
                    by_number.insert(number, entity);
                }
                _ => {}
            }
        }
        if !ended {
            return Err(malformed("the file is truncated: its data section has no end"));
        }
        Ok(Self { by_number })
    }

    /// The entities of this kind, in the order of their numbers.
    pub(super) fn of_kind(&self, kind: &str) -> Vec<u64> {
        self.that(|text| text.strip_prefix(kind).is_some_and(|rest| rest.trim_start().starts_with('(')))
    }

    /// The entities whose text fits, in the order of their numbers.
    pub(super) fn that(&self, fits: impl Fn(&str) -> bool) -> Vec<u64> {
        let mut found: Vec<u64> =
            self.by_number.iter().filter(|(_, text)| fits(text)).map(|(number, _)| *number).collect();
        found.sort_unstable();
        found
    }

    /// The parameters of a part of an entity: of the whole of a simple one, or of this part of one
    /// of several kinds at once.
    pub(super) fn part(&self, number: u64, kind: &str) -> Result<Option<Vec<Value<'a>>>, LoadError> {
        let text = self.text(number)?;
        let inner = text.strip_prefix('(').unwrap_or(text);
        let found = inner.match_indices(kind).find_map(|(at, _)| {
            let apart = !inner[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
            inner[at + kind.len()..].trim_start().strip_prefix('(').filter(|_| apart)
        });
        found.map(|rest| Reader { number, rest, depth: 0 }.list()).transpose()
    }

    /// Kind and parameters of an entity.
    pub(super) fn get(&self, number: u64) -> Result<(&'a str, Vec<Value<'a>>), LoadError> {
        let text = self.text(number)?;
        let open = text.find('(').ok_or_else(|| malformed(format!("#{number} has no parameters")))?;
        let kind = text[..open].trim();
        let mut reader = Reader { number, rest: &text[open + 1..], depth: 0 };
        Ok((kind, reader.list()?))
    }

    /// Parameters of an entity of a certain kind.
    pub(super) fn expect(&self, number: u64, kind: &str) -> Result<Vec<Value<'a>>, LoadError> {
        let (found, values) = self.get(number)?;
        if found == kind { Ok(values) } else { Err(malformed(format!("#{number} is {found} instead of {kind}"))) }
    }

    /// The text of an entity.
    pub(super) fn text(&self, number: u64) -> Result<&'a str, LoadError> {
        self.by_number.get(&number).copied().ok_or_else(|| malformed(format!("there is no entity #{number}")))
    }
}

/// The text without comments, which may stand between any two words.
pub(super) fn without_comments(text: Cow<'_, str>) -> Cow<'_, str> {
    if !text.contains("/*") {
        return text;
    }
    let (mut kept, mut rest, mut quoted) = (String::with_capacity(text.len()), &text[..], false);
    while let Some(at) = rest.find(['\'', '/']) {
        let (before, after) = rest.split_at(at);
        kept += before;
        rest = match after.strip_prefix("/*").filter(|_| !quoted) {
            // One that does not end hides the end of the file, which will be missed.
            Some(comment) => comment.find("*/").map_or("", |end| &comment[end + 2..]),
            None => {
                quoted ^= after.starts_with('\'');
                kept += &after[..1];
                &after[1..]
            }
        };
    }
    (kept + rest).into()
}

/// The next semicolon that is not within a text.
fn statement_end(text: &str) -> Option<usize> {
    let mut quoted = false;
    text.bytes().position(|byte| {
        quoted ^= byte == b'\'';
        byte == b';' && !quoted
    })
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Deepest nesting of lists that is followed.
const DEPTH: usize = 16;

struct Reader<'a> {
    number: u64,
    rest: &'a str,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn fault(&self) -> LoadError {
        malformed(format!("the parameters of #{} are not understood at '{}'", self.number, shortened(self.rest)))
    }

    /// Everything up to the closing bracket.
    fn list(&mut self) -> Result<Vec<Value<'a>>, LoadError> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(self.fault());
        }
        let mut values = Vec::new();
        loop {
            self.rest = self.rest.trim_start();
            if let Some(rest) = self.rest.strip_prefix(')') {
                self.rest = rest;
                self.depth -= 1;
                return Ok(values);
            }
            if !values.is_empty() {
                self.rest = self.rest.strip_prefix(',').ok_or_else(|| self.fault())?.trim_start();
            }
            values.push(self.value()?);
        }
    }

    fn value(&mut self) -> Result<Value<'a>, LoadError> {
        let first = self.rest.bytes().next().ok_or_else(|| self.fault())?;
        let after = &self.rest[first_len(self.rest)..];
        match first {
            b'(' => {
                self.rest = after;
                self.list().map(Value::List)
            }
            b'$' | b'*' => {
                self.rest = after;
                Ok(Value::Nothing)
            }
            b'\'' => {
                // A doubled quote is one within the text: two texts in a row, which is the same to
                // us.
                self.rest = after;
                loop {
                    let end = self.rest.find('\'').ok_or_else(|| self.fault())?;
                    self.rest = &self.rest[end + 1..];
                    match self.rest.strip_prefix('\'') {
                        Some(rest) => self.rest = rest,
                        None => return Ok(Value::Text),
                    }
                }
            }
            b'.' if !after.starts_with(|c: char| c.is_ascii_digit()) => {
                let end = after.find('.').ok_or_else(|| self.fault())?;
                self.rest = &after[end + 1..];
                Ok(Value::Word(&after[..end]))
            }
            _ => {
                let end = self.rest.find([',', ')']).ok_or_else(|| self.fault())?;
                let word = self.rest[..end].trim_end();
                let parsed = match word.strip_prefix('#') {
                    Some(number) => number.parse().ok().map(Value::Reference),
                    None => word.parse().ok().map(Value::Number),
                };
                match parsed {
                    Some(value) => {
                        self.rest = &self.rest[end..];
                        Ok(value)
                    }
                    // A typed parameter: KIND(value).
                    None => {
                        let open = self.rest.find('(').filter(|&open| open < end).ok_or_else(|| self.fault())?;
                        self.rest = &self.rest[open + 1..];
                        self.list().map(Value::List)
                    }
                }
            }
        }
    }
}

fn first_len(text: &str) -> usize {
    text.chars().next().map_or(0, char::len_utf8)
}

impl<'a> Value<'a> {
    pub(super) fn reference(&self) -> Option<u64> {
        if let Self::Reference(number) = self { Some(*number) } else { None }
    }

    pub(super) fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    pub(super) fn list(&self) -> Option<&[Value<'a>]> {
        if let Self::List(values) = self { Some(values) } else { None }
    }

    /// `.T.` or `.F.`
    pub(super) fn truth(&self) -> Option<bool> {
        match self {
            Self::Word("T") => Some(true),
            Self::Word("F") => Some(false),
            _ => None,
        }
    }

    pub(super) fn references(&self) -> Option<Vec<u64>> {
        self.list()?.iter().map(Self::reference).collect()
    }

    pub(super) fn numbers(&self) -> Option<Vec<f64>> {
        self.list()?.iter().map(Self::number).collect()
    }
}
