//! What a block is made of, and its index at the wavelength that it is designed for.

use crate::{
    failure::Failure,
    materials::{self, Material},
    spec::{Settings, Wavelength, nearest},
};

/// The index of the block that settings describe.
pub fn ior_of(settings: &Settings) -> Result<f64, Failure> {
    let named = |name: &String| materials::by_name(name).ok_or_else(|| unknown(name));
    match (&settings.material, settings.ior) {
        (Some(name), _) => ior_at(named(name)?, settings.wavelength),
        (None, Some(ior)) => Ok(ior),
        (None, None) => ior_at(named(&materials::DEFAULT.to_owned())?, settings.wavelength),
    }
}

/// What may have been meant by a name that is none.
fn unknown(name: &str) -> Failure {
    let known = || materials::MATERIALS.iter().map(|material| material.name);
    let described = |material: &Material| format!("{} ({})", material.name, material.description);
    let meant: Vec<String> = materials::meant_by(name).map(described).collect();
    let hint = match (meant.as_slice(), nearest(name, known())) {
        ([], None) => format!("; known are {}", known().collect::<Vec<_>>().join(", ")),
        ([], Some(near)) => format!(", did you mean '{near}'?"),
        (meant, _) => format!(", did you mean {}?", meant.join(", or ")),
    };
    Failure::Usage(format!("there is no material '{name}'{hint} (`ior` takes any index)"))
}

/// The index of a material at a wavelength; at the catalogue's own if none is given.
pub fn ior_at(material: &Material, wavelength: Option<Wavelength>) -> Result<f64, Failure> {
    match wavelength {
        None => Ok(material.ior),
        Some(Wavelength { nm }) => material.ior_at(nm).ok_or_else(|| no_dispersion(material)),
    }
}

pub(super) fn no_dispersion(material: &Material) -> Failure {
    let known: Vec<&str> =
        materials::MATERIALS.iter().filter(|m| m.dispersion.is_some()).map(|material| material.name).collect();
    Failure::Usage(format!(
        "how the index of {} follows the wavelength is not known here; it is of {}",
        material.name,
        known.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blue_is_bent_more_than_red_and_the_unknown_is_refused() {
        let pmma = materials::by_name("pmma").unwrap();
        let at = |nm: f64| ior_at(pmma, Some(Wavelength { nm })).unwrap();
        assert!(at(450.0) > ior_at(pmma, None).unwrap() && ior_at(pmma, None).unwrap() > at(650.0));
        let petg = materials::by_name("petg").unwrap();
        assert!(ior_at(petg, Some(Wavelength { nm: 532.0 })).unwrap_err().to_string().contains("pmma"));
    }
}
