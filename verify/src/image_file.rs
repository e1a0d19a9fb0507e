//! Writing irradiance to files, whole or not at all.

use crate::{exr_blocks, image::Image};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, ReadChannels, ReadLayers,
    Text, WritableImage,
};
use glasswarp_files::{WriteError, write_atomically};
use image::{ImageBuffer, ImageFormat, Luma, Rgb};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// Why a picture was not written. No partial file is left behind.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageFileError {
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The encoder refused.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// Where to.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// The first layer of an OpenEXR file, with all channels and attributes.
pub(crate) fn read_exr_layer(bytes: &[u8]) -> exr::error::Result<Layer<AnyChannels<FlatSamples>>> {
    let claimed = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(bytes), false)?;
    for header in &claimed.headers {
        let (nx, ny) = (header.layer_size.width(), header.layer_size.height());
        let needed = nx.saturating_mul(ny).saturating_mul(header.channels.bytes_per_pixel);
        if needed > exr_blocks::MOST_PACKING.saturating_mul(bytes.len()) {
            return Err(exr::error::Error::Invalid("more pixels than the file can hold".into()));
        }
    }
    exr_blocks::check(bytes)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))?;
    Ok(image.layer_data)
}

/// Writes an image as OpenEXR: one channel `Y` of 32-bit floats, linear.
///
/// # Errors
/// See [`ImageFileError`].
pub fn write_exr(path: &Path, image: &Image) -> Result<(), ImageFileError> {
    write_exr_layers(path, &[("irradiance".to_owned(), image)])
}

/// Writes named images as the layers of one OpenEXR file, each with a channel `Y` of 32-bit floats,
/// linear.
///
/// # Errors
/// See [`ImageFileError`]; a name that is too long or not of the Latin alphabet cannot be encoded.
pub fn write_exr_layers(path: &Path, images: &[(String, &Image)]) -> Result<(), ImageFileError> {
    write_whole(path, &exr_layers(path, images)?)
}

/// The bytes of the OpenEXR file of this name that [`write_exr`] would write.
///
/// # Errors
/// See [`ImageFileError`].
pub fn exr_bytes(path: &Path, image: &Image) -> Result<Vec<u8>, ImageFileError> {
    exr_layers(path, &[("irradiance".to_owned(), image)])
}

fn exr_layers(path: &Path, images: &[(String, &Image)]) -> Result<Vec<u8>, ImageFileError> {
    let failed = |reason: String| ImageFileError::Encode { path: path.into(), reason };
    let layers: Vec<_> = images
        .iter()
        .map(|(name, image)| {
            let name = Text::new_or_none(name).ok_or_else(|| failed(format!("'{name}' cannot name a layer")))?;
            let samples = image.values.iter().map(|&v| v as f32).collect();
            let channel = AnyChannel::new("Y", FlatSamples::F32(samples));
            Ok(Layer::new(
                (image.nx, image.ny),
                LayerAttributes::named(name),
                Encoding::FAST_LOSSLESS,
                AnyChannels::sort(std::iter::once(channel).collect()),
            ))
        })
        .collect::<Result<_, ImageFileError>>()?;
    let window = images.iter().fold((0, 0), |(nx, ny), (_, image)| (nx.max(image.nx), ny.max(image.ny)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::prelude::Image::from_layers(ImageAttributes::with_size(window), layers)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| failed(error.to_string()))?;
    Ok(bytes.into_inner())
}

/// Writes an image as a 16-bit grey PNG, linear: `white` becomes 65535, and what is brighter is cut
/// off.
///
/// # Errors
/// See [`ImageFileError`].
pub fn write_png(path: &Path, image: &Image, white: f64) -> Result<(), ImageFileError> {
    let failed = |reason: String| ImageFileError::Encode { path: path.into(), reason };
    if !(white.is_finite() && white > 0.0) {
        return Err(failed(format!("white is {white}; it must be positive and finite")));
    }
    let (nx, ny) = (u32::try_from(image.nx), u32::try_from(image.ny));
    let (Ok(nx), Ok(ny)) = (nx, ny) else { return Err(failed("too many pixels".into())) };
    let grey = |v: f64| (v / white * 65535.0).round().clamp(0.0, 65535.0) as u16;
    let pixels = image.values.iter().map(|&v| grey(v)).collect();
    let Some(buffer) = ImageBuffer::<Luma<u16>, Vec<u16>>::from_raw(nx, ny, pixels) else {
        return Err(failed("the size and the number of values do not fit".into()));
    };
    let mut bytes = std::io::Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, ImageFormat::Png).map_err(|error| failed(error.to_string()))?;
    write_whole(path, bytes.get_ref())
}

/// Writes red, green and blue as OpenEXR: 32-bit floats, linear.
///
/// # Errors
/// See [`ImageFileError`]; images of different sizes.
pub fn write_rgb_exr(path: &Path, [red, green, blue]: &[Image; 3]) -> Result<(), ImageFileError> {
    let failed = |reason: String| ImageFileError::Encode { path: path.into(), reason };
    let size = one_size([red, green, blue]).ok_or_else(|| failed("the colours are of different sizes".into()))?;
    let pixel = |at: exr::prelude::Vec2<usize>| {
        let value = |image: &Image| image.values[at.y() * image.nx + at.x()] as f32;
        (value(red), value(green), value(blue))
    };
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::prelude::Image::from_channels(size, exr::prelude::SpecificChannels::rgb(pixel))
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| failed(error.to_string()))?;
    write_whole(path, bytes.get_ref())
}

/// Writes red, green and blue as a 16-bit PNG with the curve of sRGB, for screens: `white` becomes
/// 65535; what is brighter, or negative, is cut off.
///
/// # Errors
/// See [`ImageFileError`]; images of different sizes.
pub fn write_rgb_png(path: &Path, rgb: &[Image; 3], white: f64) -> Result<(), ImageFileError> {
    let failed = |reason: String| ImageFileError::Encode { path: path.into(), reason };
    if !(white.is_finite() && white > 0.0) {
        return Err(failed(format!("white is {white}; it must be positive and finite")));
    }
    let [red, green, blue] = rgb;
    let (nx, ny) = one_size([red, green, blue]).ok_or_else(|| failed("the colours are of different sizes".into()))?;
    let (Ok(columns), Ok(rows)) = (u32::try_from(nx), u32::try_from(ny)) else {
        return Err(failed("too many pixels".into()));
    };
    let encoded = |v: f64| {
        let v = (v / white).clamp(0.0, 1.0);
        let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (v * 65535.0).round() as u16
    };
    let pixels = (0..nx * ny).flat_map(|k| rgb.each_ref().map(|image| encoded(image.values[k]))).collect();
    let Some(buffer) = ImageBuffer::<Rgb<u16>, Vec<u16>>::from_raw(columns, rows, pixels) else {
        return Err(failed("the size and the number of values do not fit".into()));
    };
    let mut bytes = std::io::Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, ImageFormat::Png).map_err(|error| failed(error.to_string()))?;
    write_whole(path, bytes.get_ref())
}

/// The size that these images share.
fn one_size(images: [&Image; 3]) -> Option<(usize, usize)> {
    let size = (images[0].nx, images[0].ny);
    images.iter().all(|image| (image.nx, image.ny) == size).then_some(size)
}

/// Writes bytes as a file that appears whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ImageFileError> {
    Ok(write_atomically(path, |out| out.write_all(bytes))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn letter() -> Image {
        Image::new(5, 4, (0..20).map(|k| f64::from(k) * 0.1).collect())
    }

    #[test]
    fn an_exr_comes_back_as_it_was_in_single_precision() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.exr");
        write_exr(&path, &letter()).unwrap();
        let back = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        assert_eq!(back.layer_data.size, exr::prelude::Vec2(5, 4));
        let values: Vec<f32> = back.layer_data.channel_data.list[0].sample_data.values_as_f32().collect();
        assert!(values.iter().zip(&letter().values).all(|(&a, &b)| a == b as f32));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
    }

    #[test]
    fn a_png_has_sixteen_bits_and_the_same_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.png");
        write_png(&path, &letter(), 1.0).unwrap();
        let back = image::open(&path).unwrap().into_luma16();
        assert_eq!((back.dimensions(), back[(0, 0)].0[0], back[(4, 0)].0[0]), ((5, 4), [0; 1][0], 26214));
        assert_eq!(back[(4, 3)].0[0], 65535, "brighter than white is cut off");
    }

    #[test]
    fn what_cannot_be_written_is_an_error() {
        assert!(matches!(write_png(Path::new("/nowhere/at/all.png"), &letter(), 1.0), Err(ImageFileError::Write(_))));
        assert!(matches!(write_png(Path::new("x.png"), &letter(), 0.0), Err(ImageFileError::Encode { .. })));
    }
}
