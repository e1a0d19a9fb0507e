//! Settings as the page writes them: a JSON object with the names of design files.

use crate::host::PageHost;
use glasswarp::{
    failure::Failure,
    spec::{self, Settings},
};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// Settings with those of their preset, and the picture that they name.
///
/// # Errors
/// A value that is none, told with the name of its setting; settings that exclude each other; no
/// picture.
pub(crate) fn read(text: &str, host: &PageHost) -> Result<(Settings, PathBuf), Failure> {
    let settings = parse(text)?;
    let picture = settings.picture.clone().ok_or_else(|| Failure::Usage("there is no picture yet".into()))?;
    let flags = Settings { picture: None, ..settings };
    spec::settings(&picture, &flags, host)
}

/// The settings as they are written.
///
/// # Errors
/// A value that is none, told with the name of its setting.
pub(crate) fn parse(text: &str) -> Result<Settings, Failure> {
    let written: Map<String, Value> =
        serde_json::from_str(text).map_err(|error| Failure::Usage(format!("the settings are no object: {error}")))?;
    let written: Map<String, Value> = written.into_iter().filter(|(_, value)| !value.is_null()).collect();
    for (name, value) in &written {
        let alone = Map::from_iter([(name.clone(), value.clone())]);
        if let Err(error) = serde_json::from_value::<Settings>(Value::Object(alone)) {
            return Err(Failure::Usage(format!("`{name}`: {error}")));
        }
    }
    serde_json::from_value(Value::Object(written)).map_err(|error| Failure::Usage(error.to_string()))
}

/// A design file of these settings.
///
/// # Errors
/// What TOML cannot hold.
pub(crate) fn to_toml(settings: &Settings) -> Result<String, Failure> {
    #[derive(serde::Serialize)]
    struct Design<'a> {
        design: &'a Settings,
    }
    toml::to_string(&Design { design: settings })
        .map_err(|source| Failure::Io { what: "the design file cannot be written".into(), source: source.into() })
}

/// The command that makes the same, for a shell.
pub(crate) fn command(settings: &Settings, picture: &Path) -> String {
    let picture = picture.to_string_lossy().into_owned();
    in_shell("design", [picture].into_iter().chain(settings.flags()))
}

/// A command for a shell.
pub(crate) fn in_shell(command: &str, words: impl IntoIterator<Item = String>) -> String {
    // `--size=100mm` means the same to every shell without quotes.
    let is_plain = |text: &str| text.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_./:=,%+@".contains(&b));
    let quoted = |text: &str| match shlex::try_quote(text) {
        Ok(quoted) if !is_plain(text) => quoted.into_owned(),
        _ => text.to_owned(),
    };
    let words = ["glasswarp".to_owned(), command.to_owned()].into_iter().chain(words);
    words.map(|word| quoted(&word)).collect::<Vec<_>>().join(" ")
}
