//! Published photometry of lamps: IES files (ANSI/IES LM-63), as makers of torches and LEDs hand
//! them out.

use std::str::SplitWhitespace;

/// Luminous intensity of a lamp by the angle to its axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// Angles to the axis, radians, ascending from 0.
    angles: Vec<f64>,
    /// Intensities, candela: means over the planes through the axis.
    candela: Vec<f64>,
    asymmetry: f64,
}

/// Why a text is no photometry.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhotometryError {
    /// Something that the format requires is missing.
    #[error("the IES file has no {0}")]
    Missing(&'static str),
    /// A number that cannot be.
    #[error("{what} of the IES file is '{text}'; {wanted}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What stands there.
        text: String,
        /// What should.
        wanted: &'static str,
    },
    /// Photometry of another kind.
    #[error(
        "the IES file uses photometry of type {0}; only type C (angles from the lamp's axis) is read: ask the maker for a type C file"
    )]
    Kind(&'static str),
}

impl Photometry {
    /// Most angles of a file, and most planes.
    const MOST: usize = 10_000;

    /// Reads the text of an IES file of type C photometry.
    ///
    /// # Errors
    /// Texts that are no such file.
    pub fn parse_ies(text: &str) -> Result<Self, PhotometryError> {
        // Keywords end with the line that says how the lamp was tilted; numbers follow, in any
        // number of lines.
        let at = text.find("TILT=").ok_or(PhotometryError::Missing("TILT= line"))?;
        let (tilt, rest) = text[at + 5..].split_once('\n').ok_or(PhotometryError::Missing("numbers"))?;
        let mut numbers = Numbers(rest.split_whitespace());
        if tilt.trim().eq_ignore_ascii_case("INCLUDE") {
            numbers.skip("lamp-to-luminaire geometry", 1)?;
            let pairs = numbers.count("number of tilt angles")?;
            numbers.skip("tilt angles and multipliers", 2 * pairs)?;
        }
        numbers.skip("lamps", 2)?;
        let multiplier = numbers.next("candela multiplier")?;
        let (vertical, horizontal) = (numbers.count("number of vertical angles")?, numbers.count("number of planes")?);
        match numbers.next("photometric type")? {
            1.0 => {}
            2.0 => return Err(PhotometryError::Kind("B")),
            3.0 => return Err(PhotometryError::Kind("A")),
            other => return Err(value("the photometric type", &other.to_string(), "1 is type C")),
        }
        // Units, three dimensions, ballast factor, one for future use, and the power.
        numbers.skip("dimensions", 7)?;
        let mut angles = Vec::with_capacity(vertical);
        for _ in 0..vertical {
            angles.push(numbers.next("vertical angle")?.to_radians());
        }
        let ascending = angles.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascending || angles[0] != 0.0 {
            let wanted = "they must ascend from 0, the lamp's axis";
            return Err(value("the first vertical angle", &angles[0].to_degrees().to_string(), wanted));
        }
        numbers.skip("plane angles", horizontal)?;
        let mut planes = vec![Vec::with_capacity(vertical); horizontal];
        for plane in &mut planes {
            for _ in 0..vertical {
                let candela = numbers.next("intensity")? * multiplier;
                if candela.is_nan() || candela < 0.0 {
                    return Err(value("an intensity", &candela.to_string(), "light is never negative"));
                }
                plane.push(candela);
            }
        }
        let mean = |k: usize| planes.iter().map(|plane| plane[k]).sum::<f64>() / horizontal as f64;
        let candela: Vec<f64> = (0..vertical).map(mean).collect();
        let peak = candela.iter().copied().fold(0.0, f64::max);
        if peak <= 0.0 {
            return Err(value("the greatest intensity", "0", "the lamp gives no light"));
        }
        let off = |k: usize| planes.iter().map(|plane| (plane[k] - candela[k]).abs()).fold(0.0, f64::max);
        let asymmetry = (0..vertical).map(off).fold(0.0, f64::max) / peak;
        Ok(Self { angles, candela, asymmetry })
    }

    /// Angles to the axis, radians, and intensities, candela.
    pub fn table(&self) -> impl Iterator<Item = (f64, f64)> {
        self.angles.iter().copied().zip(self.candela.iter().copied())
    }

    /// Intensity at an angle to the axis, radians, candela: linear between the file's angles, none
    /// beyond the last.
    pub fn candela_at(&self, angle: f64) -> f64 {
        let k = self.angles.partition_point(|&a| a <= angle);
        match (k.checked_sub(1), self.angles.get(k)) {
            (Some(low), Some(&high)) => {
                let share = (angle - self.angles[low]) / (high - self.angles[low]);
                self.candela[low] + share * (self.candela[k] - self.candela[low])
            }
            (Some(low), None) if self.angles[low] == angle => self.candela[low],
            _ => 0.0,
        }
    }

    /// Greatest difference of a plane through the axis from the mean of all, as a part of the peak.
    pub fn asymmetry(&self) -> f64 {
        self.asymmetry
    }
}

struct Numbers<'a>(SplitWhitespace<'a>);

impl Numbers<'_> {
    fn next(&mut self, what: &'static str) -> Result<f64, PhotometryError> {
        let text = self.0.next().ok_or(PhotometryError::Missing(what))?;
        match text.trim_end_matches(',').parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(value(what, text, "it must be a number")),
        }
    }

    fn count(&mut self, what: &'static str) -> Result<usize, PhotometryError> {
        let number = self.next(what)?;
        if (1.0..=Photometry::MOST as f64).contains(&number) && number.fract() == 0.0 {
            Ok(number as usize)
        } else {
            Err(value(what, &number.to_string(), "it must be a whole number from 1 to 10000"))
        }
    }

    fn skip(&mut self, what: &'static str, count: usize) -> Result<(), PhotometryError> {
        (0..count).try_for_each(|_| self.next(what).map(drop))
    }
}

fn value(what: &'static str, text: &str, wanted: &'static str) -> PhotometryError {
    PhotometryError::Value { what, text: text.chars().take(40).collect(), wanted }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TORCH: &str = "IESNA:LM-63-2002\n[TEST] bench\n[MANUFAC] none\nTILT=NONE\n1 200 2.0 4 2 1 2 0.02 0.02 0\n1.0 1.0 3\n0 10 20 30\n0 90\n100 80 20 0\n100 60 20 0\n";

    #[test]
    fn a_torch_is_read_with_its_multiplier_and_the_mean_of_its_planes() {
        let torch = Photometry::parse_ies(TORCH).unwrap();
        let wanted = [(0.0, 200.0), (5.0, 170.0), (10.0, 140.0), (25.0, 20.0), (30.0, 0.0), (31.0, 0.0)];
        for (deg, candela) in wanted {
            assert!((torch.candela_at(f64::to_radians(deg)) - candela).abs() < 1e-9, "{deg}");
        }
        assert!((torch.asymmetry() - 0.1).abs() < 1e-12);
        assert_eq!(torch.table().count(), 4);
    }

    #[test]
    fn other_texts_are_refused() {
        for (from, to) in [
            ("TILT=NONE", "no tilt"),
            ("1 200 2.0 4 2 1 2", "1 200 2.0 4 2 3 2"),
            ("1 200 2.0 4 2 1 2", "1 200 2.0 4e9 2 1 2"),
            ("0 10 20 30\n", "5 10 20 30\n"),
            ("0 10 20 30\n", "0 20 10 30\n"),
            ("100 60 20 0\n", "100 60 20\n"),
            ("100 60 20 0\n", "100 -60 20 0\n"),
            ("100 60 20 0\n", "100 nan 20 0\n"),
        ] {
            assert!(Photometry::parse_ies(&TORCH.replace(from, to)).is_err(), "{to}");
        }
        assert!(Photometry::parse_ies("").is_err());
    }
}
