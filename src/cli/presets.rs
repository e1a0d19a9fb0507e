//! `glasswarp presets`: common set-ups to start from.

use super::console::{self, say};
use crate::{
    failure::Failure,
    record::document,
    spec::{PresetName, name_of},
};
use clap::ValueEnum;

#[derive(clap::Args)]
pub(crate) struct PresetsArgs {
    /// Print this preset as a design file: add picture = "..." to it, and change what you like
    name: Option<PresetName>,
}

pub(crate) fn run(args: &PresetsArgs) -> Result<(), Failure> {
    if let Some(name) = args.name {
        say!("{}", name.text().trim_end());
        console::result(document::Result::Text(document::Text { text: name.text().to_owned() }));
        return Ok(());
    }
    let mut list = Vec::new();
    for preset in PresetName::value_variants() {
        let (name, about) = named(*preset);
        say!("{name:<16} {about}");
        list.push(document::Preset { name, about, design: preset.text().to_owned() });
    }
    say!("\n'glasswarp design picture.png --preset NAME' takes one; flags and design files go before it.");
    console::result(document::Result::Presets(document::Presets { presets: list }));
    Ok(())
}

fn named(preset: PresetName) -> (String, String) {
    let value = preset.to_possible_value();
    let about = value.as_ref().and_then(|value| value.get_help()).map(ToString::to_string).unwrap_or_default();
    (name_of(preset), about)
}
