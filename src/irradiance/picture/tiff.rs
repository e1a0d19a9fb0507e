//! TIFF, with the decoder of `image` itself: `image` refuses grey floats, palettes and much else
//! that it can read.

use super::{
    PictureError,
    canvas::Orientation,
    colour::{Alpha, Says},
    curve::Model,
    kind::{Kind, raw_photograph},
    sheet::{Sheet, Sink, emit, of_u8, of_u16},
};
use std::io::Cursor;
use tiff::{
    ColorType, TiffError,
    decoder::{ChunkType, Decoder, DecodingResult, Limits},
    tags::{PlanarConfiguration, Tag},
};

type File<'a> = Decoder<Cursor<&'a [u8]>>;

fn broken(error: &dyn std::fmt::Display) -> PictureError {
    PictureError::broken(Kind::Tiff.name(), error)
}

fn failed(error: TiffError) -> PictureError {
    match error {
        TiffError::LimitsExceeded => broken(&"it asks for more memory than a picture of its size"),
        other => broken(&other),
    }
}

/// Reads the head of a picture. Palettes are looked up here.
pub(super) fn open(bytes: &mut [u8], allowed: u64) -> Result<Sheet<'_>, PictureError> {
    // The decoder refuses palettes, but takes their indices for grey.
    let palette_entry = entry_of(bytes, PHOTOMETRIC, PALETTE);
    if let Some(at) = palette_entry {
        bytes[at] = 0;
        bytes[at + 1] = 0;
        bytes[if bytes[0] == b'I' { at } else { at + 1 }] = BLACK_IS_ZERO;
    }
    let bytes = &*bytes;
    let mut file = Decoder::new(Cursor::new(bytes)).map_err(failed)?;
    let limit = usize::try_from(allowed).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = limit;
    limits.intermediate_buffer_size = limit;
    limits.ifd_value_size = limit.min(bytes.len());
    file = file.with_limits(limits);
    let (width, height) = file.dimensions().map_err(failed)?;
    let size = (width as usize, height as usize);
    let number = |file: &mut File<'_>, tag| file.find_tag_unsigned::<u32>(tag).ok().flatten();
    let thumbnail = number(&mut file, Tag::NewSubfileType).is_some_and(|kind| kind & 1 == 1);
    let has = |file: &mut File<'_>, tag| matches!(file.find_tag(tag), Ok(Some(_)));
    if has(&mut file, Tag::Unknown(DNG_VERSION)) || thumbnail && has(&mut file, Tag::SubIfd) {
        return Err(raw_photograph());
    }
    let palette = match palette_entry {
        Some(_) => Some(file.get_tag_u16_vec(Tag::ColorMap).map_err(failed)?),
        None => None,
    };
    let colour = file.colortype().map_err(failed)?;
    let extra = file.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).ok().flatten().unwrap_or_default();
    let transparency = match extra.first() {
        Some(1) => Alpha::Premultiplied,
        Some(2) => Alpha::Straight,
        _ => Alpha::None,
    };
    let float = matches!(file.find_tag_unsigned_vec::<u16>(Tag::SampleFormat), Ok(Some(ref of)) if of.contains(&3));
    let (model, alpha, stride, bits) = match colour {
        ColorType::Gray(bits) => (Model::Grey, Alpha::None, 1, bits),
        ColorType::Multiband { bit_depth, num_samples } => {
            (Model::Grey, transparency, usize::from(num_samples), bit_depth)
        }
        ColorType::RGB(bits) => (Model::Rgb, Alpha::None, 3, bits),
        ColorType::RGBA(bits) => {
            (Model::Rgb, if transparency == Alpha::None { Alpha::Straight } else { transparency }, 4, bits)
        }
        ColorType::CMYK(bits) => (Model::Cmyk, Alpha::None, 4, bits),
        ColorType::CMYKA(bits) => (Model::Cmyk, transparency, 5, bits),
        other => return Err(broken(&format!("it has the colours {other:?}; save it as grey or RGB"))),
    };
    if stride < model.channels() + usize::from(alpha != Alpha::None) {
        return Err(broken(&"it has too few numbers a pixel"));
    }
    let says = match file.get_tag_u8_vec(Tag::IccProfile) {
        Ok(profile) if palette.is_none() => Says::Profile(profile),
        _ if float => Says::Float,
        _ => Says::Nothing,
    };
    let orientation = number(&mut file, Tag::Orientation).and_then(|number| u8::try_from(number).ok()).unwrap_or(1);
    let planar = number(&mut file, Tag::PlanarConfiguration) == Some(u32::from(PlanarConfiguration::Planar.to_u16()));
    let whole = planar || file.get_chunk_type() == ChunkType::Tile;
    let row_bytes = (size.0 as u64).saturating_mul(stride as u64 * u64::from(bits)).div_ceil(8);
    let rows_held = if whole { size.1 as u64 } else { u64::from(file.chunk_dimensions().1).min(size.1 as u64) };
    let needs = row_bytes.saturating_mul(rows_held.saturating_mul(if planar { 2 } else { 1 }));
    let small = bits < 8;
    let (model, stride) = if palette.is_some() { (Model::Rgb, 3) } else { (model, stride) };
    let greatest = match (float, bits) {
        _ if palette.is_some() => Some(u16::MAX),
        (true, _) | (_, 17..) => None,
        (_, bits) => Some(((1_u32 << bits) - 1) as u16),
    };
    let rows = Box::new(move |sink: Sink<'_>| {
        let layout = Layout { nx: size.0, per_row: size.0 * if palette.is_some() { 1 } else { stride }, bits };
        let mut give = |top: usize, found: DecodingResult| match &palette {
            Some(palette) => {
                let indices = layout.indices(found)?;
                let colours = palette.len() / 3;
                let looked_up: Vec<u16> = indices
                    .iter()
                    .flat_map(|k| {
                        [0, 1, 2].map(|c| palette.get(c * colours + usize::from(*k)).copied().unwrap_or_default())
                    })
                    .collect();
                emit(&looked_up, 3 * layout.nx, top, of_u16, sink)
            }
            None if small => {
                let scale = f32::from((1_u8 << bits) - 1);
                emit(&layout.indices(found)?, layout.per_row, top, |v| f32::from(*v) / scale, sink)
            }
            None => layout.give(found, top, sink),
        };
        if whole {
            let found = if planar { interleaved(&mut file, stride)? } else { file.read_image().map_err(failed)? };
            return give(0, found);
        }
        let (_, per_strip) = file.chunk_dimensions();
        let strips = file.strip_count().map_err(failed)?;
        for strip in 0..strips {
            let top = strip as usize * per_strip as usize;
            if top >= size.1 {
                break;
            }
            give(top, file.read_chunk(strip).map_err(failed)?)?;
        }
        Ok(())
    });
    let orientation = Orientation::new(orientation);
    Ok(Sheet { size, model, alpha, stride, greatest, orientation, says, needs, rows })
}

/// How numbers lie in a strip.
struct Layout {
    nx: usize,
    per_row: usize,
    bits: u8,
}

impl Layout {
    /// Whole numbers of at most 8 bits, one a byte.
    fn indices(&self, found: DecodingResult) -> Result<Vec<u8>, PictureError> {
        let DecodingResult::U8(bytes) = found else {
            return Err(broken(&"its palette has more than 256 colours"));
        };
        let bits = usize::from(self.bits);
        if bits == 8 {
            return Ok(bytes);
        }
        let per_row = (self.per_row * bits).div_ceil(8);
        let mask = (1_u8 << bits) - 1;
        let number = |row: &[u8], k: usize| {
            let bit = k * bits;
            (row[bit / 8] >> (8 - bits - bit % 8)) & mask
        };
        if !matches!(bits, 1 | 2 | 4) {
            return Err(broken(&format!("it has numbers of {bits} bits; save it with 8 or 16")));
        }
        Ok(bytes.chunks_exact(per_row).flat_map(|row| (0..self.per_row).map(move |k| number(row, k))).collect())
    }

    fn give(&self, found: DecodingResult, top: usize, sink: Sink<'_>) -> Result<(), PictureError> {
        let n = self.per_row;
        match found {
            DecodingResult::U8(v) => emit(&v, n, top, of_u8, sink),
            DecodingResult::U16(v) => emit(&v, n, top, of_u16, sink),
            DecodingResult::U32(v) => emit(&v, n, top, |v| (f64::from(*v) / f64::from(u32::MAX)) as f32, sink),
            DecodingResult::U64(v) => emit(&v, n, top, |v| (*v as f64 / u64::MAX as f64) as f32, sink),
            DecodingResult::F16(v) => emit(&v, n, top, |v| v.to_f32(), sink),
            DecodingResult::F32(v) => emit(&v, n, top, |v| *v, sink),
            DecodingResult::F64(v) => emit(&v, n, top, |v| *v as f32, sink),
            _ => Err(broken(&"its numbers have signs; save it with unsigned integers or floats")),
        }
    }
}

/// A picture whose colours lie one behind the other, as pixels.
fn interleaved(file: &mut File<'_>, stride: usize) -> Result<DecodingResult, PictureError> {
    let mut planes = DecodingResult::U8(Vec::new());
    file.read_image_to_buffer(&mut planes).map_err(failed)?;
    fn woven<T: Copy>(planes: &[T], stride: usize) -> Vec<T> {
        let n = planes.len() / stride;
        (0..n * stride).map(|k| planes[k % stride * n + k / stride]).collect()
    }
    Ok(match planes {
        DecodingResult::U8(v) => DecodingResult::U8(woven(&v, stride)),
        DecodingResult::U16(v) => DecodingResult::U16(woven(&v, stride)),
        DecodingResult::F32(v) => DecodingResult::F32(woven(&v, stride)),
        _ => return Err(broken(&"its colours lie in planes of unusual numbers; save it with interleaved colours")),
    })
}

const PHOTOMETRIC: u16 = 262;
const PALETTE: u16 = 3;
const BLACK_IS_ZERO: u8 = 1;
const DNG_VERSION: u16 = 50706;

/// Where the value of a short lies that is this tag of the first directory, if it has this value.
fn entry_of(bytes: &[u8], tag: u16, value: u16) -> Option<usize> {
    let little = bytes.first() == Some(&b'I');
    let number = |at: usize, length: usize| {
        let part = bytes.get(at..at.checked_add(length)?)?;
        let push = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if little { part.iter().rev().fold(0, push) } else { part.iter().fold(0, push) })
    };
    let big = number(2, 2)? == 43;
    let directory = usize::try_from(if big { number(8, 8)? } else { number(4, 4)? }).ok()?;
    let (head, entry, at_value) = if big { (8, 20, 12) } else { (2, 12, 8) };
    let entries = usize::try_from(number(directory, head)?).ok()?;
    (0..entries.min(usize::from(u16::MAX)))
        .map_while(|k| directory.checked_add(head + k * entry))
        .take_while(|at| *at < bytes.len())
        .find(|at| number(*at, 2) == Some(u64::from(tag)))
        .map(|at| at + at_value)
        .filter(|at| number(*at, 2) == Some(u64::from(value)))
}
