//! Pictures, from files of every kind that people have to light. docs/pictures.md says what each
//! means.

mod blocks;
mod canvas;
mod colour;
mod curve;
mod decode;
mod edits;
mod error;
mod exr;
mod grey;
mod kind;
mod lightness;
mod primaries;
mod profile;
mod sampling;
mod sheet;
#[cfg(feature = "svg")]
mod svg;
mod tiff;
mod transfer;
mod understood;

pub use edits::{Background, Crop, EditError, Edits, Flip, Levels, Measure, Rotation};
pub use error::PictureError;
pub use grey::Picture;
pub use transfer::Transfer;
pub use understood::Understood;

use crate::grid::Field;
use canvas::{Canvas, Orientation};
use colour::Lamp;
use kind::Kind;
use std::io::{BufRead, Seek};
#[cfg(feature = "files")]
use std::{fs::File, io::BufReader, path::Path};

/// Bytes of a pixel as light.
const LIGHT_BYTES: u64 = 8;

/// How a picture is read.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PictureOptions {
    /// How numbers become light; else as the file says.
    pub transfer: Option<Transfer>,
    /// The light behind transparent parts; else black, and white for drawings.
    pub background: Option<Background>,
    /// The layer of an OpenEXR file.
    pub layer: Option<String>,
    /// What is done to the picture then.
    pub edits: Edits,
    /// Pixels across of a drawing.
    pub drawing_width: usize,
    /// Memory that reading takes at most, bytes.
    pub memory: u64,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            transfer: None,
            background: None,
            layer: None,
            edits: Edits::default(),
            drawing_width: 512,
            memory: Picture::MEMORY,
        }
    }
}

impl PictureOptions {
    /// The same with this meaning of numbers in the place of what the file says.
    #[must_use]
    pub fn with_transfer(self, transfer: Option<Transfer>) -> Self {
        Self { transfer, ..self }
    }

    /// The same with this light behind transparent parts.
    #[must_use]
    pub fn with_background(self, background: Option<Background>) -> Self {
        Self { background, ..self }
    }

    /// The same with this layer of an OpenEXR file.
    #[must_use]
    pub fn with_layer(self, layer: Option<String>) -> Self {
        Self { layer, ..self }
    }

    /// The same with these edits.
    #[must_use]
    pub fn with_edits(self, edits: Edits) -> Self {
        Self { edits, ..self }
    }

    /// The same with so many pixels across of a drawing.
    #[must_use]
    pub fn with_drawing_width(self, pixels: usize) -> Self {
        Self { drawing_width: pixels, ..self }
    }

    /// The same with so much memory at most, bytes.
    #[must_use]
    pub fn with_memory(self, bytes: u64) -> Self {
        Self { memory: bytes, ..self }
    }

    /// Reads a picture of any kind that is known, told by its content, and how it was understood.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    #[cfg(feature = "files")]
    pub fn open(&self, path: &Path) -> Result<(Picture, Understood), PictureError> {
        let _span = tracing::info_span!("read the picture", file = %path.display()).entered();
        self.read(BufReader::with_capacity(kind::HEAD, File::open(path).map_err(PictureError::Io)?))
    }

    /// The same from anything that can be read, a file in memory for instance. A picture that would
    /// take more memory than allowed is refused before it is decoded.
    ///
    /// # Errors
    /// A file that cannot be read or decoded, or holds values that are no light; edits that do not
    /// fit; [`PictureError::Memory`].
    pub fn read(&self, mut file: impl BufRead + Seek) -> Result<(Picture, Understood), PictureError> {
        let head = file.fill_buf().map_err(PictureError::Io)?;
        let kind = Kind::of(&head[..head.len().min(kind::HEAD)])?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(PictureError::Io)?;
        if let Some(asked) = self.layer.as_ref().filter(|_| kind != Kind::Exr) {
            return Err(PictureError::NotLayered { asked: asked.clone(), kind: kind.name() });
        }
        let (light, mut understood) = match kind {
            Kind::Exr => self.read_exr(&mut bytes)?,
            Kind::Svg => self.read_svg(&bytes)?,
            _ => self.read_sheet(kind, &mut bytes)?,
        };
        drop(bytes);
        understood.see(&light, understood::Stage::Read);
        let light = self.edits.place(light)?;
        understood.see(&light, understood::Stage::Placed);
        let light = self.edits.shade(light);
        understood.see(&light, understood::Stage::Shaded);
        Ok((Picture::from_values(light)?, understood))
    }

    fn read_sheet(&self, kind: Kind, bytes: &mut [u8]) -> Result<(Field<f64>, Understood), PictureError> {
        let length = bytes.len() as u64;
        let sheet = decode::open(kind, bytes, self.memory)?;
        self.check(sheet.size, sheet.needs.saturating_add(length))?;
        let found = sheet.says.understood(sheet.model, self.transfer)?;
        let background = self.background.unwrap_or_default();
        let lamp = Lamp::new(
            (sheet.model, sheet.alpha, sheet.stride),
            sheet.greatest,
            found.lightness,
            background.light(Transfer::Srgb),
        );
        let mut canvas = Canvas::new(sheet.size, sheet.orientation, Picture::GREATEST_SIDE);
        (sheet.rows)(&mut |top, numbers| canvas.add(top, numbers, &lamp))?;
        if !canvas.is_full() {
            return Err(PictureError::broken(kind.name(), &"it has fewer rows than it says"));
        }
        let (light, factor, spread) = canvas.finish();
        let understood = Understood {
            kind: kind.name(),
            stored: sheet.size,
            orientation: sheet.orientation.number(),
            colour: found.words,
            is_plain: found.plain,
            layer: None,
            background: (spread.alpha.0 < 1.0).then_some(background),
            spread,
            factor,
            edits: self.edits,
            passed_over: found.passed_over.into_iter().collect(),
            ..Understood::default()
        };
        Ok((light, understood))
    }

    fn read_exr(&self, bytes: &mut [u8]) -> Result<(Field<f64>, Understood), PictureError> {
        let background = self.background.unwrap_or_default();
        let length = bytes.len() as u64;
        let request = exr::Request {
            transfer: self.transfer,
            layer: self.layer.as_deref(),
            background: background.light(Transfer::Srgb),
            greatest_side: Picture::GREATEST_SIDE,
            check: &|size, needs| self.check(size, needs.saturating_add(length)),
        };
        let found = exr::read(bytes, &request)?;
        let (light, factor, spread) = found.canvas.finish();
        let colour = match self.transfer {
            Some(Transfer::Srgb) => "sRGB, as asked for",
            _ => "linear light, its brightest pixel white",
        };
        let understood = Understood {
            kind: Kind::Exr.name(),
            stored: found.size,
            orientation: Orientation::UPRIGHT.number(),
            colour: colour.into(),
            layer: found.layer,
            background: (spread.alpha.0 < 1.0).then_some(background),
            spread,
            factor,
            edits: self.edits,
            ..Understood::default()
        };
        Ok((light, understood))
    }

    #[cfg(feature = "svg")]
    fn read_svg(&self, bytes: &[u8]) -> Result<(Field<f64>, Understood), PictureError> {
        let background = self.background.unwrap_or(Background::WHITE);
        let length = bytes.len() as u64;
        let size = (self.drawing_width.max(Picture::LEAST_SIDE), Picture::GREATEST_SIDE);
        let transfer = self.transfer.unwrap_or(Transfer::Srgb);
        let check = |size, needs: u64| self.check(size, needs.saturating_add(length));
        let raster = svg::read(bytes, size, (background, transfer), self.memory, &check)?;
        let understood = Understood {
            kind: Kind::Svg.name(),
            stored: (raster.light.nx(), raster.light.ny()),
            orientation: Orientation::UPRIGHT.number(),
            colour: format!("drawn in sRGB on {background}"),
            factor: 1,
            edits: self.edits,
            passed_over: raster.passed_over,
            ..Understood::default()
        };
        Ok((raster.light, understood))
    }

    #[cfg(not(feature = "svg"))]
    fn read_svg(&self, _: &[u8]) -> Result<(Field<f64>, Understood), PictureError> {
        Err(PictureError::Foreign {
            kind: Kind::Svg.name(),
            command: "rsvg-convert -w 1024 picture.svg -o picture.png",
        })
    }

    /// Whether a picture of this size may be read, which takes so many bytes besides its light.
    fn check(&self, (width, height): (usize, usize), needs: u64) -> Result<(), PictureError> {
        let (least, greatest) = (Picture::LEAST_SIDE, Picture::GREATEST_SIDE);
        let factor = Canvas::factor((width, height), greatest);
        let (nx, ny) = (width.div_ceil(factor), height.div_ceil(factor));
        if nx.min(ny) < least {
            return Err(PictureError::Size { width, height, least, greatest });
        }
        let needed = needs.saturating_add(LIGHT_BYTES * nx as u64 * ny as u64);
        let allowed = self.memory;
        if needed > allowed { Err(PictureError::Memory { width, height, needed, allowed }) } else { Ok(()) }
    }
}

#[cfg(feature = "files")]
impl Picture {
    /// Reads a picture as its file says, unless `transfer` says otherwise, without edits.
    ///
    /// # Errors
    /// Those of [`PictureOptions::open`].
    pub fn open(path: &Path, transfer: Option<Transfer>) -> Result<Self, PictureError> {
        PictureOptions::default().with_transfer(transfer).open(path).map(|(picture, _)| picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfers_invert_each_other() {
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            for k in 0..=255 {
                let value = f64::from(k) / 255.0;
                assert!((transfer.from_linear(transfer.to_linear(value)) - value).abs() < 1e-12);
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
