//! Profiles that are tables: curves, a grid of colours, curves again.

use super::values::{fixed, number, tone};
use crate::reference::tone::Tone;

/// From the numbers of a colour to luminance, by `mft1`, `mft2` or `mAB `.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::reference) struct Table {
    inputs: Vec<Tone>,
    grid: Option<Grid>,
    /// `M` curves and the matrix behind them, row by row with its offsets.
    middle: Option<(Vec<Tone>, Vec<f64>)>,
    outputs: Vec<Tone>,
    space: Space,
}

/// How luminance is told in the connection space.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Space {
    /// L* is the first number times this.
    Lab(f64),
    /// Y is the second number times this.
    Xyz(f64),
}

/// Colours at equal steps along every ink, the last ink fastest.
#[derive(Clone, Debug, PartialEq)]
struct Grid {
    points: Vec<usize>,
    values: Vec<f32>,
}

/// Inks of the connection space.
const OUT: usize = 3;

impl Table {
    pub(super) fn read(tag: &[u8], inks: usize, lab: bool) -> Option<Self> {
        match tag.get(..4)? {
            b"mft1" => Self::read_lut(tag, inks, 1, lab),
            b"mft2" => Self::read_lut(tag, inks, 2, lab),
            b"mAB " => Self::read_curves(tag, inks, lab),
            _ => None,
        }
    }

    /// `lut8Type` and `lut16Type`.
    fn read_lut(tag: &[u8], inks: usize, bytes: usize, lab: bool) -> Option<Self> {
        let (given, out, points) = (*tag.get(8)?, *tag.get(9)?, usize::from(*tag.get(10)?));
        if usize::from(given) != inks || usize::from(out) != OUT {
            return None;
        }
        let (before, behind, mut at) = match bytes {
            1 => (256, 256, 48),
            _ => (number(tag, 48, 2)? as usize, number(tag, 50, 2)? as usize, 52),
        };
        let inputs = curves(tag, at, (inks, before), bytes)?;
        at += inks * before * bytes;
        let grid = Grid::read(tag, at, vec![points; inks], bytes)?;
        at += grid.values.len() * bytes;
        let outputs = curves(tag, at, (OUT, behind), bytes)?;
        // 16 bits of L* reach a little further than 100.
        let space = match (lab, bytes) {
            (true, 1) => Space::Lab(100.0),
            (true, _) => Space::Lab(100.0 * 65535.0 / 65280.0),
            (false, _) => Space::Xyz(MOST_XYZ),
        };
        Some(Self { inputs, grid: Some(grid), middle: None, outputs, space })
    }

    /// `lutAToBType`.
    fn read_curves(tag: &[u8], inks: usize, lab: bool) -> Option<Self> {
        if usize::from(*tag.get(8)?) != inks || usize::from(*tag.get(9)?) != OUT {
            return None;
        }
        let place = |at: usize| number(tag, at, 4).map(|place| place as usize);
        let [b, matrix, m, grid, a] = [place(12)?, place(16)?, place(20)?, place(24)?, place(28)?];
        let curves = |mut at: usize, count: usize| -> Option<Vec<Tone>> {
            let curves = (0..count).map(|_| {
                let (tone, length) = tone(tag.get(at..)?)?;
                at += length.next_multiple_of(4);
                Some(tone)
            });
            curves.collect()
        };
        let outputs = curves(b, OUT)?;
        let middle = match (m, matrix) {
            (0, _) | (_, 0) => None,
            _ => {
                let matrix = (0..12).map(|k| fixed(tag, matrix + 4 * k)).collect::<Option<Vec<_>>>()?;
                Some((curves(m, OUT)?, matrix))
            }
        };
        let (inputs, grid) = match (grid, a) {
            (0, _) if inks == OUT => (Vec::new(), None),
            (0, _) | (_, 0) => return None,
            _ => {
                let points = tag.get(grid..grid.checked_add(inks)?)?.iter().map(|n| usize::from(*n)).collect();
                let bytes = usize::from(*tag.get(grid.checked_add(16)?)?);
                if !(1..=2).contains(&bytes) {
                    return None;
                }
                (curves(a, inks)?, Some(Grid::read(tag, grid.checked_add(20)?, points, bytes)?))
            }
        };
        let space = if lab { Space::Lab(100.0) } else { Space::Xyz(MOST_XYZ) };
        Some(Self { inputs, grid, middle, outputs, space })
    }

    /// Luminance of a colour, white = 1.
    pub(in crate::reference) fn luminance(&self, colour: &[f64]) -> f64 {
        // A grey picture with a table for screens is equal parts of its colours.
        let inks = self.grid.as_ref().map_or(OUT, |grid| grid.points.len());
        let mut numbers = [0.0; 4];
        for (k, number) in numbers[..inks].iter_mut().enumerate() {
            let v = colour.get(k).or(colour.first()).copied().unwrap_or(0.0).clamp(0.0, 1.0);
            *number = self.inputs.get(k).map_or(v, |tone| tone.light(v));
        }
        let mut mixed =
            self.grid.as_ref().map_or([numbers[0], numbers[1], numbers[2]], |grid| grid.at(&numbers[..inks]));
        if let Some((tones, matrix)) = &self.middle {
            let curved = [0, 1, 2].map(|k| tones[k].light(mixed[k]));
            mixed = [0, 1, 2].map(|row| {
                (0..3).map(|column| matrix[3 * row + column] * curved[column]).sum::<f64>() + matrix[9 + row]
            });
        }
        let curved = |k: usize| self.outputs[k].light(mixed[k].clamp(0.0, 1.0));
        match self.space {
            Space::Xyz(scale) => scale * curved(1),
            Space::Lab(scale) => {
                let f = (scale * curved(0) + 16.0) / 116.0;
                if f > 6.0 / 29.0 { f.powi(3) } else { (3.0 * (6.0_f64 / 29.0).powi(2) * (f - 4.0 / 29.0)).max(0.0) }
            }
        }
    }
}

/// What all bits of a number of XYZ mean.
const MOST_XYZ: f64 = 1.0 + 32767.0 / 32768.0;

/// So many curves of so many samples.
fn curves(tag: &[u8], at: usize, (count, samples): (usize, usize), bytes: usize) -> Option<Vec<Tone>> {
    if samples < 2 {
        return None;
    }
    let all = numbers(tag, at, count.checked_mul(samples)?, bytes)?;
    Some(all.chunks(samples).map(|curve| Tone::Sampled(curve.iter().copied().map(f64::from).collect())).collect())
}

/// Numbers of one or two bytes, of which the greatest is 1.
fn numbers(tag: &[u8], at: usize, count: usize, bytes: usize) -> Option<Vec<f32>> {
    let raw = tag.get(at..at.checked_add(count.checked_mul(bytes)?)?)?;
    Some(match bytes {
        1 => raw.iter().map(|v| f32::from(*v) / 255.0).collect(),
        _ => raw.chunks_exact(2).map(|v| f32::from(u16::from_be_bytes([v[0], v[1]])) / 65535.0).collect(),
    })
}

impl Grid {
    fn read(tag: &[u8], at: usize, points: Vec<usize>, bytes: usize) -> Option<Self> {
        if points.iter().any(|n| *n < 2) {
            return None;
        }
        let count = points.iter().try_fold(OUT, |product, n| product.checked_mul(*n))?;
        Some(Self { values: numbers(tag, at, count, bytes)?, points })
    }

    /// Between the corners of a cell: linear along every ink.
    fn at(&self, numbers: &[f64]) -> [f64; OUT] {
        let inks = self.points.len();
        let (mut corner, mut parts, mut strides) = (0, [0.0; 4], [0; 4]);
        let mut stride = OUT;
        for k in (0..inks).rev() {
            let last = self.points[k] - 1;
            let at = numbers[k].clamp(0.0, 1.0) * last as f64;
            let cell = (at as usize).min(last - 1);
            (parts[k], strides[k]) = (at - cell as f64, stride);
            corner += cell * stride;
            stride *= self.points[k];
        }
        let mut mixed = [0.0; OUT];
        for which in 0..1_usize << inks {
            let (mut place, mut weight) = (corner, 1.0);
            for k in 0..inks {
                if which >> k & 1 == 1 {
                    place += strides[k];
                    weight *= parts[k];
                } else {
                    weight *= 1.0 - parts[k];
                }
            }
            if weight > 0.0 {
                for (sum, value) in mixed.iter_mut().zip(&self.values[place..]) {
                    *sum += weight * f64::from(*value);
                }
            }
        }
        mixed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    /// A table of 16 bits for four inks: L* falls from 100 as they cover the paper.
    #[test]
    fn a_table_of_inks_tells_the_lightness_of_the_paper_that_they_leave() {
        let mut tag = b"mft2\0\0\0\0\x04\x03\x02\0".to_vec();
        tag.extend([0; 36]);
        tag.extend(2_u16.to_be_bytes());
        tag.extend(2_u16.to_be_bytes());
        let identity = [0_u16.to_be_bytes(), u16::MAX.to_be_bytes()].concat();
        (0..4).for_each(|_| tag.extend(&identity));
        for corner in 0..16_u16 {
            let lightness = 65280.0 * 0.5_f64.powi(corner.count_ones() as i32);
            for number in [lightness.round() as u16, 32768, 32768] {
                tag.extend(number.to_be_bytes());
            }
        }
        (0..3).for_each(|_| tag.extend(&identity));
        let table = Table::read(&tag, 4, true).unwrap();
        let of_lightness = |l: f64| ((l + 16.0) / 116.0).powi(3);
        for (colour, lightness) in [
            ([0.0; 4], 100.0),
            ([1.0, 0.0, 0.0, 0.0], 50.0),
            ([0.0, 0.0, 0.5, 0.0], 75.0),
            ([1.0, 1.0, 0.0, 0.0], 25.0),
        ] {
            let found = table.luminance(&colour);
            at_worst(6e-10, (found - of_lightness(lightness)).abs(), format_args!("{colour:?}"));
        }
        assert!(Table::read(&tag, 3, true).is_none());
        for length in 0..tag.len() {
            assert!(Table::read(&tag[..length], 4, true).is_none());
        }
    }
}
