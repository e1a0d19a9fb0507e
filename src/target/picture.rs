use crate::{grid::Field, target::TargetIrradiance};
use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};
use std::{
    fs::File,
    io::{self, BufRead, BufReader, Seek},
    path::Path,
};

/// How the numbers in a picture become light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// Numbers are encoded for a screen (IEC 61966-2-1); the wall looks like the picture on that screen.
    Srgb,
    /// Numbers are light already.
    Linear,
}

impl Transfer {
    /// Light of an encoded value, both on a 0..1 scale.
    pub fn to_linear(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Srgb if value <= 0.04045 => value / 12.92,
            Self::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    }

    /// The inverse of [`to_linear`](Self::to_linear).
    pub fn from_linear(self, light: f64) -> f64 {
        match self {
            Self::Linear => light,
            Self::Srgb if light <= 0.003_130_8 => light * 12.92,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
        }
    }
}

/// A grey-scale picture of linear light on a 0..1 scale, row 0 on top, as a viewer sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    values: Field<f64>,
}

/// Why a picture cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The file cannot be read.
    #[error("the picture cannot be read")]
    Io(#[from] io::Error),
    /// The file is no picture, or a broken one.
    #[error("the picture cannot be decoded")]
    Decode(#[from] image::ImageError),
    /// The file is no OpenEXR picture, or a broken one.
    #[error("the OpenEXR picture cannot be decoded")]
    Exr(#[from] exr::error::Error),
    /// A number that is not a light.
    #[error("the pixel at column {column}, row {row} is {value}; light is finite and never negative")]
    Value {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel, 0 on top.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// More memory than was allowed.
    #[error(
        "the picture has {width} x {height} pixels, which take {} MB of memory to read, and {} MB are allowed: make it smaller",
        needed >> 20, allowed >> 20
    )]
    Memory {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes that it takes.
        needed: u64,
        /// Bytes that it may take.
        allowed: u64,
    },
    /// Too few or too many pixels.
    #[error("the picture has {width} x {height} pixels; it needs between {least} and {greatest} along each side")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Least number of either.
        least: usize,
        /// Greatest number of either.
        greatest: usize,
    },
}

/// Bytes of a pixel as light.
const LIGHT_BYTES: u64 = 8;
/// Rows that are turned into light together.
const STRIP: u32 = 64;

/// Luminance weights of linear Rec. 709 primaries.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Picture {
    /// Greatest number of pixels along a side.
    pub const GREATEST_SIDE: usize = 16_384;
    /// Memory that [`open`](Self::open) takes at most, bytes: enough for the greatest picture with 8 bits per colour and alpha.
    pub const MEMORY: u64 = 4 << 30;

    /// Takes linear light on a 0..1 scale, row 0 on top.
    ///
    /// # Errors
    /// Values that are negative or not finite, or a picture too small or too large.
    pub fn from_values(values: Field<f64>) -> Result<Self, PictureError> {
        check_size(values.nx(), values.ny())?;
        match values.as_slice().iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            Some(k) => {
                Err(PictureError::Value { column: k % values.nx(), row: k / values.nx(), value: values.as_slice()[k] })
            }
            None => Ok(Self { values }),
        }
    }

    /// Reads a picture of any format, depth and colour that the decoders know, told by its content.
    ///
    /// Colour becomes luminance (Rec. 709, after linearisation), transparent parts give no light. OpenEXR pictures have no
    /// fixed scale: their brightest pixel becomes 1. `transfer` defaults to linear for OpenEXR and to sRGB for the rest.
    ///
    /// # Errors
    /// A file that cannot be read or decoded, or holds values that are no light.
    pub fn open(path: &Path, transfer: Option<Transfer>) -> Result<Self, PictureError> {
        let _span = tracing::info_span!("read the picture", file = %path.display()).entered();
        Self::read(BufReader::new(File::open(path)?), transfer, Self::MEMORY)
    }

    /// The same from anything that can be read, a file in memory for instance, in at most so many bytes of memory besides
    /// what the decoder of a valid file of its length takes: a picture that claims more is refused before it is decoded.
    ///
    /// # Errors
    /// Those of [`open`](Self::open), and [`PictureError::Memory`].
    pub fn read(mut file: impl BufRead + Seek, transfer: Option<Transfer>, memory: u64) -> Result<Self, PictureError> {
        let is_exr = file.fill_buf()?.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
        if is_exr { Self::read_exr(file, transfer, memory) } else { Self::read_integer(file, transfer, memory) }
    }

    fn read_integer(file: impl BufRead + Seek, transfer: Option<Transfer>, memory: u64) -> Result<Self, PictureError> {
        let mut limits = Limits::default();
        limits.max_alloc = Some(memory);
        let mut reader = ImageReader::new(file).with_guessed_format()?;
        reader.limits(limits.clone());
        let mut decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        let (nx, ny) = (width as usize, height as usize);
        check_size(nx, ny)?;
        check_memory((nx, ny), decoder.total_bytes() + LIGHT_BYTES * nx as u64 * ny as u64, memory)?;
        decoder.set_limits(limits)?;
        let has_float = matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F);
        let transfer = transfer.unwrap_or(if has_float { Transfer::Linear } else { Transfer::Srgb });
        let image = DynamicImage::from_decoder(decoder)?;
        let grey_only = !image.color().has_color();
        let mut values = Vec::with_capacity(nx * ny);
        // In strips, so that the picture is never held a third time.
        for top in (0..height).step_by(STRIP as usize) {
            let strip = image.crop_imm(0, top, width, STRIP.min(height - top));
            if has_float {
                let pixels = strip.into_rgba32f();
                values.extend(pixels.pixels().map(|p| luminance(p.0.map(f64::from), transfer, grey_only)));
            } else {
                let scale = f64::from(u16::MAX);
                let pixels = strip.into_rgba16();
                values
                    .extend(pixels.pixels().map(|p| luminance(p.0.map(|v| f64::from(v) / scale), transfer, grey_only)));
            }
        }
        Self::from_values(Field::from_vec(nx, ny, values))
    }

    fn read_exr(mut file: impl BufRead + Seek, transfer: Option<Transfer>, memory: u64) -> Result<Self, PictureError> {
        use exr::prelude::*;
        let transfer = transfer.unwrap_or(Transfer::Linear);
        let start = file.stream_position()?;
        let meta = exr::meta::MetaData::read_from_buffered(&mut file, false)?;
        for header in &meta.headers {
            let (nx, ny) = (header.layer_size.width(), header.layer_size.height());
            check_size(nx, ny)?;
            // Every colour is widened to eight bytes before they are added up.
            let pixel = header.channels.bytes_per_pixel as u64 + 3 * 8 + LIGHT_BYTES;
            check_memory((nx, ny), pixel.saturating_mul((nx * ny) as u64), memory)?;
        }
        file.seek(io::SeekFrom::Start(start))?;
        let mut image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(file)?;
        let layer = &mut image.layer_data;
        let (nx, ny) = (layer.size.width(), layer.size.height());
        let named = |names: &[&str]| {
            layer
                .channel_data
                .list
                .iter()
                .find(|channel| names.iter().any(|name| channel.name.eq_case_insensitive(name)))
        };
        let samples =
            |channel: &AnyChannel<FlatSamples>| channel.sample_data.values_as_f32().map(f64::from).collect::<Vec<_>>();
        let colours = match (named(&["R", "red"]), named(&["G", "green"]), named(&["B", "blue"])) {
            (Some(r), Some(g), Some(b)) => [samples(r), samples(g), samples(b)],
            _ => {
                let grey = named(&["Y", "L", "luminance", "R", "G", "B"]).or_else(|| layer.channel_data.list.first());
                let grey = grey.map(samples).unwrap_or_default();
                [grey.clone(), grey.clone(), grey]
            }
        };
        let mut values = Vec::with_capacity(nx * ny);
        for k in 0..nx * ny {
            let at = |channel: &Vec<f64>| channel.get(k).copied().unwrap_or(f64::NAN);
            // OpenEXR colours are premultiplied by alpha: a transparent pixel is dark already.
            values.push((0..3).map(|c| LUMINANCE[c] * transfer.to_linear(at(&colours[c]))).sum());
        }
        let picture = Self::from_values(Field::from_vec(nx, ny, values))?;
        let peak = picture.values.min_max().1;
        Ok(if peak > 0.0 { Self { values: picture.values.map(|v| v / peak) } } else { picture })
    }

    /// Linear light on a 0..1 scale, row 0 on top.
    pub fn values(&self) -> &Field<f64> {
        &self.values
    }
}

fn luminance([r, g, b, a]: [f64; 4], transfer: Transfer, grey_only: bool) -> f64 {
    let light = if grey_only {
        transfer.to_linear(r)
    } else {
        [r, g, b].iter().zip(LUMINANCE).map(|(&v, weight)| weight * transfer.to_linear(v)).sum()
    };
    light * a
}

fn check_memory((width, height): (usize, usize), needed: u64, allowed: u64) -> Result<(), PictureError> {
    if needed > allowed { Err(PictureError::Memory { width, height, needed, allowed }) } else { Ok(()) }
}

fn check_size(width: usize, height: usize) -> Result<(), PictureError> {
    let (least, greatest) = (TargetIrradiance::LEAST_CELLS, Picture::GREATEST_SIDE);
    if width.min(height) < least || width.max(height) > greatest {
        return Err(PictureError::Size { width, height, least, greatest });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfers_invert_each_other() {
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            for k in 0..=255 {
                let value = f64::from(k) / 255.0;
                assert!((transfer.from_linear(transfer.to_linear(value)) - value).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn values_that_are_no_light_are_refused_by_name() {
        for bad in [f64::NAN, f64::INFINITY, -0.5] {
            let mut values = Field::filled(8, 8, 0.5);
            values[(3, 2)] = bad;
            let error = Picture::from_values(values).unwrap_err();
            assert!(matches!(error, PictureError::Value { column: 3, row: 2, .. }), "{error}");
        }
    }
}
