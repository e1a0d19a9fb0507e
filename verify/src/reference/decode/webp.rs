//! WebP: pixels, and the profile and orientation in chunks of their own.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
        tiff_tags::orientation_of_exif,
    },
    decoded::{Decoded, believe},
};
use std::io::Cursor;

const NAME: &str = "WebP";
/// A lossless block of one colour takes no bits at all: nothing real is packed as tightly as this.
const PER_BYTE: usize = 4096;

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let failed = |error: image_webp::DecodingError| ReferenceError::malformed(NAME, error);
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(failed)?;
    let (nx, ny) = decoder.dimensions();
    let (nx, ny) = (nx as usize, ny as usize);
    believe(nx, ny, bytes.len(), PER_BYTE)?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut samples = vec![0; nx * ny * channels];
    decoder.read_image(&mut samples).map_err(failed)?;
    let alpha = if channels == 4 { Alpha::Straight } else { Alpha::None };
    let raster = Raster { nx, ny, inks: Inks::Rgb, alpha, samples: Samples::Bits8(samples) };
    let orientation = chunk(bytes, b"EXIF").map_or(1, orientation_of_exif);
    let decoded = Decoded::new(raster, chunk(bytes, b"ICCP"), Meaning::srgb());
    Ok(Decoded { orientation, lossy: decoder.is_lossy(), ..decoded })
}

/// The content of the first chunk of this name.
fn chunk<'a>(bytes: &'a [u8], name: &[u8; 4]) -> Option<&'a [u8]> {
    let mut rest = bytes.get(12..)?;
    loop {
        let length = u32::from_le_bytes([*rest.get(4)?, *rest.get(5)?, *rest.get(6)?, *rest.get(7)?]) as usize;
        if rest[..4] == *name {
            return rest.get(8..8 + length);
        }
        rest = rest.get(8 + length.next_multiple_of(2)..)?;
    }
}
