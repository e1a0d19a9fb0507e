//! Where settings come from: flags go before a design file, that goes before its preset.

use super::{
    conflicts,
    host::Host,
    mistakes::{self, Known},
    presets::PresetName,
    quantity::name_of,
    settings::{DesignFile, Settings},
};
use crate::{failure::Failure, materials};
use std::path::{Path, PathBuf};

/// What messages call a design file.
const KIND: &str = "design file";

/// What flags and a design file together ask for, and the picture; `named` is either.
///
/// # Errors
/// Settings that exclude each other, a file that cannot be read or holds mistakes, no picture.
pub fn settings(named: &Path, flags: &Settings, host: &dyn Host) -> Result<(Settings, PathBuf), Failure> {
    conflicts::check_flags(flags)?;
    if !mistakes::is_toml(named) {
        return Ok((with_preset(flags.clone())?, named.to_path_buf()));
    }
    let file = as_written(named, host)?;
    for (silenced, by) in conflicts::silence(flags, &mut file.clone()) {
        host.warn(&format!("`{by}` takes the place of {silenced} in {}", named.display()));
    }
    let settings = with_preset(or(flags.clone(), file))?;
    let picture = settings.named_picture(named)?;
    Ok((settings, picture))
}

/// Reads the `[design]` table of a TOML file. The picture's path is taken relative to the file.
///
/// # Errors
/// A file that cannot be read or holds mistakes.
pub fn read(path: &Path, host: &dyn Host) -> Result<Settings, Failure> {
    with_preset(as_written(path, host)?)
}

/// The same with its preset yet to be looked up.
fn as_written(path: &Path, host: &dyn Host) -> Result<Settings, Failure> {
    let mut settings = parse(&host.text(path)?, path, KIND)?;
    settings.resolve_paths(path);
    Ok(settings)
}

/// The settings of a design file, as they are written. `path` is its name, `kind` what it is
/// called.
///
/// # Errors
/// Mistakes, settings that exclude each other.
pub fn parse(text: &str, path: &Path, kind: &str) -> Result<Settings, Failure> {
    let settings = mistakes::parse::<DesignFile>(text, path, kind, &Known::DESIGN)?.design;
    conflicts::check_file(&settings).map_err(|refusal| mistakes::placed(refusal, text, path))?;
    Ok(settings)
}

/// The settings of a preset.
///
/// # Errors
/// None, as a test shows.
pub fn preset(name: PresetName) -> Result<Settings, Failure> {
    parse(name.text(), Path::new(&name_of(name)), "preset")
}

/// Settings with those of their preset where they are silent, and a material where nothing is said
/// of the index.
pub(crate) fn with_preset(settings: Settings) -> Result<Settings, Failure> {
    let mut settings = match settings.preset {
        Some(name) => Settings { preset: None, ..or(settings, preset(name)?) },
        None => settings,
    };
    if settings.ior.is_none() && !settings.is_mirror() {
        settings.material.get_or_insert_with(|| materials::DEFAULT.to_owned());
    }
    Ok(settings)
}

/// Settings, and where they are silent, another's as far as these do not exclude them.
pub(crate) fn or(settings: Settings, mut under: Settings) -> Settings {
    conflicts::silence(&settings, &mut under);
    settings.over(under)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{choices::SolverName, length::Length};

    #[test]
    fn flags_go_before_the_file() {
        let file: DesignFile =
            toml::from_str("[design]\nsize = \"20cm\"\nior = 1.6\noffset = 0.2\nsolver = \"warping-paper\"").unwrap();
        let flags = Settings { material: Some("pmma".into()), offset: Some(0.3), ..Settings::default() };
        let merged = or(flags, file.design);
        assert_eq!(merged.size, Some(Length { mm: 200.0 }));
        assert_eq!((merged.ior, merged.material.as_deref()), (None, Some("pmma")));
        assert_eq!(merged.offset, Some(0.3));
        assert_eq!(merged.solver, Some(SolverName::WarpingPaper));
    }

    #[test]
    fn a_file_goes_before_its_preset() {
        let file = "[design]\npreset = \"desk-demo\"\nsize = \"70mm\"\nior = 1.6";
        let settings = toml::from_str::<DesignFile>(file).unwrap().design;
        let settings = with_preset(settings).unwrap();
        assert_eq!(settings.size, Some(Length { mm: 70.0 }));
        assert_eq!(settings.distance, Some(Length { mm: 200.0 }));
        assert_eq!((settings.ior, settings.material), (Some(1.6), None));
    }

    #[test]
    fn a_block_of_which_nothing_is_said_is_of_acrylic() {
        let material = |file: &str| with_preset(toml::from_str::<DesignFile>(file).unwrap().design).unwrap().material;
        assert_eq!(material("[design]\nsize = \"70mm\"").as_deref(), Some("pmma"));
        assert_eq!(material("[design]\nmaterial = \"bk7\"").as_deref(), Some("bk7"));
        assert_eq!(material("[design]\nior = 1.6"), None);
        assert_eq!(material("[design]\nmirror = true"), None);
    }
}
