//! Numbers and curves of a profile.

use crate::reference::tone::Tone;

/// Most samples of a curve that is believed: 16 bits have no more.
const MOST_SAMPLES: usize = 65536;

/// An unsigned number of so many bytes.
pub(super) fn number(bytes: &[u8], at: usize, length: usize) -> Option<u32> {
    let raw = bytes.get(at..at.checked_add(length)?)?;
    Some(raw.iter().fold(0, |sum, byte| sum << 8 | u32::from(*byte)))
}

/// An `s15Fixed16Number`.
pub(super) fn fixed(bytes: &[u8], at: usize) -> Option<f64> {
    Some(f64::from(number(bytes, at, 4)?.cast_signed()) / 65536.0)
}

/// A curve, `curv` or `para`, and the length that it takes, bytes.
pub(super) fn tone(tag: &[u8]) -> Option<(Tone, usize)> {
    match tag.get(..4)? {
        b"curv" => {
            let count = number(tag, 8, 4)? as usize;
            let tone = match count {
                0 => Tone::Linear,
                1 => Tone::Power(f64::from(number(tag, 12, 2)?) / 256.0),
                2..=MOST_SAMPLES => {
                    let samples = (0..count).map(|k| Some(f64::from(number(tag, 12 + 2 * k, 2)?) / 65535.0));
                    Tone::Sampled(samples.collect::<Option<_>>()?)
                }
                _ => return None,
            };
            Some((tone, 12 + 2 * count))
        }
        b"para" => {
            let kind = number(tag, 8, 2)?;
            let count = *[1, 3, 4, 5, 7].get(kind as usize)?;
            let p = (0..count).map(|k| fixed(tag, 12 + 4 * k)).collect::<Option<Vec<f64>>>()?;
            let g = p[0];
            let tone = match kind {
                0 => Tone::Power(g),
                1 if p[1] != 0.0 => Tone::Parametric { g, a: p[1], b: p[2], c: 0.0, d: -p[2] / p[1], e: 0.0, f: 0.0 },
                2 if p[1] != 0.0 => Tone::Parametric { g, a: p[1], b: p[2], c: 0.0, d: -p[2] / p[1], e: p[3], f: p[3] },
                3 => Tone::Parametric { g, a: p[1], b: p[2], c: p[3], d: p[4], e: 0.0, f: 0.0 },
                4 => Tone::Parametric { g, a: p[1], b: p[2], c: p[3], d: p[4], e: p[5], f: p[6] },
                _ => return None,
            };
            Some((tone, 12 + 4 * count))
        }
        _ => None,
    }
}
