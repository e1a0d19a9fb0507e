//! The cutters that a shop has, as a list in TOML.

use super::{
    length::{Feed, Length},
    mistakes::{self, Known},
};
use crate::{fabricate::Cutter, failure::Failure};
use serde::{Deserialize, Deserializer, de};
use std::path::Path;

/// The keys of an entry.
const KNOWN: Known = Known { table: "cutter", keys: &["name", "cutter", "feed", "step_overs"] };

/// What the shop has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutterList {
    /// The cutters.
    pub cutter: Vec<CutterEntry>,
}

/// A cutter, and how fast it may be moved.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CutterEntry {
    /// What the shop calls it.
    pub name: Option<String>,
    /// The cutter.
    #[serde(deserialize_with = "cutter")]
    pub cutter: Cutter,
    /// Along the rows.
    pub feed: Feed,
    /// What is tried, if only some are wanted.
    #[serde(default)]
    pub step_overs: Vec<Length>,
}

fn cutter<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Cutter, D::Error> {
    String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
}

impl CutterList {
    /// Reads a list from memory; `path` is its name.
    ///
    /// # Errors
    /// Mistakes, no cutter at all, a feed that gets nowhere.
    pub fn parse(text: &str, path: &Path) -> Result<Self, Failure> {
        let list: Self = mistakes::parse(text, path, "list of cutters", &KNOWN)?;
        if list.cutter.is_empty() {
            return Err(Failure::Usage(format!("{} names no cutter", path.display())));
        }
        Ok(list)
    }
}
