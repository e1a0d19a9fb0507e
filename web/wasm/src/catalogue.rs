//! What there is to set, told by the declaration that serves the command line too.

use crate::{
    reply::{plain, told},
    settings::parse,
};
use clap::{Args, Command, ValueEnum};
use glasswarp::{
    materials::MATERIALS,
    spec::{self, LightName, PresetName, Settings, name_of},
};
use serde::Serialize;
use wasm_bindgen::prelude::*;

#[derive(Serialize)]
struct Catalogue {
    version: &'static str,
    settings: Vec<Setting>,
    materials: Vec<MaterialEntry>,
    presets: Vec<Preset>,
}

/// A setting: its name, what is written there, and what help says of it.
#[derive(Serialize)]
struct Setting {
    name: String,
    group: String,
    value: String,
    help: String,
    more: String,
    choices: Vec<Choice>,
    is_switch: bool,
    /// Left out of the short help: for those who look for it.
    rare: bool,
}

#[derive(Serialize)]
struct Choice {
    name: String,
    help: String,
}

#[derive(Serialize)]
struct MaterialEntry {
    name: &'static str,
    description: &'static str,
    ior: f64,
}

#[derive(Serialize)]
struct Preset {
    name: String,
    help: String,
    settings: Settings,
}

fn choices<T: ValueEnum>() -> Vec<Choice> {
    T::value_variants().iter().filter_map(ValueEnum::to_possible_value).map(|value| choice(&value)).collect()
}

fn choice(value: &clap::builder::PossibleValue) -> Choice {
    Choice { name: value.get_name().to_owned(), help: value.get_help().map(ToString::to_string).unwrap_or_default() }
}

fn setting(argument: &clap::Arg) -> Setting {
    let text = |words: Option<&clap::builder::StyledStr>| words.map(ToString::to_string).unwrap_or_default();
    let name = argument.get_long().unwrap_or_default().to_owned();
    let known: Vec<Choice> = argument.get_possible_values().iter().map(choice).collect();
    let help = text(argument.get_help());
    let more = text(argument.get_long_help());
    Setting {
        choices: if name == "light" { choices::<LightName>() } else { known },
        group: argument.get_help_heading().unwrap_or_default().to_owned(),
        value: argument.get_value_names().and_then(|names| names.first()).map(ToString::to_string).unwrap_or_default(),
        // The long help begins with the short one.
        more: more.strip_prefix(help.as_str()).unwrap_or_default().trim().to_owned(),
        is_switch: argument.get_num_args().is_some_and(|range| range.min_values() == 0),
        rare: argument.is_hide_short_help_set(),
        name,
        help,
    }
}

/// All settings, materials and presets.
///
/// # Errors
/// None, as the tests of the presets show.
#[wasm_bindgen]
pub fn catalogue() -> Result<JsValue, JsValue> {
    let command = Settings::augment_args(Command::new("design"));
    let mut presets = Vec::new();
    for (name, known) in PresetName::value_variants().iter().zip(choices::<PresetName>()) {
        let settings = spec::preset(*name).map_err(|failure| told(&failure))?;
        presets.push(Preset { name: name_of(*name), help: known.help, settings });
    }
    plain(&Catalogue {
        version: env!("CARGO_PKG_VERSION"),
        settings: command.get_arguments().filter(|argument| argument.get_long().is_some()).map(setting).collect(),
        materials: MATERIALS
            .iter()
            .map(|m| MaterialEntry { name: m.name, description: m.description, ior: m.ior })
            .collect(),
        presets,
    })
}

/// What is wrong with a value of a setting; nothing, if it will do.
#[wasm_bindgen]
pub fn fault_of(settings: &str) -> Option<String> {
    parse(settings).err().map(|failure| failure.to_string())
}

/// The settings of a design file, as an object.
///
/// # Errors
/// Mistakes, told with their line.
#[wasm_bindgen]
pub fn read_design(text: &str, name: &str) -> Result<JsValue, JsValue> {
    let settings = spec::parse(text, std::path::Path::new(name), "design file").map_err(|failure| told(&failure))?;
    plain(&settings)
}
