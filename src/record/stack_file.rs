//! The file that names the plates of a stack.

use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Plates in the order of the light. How they stand, each says in its own side file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct StackFile {
    /// The files of the plates, beside this one.
    pub stack: Vec<String>,
}

impl StackFile {
    /// Reads such a file from memory; none if it is another file of settings.
    ///
    /// # Errors
    /// A file that is no TOML, or names no plates.
    pub fn parse(text: &str, path: &Path) -> Result<Option<Self>, Failure> {
        let wrong = |why: String| Failure::Usage(format!("{} is no file of a stack: {why}", path.display()));
        let table: toml::Table = toml::from_str(text).map_err(|error| wrong(error.message().to_owned()))?;
        if !table.contains_key("stack") {
            return Ok(None);
        }
        let stack: Self = table.try_into().map_err(|error: toml::de::Error| wrong(error.message().to_owned()))?;
        if stack.stack.is_empty() {
            return Err(wrong("it names no plates".into()));
        }
        Ok(Some(stack))
    }

    /// The text of the file.
    ///
    /// # Errors
    /// None that is known.
    pub fn to_text(&self) -> Result<String, Failure> {
        let text = toml::to_string(self).map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(format!(
            "# Written by glasswarp {}. Plates in the order of the light; their side files say how far apart they stand.\n{text}",
            env!("CARGO_PKG_VERSION")
        ))
    }
}
