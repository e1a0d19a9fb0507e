//! From the numbers of a picture to luminance.

use super::{
    PictureError, Transfer,
    curve::{Curve, Model},
    lightness::Lightness,
    primaries::{Primaries, REC_709},
    profile,
};

/// What a file says of its colours.
#[derive(Clone, Debug)]
pub(super) enum Says {
    Nothing,
    /// Numbers that are light as they stand.
    Float,
    Profile(Vec<u8>),
    /// PNG's chunk `cICP`, in the words of ITU-T H.273.
    Coded {
        primaries: u8,
        transfer: u8,
        matrix: u8,
        full: bool,
    },
    /// PNG's chunk `sRGB`.
    Srgb,
    /// PNG's chunks `gAMA` and `cHRM`.
    Gamma {
        gamma: Option<f64>,
        primaries: Option<Primaries>,
    },
}

/// How a picture's colours are understood.
pub(super) struct Understanding {
    pub(super) lightness: Lightness,
    /// In words.
    pub(super) words: String,
    /// Nothing that would have to be said.
    pub(super) plain: bool,
    /// What was passed over, in words.
    pub(super) passed_over: Option<String>,
}

impl Says {
    /// What it means for a picture of these numbers, unless a transfer was asked for.
    pub(super) fn understood(&self, model: Model, asked: Option<Transfer>) -> Result<Understanding, PictureError> {
        let curve = |curve: Curve, weights: [f64; 3], words: String, plain: bool| Understanding {
            lightness: Lightness::alike(&curve, weights),
            words,
            plain,
            passed_over: None,
        };
        let srgb = || {
            let words = if model == Model::Cmyk { "CMYK without a profile, as sRGB" } else { "sRGB" };
            curve(Curve::Transfer(Transfer::Srgb), REC_709, words.into(), model != Model::Cmyk)
        };
        if let Some(transfer) = asked {
            let words = match transfer {
                Transfer::Srgb => "sRGB, as asked for",
                Transfer::Linear => "linear light, as asked for",
            };
            return Ok(curve(Curve::Transfer(transfer), REC_709, words.into(), false));
        }
        Ok(match self {
            Self::Nothing | Self::Srgb => srgb(),
            Self::Float => {
                curve(Curve::Transfer(Transfer::Linear), REC_709, "linear light, as floats are".into(), false)
            }
            Self::Profile(bytes) => match profile::read(bytes, model) {
                Ok((lightness, name)) => {
                    let plain = name.starts_with("sRGB");
                    Understanding { lightness, words: format!("by its ICC profile '{name}'"), plain, passed_over: None }
                }
                Err(why) => Understanding { passed_over: Some(format!("{why} and was passed over")), ..srgb() },
            },
            Self::Coded { primaries, transfer, matrix, full } => {
                let (of, by) = coded_curve(*transfer)?;
                let refused = |what: String| PictureError::Coded { what };
                if *matrix != 0 || !full {
                    return Err(refused("colours that are no RGB of full range".into()));
                }
                let (set, name) = Primaries::coded(*primaries)
                    .ok_or_else(|| refused(format!("colour primaries number {primaries}")))?;
                let weights = set.weights().unwrap_or(REC_709);
                let plain = (*primaries, *transfer) == (1, 13);
                let weights = if *primaries == 1 { REC_709 } else { weights };
                curve(of, weights, format!("{by}, primaries of {name}, by its cICP chunk"), plain)
            }
            Self::Gamma { gamma, primaries } => {
                let weights = primaries.and_then(|primaries| primaries.weights());
                let by = if weights.is_some() && model != Model::Grey { "gAMA and cHRM chunks" } else { "gAMA chunk" };
                let weights = weights.unwrap_or(REC_709);
                match gamma {
                    Some(gamma) if (*gamma - 1.0).abs() < 1e-9 => {
                        curve(Curve::Transfer(Transfer::Linear), weights, format!("linear light by its {by}"), false)
                    }
                    Some(gamma) => {
                        curve(Curve::Power(1.0 / gamma), weights, format!("gamma {gamma} by its {by}"), false)
                    }
                    None if model == Model::Grey => srgb(),
                    None => curve(
                        Curve::Transfer(Transfer::Srgb),
                        weights,
                        "the curve of sRGB with the primaries of its cHRM chunk".into(),
                        false,
                    ),
                }
            }
        })
    }
}

/// The transfer function that ITU-T H.273 numbers so.
fn coded_curve(number: u8) -> Result<(Curve, &'static str), PictureError> {
    let hdr = |what: &str| PictureError::Coded { what: what.into() };
    Ok(match number {
        1 | 6 | 14 | 15 => (Curve::Rec709, "curve of Rec. 709"),
        4 => (Curve::Power(2.2), "power 2.2"),
        5 => (Curve::Power(2.8), "power 2.8"),
        8 => (Curve::Transfer(Transfer::Linear), "linear light"),
        13 => (Curve::Transfer(Transfer::Srgb), "curve of sRGB"),
        16 => return Err(hdr("the HDR curve PQ (SMPTE 2084), whose light has no white")),
        18 => return Err(hdr("the HDR curve HLG (ARIB B67), whose light has no white")),
        other => return Err(hdr(&format!("transfer function number {other}"))),
    })
}

/// Whether the colours are multiplied by alpha already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    None,
    Straight,
    Premultiplied,
}

/// Turns rows of numbers into light.
pub(super) struct Lamp {
    model: Model,
    alpha: Alpha,
    lightness: Lightness,
    /// Light behind transparent parts.
    background: f64,
    /// Light of every integer, where numbers are integers: the greatest one, and a table for each
    /// colour.
    known: Option<(f64, [Vec<f64>; 3])>,
    stride: usize,
}

/// What a pixel shows, and through what.
#[derive(Clone, Copy)]
pub(super) struct Shown {
    pub(super) light: f64,
    /// Light of its colour alone.
    pub(super) colour: f64,
    pub(super) alpha: f64,
}

impl Lamp {
    /// `greatest` is the integer that stands for 1, if numbers are integers; `stride` numbers lie
    /// from pixel to pixel.
    pub(super) fn new(
        (model, alpha, stride): (Model, Alpha, usize),
        greatest: Option<u16>,
        lightness: Lightness,
        background: f64,
    ) -> Self {
        let known = greatest.map(f64::from).and_then(|greatest| {
            let table = |curve: &Curve, weight: f64| -> Vec<f64> {
                (0..=greatest as usize).map(|k| weight * curve.light(k as f64 / greatest)).collect()
            };
            match (&lightness, model) {
                (Lightness::Rgb { curves, weights }, Model::Rgb) if alpha != Alpha::Premultiplied => {
                    Some((greatest, [0, 1, 2].map(|k| table(&curves[k], weights[k]))))
                }
                (Lightness::Rgb { .. } | Lightness::Grey(_), Model::Grey) if alpha != Alpha::Premultiplied => {
                    let grey = (0..=greatest as usize).map(|k| light_of(&lightness, model, &[k as f64 / greatest]));
                    Some((greatest, [grey.collect(), Vec::new(), Vec::new()]))
                }
                _ => None,
            }
        });
        Self { model, alpha, lightness, background, known, stride }
    }

    /// Numbers from pixel to pixel.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// What a pixel shows.
    pub(super) fn shine(&self, pixel: &[f32]) -> Shown {
        let channels = self.model.channels();
        let alpha = if self.alpha == Alpha::None { 1.0 } else { f64::from(pixel[channels]).clamp(0.0, 1.0) };
        let colour = match &self.known {
            Some((greatest, tables)) => (0..tables.len().min(channels))
                .map(|k| tables[k][((f64::from(pixel[k]) * greatest + 0.5) as usize).min(tables[k].len() - 1)])
                .sum(),
            None => {
                // On a curve, premultiplied numbers mean nothing before they are divided.
                let divided = if self.alpha == Alpha::Premultiplied && alpha > 0.0 { alpha } else { 1.0 };
                let mut numbers = [0.0; 4];
                for k in 0..channels {
                    numbers[k] = f64::from(pixel[k]) / divided;
                }
                light_of(&self.lightness, self.model, &numbers[..channels])
            }
        };
        let light = if self.alpha == Alpha::None { colour } else { alpha * colour + (1.0 - alpha) * self.background };
        Shown { light, colour, alpha }
    }
}

fn light_of(lightness: &Lightness, model: Model, numbers: &[f64]) -> f64 {
    match (lightness, model) {
        (Lightness::Grey(curve), _) => curve.light(numbers[0]),
        (Lightness::Rgb { curves, weights }, Model::Grey) => {
            if curves[0] == curves[1] && curves[0] == curves[2] {
                // The weights add up to 1 but for rounding.
                curves[0].light(numbers[0])
            } else {
                (0..3).map(|k| weights[k] * curves[k].light(numbers[0])).sum()
            }
        }
        (Lightness::Rgb { curves, weights }, Model::Rgb) => {
            (0..3).map(|k| weights[k] * curves[k].light(numbers[k])).sum()
        }
        (Lightness::Rgb { curves, weights }, Model::Cmyk) => {
            (0..3).map(|k| weights[k] * curves[k].light((1.0 - numbers[k]) * (1.0 - numbers[3]))).sum()
        }
        (Lightness::Table(table), Model::Grey) => table.light(&[numbers[0]; 3]),
        (Lightness::Table(table), _) => table.light(numbers),
    }
}
