//! Windows bitmaps: 1 to 32 bits, palettes, bit fields, runs.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
    },
    bits::{Reader, packed, widened},
    decoded::{Decoded, believe},
};

const NAME: &str = "BMP";
/// A run of 255 takes two bytes, and rows may be left out; nothing real is packed as tightly as
/// this.
const PER_BYTE: usize = 4096;

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let refused = |reason: String| Err(ReferenceError::malformed(NAME, reason));
    let mut reader = Reader::new(bytes, NAME);
    reader.take(10)?;
    let pixels_at = reader.u32_le()? as usize;
    let header = reader.u32_le()? as usize;
    let (width, height, bits, compression, colours) = match header {
        12 => {
            let (width, height) = (i64::from(reader.u16_le()?), i64::from(reader.u16_le()?));
            reader.take(2)?;
            (width, height, reader.u16_le()?, 0, 0)
        }
        40 | 52 | 56 | 64 | 108 | 124 => {
            let [width, height] = [reader.u32_le()?, reader.u32_le()?].map(|v| i64::from(v.cast_signed()));
            reader.take(2)?;
            let (bits, compression) = (reader.u16_le()?, reader.u32_le()?);
            reader.take(12)?;
            let colours = reader.u32_le()?;
            reader.take(4)?;
            (width, height, bits, compression, colours as usize)
        }
        other => return refused(format!("its header has {other} bytes")),
    };
    if width <= 0 || height == 0 {
        return Err(ReferenceError::Empty { width: width.max(0) as usize, height: height.unsigned_abs() as usize });
    }
    let (nx, ny, upside_down) = (width as usize, height.unsigned_abs() as usize, height > 0);
    believe(nx, ny, bytes.len(), PER_BYTE)?;
    let masks = match (compression, header) {
        (3 | 6, _) => {
            // In longer headers they stand at the same place.
            let mut masks = [reader.u32_le()?, reader.u32_le()?, reader.u32_le()?, 0];
            if header >= 56 || compression == 6 {
                masks[3] = reader.u32_le()?;
            }
            masks
        }
        _ if bits == 16 => [0x7c00, 0x03e0, 0x001f, 0],
        // The fourth byte is nobody's.
        _ => [0x00ff_0000, 0x0000_ff00, 0x0000_00ff, 0],
    };
    let palette = if bits <= 8 {
        let at = 14 + header + if header == 40 && compression == 3 { 12 } else { 0 };
        let entry = if header == 12 { 3 } else { 4 };
        let count = if colours == 0 { 1 << bits } else { colours.min(256) };
        bytes.get(at..).unwrap_or(&[]).chunks_exact(entry).take(count).map(|c| [c[2], c[1], c[0]]).collect()
    } else {
        Vec::new()
    };
    let data = bytes.get(pixels_at..).unwrap_or(&[]);
    let place = |y: usize| if upside_down { ny - 1 - y } else { y };
    let raster = |alpha, samples| Raster { nx, ny, inks: Inks::Rgb, alpha, samples: Samples::Bits8(samples) };
    let raster = match (bits, compression) {
        (1 | 2 | 4 | 8, 0) | (8, 1) | (4, 2) => {
            // Pixels that runs leave out are of colour 0.
            let indices = match compression {
                0 => {
                    let row = (nx * usize::from(bits)).div_ceil(32) * 4;
                    enough(data, row, ny)?;
                    data.chunks_exact(row)
                        .take(ny)
                        .flat_map(|row| (0..nx).map(move |x| packed(row, x, usize::from(bits)) as u8))
                        .collect()
                }
                _ => runs(data, nx, ny, compression == 2)?,
            };
            let mut samples = vec![0; nx * ny * 3];
            for (y, row) in indices.chunks_exact(nx).enumerate() {
                for (x, index) in row.iter().enumerate() {
                    let Some(colour) = palette.get(usize::from(*index)) else {
                        return refused(format!("it uses colour {index} of a palette of {}", palette.len()));
                    };
                    samples[3 * (place(y) * nx + x)..][..3].copy_from_slice(colour);
                }
            }
            raster(Alpha::None, samples)
        }
        (16 | 24 | 32, 0) | (16 | 32, 3 | 6) => {
            let size = usize::from(bits / 8);
            let row = (nx * size).div_ceil(4) * 4;
            enough(data, row, ny)?;
            let channels = if masks[3] == 0 { 3 } else { 4 };
            let mut samples = vec![0; nx * ny * channels];
            for (y, row) in data.chunks_exact(row).take(ny).enumerate() {
                for (x, pixel) in row.chunks_exact(size).take(nx).enumerate() {
                    let value = pixel.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
                    let out = &mut samples[channels * (place(y) * nx + x)..][..channels];
                    for (sample, mask) in out.iter_mut().zip(masks) {
                        *sample = field(value, mask);
                    }
                }
            }
            raster(if channels == 4 { Alpha::Straight } else { Alpha::None }, samples)
        }
        _ => return refused(format!("it has {bits} bits and the compression {compression}")),
    };
    Ok(Decoded::new(raster, None, Meaning::srgb()))
}

fn enough(data: &[u8], row: usize, ny: usize) -> Result<(), ReferenceError> {
    let needed = row.checked_mul(ny).filter(|needed| *needed <= data.len());
    needed.map(drop).ok_or_else(|| ReferenceError::malformed(NAME, "it ends too early"))
}

/// The bits of a mask as a number of eight.
fn field(value: u32, mask: u32) -> u8 {
    if mask == 0 {
        return 0;
    }
    let shift = mask.trailing_zeros();
    widened((value & mask) >> shift, mask >> shift, 255) as u8
}

/// Run lengths of 8 or 4 bits, row by row from the bottom.
fn runs(data: &[u8], nx: usize, ny: usize, nibbles: bool) -> Result<Vec<u8>, ReferenceError> {
    let mut reader = Reader::new(data, NAME);
    let mut indices = vec![0; nx * ny];
    let (mut x, mut y) = (0, 0);
    let mut put = |x: &mut usize, y: usize, index: u8| {
        if *x < nx && y < ny {
            indices[y * nx + *x] = index;
        }
        *x += 1;
    };
    let of_pair = |byte: u8, k: usize| match (nibbles, k % 2) {
        (false, _) => byte,
        (true, 0) => byte >> 4,
        (true, _) => byte & 15,
    };
    while y < ny {
        match (reader.u8()?, reader.u8()?) {
            (0, 0) => (x, y) = (0, y + 1),
            (0, 1) => break,
            (0, 2) => {
                x += usize::from(reader.u8()?);
                y += usize::from(reader.u8()?);
            }
            (0, count) => {
                let count = usize::from(count);
                let length = if nibbles { count.div_ceil(2) } else { count };
                let literal = reader.take(length)?;
                for k in 0..count {
                    put(&mut x, y, of_pair(literal[if nibbles { k / 2 } else { k }], k));
                }
                // Literals end at even bytes.
                if length % 2 == 1 {
                    reader.take(1)?;
                }
            }
            (count, byte) => (0..usize::from(count)).for_each(|k| put(&mut x, y, of_pair(byte, k))),
        }
    }
    Ok(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_literals_and_jumps() {
        // As in Microsoft's description: 03 04 05 06 00 03 45 56 67 00 02 78 00 00 00 01.
        let data = [3, 4, 5, 6, 0, 0, 0, 3, 0x45, 0x56, 0x67, 0, 2, 0x78, 0, 1];
        assert_eq!(runs(&data, 8, 2, false).unwrap(), [4, 4, 4, 6, 6, 6, 6, 6, 0x45, 0x56, 0x67, 0x78, 0x78, 0, 0, 0]);
        assert_eq!(runs(&[5, 0x12, 0, 1], 6, 1, true).unwrap(), [1, 2, 1, 2, 1, 0]);
        assert!(runs(&[5], 6, 1, true).is_err());
        assert_eq!((field(0b11_1110_0000, 0x03e0), field(0, 0x03e0), field(0x12, 0)), (255, 0, 0));
    }
}
