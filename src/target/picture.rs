use crate::{grid::Field, target::TargetIrradiance};
use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};
use std::{
    fs::File,
    io::{self, BufReader},
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

/// Luminance weights of linear Rec. 709 primaries.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Picture {
    /// Greatest number of pixels along a side.
    pub const GREATEST_SIDE: usize = 16_384;
    /// Memory that decoding may take, bytes.
    const DECODER_MEMORY: u64 = 2 << 30;

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
        let mut magic = [0; 4];
        let is_exr =
            io::Read::read_exact(&mut File::open(path)?, &mut magic).is_ok() && magic == [0x76, 0x2f, 0x31, 0x01];
        if is_exr { Self::open_exr(path, transfer) } else { Self::open_integer(path, transfer) }
    }

    fn open_integer(path: &Path, transfer: Option<Transfer>) -> Result<Self, PictureError> {
        let reader = ImageReader::new(BufReader::new(File::open(path)?)).with_guessed_format()?;
        let mut decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        check_size(width as usize, height as usize)?;
        let mut limits = Limits::default();
        limits.max_alloc = Some(Self::DECODER_MEMORY);
        decoder.set_limits(limits)?;
        let has_float = matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F);
        let transfer = transfer.unwrap_or(if has_float { Transfer::Linear } else { Transfer::Srgb });
        let image = DynamicImage::from_decoder(decoder)?;
        let (nx, ny) = (width as usize, height as usize);
        let grey_only = !image.color().has_color();
        let values: Vec<f64> = if has_float {
            image.into_rgba32f().pixels().map(|p| luminance(p.0.map(f64::from), transfer, grey_only)).collect()
        } else {
            let scale = f64::from(u16::MAX);
            image
                .into_rgba16()
                .pixels()
                .map(|p| luminance(p.0.map(|v| f64::from(v) / scale), transfer, grey_only))
                .collect()
        };
        Self::from_values(Field::from_vec(nx, ny, values))
    }

    fn open_exr(path: &Path, transfer: Option<Transfer>) -> Result<Self, PictureError> {
        use exr::prelude::*;
        let transfer = transfer.unwrap_or(Transfer::Linear);
        let meta = exr::meta::MetaData::read_from_file(path, false)?;
        for header in &meta.headers {
            check_size(header.layer_size.width(), header.layer_size.height())?;
        }
        let mut image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_file(path)?;
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
