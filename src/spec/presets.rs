//! Common set-ups as design files.

use super::quantity::names;
use clap::ValueEnum;

names!(PresetName, "preset");

/// A common set-up to start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// A block in the sun, its picture on a card a hand's breadth behind it
    SunlitWindow,
    /// A bare LED behind a block on the table
    TorchOnTable,
    /// A laser made wide and a small block on a desk
    DeskDemo,
    /// A polished face that throws sunlight onto a wall near by
    WallMirror,
}

impl PresetName {
    /// The preset as a design file without a picture.
    pub fn text(self) -> &'static str {
        match self {
            Self::SunlitWindow => include_str!("../presets/sunlit-window.toml"),
            Self::TorchOnTable => include_str!("../presets/torch-on-table.toml"),
            Self::DeskDemo => include_str!("../presets/desk-demo.toml"),
            Self::WallMirror => include_str!("../presets/wall-mirror.toml"),
        }
    }
}
