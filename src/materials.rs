//! What blocks are made of.

/// A transparent material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Name on the command line.
    pub name: &'static str,
    /// What a supplier calls it.
    pub description: &'static str,
    /// Refractive index at the yellow d line (587.6 nm) against air.
    pub ior: f64,
    /// Where the index is from.
    pub source: &'static str,
    /// How the index follows the wavelength, where that has been published.
    pub dispersion: Option<Dispersion>,
}

/// How the refractive index of a material follows the wavelength `w`, in micrometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dispersion {
    /// Sellmeier's equation, `n^2 = 1 + sum of b w^2 / (w^2 - c)`: pairs of b and c (square
    /// micrometres).
    Sellmeier(&'static [(f64, f64)]),
    /// Cauchy's equation with a term for the infrared, `n = a + b / w^2 + c w^2`.
    Cauchy {
        /// `a`.
        constant: f64,
        /// `b`, square micrometres.
        blue: f64,
        /// `c`, per square micrometre.
        infrared: f64,
    },
}

impl Dispersion {
    /// Refractive index at a wavelength, nm.
    pub fn ior_at(&self, wavelength_nm: f64) -> f64 {
        let square = (1e-3 * wavelength_nm).powi(2);
        match self {
            Self::Sellmeier(terms) => (1.0 + terms.iter().map(|(b, c)| b * square / (square - c)).sum::<f64>()).sqrt(),
            Self::Cauchy { constant, blue, infrared } => constant + blue / square + infrared * square,
        }
    }
}

/// The yellow d line of helium, nm: catalogues give the index there.
pub const D_LINE_NM: f64 = 587.6;

impl Material {
    /// Refractive index at a wavelength (nm, 400 to 700), where the dispersion is known: as
    /// published, shifted so that it is the catalogue's index at the d line.
    pub fn ior_at(&self, wavelength_nm: f64) -> Option<f64> {
        let dispersion = self.dispersion?;
        Some(self.ior + (dispersion.ior_at(wavelength_nm) - dispersion.ior_at(D_LINE_NM)))
    }
}

/// The materials known by name. Indices are the usual catalogue values; batches differ by some
/// units of the third decimal.
pub const MATERIALS: &[Material] = &[
    Material {
        name: "pmma",
        description: "cast acrylic, Plexiglas, Perspex, acrylic glass",
        ior: 1.49,
        source: "data sheets of cast sheets (ISO 489)",
        dispersion: Some(PMMA),
    },
    Material {
        name: "polycarbonate",
        description: "polycarbonate, Makrolon, Lexan",
        ior: 1.585,
        source: "data sheets (ISO 489)",
        dispersion: Some(POLYCARBONATE),
    },
    Material {
        name: "polystyrene",
        description: "clear polystyrene",
        ior: 1.59,
        source: "data sheets (ISO 489)",
        dispersion: Some(POLYSTYRENE),
    },
    Material { name: "petg", description: "PETG, Vivak", ior: 1.57, source: "data sheets (ISO 489)", dispersion: None },
    Material {
        name: "sla-clear",
        description: "clear printing resin, SLA or DLP; 1.505 to 1.52 by brand and cure",
        ior: 1.513,
        source: "two resins measured in Optical Materials Express 11, 3392 (2021)",
        dispersion: None,
    },
    Material {
        name: "cr39",
        description: "CR-39, the resin of spectacle lenses",
        ior: 1.498,
        source: "makers of lenses",
        dispersion: None,
    },
    Material {
        name: "bk7",
        description: "optical crown glass, Schott N-BK7",
        ior: 1.5168,
        source: "Schott's catalogue",
        dispersion: Some(BK7),
    },
    Material {
        name: "soda-lime",
        description: "window glass, float glass",
        ior: 1.523,
        source: "Rubin, Solar Energy Materials 12, 275 (1985)",
        dispersion: Some(SODA_LIME),
    },
    Material {
        name: "b270",
        description: "clear crown glass, Schott B 270",
        ior: 1.523,
        source: "Schott's data sheet",
        dispersion: None,
    },
    Material {
        name: "borosilicate",
        description: "borosilicate glass 3.3, Borofloat, Pyrex, Duran",
        ior: 1.4714,
        source: "Schott's data sheet of Borofloat 33",
        dispersion: None,
    },
    Material {
        name: "fused-silica",
        description: "synthetic quartz glass",
        ior: 1.4585,
        source: "Malitson (1965)",
        dispersion: Some(FUSED_SILICA),
    },
    Material {
        name: "water",
        description: "water at 20 degrees Celsius",
        ior: 1.3330,
        source: "Daimon and Masumura (2007)",
        dispersion: Some(WATER),
    },
];

/// What blocks are made of unless something else is said: what most of them are cut from.
pub const DEFAULT: &str = "pmma";

/// Szczurowski 2013, 405 to 1083 nm.
const PMMA: Dispersion = Dispersion::Sellmeier(&[(0.996_54, 0.007_87), (0.189_64, 0.021_91), (0.004_11, 3.857_27)]);
/// Sultanova, Kasarova and Nikolov, Acta Physica Polonica A 116, 585 (2009), 437 to 1052 nm.
const POLYCARBONATE: Dispersion = Dispersion::Sellmeier(&[(1.4182, 0.021_304)]);
/// The same.
const POLYSTYRENE: Dispersion = Dispersion::Sellmeier(&[(1.4435, 0.020_216)]);
/// Schott's catalogue of optical glass.
const BK7: Dispersion = Dispersion::Sellmeier(&[
    (1.039_612_12, 0.006_000_698_67),
    (0.231_792_344, 0.020_017_914_4),
    (1.010_469_45, 103.560_653),
]);
/// Rubin, Solar Energy Materials 12, 275 (1985): clear window glass.
const SODA_LIME: Dispersion = Dispersion::Cauchy { constant: 1.5130, blue: 0.003_962, infrared: -0.003_169 };
/// Malitson, Journal of the Optical Society of America 55, 1205 (1965).
const FUSED_SILICA: Dispersion = Dispersion::Sellmeier(&[
    (0.696_166_3, 0.068_404_3 * 0.068_404_3),
    (0.407_942_6, 0.116_241_4 * 0.116_241_4),
    (0.897_479_4, 9.896_161 * 9.896_161),
]);
/// Daimon and Masumura, Applied Optics 46, 3811 (2007), 20 degrees Celsius.
const WATER: Dispersion = Dispersion::Sellmeier(&[
    (0.568_402_756_5, 0.005_101_829_712),
    (0.172_617_739_1, 0.018_211_539_36),
    (0.020_861_895_78, 0.026_207_222_93),
    (0.113_074_868_8, 10.697_927_21),
]);

/// The material of this name, without regard to case.
pub fn by_name(name: &str) -> Option<&'static Material> {
    MATERIALS.iter().find(|material| material.name.eq_ignore_ascii_case(name))
}

/// The materials that may have been meant by a word: those of whose description it is a part, or
/// begins a part.
pub fn meant_by(word: &str) -> impl Iterator<Item = &'static Material> {
    let word = word.to_lowercase();
    let is_meant = move |material: &&Material| {
        let description = material.description.to_lowercase();
        let mut words = description.split(|c: char| !c.is_alphanumeric());
        word.chars().count() > 2 && words.any(|part| part.starts_with(&word))
    };
    MATERIALS.iter().filter(is_meant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispersion_formulas_meet_the_catalogue_at_the_d_line() {
        for material in MATERIALS {
            let Some(dispersion) = material.dispersion else { continue };
            let off = dispersion.ior_at(D_LINE_NM) - material.ior;
            assert!(off.abs() < 0.002, "{}: off by {off}", material.name);
            assert_eq!(material.ior_at(D_LINE_NM), Some(material.ior));
            assert!(material.ior_at(420.0) > material.ior_at(500.0) && material.ior_at(500.0) > material.ior_at(680.0));
        }
    }

    #[test]
    fn abbe_numbers_are_those_of_the_catalogues() {
        // Of plastics, sources differ by two.
        for (name, wanted, tolerance) in [
            ("bk7", 64.17, 0.05),
            ("fused-silica", 67.82, 0.1),
            ("pmma", 57.4, 2.5),
            ("polycarbonate", 29.9, 2.2),
            ("polystyrene", 30.9, 2.2),
            ("water", 55.7, 0.3),
        ] {
            let material = by_name(name).unwrap();
            let at = |nm: f64| material.ior_at(nm).unwrap();
            let abbe = (material.ior - 1.0) / (at(486.1) - at(656.3));
            assert!((abbe - wanted).abs() < tolerance, "{name}: {abbe}");
        }
    }

    #[test]
    fn materials_are_known_by_what_people_call_them() {
        let names = |word: &str| meant_by(word).map(|material| material.name).collect::<Vec<_>>();
        assert_eq!(names("acrylic"), ["pmma"]);
        assert_eq!(names("Plexi"), ["pmma"]);
        assert_eq!(names("resin"), ["sla-clear", "cr39"]);
        assert!(names("glas").contains(&"soda-lime") && names("glas").contains(&"bk7"));
        assert!(names("x").is_empty() && names("").is_empty());
    }
}
