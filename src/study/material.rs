//! What a block is made of, and its index at the wavelength that it is designed for.

use crate::{
    failure::Failure,
    materials::{self, D_LINE_NM, Material},
    spec::{Settings, VISIBLE_NM, Wavelength, nearest},
};
use serde::Serialize;

/// The index of the block that settings describe.
pub fn ior_of(settings: &Settings) -> Result<f64, Failure> {
    match named(settings) {
        Ok(name) => ior_at(materials::by_name(name).ok_or_else(|| unknown(name))?, settings.wavelength),
        Err(ior) => Ok(ior),
    }
}

/// The name of the material, or an index that was given instead.
fn named(settings: &Settings) -> Result<&str, f64> {
    match (&settings.material, settings.ior) {
        (Some(name), _) => Ok(name),
        (None, Some(ior)) => Err(ior),
        (None, None) => Ok(materials::DEFAULT),
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

/// How the index of a block follows the wavelength, as plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spectrum {
    /// The wavelength that the block is designed for.
    pub design_nm: f64,
    /// That of the first index, and from each to the next.
    pub first_nm: f64,
    /// From each to the next.
    pub step_nm: f64,
    /// The material's index.
    pub ior: Vec<f64>,
}

/// Between its numbers an index is taken as on a straight line: that of acrylic is off by 3.8e-6 at most.
const STEP_NM: f64 = 5.0;

impl Spectrum {
    /// That of the material that settings name, if it has been published.
    pub fn of(settings: &Settings) -> Option<Self> {
        let material = materials::by_name(named(settings).ok()?)?;
        let (first_nm, last_nm) = VISIBLE_NM;
        let count = ((last_nm - first_nm) / STEP_NM).round() as usize;
        let ior = (0..=count).map(|k| material.ior_at(first_nm + k as f64 * STEP_NM)).collect::<Option<_>>()?;
        let design_nm = settings.wavelength.map_or(D_LINE_NM, |wavelength| wavelength.nm);
        Some(Self { design_nm, first_nm, step_nm: STEP_NM, ior })
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
    use crate::measured::at_worst;

    #[test]
    fn a_spectrum_is_that_of_the_material_between_its_numbers_too() {
        let pmma = materials::by_name("pmma").unwrap();
        let Spectrum { design_nm, first_nm, step_nm, ior } = Spectrum::of(&Settings::default()).unwrap();
        let furthest = (0..ior.len() - 1).map(|k| {
            let nm = first_nm + (k as f64 + 0.5) * step_nm;
            (pmma.ior_at(nm).unwrap() - 0.5 * (ior[k] + ior[k + 1])).abs()
        });
        at_worst(3.75e-6, furthest.fold(0.0, f64::max), format_args!("halfway"));
        assert!((first_nm + step_nm * (ior.len() - 1) as f64 - VISIBLE_NM.1).abs() < 1e-9);
        assert_eq!(design_nm, D_LINE_NM);
        assert_eq!(Spectrum::of(&Settings { ior: Some(1.5), ..Settings::default() }), None);
        assert_eq!(Spectrum::of(&Settings { material: Some("petg".into()), ..Settings::default() }), None);
    }

    #[test]
    fn blue_is_bent_more_than_red_and_the_unknown_is_refused() {
        let pmma = materials::by_name("pmma").unwrap();
        let at = |nm: f64| ior_at(pmma, Some(Wavelength { nm })).unwrap();
        assert!(at(450.0) > ior_at(pmma, None).unwrap() && ior_at(pmma, None).unwrap() > at(650.0));
        let petg = materials::by_name("petg").unwrap();
        assert!(ior_at(petg, Some(Wavelength { nm: 532.0 })).unwrap_err().to_string().contains("pmma"));
    }
}
