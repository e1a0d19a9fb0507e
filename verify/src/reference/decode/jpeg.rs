//! JPEG: pixels by jpeg-decoder; profile, orientation and Adobe's marker are read here.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
        tiff_tags::orientation_of_exif,
    },
    decoded::{Decoded, believe},
};
use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};
use std::collections::BTreeMap;

const NAME: &str = "JPEG";
/// A block of 64 pixels takes at least one bit.
const PER_BYTE: usize = 64 * 8;

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let markers = Markers::of(bytes);
    let raster = pixels(bytes, None, markers.adobe)?;
    let decoded = Decoded::new(raster, markers.profile().as_deref(), Meaning::srgb());
    Ok(Decoded { orientation: markers.orientation, lossy: true, ..decoded })
}

/// The pixels of a stream. CMYK is the share of ink that covers the paper; Adobe's marker says that
/// the stream holds the bare paper.
pub(super) fn pixels(
    bytes: &[u8],
    transform: Option<ColorTransform>,
    inverted: bool,
) -> Result<Raster, ReferenceError> {
    let failed = |error: jpeg_decoder::Error| ReferenceError::malformed(NAME, error);
    let mut decoder = Decoder::new(bytes);
    if let Some(transform) = transform {
        decoder.set_color_transform(transform);
    }
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or_else(|| ReferenceError::malformed(NAME, "it has no frame"))?;
    let (nx, ny) = (usize::from(info.width), usize::from(info.height));
    believe(nx, ny, bytes.len(), PER_BYTE)?;
    let data = decoder.decode().map_err(failed)?;
    let (inks, samples) = match info.pixel_format {
        PixelFormat::L8 => (Inks::Grey, Samples::Bits8(data)),
        PixelFormat::RGB24 => (Inks::Rgb, Samples::Bits8(data)),
        PixelFormat::L16 => {
            (Inks::Grey, Samples::Bits16(data.chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]])).collect()))
        }
        // The decoder takes every CMYK for Adobe's.
        PixelFormat::CMYK32 if inverted => (Inks::Cmyk, Samples::Bits8(data)),
        PixelFormat::CMYK32 => (Inks::Cmyk, Samples::Bits8(data.into_iter().map(|v| 255 - v).collect())),
    };
    Ok(Raster { nx, ny, inks, alpha: Alpha::None, samples })
}

/// What stands in front of the pixels.
struct Markers<'a> {
    orientation: u8,
    /// Adobe's marker, APP14.
    adobe: bool,
    /// Parts of a profile by their numbers, and how many there shall be.
    parts: BTreeMap<u8, &'a [u8]>,
    count: u8,
}

impl<'a> Markers<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let mut found = Self { orientation: 1, adobe: false, parts: BTreeMap::new(), count: 0 };
        let mut rest = bytes.get(2..).unwrap_or(&[]);
        let mut has_exif = false;
        loop {
            // Any number of 0xff may stand in front of a marker.
            while rest.starts_with(&[0xff, 0xff]) {
                rest = &rest[1..];
            }
            let [0xff, marker, high, low, ..] = *rest else { return found };
            let length = usize::from(u16::from_be_bytes([high, low]));
            // The pixels begin, or nothing that is known.
            if marker == 0xda || marker == 0xd9 || length < 2 {
                return found;
            }
            let Some(segment) = rest.get(4..2 + length) else { return found };
            match marker {
                0xe1 if !has_exif => {
                    if let Some(exif) = segment.strip_prefix(b"Exif\0\0") {
                        (found.orientation, has_exif) = (orientation_of_exif(exif), true);
                    }
                }
                0xe2 => {
                    if let Some([number, count, part @ ..]) = segment.strip_prefix(b"ICC_PROFILE\0") {
                        found.parts.insert(*number, part);
                        found.count = *count;
                    }
                }
                0xee => found.adobe |= segment.starts_with(b"Adobe"),
                _ => {}
            }
            rest = &rest[2 + length..];
        }
    }

    /// The profile, if all of its parts are there.
    fn profile(&self) -> Option<Vec<u8>> {
        let whole = self.count > 0 && self.parts.len() == usize::from(self.count);
        whole.then(|| self.parts.values().copied().flatten().copied().collect())
    }
}
