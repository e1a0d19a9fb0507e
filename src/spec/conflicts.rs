//! Settings that exclude each other: one declaration for the command line, for design files, and
//! for both together.

use super::{lamp::LightName, settings::Settings};
use crate::failure::Failure;

/// One side of a pair.
struct Half {
    /// As it is written in a design file; with two hyphens before it, as a flag.
    name: &'static str,
    given: fn(&Settings) -> bool,
    silence: fn(&mut Settings),
}

macro_rules! half {
    ($name:literal, $field:ident) => {
        Half { name: $name, given: |settings| settings.$field.is_some(), silence: |settings| settings.$field = None }
    };
}

const PARALLEL: Half = Half {
    name: "light parallel",
    given: |settings| settings.light == Some(LightName::Parallel),
    silence: |settings| settings.light = None,
};

/// The pairs, and why they exclude each other.
const PAIRS: [(Half, Half, &str); 11] = [
    (half!("ior", ior), half!("material", material), "both say what the index is"),
    (half!("ior", ior), half!("wavelength", wavelength), "an index is that of its wavelength already"),
    (half!("beam", beam), half!("emission", emission), "a measured beam stands for what a source would give"),
    (PARALLEL, half!("emission", emission), "only a point source emits in some way"),
    (PARALLEL, half!("source-distance", source_distance), "only a point source has a distance"),
    (half!("behind", behind), half!("mirror", mirror), "light does not go on behind another block to a mirror"),
    (half!("behind", behind), half!("light", light), OF_THE_FIRST),
    (half!("behind", behind), half!("tilt", tilt), OF_THE_FIRST),
    (half!("behind", behind), half!("source-distance", source_distance), OF_THE_FIRST),
    (half!("behind", behind), half!("emission", emission), OF_THE_FIRST),
    (half!("behind", behind), half!("beam", beam), OF_THE_FIRST),
];

const OF_THE_FIRST: &str = "the light is that for which the block before was made";

impl Half {
    fn flag(&self) -> String {
        format!("--{}", self.name)
    }
}

/// Refuses flags that exclude each other.
pub(crate) fn check_flags(flags: &Settings) -> Result<(), Failure> {
    check(flags, Half::flag)
}

/// Refuses settings of a design file that exclude each other.
pub(crate) fn check_file(settings: &Settings) -> Result<(), Failure> {
    check(settings, |half| half.name.to_owned())
}

fn check(settings: &Settings, name: impl Fn(&Half) -> String) -> Result<(), Failure> {
    match PAIRS.iter().find(|(one, other, _)| (one.given)(settings) && (other.given)(settings)) {
        Some((one, other, why)) => {
            let (one, other) = (name(one), name(other));
            Err(Failure::Usage(format!("{one} cannot be used with {other}: {why}; leave one of them out")))
        }
        None => Ok(()),
    }
}

/// Silences what these settings exclude in those that they go before. Returns what has been
/// silenced, and by what.
pub(crate) fn silence(first: &Settings, other: &mut Settings) -> Vec<(&'static str, &'static str)> {
    let mut silenced = Vec::new();
    for (one, two, _) in &PAIRS {
        for (wins, yields) in [(one, two), (two, one)] {
            if (wins.given)(first) && (yields.given)(other) {
                (yields.silence)(other);
                silenced.push((yields.name, wins.name));
            }
        }
    }
    silenced
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::settings::DesignFile;

    /// A value for every setting of a pair.
    const VALUES: [(&str, &str); 11] = [
        ("ior", "ior = 1.6"),
        ("material", "material = \"pmma\""),
        ("wavelength", "wavelength = \"532nm\""),
        ("beam", "beam = \"b.png\""),
        ("emission", "emission = \"lambertian\""),
        ("light parallel", "light = \"parallel\""),
        ("source-distance", "source-distance = \"1m\""),
        ("behind", "behind = \"a.stl,10mm\""),
        ("mirror", "mirror = true"),
        ("light", "light = \"point\""),
        ("tilt", "tilt = \"5deg\""),
    ];

    fn settings(names: &[&str]) -> Settings {
        let line = |name: &&str| VALUES.iter().find(|(known, _)| known == name).unwrap().1;
        let text = format!("[design]\n{}", names.iter().map(line).collect::<Vec<_>>().join("\n"));
        toml::from_str::<DesignFile>(&text).unwrap().design
    }

    #[test]
    fn both_of_a_pair_are_refused_on_either_side_and_the_first_silences_the_other() {
        for (one, two, why) in &PAIRS {
            let both = settings(&[one.name, two.name]);
            for (said, flag) in [(check_flags(&both), "--"), (check_file(&both), "")] {
                let said = said.unwrap_err().to_string();
                assert!(said.contains(&format!("{flag}{} cannot be used with {flag}{}", one.name, two.name)), "{said}");
                assert!(said.contains(why), "{said}");
            }
            for (wins, yields) in [(one, two), (two, one)] {
                let (first, mut other) = (settings(&[wins.name]), settings(&[yields.name]));
                assert!(check_file(&first).is_ok());
                assert_eq!(silence(&first, &mut other), [(yields.name, wins.name)]);
                assert!(!(yields.given)(&other));
                let merged = crate::spec::layers::or(settings(&[wins.name]), settings(&[yields.name]));
                assert!((wins.given)(&merged) && !(yields.given)(&merged), "{} {}", wins.name, yields.name);
                assert!(check_file(&merged).is_ok());
            }
        }
    }
}
