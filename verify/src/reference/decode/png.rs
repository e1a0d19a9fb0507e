//! PNG (third edition): pixels by lodepng; what the chunks say of colour and orientation is read
//! here.

use super::{
    super::{
        colour::{self, Meaning},
        error::ReferenceError,
        icc,
        raster::{Alpha, Inks, Raster, Samples},
        tiff_tags::orientation_of_exif,
    },
    decoded::{Decoded, believe},
};
use flate2::read::ZlibDecoder;
use std::io::Read;

const NAME: &str = "PNG";
/// Deflate makes at most 1032 bytes of one, and eight pixels of a byte.
const PER_BYTE: usize = 1032 * 8;
/// Longest profile that is read: those of printers take a few megabytes.
const MOST_PROFILE: u64 = 64 << 20;

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let chunks = Chunks::of(bytes);
    let header = chunks.find(b"IHDR").filter(|header| header.len() == 13);
    let header = header.ok_or_else(|| ReferenceError::malformed(NAME, "it does not begin with a header"))?;
    let side = |at: usize| u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]) as usize;
    let (nx, ny, depth, kind) = (side(0), side(4), header[8], header[9]);
    believe(nx, ny, bytes.len(), PER_BYTE / usize::from(depth.max(1)))?;
    let inks = if matches!(kind, 0 | 4) { Inks::Grey } else { Inks::Rgb };
    let has_alpha = matches!(kind, 4 | 6) || chunks.find(b"tRNS").is_some();
    let alpha = if has_alpha { Alpha::Straight } else { Alpha::None };
    let raster = Raster { nx, ny, inks, alpha, samples: samples(bytes, inks, has_alpha, depth == 16)? };
    let meaning = meaning(&chunks, inks);
    let orientation = chunks.find(b"eXIf").map_or(1, orientation_of_exif);
    Ok(Decoded { raster, orientation, meaning, scaled_to_peak: false, lossy: false })
}

/// What the chunks say of colour, the first that there is: `cICP`, `iCCP`, `sRGB`, `gAMA` and
/// `cHRM`.
fn meaning(chunks: &Chunks<'_>, inks: Inks) -> Result<Meaning, ReferenceError> {
    if let Some(cicp) = chunks.find(b"cICP")
        && let Some(meaning) = colour::of_cicp(cicp)?
    {
        return Ok(meaning);
    }
    if let Some(meaning) = chunks.find(b"iCCP").and_then(profile).and_then(|profile| icc::read(&profile, inks)) {
        return Ok(meaning);
    }
    let (gamma, chromaticities) = (chunks.find(b"gAMA"), chunks.find(b"cHRM"));
    if chunks.find(b"sRGB").is_some() || (gamma.is_none() && chromaticities.is_none()) {
        return Ok(Meaning::srgb());
    }
    colour::of_gamma(gamma, chromaticities)
}

/// The profile in `iCCP`: a name, its end, the method 0, and deflated bytes.
fn profile(chunk: &[u8]) -> Option<Vec<u8>> {
    let end = chunk.iter().take(80).position(|byte| *byte == 0)?;
    let packed = chunk.get(end + 2..)?;
    let mut profile = Vec::new();
    ZlibDecoder::new(packed).take(MOST_PROFILE).read_to_end(&mut profile).ok()?;
    Some(profile)
}

/// The pixels, with palettes looked up and bits widened to 8 or 16.
fn samples(bytes: &[u8], inks: Inks, has_alpha: bool, deep: bool) -> Result<Samples, ReferenceError> {
    let failed = |error: lodepng::Error| ReferenceError::malformed(NAME, error);
    let mut decoder = lodepng::Decoder::new();
    decoder.color_convert(true);
    decoder.read_text_chunks(false);
    decoder.remember_unknown_chunks(false);
    let kind = match (inks, has_alpha) {
        (Inks::Grey, false) => lodepng::ColorType::GREY,
        (Inks::Grey, true) => lodepng::ColorType::GREY_ALPHA,
        (_, false) => lodepng::ColorType::RGB,
        (_, true) => lodepng::ColorType::RGBA,
    };
    let raw = decoder.info_raw_mut();
    raw.set_colortype(kind);
    raw.try_set_bitdepth(if deep { 16 } else { 8 }).map_err(failed)?;
    let image = decoder.decode(bytes).map_err(failed)?;
    let held = image.bytes();
    // Numbers of two bytes are big-endian, as they are stored.
    Ok(if deep {
        Samples::Bits16(held.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect())
    } else {
        Samples::Bits8(held.to_vec())
    })
}

/// The chunks of a file, as far as they are whole.
struct Chunks<'a> {
    all: Vec<(&'a [u8], &'a [u8])>,
}

impl<'a> Chunks<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let mut all = Vec::new();
        let mut rest = bytes.get(8..).unwrap_or(&[]);
        while let Some(head) = rest.get(..8) {
            let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
            let Some(data) = length.checked_add(8).and_then(|end| rest.get(8..end)) else { break };
            // Nothing of colour stands behind the pixels, and there may be many of their chunks.
            match &head[4..8] {
                b"IEND" => break,
                b"IDAT" => {}
                name => all.push((name, data)),
            }
            rest = rest.get(12 + length..).unwrap_or(&[]);
        }
        Self { all }
    }

    fn find(&self, name: &[u8; 4]) -> Option<&'a [u8]> {
        self.all.iter().find(|(known, _)| *known == name).map(|(_, data)| *data)
    }
}
