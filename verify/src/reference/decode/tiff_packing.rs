//! How TIFF packs a strip or a tile: compression, predictor and the order of bits.

use super::{
    super::{
        error::ReferenceError,
        raster::{Raster, Samples},
    },
    jpeg,
};
use fax::{Color, decoder};
use flate2::read::ZlibDecoder;
use jpeg_decoder::ColorTransform;
use std::{borrow::Cow, io::Read};
use weezl::{BitOrder, decode};

const NAME: &str = "TIFF";

pub(super) struct Packing<'a> {
    pub(super) compression: u64,
    pub(super) predictor: u64,
    /// The lowest bit of a byte comes first.
    pub(super) reversed_bits: bool,
    pub(super) fax_options: u64,
    pub(super) ycbcr: bool,
    /// Tables that all JPEG streams share.
    pub(super) tables: Option<&'a [u8]>,
    pub(super) big_endian: bool,
}

/// A strip or a tile.
pub(super) struct Piece {
    pub(super) wide: usize,
    pub(super) rows: usize,
    /// Of each pixel, in this piece.
    pub(super) samples: usize,
    pub(super) bits: usize,
}

impl Piece {
    pub(super) fn row_bytes(&self) -> usize {
        (self.wide * self.samples * self.bits).div_ceil(8)
    }
}

/// The rows of a piece, each beginning with a byte of its own.
pub(super) fn unpack(packed: &[u8], piece: &Piece, packing: &Packing<'_>) -> Result<Vec<u8>, ReferenceError> {
    let malformed = |reason: String| ReferenceError::malformed(NAME, reason);
    let length = piece.row_bytes() * piece.rows;
    let packed: Cow<'_, [u8]> =
        if packing.reversed_bits { packed.iter().map(|byte| byte.reverse_bits()).collect() } else { packed.into() };
    let mut data = Vec::new();
    match packing.compression {
        1 => data.extend(packed.iter().take(length)),
        3 | 4 => data = unfaxed(&packed, piece, packing)?,
        5 => {
            data = vec![0; length];
            let mut lzw = decode::Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
            let (mut read, mut written) = (0, 0);
            while written < length {
                let step = lzw.decode_bytes(&packed[read..], &mut data[written..]);
                (read, written) = (read + step.consumed_in, written + step.consumed_out);
                match step.status {
                    Ok(weezl::LzwStatus::Ok) if step.consumed_in + step.consumed_out > 0 => {}
                    Ok(_) => break,
                    Err(error) => return Err(malformed(format!("LZW: {error}"))),
                }
            }
            data.truncate(written);
        }
        7 => data = of_jpeg(&packed, piece, packing)?,
        8 | 32946 => {
            ZlibDecoder::new(&*packed)
                .take(length as u64)
                .read_to_end(&mut data)
                .map_err(|error| malformed(format!("Deflate: {error}")))?;
        }
        32773 => data = unpacked_bits(&packed, length),
        other => return Err(malformed(format!("it is compressed in the way {other}, which is not read"))),
    }
    if data.len() < length {
        return Err(malformed(format!("a strip or tile holds {} bytes instead of {length}", data.len())));
    }
    match packing.predictor {
        _ if matches!(packing.compression, 3 | 4 | 7) => {}
        1 => {}
        2 => sum_up(&mut data, piece, packing.big_endian)?,
        3 => unshuffle(&mut data, piece, packing.big_endian)?,
        other => return Err(malformed(format!("its predictor is {other}, which is not read"))),
    }
    Ok(data)
}

/// `PackBits`, Apple's runs.
fn unpacked_bits(packed: &[u8], length: usize) -> Vec<u8> {
    let mut data = Vec::new();
    let mut rest = packed;
    while let ([head, tail @ ..], true) = (rest, data.len() < length) {
        rest = match head.cast_signed() {
            -128 => tail,
            count @ 0.. => {
                let count = (usize::from(count.unsigned_abs()) + 1).min(tail.len());
                data.extend(&tail[..count]);
                &tail[count..]
            }
            count => {
                let Some((byte, tail)) = tail.split_first() else { break };
                data.resize(data.len() + usize::from(count.unsigned_abs()) + 1, *byte);
                tail
            }
        };
    }
    data.truncate(length);
    data
}

/// Group 3 (one-dimensional) and group 4 of CCITT: 1 is black, as the photometric interpretation
/// then says.
fn unfaxed(packed: &[u8], piece: &Piece, packing: &Packing<'_>) -> Result<Vec<u8>, ReferenceError> {
    let malformed = |reason: &str| ReferenceError::malformed(NAME, reason);
    let width = u16::try_from(piece.wide).map_err(|_| malformed("a fax is wider than 65535 pixels"))?;
    if piece.samples != 1 || piece.bits != 1 || packing.fax_options & 1 == 1 {
        return Err(malformed("a fax in two dimensions of group 3, or with colours"));
    }
    let mut data = vec![0; piece.row_bytes() * piece.rows];
    let mut rows = data.chunks_exact_mut(piece.row_bytes());
    let line = |transitions: &[u16]| {
        let Some(row) = rows.next() else { return };
        for (x, colour) in decoder::pels(transitions, width).take(piece.wide).enumerate() {
            if colour == Color::Black {
                row[x / 8] |= 0x80 >> (x % 8);
            }
        }
    };
    let height = u16::try_from(piece.rows).map_err(|_| malformed("a fax is higher than 65535 pixels"))?;
    let read = match packing.compression {
        4 => decoder::decode_g4(packed.iter().copied(), width, Some(height), line),
        _ => decoder::decode_g3(packed.iter().copied(), line),
    };
    read.map(|()| data).ok_or_else(|| malformed("a fax with lines that are none"))
}

/// A JPEG stream of its own, whose tables may stand elsewhere.
fn of_jpeg(packed: &[u8], piece: &Piece, packing: &Packing<'_>) -> Result<Vec<u8>, ReferenceError> {
    let stream = match packing.tables {
        // The tables end with a marker, the stream begins with one.
        Some(tables) if tables.len() > 4 && packed.len() > 2 => [&tables[..tables.len() - 2], &packed[2..]].concat(),
        _ => packed.to_vec(),
    };
    let transform = match (piece.samples, packing.ycbcr) {
        (3, true) => Some(ColorTransform::YCbCr),
        (3, false) => Some(ColorTransform::RGB),
        _ => None,
    };
    // TIFF stores what covers the paper.
    let Raster { nx, ny, inks, samples, .. } = jpeg::pixels(&stream, transform, false)?;
    let Samples::Bits8(data) = samples else {
        return Err(ReferenceError::malformed(NAME, "JPEG of more than 8 bits"));
    };
    if nx != piece.wide || ny < piece.rows || inks.count() != piece.samples || piece.bits != 8 {
        return Err(ReferenceError::malformed(NAME, format!("a strip of {nx} x {ny} pixels of JPEG")));
    }
    Ok(data)
}

/// Undoes the differences between neighbours.
fn sum_up(data: &mut [u8], piece: &Piece, big_endian: bool) -> Result<(), ReferenceError> {
    let step = piece.samples;
    for row in data.chunks_exact_mut(piece.row_bytes()) {
        match piece.bits {
            8 => (step..row.len()).for_each(|k| row[k] = row[k].wrapping_add(row[k - step])),
            16 | 32 | 64 => {
                let size = piece.bits / 8;
                for k in step..row.len() / size {
                    let of = |k: usize| {
                        let fold = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
                        let bytes = &row[k * size..(k + 1) * size];
                        if big_endian { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
                    };
                    let sum = of(k).wrapping_add(of(k - step)).to_le_bytes();
                    let place = &mut row[k * size..(k + 1) * size];
                    place.copy_from_slice(&sum[..size]);
                    if big_endian {
                        place.reverse();
                    }
                }
            }
            bits => {
                return Err(ReferenceError::malformed(NAME, format!("differences between samples of {bits} bits")));
            }
        }
    }
    Ok(())
}

/// Undoes the predictor of floating-point numbers: bytes of equal weight lie together, as
/// differences, the highest first.
fn unshuffle(data: &mut [u8], piece: &Piece, big_endian: bool) -> Result<(), ReferenceError> {
    let size = piece.bits / 8;
    if !matches!(piece.bits, 16 | 32 | 64) {
        return Err(ReferenceError::malformed(NAME, format!("the predictor of floats for {} bits", piece.bits)));
    }
    let count = piece.wide * piece.samples;
    for row in data.chunks_exact_mut(piece.row_bytes()) {
        (piece.samples..row.len()).for_each(|k| row[k] = row[k].wrapping_add(row[k - piece.samples]));
        let shuffled = row.to_vec();
        for k in 0..count {
            for byte in 0..size {
                let place = if big_endian { byte } else { size - 1 - byte };
                row[k * size + place] = shuffled[byte * count + k];
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_packbits_as_apple_prints_them() {
        let packed = [0xfe, 0xaa, 0x02, 0x80, 0x00, 0x2a, 0xfd, 0xaa, 0x03, 0x80, 0x00, 0x2a, 0x22, 0xf7, 0xaa];
        let expected = [
            0xaa, 0xaa, 0xaa, 0x80, 0x00, 0x2a, 0xaa, 0xaa, 0xaa, 0xaa, 0x80, 0x00, 0x2a, 0x22, 0xaa, 0xaa, 0xaa, 0xaa,
            0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa,
        ];
        assert_eq!(unpacked_bits(&packed, 24), expected);
    }

    #[test]
    fn predictors_are_undone() {
        let piece = Piece { wide: 3, rows: 1, samples: 1, bits: 16 };
        let mut data = [1_u16, 1, 65535].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
        sum_up(&mut data, &piece, false).unwrap();
        assert_eq!(data, [1, 0, 2, 0, 1, 0]);
        // 1.0 and 0.5 as big-endian bytes, shuffled, differences taken.
        let piece = Piece { wide: 2, rows: 1, samples: 1, bits: 32 };
        let mut data = vec![0x3f, 0, 0x80_u8.wrapping_sub(0x3f), 0x80, 0, 0, 0, 0];
        unshuffle(&mut data, &piece, false).unwrap();
        let floats: Vec<f32> = data.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        assert_eq!(floats, [1.0, 0.5]);
    }
}
