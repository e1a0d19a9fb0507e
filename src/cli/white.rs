//! White light: the wavelength that a block is designed for, and what becomes of the others.

use super::{
    console::say, error::Failure, judge::Subject, quantity::number_or_text, settings::Settings, verify::IrradianceFile,
};
use glasswarp::materials::{self, D_LINE_NM, Material};
use glasswarp_verify::{
    Optics, Scene,
    dispersion::{Dispersed, Fringing, LINES_NM, disperse},
    image_file,
};
use serde::{Deserialize, Deserializer};
use std::{fmt, path::Path, str::FromStr};

/// A wavelength as a person writes it: `532nm`; a bare number is nanometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wavelength {
    pub(crate) nm: f64,
}

/// Wavelengths for which dispersion is known of most materials, nm.
const VISIBLE_NM: (f64, f64) = (400.0, 700.0);

impl FromStr for Wavelength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.trim().strip_suffix("nm").unwrap_or(text).trim();
        match number.parse::<f64>() {
            Ok(nm) if (VISIBLE_NM.0..=VISIBLE_NM.1).contains(&nm) => Ok(Self { nm }),
            Ok(nm) => Err(format!(
                "{nm} nm is no visible light; it must lie between {} and {} nm",
                VISIBLE_NM.0, VISIBLE_NM.1
            )),
            Err(_) => Err(format!("'{text}' is no wavelength; write 532nm (a bare number is nanometres)")),
        }
    }
}

impl fmt::Display for Wavelength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}nm", self.nm)
    }
}

impl<'de> Deserialize<'de> for Wavelength {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number_or_text(deserializer, "a wavelength such as \"532nm\", or a number of nanometres", |nm| {
            nm.to_string().parse()
        })
    }
}

/// The index of a material at a wavelength; at the catalogue's own if none is given.
pub(crate) fn ior_at(material: &Material, wavelength: Option<Wavelength>) -> Result<f64, Failure> {
    match wavelength {
        None => Ok(material.ior),
        Some(Wavelength { nm }) => material.ior_at(nm).ok_or_else(|| no_dispersion(material)),
    }
}

fn no_dispersion(material: &Material) -> Failure {
    let known: Vec<&str> =
        materials::MATERIALS.iter().filter(|m| m.dispersion.is_some()).map(|material| material.name).collect();
    Failure::Usage(format!(
        "how the index of {} follows the wavelength is not known here; it is of {}",
        material.name,
        known.join(", ")
    ))
}

/// Looks at a block in white light, and writes its picture: .png (sRGB) or .exr (linear, with the primaries of sRGB).
pub(crate) fn look(
    subject: &Subject,
    scene: &Scene,
    settings: Option<&Settings>,
    beams: (usize, usize),
    output: &Path,
) -> Result<Fringing, Failure> {
    let format = IrradianceFile::of(output)?;
    let Subject::Block(block) = subject else {
        return Err(Failure::Usage("--white looks at blocks; this is another solid".into()));
    };
    if scene.optics == Optics::Reflects {
        return Err(Failure::Usage(
            "--white: a mirror reflects all colours alike, there is no dispersion to look at".into(),
        ));
    }
    let material = settings.and_then(|settings| settings.material.as_deref()).and_then(materials::by_name);
    let material = material.ok_or_else(|| {
        Failure::Usage(
            "--white needs to know what the block is made of, and its side file names an index only: design it with --material"
                .into(),
        )
    })?;
    if material.dispersion.is_none() {
        return Err(no_dispersion(material));
    }
    let index = |nm: f64| material.ior_at(nm).unwrap_or(material.ior);
    let Dispersed { rgb, fringing, .. } = disperse(block, scene, &index, beams).map_err(Failure::refused)?;
    let peak = rgb.iter().flat_map(|image| &image.values).copied().fold(0.0, f64::max);
    let written = match format {
        IrradianceFile::Png => image_file::write_rgb_png(output, &rgb, peak),
        IrradianceFile::Exr => image_file::write_rgb_exr(output, &rgb),
    };
    written.map_err(Failure::writing)?;
    let designed = settings.and_then(|settings| settings.wavelength).map_or(D_LINE_NM, |wavelength| wavelength.nm);
    say!("\nIn white light ({}, designed for {designed} nm)", material.name);
    say!(
        "  colours part   {:.3} mm rms, {:.3} mm at most, between {} nm (index {:.4}) and {} nm (index {:.4})",
        fringing.rms_mm,
        fringing.worst_mm,
        LINES_NM[0],
        fringing.ior[0],
        LINES_NM[1],
        fringing.ior[1]
    );
    say!("  brightness     {:.4} relative RMS from the light of one colour", fringing.rel_rms);
    say!("  picture        {}", output.display());
    Ok(fringing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavelengths_are_read_with_their_unit_and_their_limits() {
        assert_eq!("532nm".parse(), Ok(Wavelength { nm: 532.0 }));
        assert_eq!(" 632.8 nm ".parse(), Ok(Wavelength { nm: 632.8 }));
        for text in ["", "nm", "532um", "1064nm", "nan"] {
            assert!(text.parse::<Wavelength>().is_err(), "{text}");
        }
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
