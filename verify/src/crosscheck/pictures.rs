//! The pictures that a finished job has left, read as what they mean.

use super::{
    error::CrosscheckError,
    job::{Code, Job, Run},
    renderer::Renderer,
};
use crate::image::Image;
use glam::DVec2;
use std::path::Path;

/// Columns and rows, and red, green and blue of every pixel.
type Pixels = ((usize, usize), Vec<[f32; 3]>);

impl Job {
    fn read(&self, output: &str) -> Result<Vec<[f32; 3]>, CrosscheckError> {
        let path = self.folder.join(output);
        let wrong = |reason: String| CrosscheckError::Picture { path: path.clone(), reason };
        let (size, pixels) = match self.renderer {
            Renderer::PovRay => read_png(&path),
            Renderer::Blender | Renderer::Mitsuba | Renderer::LuxCore => read_exr(&path),
        }
        .map_err(wrong)?;
        if size != self.pixels {
            return Err(wrong(format!("it has {size:?} pixels instead of {:?}", self.pixels)));
        }
        Ok(pixels)
    }

    /// Landing points that were rendered, in the order of the pixels.
    pub(super) fn read_landings(&self, nx: usize, ny: usize) -> Result<Vec<Option<DVec2>>, CrosscheckError> {
        let Code::Landings([from, to]) = self.code else { return Err(self.not_such("map")) };
        debug_assert_eq!(self.pixels, (nx, ny));
        let decode = |&[r, g, b]: &[f32; 3]| {
            // Blue is 1 wherever the receiver was hit: it takes out whatever the glass may have
            // absorbed.
            (b > 0.5).then(|| from + (to - from) * DVec2::new(f64::from(r / b), f64::from(g / b)))
        };
        Ok(self.read(&self.runs[0].output)?.iter().map(decode).collect())
    }

    /// Irradiance that was rendered, one image for every run.
    pub(super) fn read_images(&self, nx: usize, ny: usize) -> Result<Vec<Image>, CrosscheckError> {
        let Code::Irradiance { clipped, .. } = self.code else { return Err(self.not_such("image")) };
        let image = |run: &Run| {
            let values: Vec<f64> = self.read(&run.output)?.iter().map(|p| f64::from(p[1])).collect();
            let over = values.iter().filter(|&&v| v >= clipped).count();
            if over > 0 {
                let path = self.folder.join(&run.output);
                return Err(CrosscheckError::Picture { path, reason: format!("{over} pixels are clipped") });
            }
            Ok(Image::new(nx, ny, values))
        };
        self.runs.iter().map(image).collect()
    }

    fn not_such(&self, mode: &str) -> CrosscheckError {
        CrosscheckError::Picture { path: self.folder.clone(), reason: format!("this is no scene of {mode} mode") }
    }
}

/// Pixels of a 16-bit PNG, 0..1.
fn read_png(path: &Path) -> Result<Pixels, String> {
    let picture = image::open(path).map_err(|error| error.to_string())?.into_rgb16();
    let size = (picture.width() as usize, picture.height() as usize);
    Ok((size, picture.pixels().map(|p| p.0.map(|v| f32::from(v) / f32::from(u16::MAX))).collect()))
}

/// Pixels of a 32-bit OpenEXR.
fn read_exr(path: &Path) -> Result<Pixels, String> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let picture = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: exr::prelude::Vec2<usize>, _| (size, vec![[0f32; 3]; size.area()]),
            |(size, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.y() * size.x() + at.x()] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| error.to_string())?;
    let (size, pixels) = picture.layer_data.channel_data.pixels;
    Ok(((size.x(), size.y()), pixels))
}
