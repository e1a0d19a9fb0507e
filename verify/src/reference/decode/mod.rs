//! From the bytes of a file to numbers, and what the file says that they mean. One module per
//! format, each from its specification.

mod bits;
mod bmp;
mod decoded;
mod exr;
mod gif;
mod jpeg;
mod png;
mod pnm;
#[cfg(feature = "svg")]
pub(super) mod svg;
#[cfg(feature = "svg")]
mod svg_work;
mod tiff;
mod tiff_packing;
mod webp;

pub(super) use decoded::Decoded;

use super::error::ReferenceError;

/// A kind of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Jpeg,
    Tiff,
    WebP,
    Bmp,
    Gif,
    Pnm,
    Exr,
    Svg,
}

/// Says by its content what a file is.
pub(super) fn sniff(bytes: &[u8]) -> Result<Format, ReferenceError> {
    let has = |at: usize, mark: &[u8]| bytes.get(at..).is_some_and(|rest| rest.starts_with(mark));
    if has(0, b"\x89PNG\r\n\x1a\n") {
        return Ok(Format::Png);
    }
    if has(0, b"\xff\xd8\xff") {
        return Ok(Format::Jpeg);
    }
    if has(0, b"RIFF") && has(8, b"WEBP") {
        return Ok(Format::WebP);
    }
    if has(0, b"GIF87a") || has(0, b"GIF89a") {
        return Ok(Format::Gif);
    }
    if has(0, b"\x76\x2f\x31\x01") {
        return Ok(Format::Exr);
    }
    if let Some(foreign) = foreign(has) {
        return Err(foreign);
    }
    if has(0, b"II*\0") || has(0, b"MM\0*") || has(0, b"II+\0") || has(0, b"MM\0+") {
        return Ok(Format::Tiff);
    }
    if bytes.len() > 26 && has(0, b"BM") {
        return Ok(Format::Bmp);
    }
    if let [b'P', b'1'..=b'7', space, ..] = bytes
        && (space.is_ascii_whitespace() || *space == b'#')
    {
        return Ok(Format::Pnm);
    }
    if is_svg(bytes) {
        return Ok(Format::Svg);
    }
    Err(ReferenceError::UnknownFormat)
}

/// Whether the text of a file begins as SVG does, behind declarations and comments.
fn is_svg(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let begin = text.iter().position(|byte| !byte.is_ascii_whitespace());
    let Some(b'<') = begin.map(|at| text[at]) else { return false };
    text[..text.len().min(1 << 16)].windows(4).any(|word| word == b"<svg" || word == b":svg")
}

/// Formats that are known and not read.
fn foreign(has: impl Fn(usize, &[u8]) -> bool) -> Option<ReferenceError> {
    let brand = |names: &[&[u8]]| has(4, b"ftyp") && names.iter().any(|name| has(8, name));
    let (format, remedy) = if brand(&[b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1"]) {
        ("HEIC", "heif-convert photo.heic photo.png")
    } else if brand(&[b"avif", b"avis"]) {
        ("AVIF", "avifdec photo.avif photo.png")
    } else if brand(&[b"crx "])
        || has(0, b"FUJIFILMCCD-RAW")
        || has(8, b"CR\x02\0")
        || has(0, b"IIRO")
        || has(0, b"IIU\0")
    {
        ("raw photograph", "darktable-cli photo.raw photo.png")
    } else if has(0, b"\xff\x0a") || has(0, b"\0\0\0\x0cJXL ") {
        ("JPEG XL", "djxl photo.jxl photo.png")
    } else if has(0, b"\0\0\0\x0cjP  ") || has(0, b"\xff\x4f\xff\x51") {
        ("JPEG 2000", "opj_decompress -i photo.jp2 -o photo.png")
    } else if has(0, b"%PDF-") {
        ("PDF", "pdftoppm -png -r 300 -singlefile page.pdf page")
    } else if has(0, b"8BPS") {
        ("PSD", "magick 'picture.psd[0]' picture.png")
    } else {
        return None;
    };
    Some(ReferenceError::Foreign { format, remedy })
}

/// Decodes a picture; `layer` names that of an OpenEXR file.
pub(super) fn decode(format: Format, bytes: &[u8], layer: Option<&str>) -> Result<Decoded, ReferenceError> {
    let decoded = match format {
        Format::Png => png::decode(bytes),
        Format::Jpeg => jpeg::decode(bytes),
        Format::Tiff => tiff::decode(bytes),
        Format::WebP => webp::decode(bytes),
        Format::Bmp => bmp::decode(bytes),
        Format::Gif => gif::decode(bytes),
        Format::Pnm => pnm::decode(bytes),
        Format::Exr => exr::decode(bytes, layer),
        Format::Svg => return Err(ReferenceError::malformed("SVG", "it has no pixels of its own")),
    }?;
    if decoded.raster.is_whole() {
        Ok(decoded)
    } else {
        Err(ReferenceError::malformed("picture", "the decoder left another number of samples than it has pixels"))
    }
}
