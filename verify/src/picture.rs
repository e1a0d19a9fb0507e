//! Writing irradiance to files, whole or not at all.

use crate::film::Image;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, ReadChannels, ReadLayers,
    Text, WritableImage,
};
use image::{ImageBuffer, ImageFormat, Luma};
use std::{
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

/// Why a picture was not written. No partial file is left behind.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file system refused.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Where to.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The encoder refused.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// Where to.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// No packing of OpenEXR makes more of a byte than deflate does.
const MOST_PACKING: usize = 1032;

/// The first layer of an OpenEXR file, with all channels and attributes.
pub(crate) fn read_exr_layer(bytes: &[u8]) -> exr::error::Result<Layer<AnyChannels<FlatSamples>>> {
    let claimed = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(bytes), false)?;
    for header in &claimed.headers {
        let (nx, ny) = (header.layer_size.width(), header.layer_size.height());
        let needed = nx.saturating_mul(ny).saturating_mul(header.channels.bytes_per_pixel);
        if needed > MOST_PACKING.saturating_mul(bytes.len()) {
            return Err(exr::error::Error::Invalid("more pixels than the file can hold".into()));
        }
    }
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
/// See [`PictureError`].
pub fn write_exr(path: &Path, image: &Image) -> Result<(), PictureError> {
    write_exr_layers(path, &[("irradiance".to_owned(), image)])
}

/// Writes named images as the layers of one OpenEXR file, each with a channel `Y` of 32-bit floats, linear.
///
/// # Errors
/// See [`PictureError`]; a name that is too long or not of the Latin alphabet cannot be encoded.
pub fn write_exr_layers(path: &Path, images: &[(String, &Image)]) -> Result<(), PictureError> {
    let failed = |reason: String| PictureError::Encode { path: path.into(), reason };
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
        .collect::<Result<_, PictureError>>()?;
    let window = images.iter().fold((0, 0), |(nx, ny), (_, image)| (nx.max(image.nx), ny.max(image.ny)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    exr::prelude::Image::from_layers(ImageAttributes::with_size(window), layers)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| failed(error.to_string()))?;
    write_whole(path, bytes.get_ref())
}

/// Writes an image as a 16-bit grey PNG, linear: `white` becomes 65535, and what is brighter is cut off.
///
/// # Errors
/// See [`PictureError`].
pub fn write_png(path: &Path, image: &Image, white: f64) -> Result<(), PictureError> {
    let failed = |reason: String| PictureError::Encode { path: path.into(), reason };
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

/// Writes to a temporary file beside the target, which takes its name once it is complete.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), PictureError> {
    let failed = |source| PictureError::Write { path: path.into(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::Builder::new().prefix(".glasswarp-").tempfile_in(folder).map_err(failed)?;
    let mut writer = BufWriter::new(file.as_file_mut());
    writer.write_all(bytes).and_then(|()| writer.flush()).map_err(failed)?;
    drop(writer);
    open_to_others(file.as_file()).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Temporary files are private; a result is not.
#[cfg(unix)]
fn open_to_others(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn open_to_others(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
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
        assert!(matches!(write_png(Path::new("/nowhere/at/all.png"), &letter(), 1.0), Err(PictureError::Write { .. })));
        assert!(matches!(write_png(Path::new("x.png"), &letter(), 0.0), Err(PictureError::Encode { .. })));
    }
}
