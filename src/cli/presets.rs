//! Common set-ups as design files, and `glasswarp presets`, which lists them.

use super::{
    console::{self, say},
    error::Failure,
    json,
    settings::Settings,
    toml_file,
};
use clap::ValueEnum;
use serde::Deserialize;
use std::path::Path;

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum PresetName {
    /// A slab on the sill of a sunny window, its picture in the room
    SunlitWindow,
    /// A torch or LED behind a block on the table
    TorchOnTable,
    /// A collimated lamp and a small block on a desk
    DeskDemo,
    /// A polished face that throws sunlight onto a wall
    WallMirror,
}

impl PresetName {
    /// The preset as a design file without a picture.
    fn text(self) -> &'static str {
        match self {
            Self::SunlitWindow => include_str!("../presets/sunlit-window.toml"),
            Self::TorchOnTable => include_str!("../presets/torch-on-table.toml"),
            Self::DeskDemo => include_str!("../presets/desk-demo.toml"),
            Self::WallMirror => include_str!("../presets/wall-mirror.toml"),
        }
    }

    pub(crate) fn settings(self) -> Result<Settings, Failure> {
        let name = super::settings::name_of(self);
        Ok(toml_file::parse::<super::settings::DesignFile>(self.text(), Path::new(&name), "preset")?.design)
    }
}

#[derive(clap::Args)]
pub(crate) struct PresetsArgs {
    /// Print this preset as a design file: add picture = "..." to it, and change what you like
    name: Option<PresetName>,
}

pub(crate) fn run(args: &PresetsArgs) -> Result<(), Failure> {
    if let Some(name) = args.name {
        say!("{}", name.text().trim_end());
        console::result(json::Result::Text(json::Text { text: name.text().to_owned() }));
        return Ok(());
    }
    let mut list = Vec::new();
    for preset in PresetName::value_variants() {
        let (name, about) = named(*preset);
        say!("{name:<16} {about}");
        list.push(json::Preset { name, about, design: preset.text().to_owned() });
    }
    say!("\n'glasswarp design picture.png --preset NAME' takes one; flags and design files go before it.");
    console::result(json::Result::Presets(json::Presets { presets: list }));
    Ok(())
}

fn named(preset: PresetName) -> (String, String) {
    let value = preset.to_possible_value();
    let about = value.as_ref().and_then(|value| value.get_help()).map(ToString::to_string).unwrap_or_default();
    (super::settings::name_of(preset), about)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_design_file_with_a_sound_bench() {
        for preset in PresetName::value_variants() {
            let settings = preset.settings().unwrap_or_else(|error| panic!("{error}"));
            super::super::bench::bench_of(&settings, 1.0, 10.0).unwrap_or_else(|error| panic!("{preset:?}: {error}"));
        }
    }
}
