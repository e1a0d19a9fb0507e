//! TOML with words behind its values, for people who open the file.

use crate::failure::Failure;
use serde::Serialize;
use std::fmt::Write as _;
use toml::{Table, Value};

/// A key, and what is said of it.
pub(super) type Note = (&'static str, &'static str);

/// A document that is written table by table.
pub(super) struct Annotated {
    document: Table,
    text: String,
}

impl Annotated {
    /// # Errors
    /// What TOML cannot hold.
    pub(super) fn of(document: &impl Serialize) -> Result<Self, Failure> {
        let document = Table::try_from(document)
            .map_err(|source| Failure::Io { what: "the side file cannot be written".into(), source: source.into() })?;
        Ok(Self { document, text: String::new() })
    }

    pub(super) fn comment(&mut self, words: &str) {
        self.text += &format!("# {words}\n");
    }

    /// The table of this name, if there is one: the keys of the notes in their order, then all
    /// others in theirs.
    pub(super) fn table(&mut self, name: &str, about: &str, notes: &[Note]) {
        if let Some(Value::Table(table)) = self.document.remove(name) {
            self.write(name, about, notes, table);
        }
    }

    /// A table of tables.
    pub(super) fn tables(&mut self, name: &str, about: &str) {
        let Some(Value::Table(tables)) = self.document.remove(name) else { return };
        for (key, value) in tables {
            if let Value::Table(table) = value {
                self.write(&format!("{name}.{}", quoted(&key)), about, &[], table);
            }
        }
    }

    fn write(&mut self, name: &str, about: &str, notes: &[Note], mut table: Table) {
        let words = |about: &str| if about.is_empty() { String::new() } else { format!(" # {about}") };
        let text = &mut self.text;
        let _ = writeln!(text, "\n[{name}]{}", words(about));
        for (key, note) in notes {
            if let Some(value) = table.remove(*key) {
                let _ = writeln!(text, "{key} = {}{}", in_toml(&value), words(note));
            }
        }
        for (key, value) in table {
            let is_bare = key.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
            let key = if is_bare { key } else { quoted(&key) };
            let _ = writeln!(text, "{key} = {}", in_toml(&value));
        }
    }

    pub(super) fn finish(self) -> String {
        self.text
    }
}

fn quoted(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

/// A value; numbers with all their digits, and with an exponent where that is shorter.
fn in_toml(value: &Value) -> String {
    match value {
        Value::Float(number) => format!("{number:?}"),
        Value::Array(values) => {
            format!("[{}]", values.iter().map(in_toml).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}
