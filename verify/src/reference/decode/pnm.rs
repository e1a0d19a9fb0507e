//! Portable anymaps: PBM, PGM and PPM as text and binary, and PAM.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
    },
    bits::{packed, widened},
    decoded::{Decoded, believe},
};

const NAME: &str = "PNM";

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let mut text = Words { bytes, at: 2 };
    let kind = bytes.get(1).copied().unwrap_or(0);
    let Header { nx, ny, most, inks, alpha } = match kind {
        b'7' => pam(&mut text)?,
        _ => {
            let (nx, ny) = (text.number()?, text.number()?);
            let most = if matches!(kind, b'1' | b'4') { 1 } else { text.number()? };
            let inks = if matches!(kind, b'3' | b'6') { Inks::Rgb } else { Inks::Grey };
            Header { nx, ny, most, inks, alpha: Alpha::None }
        }
    };
    if !(1..=65535).contains(&most) {
        return Err(ReferenceError::malformed(NAME, format!("its greatest number is {most}; 1 to 65535 are possible")));
    }
    let channels = inks.count() + usize::from(alpha != Alpha::None);
    // Of bits there are eight in a byte.
    believe(nx, ny, bytes.len(), 8)?;
    let count = nx * ny * channels;
    let numbers: Vec<u32> = match kind {
        b'1' => (0..count).map(|_| text.bit()).collect::<Result<_, _>>()?,
        b'2' | b'3' => (0..count).map(|_| Ok(text.number()? as u32)).collect::<Result<_, ReferenceError>>()?,
        _ => {
            // One white space ends the header.
            let data = bytes.get(text.at + usize::from(kind != b'7')..).unwrap_or(&[]);
            let bits = match (kind, most) {
                (b'4', _) => 1,
                (_, ..256) => 8,
                _ => 16,
            };
            let row = (nx * channels * bits).div_ceil(8);
            if data.len() < row * ny {
                return Err(ReferenceError::malformed(NAME, "it ends too early"));
            }
            data.chunks_exact(row)
                .take(ny)
                .flat_map(|row| (0..nx * channels).map(move |k| packed(row, k, bits)))
                .collect()
        }
    };
    // In PBM 1 is ink; in PAM it is light.
    let inverted = matches!(kind, b'1' | b'4');
    let most = most as u32;
    let of = |value: u32, full: u32| widened(if inverted { most - value.min(most) } else { value }, most, full);
    let samples = if most < 256 && 255 % most == 0 {
        Samples::Bits8(numbers.into_iter().map(|v| of(v, 255) as u8).collect())
    } else if most == 65535 {
        Samples::Bits16(numbers.into_iter().map(|v| v.min(most) as u16).collect())
    } else {
        Samples::Float(numbers.into_iter().map(|v| (f64::from(v.min(most)) / f64::from(most)) as f32).collect())
    };
    Ok(Decoded::new(Raster { nx, ny, inks, alpha, samples }, None, Meaning::srgb()))
}

struct Header {
    nx: usize,
    ny: usize,
    most: usize,
    inks: Inks,
    alpha: Alpha,
}

/// The header of a PAM: lines of names and values.
fn pam(text: &mut Words<'_>) -> Result<Header, ReferenceError> {
    let (mut nx, mut ny, mut depth, mut most) = (0, 0, 0, 0);
    loop {
        let rest = text.bytes.get(text.at..).unwrap_or(&[]);
        let Some(end) = rest.iter().take(1 << 10).position(|byte| *byte == b'\n') else {
            return Err(ReferenceError::malformed(NAME, "its header does not end"));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        text.at += end + 1;
        let mut words = line.split_ascii_whitespace();
        let (name, value) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
        let place = match name {
            "ENDHDR" => break,
            "WIDTH" => &mut nx,
            "HEIGHT" => &mut ny,
            "DEPTH" => &mut depth,
            "MAXVAL" => &mut most,
            _ => continue,
        };
        *place = value.parse().map_err(|_| ReferenceError::malformed(NAME, format!("{name} is '{value}'")))?;
    }
    let (inks, alpha) = match depth {
        1 => (Inks::Grey, Alpha::None),
        2 => (Inks::Grey, Alpha::Straight),
        3 => (Inks::Rgb, Alpha::None),
        4 => (Inks::Rgb, Alpha::Straight),
        _ => return Err(ReferenceError::malformed(NAME, format!("it has {depth} channels; 1 to 4 are read"))),
    };
    Ok(Header { nx, ny, most, inks, alpha })
}

/// Numbers between white space and comments.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Words<'_> {
    fn skip(&mut self) -> Result<u8, ReferenceError> {
        loop {
            match self.bytes.get(self.at) {
                Some(b'#') => {
                    while self.bytes.get(self.at).is_some_and(|byte| *byte != b'\n') {
                        self.at += 1;
                    }
                }
                Some(byte) if byte.is_ascii_whitespace() => self.at += 1,
                Some(byte) => return Ok(*byte),
                None => return Err(ReferenceError::malformed(NAME, "it ends too early")),
            }
        }
    }

    fn number(&mut self) -> Result<usize, ReferenceError> {
        let first = self.skip()?;
        let mut value: usize = 0;
        if !first.is_ascii_digit() {
            return Err(ReferenceError::malformed(NAME, format!("there is no number at byte {}", self.at)));
        }
        while let Some(digit) = self.bytes.get(self.at).filter(|byte| byte.is_ascii_digit()) {
            value = value.saturating_mul(10).saturating_add(usize::from(digit - b'0'));
            self.at += 1;
        }
        Ok(value)
    }

    /// Bits need no space between them.
    fn bit(&mut self) -> Result<u32, ReferenceError> {
        let digit = self.skip()?;
        self.at += 1;
        match digit {
            b'0' => Ok(0),
            b'1' => Ok(1),
            _ => Err(ReferenceError::malformed(NAME, format!("there is no bit at byte {}", self.at - 1))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floats(bytes: &[u8]) -> Vec<f32> {
        match decode(bytes).unwrap().raster.samples {
            Samples::Bits8(samples) => samples.iter().map(|v| f32::from(*v) / 255.0).collect(),
            Samples::Bits16(samples) => samples.iter().map(|v| f32::from(*v) / 65535.0).collect(),
            Samples::Float(samples) => samples,
        }
    }

    #[test]
    fn all_seven_kinds() {
        assert_eq!(floats(b"P1 # bits\n3 1\n1 01"), [0.0, 1.0, 0.0]);
        assert_eq!(floats(b"P4\n3 1\n\xa0"), [0.0, 1.0, 0.0]);
        assert_eq!(floats(b"P2 2 1 4 0 3"), [0.0, 0.75]);
        assert_eq!(floats(b"P5 2 1 65535\n\x00\x00\xff\xff"), [0.0, 1.0]);
        assert_eq!(floats(b"P3 1 1 255 255 0 51"), [1.0, 0.0, 0.2]);
        assert_eq!(floats(b"P6 1 1 255\n\xff\x00\x33"), [1.0, 0.0, 0.2]);
        assert_eq!(
            floats(b"P7\nWIDTH 1\nHEIGHT 1\nDEPTH 2\nMAXVAL 255\nTUPLTYPE GRAYSCALE_ALPHA\nENDHDR\n\xff\x33"),
            [1.0, 0.2]
        );
        for bad in [
            &b"P5 2 2 255\n\0"[..],
            b"P2 1 1 0 0",
            b"P2 1 1 99999 0",
            b"P5 4000000000 4000000000 255\n1",
            b"P7\nWIDTH x\n",
        ] {
            assert!(decode(bad).is_err());
        }
    }
}
