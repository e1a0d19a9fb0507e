//! Decoders: from a file in memory to rows of numbers.

use super::{
    PictureError,
    canvas::Orientation,
    colour::{Alpha, Says},
    curve::Model,
    kind::Kind,
    primaries::Primaries,
    sheet::{Rows, Sheet, Sink, emit, of_u8, of_u16, rows_together},
    tiff,
};
use glam::DVec2;
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};

/// Reads the head of a picture; `allowed` is the memory that decoding may take, bytes.
pub(super) fn open(kind: Kind, bytes: &mut [u8], allowed: u64) -> Result<Sheet<'_>, PictureError> {
    match kind {
        Kind::Png => open_png(bytes, allowed),
        Kind::Jpeg => open_jpeg(bytes, allowed),
        Kind::Tiff => tiff::open(bytes, allowed),
        Kind::WebP => open_common(bytes, ImageFormat::WebP, kind, allowed),
        Kind::Bmp => open_common(bytes, ImageFormat::Bmp, kind, allowed),
        Kind::Gif => open_common(bytes, ImageFormat::Gif, kind, allowed),
        Kind::Pnm => open_common(bytes, ImageFormat::Pnm, kind, allowed),
        Kind::Exr | Kind::Svg => Err(PictureError::Unknown),
    }
}

fn broken(kind: Kind) -> impl Fn(&dyn std::fmt::Display) -> PictureError {
    move |error| PictureError::broken(kind.name(), error)
}

/// The orientation in a block of EXIF, which some writers begin with its name.
fn orientation_of(exif: Option<&[u8]>) -> Orientation {
    let exif = exif.map(|exif| exif.strip_prefix(b"Exif\0\0").unwrap_or(exif));
    let found = exif.and_then(image::metadata::Orientation::from_exif_chunk);
    found.map_or(Orientation::UPRIGHT, |found| Orientation::new(found.to_exif()))
}

/// PNG is read with the decoder of `image` itself, which knows more of the file, and row by row.
fn open_png(bytes: &[u8], allowed: u64) -> Result<Sheet<'_>, PictureError> {
    let failed = |error: png::DecodingError| broken(Kind::Png)(&error);
    let limits = png::Limits { bytes: usize::try_from(allowed).unwrap_or(usize::MAX) };
    // It may lie behind the picture, which the decoder does not know before it is read.
    let exif = chunk_of(bytes, b"eXIf");
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    // Palettes, few bits and transparent colours become bytes and alpha.
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let mut reader = decoder.read_info().map_err(failed)?;
    let info = reader.info();
    // The decoder believes that it is whole colours, and panics.
    if info.palette.as_ref().is_some_and(|palette| palette.len() % 3 != 0) {
        return Err(broken(Kind::Png)(&"its palette ends within a colour"));
    }
    let chromaticity = |(x, y): (png::ScaledFloat, png::ScaledFloat)| DVec2::new(scaled(x), scaled(y));
    let says = if let Some(coded) = info.coding_independent_code_points.filter(|coded| {
        // Left open.
        coded.color_primaries != 2 && coded.transfer_function != 2
    }) {
        Says::Coded {
            primaries: coded.color_primaries,
            transfer: coded.transfer_function,
            matrix: coded.matrix_coefficients,
            full: coded.is_video_full_range_image,
        }
    } else if let Some(profile) = &info.icc_profile {
        Says::Profile(profile.to_vec())
    } else if info.srgb.is_some() {
        Says::Srgb
    } else {
        let gamma = info.gama_chunk.map(scaled).filter(|gamma| *gamma > 0.0);
        let primaries = info
            .chrm_chunk
            .map(|of| Primaries { rgb: [of.red, of.green, of.blue].map(chromaticity), white: chromaticity(of.white) });
        if gamma.is_none() && primaries.is_none() { Says::Nothing } else { Says::Gamma { gamma, primaries } }
    };
    let orientation = orientation_of(exif);
    let size = (info.width as usize, info.height as usize);
    let interlaced = info.interlaced;
    let (colour, depth) = reader.output_color_type();
    let (model, alpha) = match colour {
        png::ColorType::Grayscale => (Model::Grey, Alpha::None),
        png::ColorType::GrayscaleAlpha => (Model::Grey, Alpha::Straight),
        png::ColorType::Rgba => (Model::Rgb, Alpha::Straight),
        png::ColorType::Rgb | png::ColorType::Indexed => (Model::Rgb, Alpha::None),
    };
    let wide = depth == png::BitDepth::Sixteen;
    let stride = colour.samples();
    let row_bytes = size.0 as u64 * stride as u64 * if wide { 2 } else { 1 };
    let rows_held = if interlaced { size.1 } else { rows_together(size.0 * stride).min(size.1) } as u64;
    let rows: Rows<'_> = Box::new(move |sink| {
        let per_row = size.0 * stride;
        let give = |bytes: &[u8], top: usize, sink: Sink<'_>| {
            if wide {
                let numbers: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
                emit(&numbers, per_row, top, of_u16, sink)
            } else {
                emit(bytes, per_row, top, of_u8, sink)
            }
        };
        if interlaced {
            let length = reader.output_buffer_size().ok_or_else(|| broken(Kind::Png)(&"its size overflows"))?;
            let mut frame = vec![0; length];
            reader.next_frame(&mut frame).map_err(failed)?;
            return give(&frame, 0, sink);
        }
        let together = rows_together(per_row);
        let mut strip = Vec::new();
        for j in 0..size.1 {
            let row = reader.next_row().map_err(failed)?.ok_or_else(|| broken(Kind::Png)(&"it ends too early"))?;
            strip.extend_from_slice(row.data());
            if (j + 1) % together == 0 || j + 1 == size.1 {
                give(&strip, j / together * together, sink)?;
                strip.clear();
            }
        }
        Ok(())
    });
    let greatest = Some(if wide { u16::MAX } else { u16::from(u8::MAX) });
    let needs = rows_held.saturating_mul(row_bytes);
    Ok(Sheet { size, model, alpha, stride, greatest, orientation, says, needs, rows })
}

/// What the first chunk of a kind holds.
fn chunk_of<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<&'a [u8]> {
    let mut at = 8;
    while let Some((length, rest)) = bytes.get(at..)?.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        if rest.starts_with(kind) {
            return rest.get(4..4 + length);
        }
        at += 12 + length;
    }
    None
}

fn scaled(value: png::ScaledFloat) -> f64 {
    f64::from(value.into_scaled()) / 100_000.0
}

/// A block of 64 pixels takes at least one bit.
const JPEG_PIXELS_PER_BYTE: usize = 64 * 8;

fn open_jpeg(bytes: &[u8], allowed: u64) -> Result<Sheet<'_>, PictureError> {
    // A decoder fills what is missing with grey.
    if !is_whole(bytes) {
        return Err(broken(Kind::Jpeg)(&"it ends before its picture does"));
    }
    let mut head = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), jpeg_options());
    head.decode_headers().map_err(|error| broken(Kind::Jpeg)(&error))?;
    let (width, height) = head.dimensions().unwrap_or_default();
    let most = bytes.len().saturating_mul(JPEG_PIXELS_PER_BYTE);
    if width.saturating_mul(height) > most {
        let says = format!("it claims {width} x {height} pixels, and its {} bytes hold at most {most}", bytes.len());
        return Err(broken(Kind::Jpeg)(&says));
    }
    let is_cmyk = matches!(head.input_colorspace(), Some(ColorSpace::CMYK | ColorSpace::YCCK));
    if !is_cmyk {
        return open_common(bytes, ImageFormat::Jpeg, Kind::Jpeg, allowed);
    }
    // Of four inks `image` would make RGB, past any profile.
    let size = head.dimensions().unwrap_or_default();
    let stored = head.input_colorspace().unwrap_or(ColorSpace::CMYK);
    let says = head.icc_profile().map_or(Says::Nothing, Says::Profile);
    let orientation = orientation_of(head.exif().map(Vec::as_slice));
    let inverted = has_adobe_marker(bytes);
    let rows: Rows<'_> = Box::new(move |sink| {
        let options = jpeg_options().jpeg_set_out_colorspace(stored);
        let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
        let mut inks = decoder.decode().map_err(|error| broken(Kind::Jpeg)(&error))?;
        if inks.len() != 4 * size.0 * size.1 {
            return Err(broken(Kind::Jpeg)(&"it has too few pixels"));
        }
        for ink in inks.as_chunks_mut::<4>().0 {
            if stored == ColorSpace::YCCK {
                *ink = cmyk_of_ycck(*ink);
            }
            if inverted {
                *ink = ink.map(|ink| 255 - ink);
            }
        }
        emit(&inks, 4 * size.0, 0, of_u8, sink)
    });
    Ok(Sheet {
        size,
        model: Model::Cmyk,
        alpha: Alpha::None,
        stride: 4,
        greatest: Some(255),
        orientation,
        says,
        needs: 12 * size.0 as u64 * size.1 as u64,
        rows,
    })
}

/// Whether a JPEG goes on to its end marker. Behind it there may be anything: phones put a film
/// there.
fn is_whole(bytes: &[u8]) -> bool {
    let mut at = 2;
    loop {
        match bytes.get(at..) {
            // Markers may be filled up with any number of these.
            Some([0xff, 0xff, ..]) => at += 1,
            Some([0xff, 0xd9, ..]) => return true,
            // Those without a length, and bytes of a scan that look like a marker.
            Some([0xff, 0x00 | 0x01 | 0xd0..=0xd8, ..]) => at += 2,
            Some([0xff, _, high, low, ..]) => at += 2 + usize::from(u16::from_be_bytes([*high, *low])).max(2),
            Some([_, ..]) => at += 1,
            _ => return false,
        }
    }
}

fn jpeg_options() -> DecoderOptions {
    DecoderOptions::default().set_strict_mode(false).set_max_width(usize::MAX).set_max_height(usize::MAX)
}

/// The first three inks of YCCK are the complements of what their YCbCr is in RGB (Adobe technical
/// note 5116).
fn cmyk_of_ycck([y, cb, cr, k]: [u8; 4]) -> [u8; 4] {
    let (y, cb, cr) = (f32::from(y), f32::from(cb) - 128.0, f32::from(cr) - 128.0);
    let rgb = [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb];
    let [c, m, y] = rgb.map(|value| 255 - value.round().clamp(0.0, 255.0) as u8);
    [c, m, y, k]
}

/// Whether there is an APP14 segment of Adobe's, which tells that inks are stored the other way
/// round.
fn has_adobe_marker(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4).and_then(|b| b.first_chunk::<4>()) {
        if marker == 0xda {
            return false;
        }
        if marker == 0xee && bytes[at + 4..].starts_with(b"Adobe") {
            return true;
        }
        at += 2 + usize::from(u16::from_be_bytes([high, low])).max(2);
    }
    false
}

/// Whether the chunks of a RIFF file end within it: the decoder takes as much memory as one claims.
fn holds_its_chunks(bytes: &[u8]) -> bool {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let end = word(4).map_or(0, |size| size.saturating_add(8)).min(bytes.len());
    let mut at = 12;
    while at < end {
        let Some(size) = word(at + 4) else { return false };
        let next = (at + 8).saturating_add(size);
        if next > bytes.len() {
            return false;
        }
        at = next + size % 2;
    }
    true
}

/// What the decoders of `image` read.
fn open_common(bytes: &[u8], format: ImageFormat, kind: Kind, allowed: u64) -> Result<Sheet<'_>, PictureError> {
    let failed = move |error: image::ImageError| broken(kind)(&error);
    if format == ImageFormat::WebP && !holds_its_chunks(bytes) {
        return Err(broken(kind)(&"it ends within a chunk"));
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(allowed);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits.clone());
    let mut decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let size = (width as usize, height as usize);
    let colour = decoder.color_type();
    let (model, alpha) = match colour {
        ColorType::L8 | ColorType::L16 => (Model::Grey, Alpha::None),
        ColorType::La8 | ColorType::La16 => (Model::Grey, Alpha::Straight),
        ColorType::Rgba8 | ColorType::Rgba16 | ColorType::Rgba32F => (Model::Rgb, Alpha::Straight),
        _ => (Model::Rgb, Alpha::None),
    };
    let stride = usize::from(colour.channel_count());
    let width = colour.bytes_per_pixel() / colour.channel_count();
    let profile = decoder.icc_profile().ok().flatten();
    let says = profile.map_or(if width == 4 { Says::Float } else { Says::Nothing }, Says::Profile);
    let orientation = orientation_of(decoder.exif_metadata().ok().flatten().as_deref());
    let total = decoder.total_bytes();
    let rows: Rows<'_> = Box::new(move |sink| {
        decoder.set_limits(limits).map_err(failed)?;
        let mut buffer = vec![0; total as usize];
        decoder.read_image(&mut buffer).map_err(failed)?;
        let per_row = size.0 * stride;
        match width {
            1 => emit(&buffer, per_row, 0, of_u8, sink),
            2 => emit(buffer.as_chunks::<2>().0, per_row, 0, |b| of_u16(&u16::from_ne_bytes(*b)), sink),
            _ => emit(buffer.as_chunks::<4>().0, per_row, 0, |b| f32::from_ne_bytes(*b), sink),
        }
    });
    let greatest = match width {
        1 => Some(u16::from(u8::MAX)),
        2 => Some(u16::MAX),
        _ => None,
    };
    Ok(Sheet { size, model, alpha, stride, greatest, orientation, says, needs: total, rows })
}
