//! TIFF 6.0 and BigTIFF: the first page, its strips or tiles put together here.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
        tiff_tags::{Directory, PROFILE},
    },
    bits::{packed, widened},
    decoded::{Decoded, believe},
    tiff_packing::{Packing, Piece, unpack},
};

const NAME: &str = "TIFF";
/// Deflate makes at most 1032 bytes of one, and eight pixels of a byte; a line of a fax that
/// repeats the last takes a bit.
const PER_BYTE: usize = 1032 * 8;

/// What the tags say of the samples.
struct Layout {
    nx: usize,
    ny: usize,
    bits: usize,
    float: bool,
    per_pixel: usize,
    planar: bool,
    photometric: u64,
    big_endian: bool,
    /// Of the samples of a pixel, those that are wanted.
    wanted: Vec<usize>,
}

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let refused = |reason: String| Err(ReferenceError::malformed(NAME, reason));
    let Some(directory) = Directory::first(bytes) else { return refused("it has no directory".into()) };
    let value = |tag: u16, usual: u64| directory.value(tag).unwrap_or(usual);
    let number = |tag: u16, usual: u64| usize::try_from(value(tag, usual)).unwrap_or(usize::MAX);
    let (nx, ny, per_pixel) = (number(256, 0), number(257, 0), number(277, 1));
    let all_bits = directory.values(258).unwrap_or_else(|| vec![1]);
    let bits = all_bits.first().copied().unwrap_or(1) as usize;
    let formats = directory.values(339).unwrap_or_default();
    if all_bits.iter().any(|b| *b as usize != bits) || formats.iter().any(|f| f != &formats[0]) {
        return refused("its channels are of different kinds".into());
    }
    let float = match (formats.first().copied().unwrap_or(1), bits) {
        (1 | 4, 1..=16 | 24 | 32 | 64) => false,
        (3, 16 | 32 | 64) => true,
        (format, bits) => return refused(format!("its samples have {bits} bits of the format {format}")),
    };
    if !(1..=64).contains(&per_pixel) {
        return refused(format!("its pixels have {per_pixel} samples"));
    }
    believe(nx.saturating_mul(per_pixel), ny, bytes.len(), PER_BYTE / bits)?;
    let photometric = value(262, 1);
    let inks = match photometric {
        0 | 1 => Inks::Grey,
        2 | 3 | 6 => Inks::Rgb,
        5 if value(332, 1) == 1 => Inks::Cmyk,
        other => return refused(format!("its colours are of the kind {other} (PhotometricInterpretation)")),
    };
    let stored = if photometric == 3 { 1 } else { inks.count() };
    if per_pixel < stored {
        return refused(format!("its pixels have {per_pixel} samples instead of {stored}"));
    }
    // Of the further samples one may be alpha: 1 premultiplied, 2 straight.
    let extra = directory.values(338).unwrap_or_default();
    let alpha_at = extra.iter().position(|kind| matches!(kind, 1 | 2)).filter(|k| stored + k < per_pixel);
    let alpha = match alpha_at.map(|k| extra[k]) {
        Some(1) => Alpha::Premultiplied,
        Some(_) => Alpha::Straight,
        None => Alpha::None,
    };
    let wanted = (0..stored).chain(alpha_at.map(|k| stored + k)).collect();
    let big_endian = bytes.starts_with(b"MM");
    let planar = value(284, 1) == 2 && per_pixel > 1;
    let layout = Layout { nx, ny, bits, float, per_pixel, planar, photometric, big_endian, wanted };
    let packing = Packing {
        compression: value(259, 1),
        predictor: value(317, 1),
        reversed_bits: value(266, 1) == 2,
        fax_options: value(292, 0),
        ycbcr: photometric == 6,
        tables: directory.raw(347),
        big_endian,
    };
    if photometric == 6 && packing.compression != 7 {
        return refused("its colours are YCbCr without JPEG".into());
    }
    let mut numbers = vec![0.0_f32; nx * ny * layout.wanted.len()];
    let mut whole = Whole { layout: &layout, numbers: &mut numbers };
    read_pieces(bytes, &directory, &packing, &mut whole)?;
    let raster = layout.raster(numbers, inks, alpha, directory.values(320))?;
    let meaning = if float { Meaning::linear() } else { Meaning::srgb() };
    let decoded = Decoded::new(raster, directory.raw(PROFILE), meaning);
    Ok(Decoded { orientation: directory.orientation(), lossy: packing.compression == 7, ..decoded })
}

/// Reads every strip or tile of every plane.
fn read_pieces(
    bytes: &[u8],
    directory: &Directory<'_>,
    packing: &Packing<'_>,
    whole: &mut Whole<'_>,
) -> Result<(), ReferenceError> {
    let malformed = |reason: &str| ReferenceError::malformed(NAME, reason);
    let number = |tag: u16| directory.value(tag).and_then(|value| usize::try_from(value).ok());
    let Layout { nx, ny, bits, per_pixel, planar, .. } = *whole.layout;
    let tiled = number(322).is_some();
    let (wide, high) = if tiled {
        (number(322).unwrap_or(0), number(323).unwrap_or(0))
    } else {
        (nx, number(278).unwrap_or(ny).min(ny))
    };
    if wide == 0 || high == 0 || wide > nx + (1 << 16) || high > ny + (1 << 16) {
        return Err(malformed("its strips or tiles have no size"));
    }
    believe(wide.saturating_mul(per_pixel), high, bytes.len(), PER_BYTE / bits)?;
    let (offsets, counts) = if tiled { (324, 325) } else { (273, 279) };
    let offsets = directory.values(offsets).ok_or_else(|| malformed("its strips or tiles are nowhere"))?;
    let counts = directory.values(counts).unwrap_or_default();
    let (across, down) = (nx.div_ceil(wide), ny.div_ceil(high));
    let planes = if planar { per_pixel } else { 1 };
    if offsets.len() < across * down * planes {
        return Err(malformed("strips or tiles are missing"));
    }
    for plane in 0..planes {
        if planar && !whole.layout.wanted.contains(&plane) {
            continue;
        }
        for k in 0..across * down {
            let at = plane * across * down + k;
            let begin = usize::try_from(offsets[at]).unwrap_or(usize::MAX);
            let rest = bytes.get(begin..).ok_or_else(|| malformed("a strip or tile lies beyond the end"))?;
            let length = counts.get(at).map_or(rest.len(), |count| usize::try_from(*count).unwrap_or(usize::MAX));
            let (left, top) = (k % across * wide, k / across * high);
            // The last strip is only as high as the picture; tiles are always whole.
            let rows = if tiled { high } else { high.min(ny - top) };
            let piece = Piece { wide, rows, samples: if planar { 1 } else { per_pixel }, bits };
            let unpacked = unpack(&rest[..length.min(rest.len())], &piece, packing)?;
            whole.take(&unpacked, &piece, (left, top), plane);
        }
    }
    Ok(())
}

/// The picture as it is put together.
struct Whole<'a> {
    layout: &'a Layout,
    /// The wanted samples, pixel by pixel: integers as they are stored up to 16 bits, else parts of
    /// the greatest.
    numbers: &'a mut [f32],
}

impl Whole<'_> {
    fn take(&mut self, data: &[u8], piece: &Piece, (left, top): (usize, usize), plane: usize) {
        let layout = self.layout;
        let count = layout.wanted.len();
        for (j, row) in data.chunks_exact(piece.row_bytes()).enumerate().take_while(|(j, _)| top + j < layout.ny) {
            for i in (0..piece.wide).take_while(|i| left + i < layout.nx) {
                let at = ((top + j) * layout.nx + left + i) * count;
                for (place, channel) in layout.wanted.iter().enumerate() {
                    if layout.planar && *channel != plane {
                        continue;
                    }
                    let k = if layout.planar { i } else { i * piece.samples + channel };
                    self.numbers[at + place] = layout.number(row, k);
                }
            }
        }
    }
}

impl Layout {
    fn number(&self, row: &[u8], k: usize) -> f32 {
        let raw = |length: usize| -> u64 {
            let bytes = &row[k * length..(k + 1) * length];
            let fold = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
            if self.big_endian { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
        };
        match (self.float, self.bits) {
            (true, 16) => exr::prelude::f16::from_bits(raw(2) as u16).to_f32(),
            (true, 32) => f32::from_bits(raw(4) as u32),
            (true, _) => f64::from_bits(raw(8)) as f32,
            (false, 16) => raw(2) as f32,
            (false, 24 | 32 | 64) => (raw(self.bits / 8) as f64 / (u64::MAX >> (64 - self.bits)) as f64) as f32,
            (false, bits) => packed(row, k, bits) as f32,
        }
    }

    /// The samples, with palettes looked up and the greatest number as white.
    fn raster(
        &self,
        numbers: Vec<f32>,
        inks: Inks,
        alpha: Alpha,
        palette: Option<Vec<u64>>,
    ) -> Result<Raster, ReferenceError> {
        let raster = |samples| Raster { nx: self.nx, ny: self.ny, inks, alpha, samples };
        let most = if self.bits <= 16 { (1_u32 << self.bits) - 1 } else { 1 };
        let count = self.wanted.len();
        if self.photometric == 3 {
            let (Some(palette), false) = (palette, self.float || self.bits > 16) else {
                return Err(ReferenceError::malformed(NAME, "it has no palette"));
            };
            let entries = palette.len() / 3;
            let mut samples = Vec::with_capacity(self.nx * self.ny * (count + 2));
            for pixel in numbers.chunks_exact(count) {
                let index = pixel[0] as usize;
                for channel in 0..3 {
                    let value = palette.get(channel * entries + index).filter(|_| index < entries);
                    let value =
                        value.ok_or_else(|| ReferenceError::malformed(NAME, "a colour is not in its palette"))?;
                    samples.push((*value).min(65535) as u16);
                }
                samples.extend(pixel.get(1).map(|alpha| widened(*alpha as u32, most, 65535) as u16));
            }
            return Ok(raster(Samples::Bits16(samples)));
        }
        let inverted = self.photometric == 0;
        let is_ink = |k: usize| k % count < inks.count();
        Ok(raster(if self.float || self.bits > 16 {
            let turned = |(k, v): (usize, f32)| if inverted && is_ink(k) { 1.0 - v } else { v };
            Samples::Float(numbers.into_iter().enumerate().map(turned).collect())
        } else {
            let turned = |(k, v): (usize, f32)| {
                let v = v as u32;
                if inverted && is_ink(k) { most - v } else { v }
            };
            let numbers = numbers.into_iter().enumerate().map(turned);
            if self.bits <= 8 && 255 % most == 0 {
                Samples::Bits8(numbers.map(|v| widened(v, most, 255) as u8).collect())
            } else if self.bits == 16 {
                Samples::Bits16(numbers.map(|v| v as u16).collect())
            } else {
                Samples::Float(numbers.map(|v| (f64::from(v) / f64::from(most)) as f32).collect())
            }
        }))
    }
}
