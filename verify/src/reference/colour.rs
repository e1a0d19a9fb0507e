//! From numbers in a file to light: the luminance of a colour, and what PNG says of them.

use super::{
    error::ReferenceError,
    icc::Table,
    plane::Plane,
    raster::{Alpha, Inks, Raster, Samples},
    tone::Tone,
};
use rayon::prelude::*;

/// Luminance of the primaries of Rec. 709, which sRGB has too (white = 1).
pub(super) const REC_709: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What the numbers of a picture mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    /// A curve for each colour, and their luminance; grey is equal parts of all.
    Curves { tones: Box<[Tone; 3]>, weights: [f64; 3] },
    /// A table of an ICC profile.
    Table(Box<Table>),
}

impl Meaning {
    pub(super) fn of(tone: Tone, weights: [f64; 3]) -> Self {
        Self::Curves { tones: Box::new([tone.clone(), tone.clone(), tone]), weights }
    }

    pub(super) fn srgb() -> Self {
        Self::of(Tone::Srgb, REC_709)
    }

    pub(super) fn linear() -> Self {
        Self::of(Tone::Linear, REC_709)
    }

    /// Whether light is proportional to the numbers, as that of glowing gas in front of nothing is.
    pub(super) fn is_linear(&self) -> bool {
        matches!(self, Self::Curves { tones, .. } if tones.iter().all(|tone| *tone == Tone::Linear))
    }

    /// The luminance of a pixel's colour, without its alpha.
    fn light(&self, inks: Inks, colour: &[f64]) -> f64 {
        match (self, inks) {
            (Self::Table(table), _) => table.luminance(colour),
            (Self::Curves { tones, weights }, Inks::Grey) => {
                (0..3).map(|k| weights[k] * tones[k].light(colour[0])).sum()
            }
            (Self::Curves { tones, weights }, Inks::Rgb) => {
                (0..3).map(|k| weights[k] * tones[k].light(colour[k])).sum()
            }
            (Self::Curves { tones, weights }, Inks::Cmyk) => {
                let paper = 1.0 - colour[3];
                (0..3).map(|k| weights[k] * tones[k].light((1.0 - colour[k]) * paper)).sum()
            }
        }
    }

    /// The light of all pixels over a background of this luminance.
    pub(super) fn linearised(&self, raster: &Raster, background: f64) -> Plane {
        let values = match &raster.samples {
            Samples::Bits8(samples) => self.of_integers(raster, samples, background),
            Samples::Bits16(samples) => self.of_integers(raster, samples, background),
            Samples::Float(samples) => self.of_samples(raster, samples, 1.0, background),
        };
        Plane { nx: raster.nx, ny: raster.ny, values }
    }

    fn of_integers<T: Copy + Into<u32> + Into<f64> + Sync>(
        &self,
        raster: &Raster,
        samples: &[T],
        background: f64,
    ) -> Vec<f32> {
        let most = if size_of::<T>() == 1 { 255.0 } else { 65535.0 };
        let (Self::Curves { tones, weights }, Inks::Grey | Inks::Rgb) = (self, raster.inks) else {
            return self.of_samples(raster, samples, 1.0 / most, background);
        };
        if raster.alpha == Alpha::Premultiplied {
            return self.of_samples(raster, samples, 1.0 / most, background);
        }
        // Every curve is taken once for every number that there can be.
        let of = |colours: std::ops::Range<usize>| -> Vec<f64> {
            let light = |v: f64| colours.clone().map(|k| weights[k] * tones[k].light(v)).sum();
            (0..=most as u32).map(|v| light(f64::from(v) / most)).collect()
        };
        let tables = match raster.inks {
            Inks::Grey => vec![of(0..3)],
            _ => (0..3).map(|k| of(k..k + 1)).collect(),
        };
        let has_alpha = raster.alpha != Alpha::None;
        let light = |pixel: &[T]| {
            let light: f64 = tables.iter().zip(pixel).map(|(table, v)| table[Into::<u32>::into(*v) as usize]).sum();
            if !has_alpha {
                return light as f32;
            }
            let alpha = Into::<f64>::into(pixel[tables.len()]) / most;
            (alpha * light + (1.0 - alpha) * background) as f32
        };
        samples.par_chunks_exact(raster.channels()).map(light).collect()
    }

    fn of_samples<T: Copy + Into<f64> + Sync>(
        &self,
        raster: &Raster,
        samples: &[T],
        scale: f64,
        background: f64,
    ) -> Vec<f32> {
        let count = raster.inks.count();
        let light = |pixel: &[T]| {
            let mut colour = [0.0; 4];
            for (value, sample) in colour.iter_mut().zip(&pixel[..count]) {
                *value = scale * Into::<f64>::into(*sample);
            }
            let alpha = match raster.alpha {
                Alpha::None => return self.light(raster.inks, &colour[..count]) as f32,
                Alpha::Straight => scale * Into::<f64>::into(pixel[count]),
                Alpha::Premultiplied => {
                    let alpha = scale * Into::<f64>::into(pixel[count]);
                    if self.is_linear() {
                        return (self.light(raster.inks, &colour[..count]) + (1.0 - alpha) * background) as f32;
                    }
                    if alpha > 0.0 {
                        colour.iter_mut().for_each(|value| *value /= alpha);
                    }
                    alpha
                }
            };
            (alpha * self.light(raster.inks, &colour[..count]) + (1.0 - alpha) * background) as f32
        };
        samples.par_chunks_exact(raster.channels()).map(light).collect()
    }
}

/// Luminance of primaries with these chromaticities (x, y of red, green, blue) for a white of
/// luminance 1. `None` if they make none.
pub(super) fn luminances(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Option<[f64; 3]> {
    // The columns are the tristimulus values of primaries of luminance 1; what mixes the white is
    // asked for.
    let tristimulus = |[x, y]: [f64; 2]| glam::DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let mixed = glam::DMat3::from_cols(tristimulus(primaries[0]), tristimulus(primaries[1]), tristimulus(primaries[2]));
    let weights = mixed.inverse() * tristimulus(white);
    let sound = mixed.determinant().abs() > 1e-9 && weights.is_finite();
    sound.then(|| weights.to_array())
}

/// What PNG's `cICP` says (ITU-T H.273), `None` if that is "unspecified".
pub(super) fn of_cicp(cicp: &[u8]) -> Result<Option<Meaning>, ReferenceError> {
    let &[primaries, transfer, matrix, full] = cicp else {
        return Err(ReferenceError::malformed("PNG", format!("cICP has {} bytes instead of 4", cicp.len())));
    };
    let refused = |what: String| Err(ReferenceError::Colour { what });
    if primaries == 2 || transfer == 2 {
        return Ok(None);
    }
    if matrix != 0 {
        return refused(format!("cICP with the matrix {matrix}"));
    }
    if full != 1 {
        return refused(format!("cICP with values that do not fill their range (full-range flag {full})"));
    }
    let tone = match transfer {
        1 | 6 | 14 | 15 => Tone::Rec709,
        4 => Tone::Power(2.2),
        5 => Tone::Power(2.8),
        8 => Tone::Linear,
        13 => Tone::Srgb,
        16 => return refused("cICP with the transfer function PQ (16)".into()),
        18 => return refused("cICP with the transfer function HLG (18)".into()),
        other => return refused(format!("cICP with the transfer function {other}")),
    };
    const D65: [f64; 2] = [0.3127, 0.3290];
    const C: [f64; 2] = [0.310, 0.316];
    let weights = match primaries {
        1 => Some(REC_709),
        4 => luminances([[0.67, 0.33], [0.21, 0.71], [0.14, 0.08]], C),
        5 => luminances([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06]], D65),
        6 | 7 => luminances([[0.630, 0.340], [0.310, 0.595], [0.155, 0.070]], D65),
        8 => luminances([[0.681, 0.319], [0.243, 0.692], [0.145, 0.049]], C),
        9 => luminances([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], D65),
        // XYZ: only the second is bright.
        10 => Some([0.0, 1.0, 0.0]),
        11 => luminances([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], [0.314, 0.351]),
        12 => luminances([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], D65),
        22 => luminances([[0.630, 0.340], [0.295, 0.605], [0.155, 0.077]], D65),
        _ => None,
    };
    match weights {
        Some(weights) => Ok(Some(Meaning::of(tone, weights))),
        None => refused(format!("cICP with the primaries {primaries}")),
    }
}

/// What PNG's `gAMA` and `cHRM` say, whichever are there; both hold numbers times 100 000.
pub(super) fn of_gamma(gamma: Option<&[u8]>, chromaticities: Option<&[u8]>) -> Result<Meaning, ReferenceError> {
    let numbers = |bytes: &[u8]| -> Vec<f64> {
        bytes.chunks_exact(4).map(|b| f64::from(u32::from_be_bytes([b[0], b[1], b[2], b[3]])) / 1e5).collect()
    };
    let tone = match gamma.map(numbers).as_deref() {
        None => Tone::Srgb,
        Some(&[gamma]) if gamma > 0.0 => Tone::Power(1.0 / gamma),
        Some(_) => return Err(ReferenceError::malformed("PNG", "gAMA is not one positive number")),
    };
    let weights = match chromaticities.map(numbers).as_deref() {
        None => REC_709,
        Some(&[wx, wy, rx, ry, gx, gy, bx, by]) => luminances([[rx, ry], [gx, gy], [bx, by]], [wx, wy])
            .ok_or_else(|| ReferenceError::malformed("PNG", "the primaries of cHRM make no white"))?,
        Some(_) => return Err(ReferenceError::malformed("PNG", "cHRM does not hold eight numbers")),
    };
    Ok(Meaning::of(tone, weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_of_the_standards_have_the_luminance_that_the_standards_print() {
        let d65 = [0.3127, 0.3290];
        let rec_709 = luminances([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], d65).unwrap();
        let rec_2020 = luminances([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], d65).unwrap();
        for (found, printed) in [(rec_709, REC_709), (rec_2020, [0.2627, 0.6780, 0.0593])] {
            assert!(found.iter().zip(printed).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?}");
        }
        assert_eq!(luminances([[0.3, 0.3]; 3], d65), None);
    }
}
