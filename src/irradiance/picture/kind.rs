//! What kind of file a picture is, told by its first bytes.

use super::PictureError;

/// Bytes from the start of a file that tell its kind.
pub(super) const HEAD: usize = 1 << 16;

/// A kind that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Png,
    Jpeg,
    Tiff,
    Exr,
    Svg,
    WebP,
    Bmp,
    Gif,
    Pnm,
}

/// A kind that is not read: its name, and what makes a picture of it that is.
struct Foreign {
    name: &'static str,
    command: &'static str,
}

const fn foreign(name: &'static str, command: &'static str) -> Foreign {
    Foreign { name, command }
}

const HEIC: Foreign = foreign("HEIC", "heif-convert picture.heic picture.png");
const AVIF: Foreign = foreign("AVIF", "avifdec picture.avif picture.png");
const JPEG_XL: Foreign = foreign("JPEG XL", "djxl picture.jxl picture.png");
const JPEG_2000: Foreign = foreign("JPEG 2000", "opj_decompress -i picture.jp2 -o picture.png");
const PDF: Foreign = foreign("PDF", "pdftocairo -svg picture.pdf picture.svg");
const POSTSCRIPT: Foreign =
    foreign("PostScript", "gs -o picture.png -sDEVICE=png16m -r300 -dGraphicsAlphaBits=4 picture.ps");
const PHOTOSHOP: Foreign = foreign("Photoshop", "magick 'picture.psd[0]' picture.png");
const RAW: Foreign = foreign("raw photograph", "darktable-cli photograph.nef picture.png");
const GIMP: Foreign = foreign("GIMP", "magick picture.xcf -flatten picture.png");
const RADIANCE: Foreign = foreign("Radiance HDR", "magick picture.hdr picture.exr");
const FLOAT_MAP: Foreign = foreign("portable float map", "magick picture.pfm picture.exr");
const ICON: Foreign = foreign("Windows icon", "magick 'picture.ico[0]' picture.png");
const DIRECT_DRAW: Foreign = foreign("DirectDraw", "magick picture.dds picture.png");
const QOI: Foreign = foreign("QOI", "magick picture.qoi picture.png");
const GZIP: Foreign = foreign("gzip", "gzip -dc picture.svgz > picture.svg");

impl Foreign {
    fn refused(&self) -> PictureError {
        PictureError::Foreign { kind: self.name, command: self.command }
    }
}

impl Kind {
    /// The kind of a file that begins with `head`.
    pub(super) fn of(head: &[u8]) -> Result<Self, PictureError> {
        let starts = |magic: &[u8]| head.starts_with(magic);
        let at = |offset: usize, magic: &[u8]| head.get(offset..offset + magic.len()) == Some(magic);
        let kind = match head {
            [] => return Err(PictureError::Empty),
            _ if starts(b"\x89PNG\r\n\x1a\n") => Self::Png,
            _ if starts(b"\xff\xd8\xff") => Self::Jpeg,
            _ if starts(b"\x76\x2f\x31\x01") => Self::Exr,
            _ if starts(b"RIFF") && at(8, b"WEBP") => Self::WebP,
            _ if starts(b"GIF8") => Self::Gif,
            _ if starts(b"BM") => Self::Bmp,
            [b'P', b'1'..=b'7', b, ..] if b.is_ascii_whitespace() || *b == b'#' => Self::Pnm,
            _ if starts(b"II*\0") && at(8, b"CR") => return Err(RAW.refused()),
            _ if starts(b"II*\0") || starts(b"MM\0*") || starts(b"II+\0") || starts(b"MM\0+") => Self::Tiff,
            _ if at(4, b"ftyp") => return Err(of_boxes(head).refused()),
            _ => match foreign_of(head) {
                Some(foreign) => return Err(foreign.refused()),
                None if is_svg(head) => Self::Svg,
                None => return Err(PictureError::Unknown),
            },
        };
        Ok(kind)
    }

    /// As people call it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tiff => "TIFF",
            Self::Exr => "OpenEXR",
            Self::Svg => "SVG",
            Self::WebP => "WebP",
            Self::Bmp => "BMP",
            Self::Gif => "GIF",
            Self::Pnm => "PNM",
        }
    }
}

/// The refusal of a raw photograph that is a TIFF file otherwise.
pub(super) fn raw_photograph() -> PictureError {
    RAW.refused()
}

fn foreign_of(head: &[u8]) -> Option<&'static Foreign> {
    let kinds: [(&[u8], &Foreign); 22] = [
        (b"\xff\x0a", &JPEG_XL),
        (b"\0\0\0\x0cJXL ", &JPEG_XL),
        (b"\0\0\0\x0cjP  ", &JPEG_2000),
        (b"\xff\x4f\xff\x51", &JPEG_2000),
        (b"%PDF", &PDF),
        (b"%!PS", &POSTSCRIPT),
        (b"\xc5\xd0\xd3\xc6", &POSTSCRIPT),
        (b"8BPS", &PHOTOSHOP),
        (b"gimp xcf", &GIMP),
        (b"FUJIFILMCCD-RAW", &RAW),
        (b"IIRO", &RAW),
        (b"IIRS", &RAW),
        (b"MMOR", &RAW),
        (b"IIU\0", &RAW),
        (b"#?RADIANCE", &RADIANCE),
        (b"#?RGBE", &RADIANCE),
        (b"PF\n", &FLOAT_MAP),
        (b"Pf\n", &FLOAT_MAP),
        (b"\0\0\x01\0", &ICON),
        (b"DDS ", &DIRECT_DRAW),
        (b"qoif", &QOI),
        (b"\x1f\x8b", &GZIP),
    ];
    kinds.into_iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, foreign)| foreign)
}

/// Files of boxes (ISO 14496-12) name their brands in the first one.
fn of_boxes(head: &[u8]) -> &'static Foreign {
    let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
    let brands = &head[8..length.clamp(8, head.len())];
    let has = |names: &[&[u8]]| brands.chunks_exact(4).any(|brand| names.contains(&brand));
    match () {
        () if has(&[b"avif", b"avis"]) => &AVIF,
        () if has(&[b"crx "]) => &RAW,
        () if has(&[b"jxl "]) => &JPEG_XL,
        () if has(&[b"jp2 ", b"jpx "]) => &JPEG_2000,
        () => &HEIC,
    }
}

/// Markup whose first element is `svg`, or UTF-16 that looks like markup.
fn is_svg(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if !text.starts_with('<') {
        return false;
    }
    let opens = |name: &str| text.find(name).unwrap_or(usize::MAX);
    opens("<svg").min(opens(":svg")) < opens("<html").min(opens("<HTML"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_told_by_their_first_bytes() {
        for (head, kind) in [
            (&b"\x89PNG\r\n\x1a\n"[..], Kind::Png),
            (b"\xff\xd8\xff\xe0", Kind::Jpeg),
            (b"MM\0*\0\0\0\x08", Kind::Tiff),
            (b"P5\n4 4", Kind::Pnm),
            (b"RIFF\0\0\0\0WEBPVP8L", Kind::WebP),
            (b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<!-- x --><svg xmlns=\"\">", Kind::Svg),
        ] {
            assert_eq!(Kind::of(head).unwrap(), kind);
        }
    }

    #[test]
    fn kinds_that_are_not_read_are_named_with_what_converts_them() {
        for (head, words) in [
            (&b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"[..], ["HEIC", "heif-convert"]),
            (b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic", ["HEIC", "heif-convert"]),
            (b"\0\0\0\x1cftypavif\0\0\0\0mif1avif", ["AVIF", "avifdec"]),
            (b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom", ["raw photograph", "darktable-cli"]),
            (b"\xff\x0a\0\0", ["JPEG XL", "djxl"]),
            (b"%PDF-1.7", ["PDF", "pdftocairo -svg"]),
            (b"8BPS\0\x01", ["Photoshop", "magick"]),
            (b"II*\0\x10\0\0\0CR\x02\0", ["raw photograph", "darktable-cli"]),
        ] {
            let said = Kind::of(head).unwrap_err().to_string();
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
        for head in [&b"hello"[..], b"<!DOCTYPE html><html><svg>", b"PK\x03\x04"] {
            assert!(matches!(Kind::of(head), Err(PictureError::Unknown)));
        }
        assert!(matches!(Kind::of(b""), Err(PictureError::Empty)));
    }
}
