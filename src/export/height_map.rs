//! The exit face as a picture of heights, as routers with relief programs want it: 16-bit PNG, or
//! OpenEXR of 32-bit floats.
//!
//! A pixel is a node: the middles of the outermost pixels stand on the border of the face. The
//! picture lies as such a program shows the block from above: its left is `-x`, its top is `+y`
//! (the picture on the wall is seen from the other side, and left is `+x` there). Both files carry
//! their numbers as text: see [`HeightMap::entries`].
//!
//! Of a block that is not rectangular the heights go on beyond the outline as those of the
//! [sheet](crate::surface::HeightField::sheet) that it is cut from: without a cliff that a program
//! would smooth into the picture, or that a tool would plunge down. Where the block is, the numbers
//! say, and a [mask](HeightMap::mask).

#[cfg(feature = "files")]
use super::{WriteError, write_atomically};
use crate::{
    fabricate::{Cutter, tool_offset},
    grid::{Contour, Field},
    solid::Solid,
};
use exr::{
    meta::{MetaData, attribute, header::Header, magic_number, sequence_end},
    prelude::{
        AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, Text,
        WritableImage,
    },
};
use glam::DVec2;
use image::{GrayImage, Luma};
#[cfg(feature = "files")]
use std::io::Write;
use std::{
    io::{self, Cursor},
    path::Path,
};

/// What the heights of a map are.
#[derive(Clone, Debug, PartialEq)]
enum Meaning {
    /// The face itself.
    Surface,
    /// Where the tip of a cutter goes, already offset for it; the cutter as [`Cutter`] writes it,
    /// such as `ball, 6 mm diameter`.
    ToolTip(String),
}

/// Heights above a block's entry plane, ready to be written.
#[derive(Clone, Debug)]
pub struct HeightMap {
    heights_mm: Field<f64>,
    pitch_mm: DVec2,
    entry_z_mm: f64,
    base_z_mm: f64,
    top_z_mm: f64,
    meaning: Meaning,
    contour: Contour,
}

/// A file format for height maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightMapFormat {
    /// Grey, 16 bits: black is the lowest place, white the highest.
    Png,
    /// 32-bit floats: mm above the mean plane of the exit face.
    Exr,
}

/// Why a height map was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HeightMapError {
    /// The extension names no format.
    #[error(
        "{path:?} has {}; a height map is written as .png (16-bit) or .exr (32-bit)",
        super::format::found(extension)
    )]
    Extension {
        /// The file that was asked for.
        path: String,
        /// Its extension.
        extension: Option<String>,
    },
    /// The file could not be written.
    #[cfg(feature = "files")]
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl HeightMapFormat {
    /// The format that a file's extension names, in capitals or not.
    ///
    /// # Errors
    /// No extension, or an unknown one.
    pub fn from_path(path: &Path) -> Result<Self, HeightMapError> {
        let extension = path.extension().map(|e| e.to_string_lossy().into_owned());
        match extension.as_deref().map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(HeightMapError::Extension { path: path.display().to_string(), extension }),
        }
    }
}

impl HeightMap {
    /// The map of a block's exit face.
    pub fn of(solid: &Solid) -> Self {
        Self::new(solid, solid.surface().sheet().heights_mm().clone(), Meaning::Surface)
    }

    /// The map of where the tip of a cutter goes over a block's exit face: see [`tool_offset`].
    pub fn of_tips(solid: &Solid, cutter: Cutter) -> Self {
        Self::new(solid, tool_offset(&solid.surface().sheet(), cutter), Meaning::ToolTip(cutter.in_words()))
    }

    /// The map of heights at equidistant nodes over a block, mm above the mean plane of its exit
    /// face.
    fn new(solid: &Solid, heights_mm: Field<f64>, meaning: Meaning) -> Self {
        Self {
            pitch_mm: solid.surface().extent().node_spacing(heights_mm.nx(), heights_mm.ny()),
            entry_z_mm: solid.entry_z_mm(),
            base_z_mm: solid.base_z_mm(),
            top_z_mm: solid.base_z_mm() + solid.thickness_mm(),
            heights_mm,
            meaning,
            contour: solid.surface().contour(),
        }
    }

    /// Lowest and highest place, mm above the mean plane of the exit face: black and white of the
    /// PNG.
    pub fn range_mm(&self) -> (f64, f64) {
        let (low, high) = self.heights_mm.min_max();
        // A plane is all black; white must be somewhere else.
        (low, if high > low { high } else { low + 1.0 })
    }

    /// From the middle of a pixel to that of the next, mm.
    pub fn pitch_mm(&self) -> DVec2 {
        self.pitch_mm
    }

    /// The size to type into a program that takes pixels for areas: pixels times pitch, mm.
    pub fn picture_size_mm(&self) -> DVec2 {
        self.pitch_mm * DVec2::new(self.heights_mm.nx() as f64, self.heights_mm.ny() as f64)
    }

    /// What the map says of itself, in both formats, as names and values: millimetres, decimal.
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        let (low, high) = self.range_mm();
        let size = self.picture_size_mm();
        let meaning = match &self.meaning {
            Meaning::Surface => "the face itself".to_owned(),
            Meaning::ToolTip(cutter) => format!("tip of the cutter ({cutter}), already offset for it"),
        };
        let number = |value: f64| format!("{value:?}");
        let mut entries = vec![
            ("Title", "height map of a glasswarp block, millimetres".to_owned()),
            ("Orientation", "seen from above the exit face: left is -x, top is +y; white is high".to_owned()),
            ("Heights", meaning),
            ("MmPerPixelX", number(self.pitch_mm.x)),
            ("MmPerPixelY", number(self.pitch_mm.y)),
            ("WidthMm", number(size.x)),
            ("HeightMm", number(size.y)),
            ("BlackZMm", number(low)),
            ("WhiteZMm", number(high)),
            ("DepthMm", number(high - low)),
            ("WhiteBelowStockTopMm", number(self.top_z_mm - high)),
            ("StockThicknessMm", number(self.top_z_mm - self.base_z_mm)),
            ("EntryZMm", number(self.entry_z_mm)),
        ];
        if !self.contour.is_rectangle() {
            let radius = self.contour.radius_mm();
            entries.extend([
                (
                    "Outline",
                    "a rectangle from the first to the last pixel with elliptic corners of these semi-axes; beyond it heights only go on"
                        .to_owned(),
                ),
                ("CornerRadiusXMm", number(radius.x)),
                ("CornerRadiusYMm", number(radius.y)),
            ]);
        }
        entries
    }

    /// What the heights are of, in words.
    pub fn subject(&self) -> &'static str {
        match self.meaning {
            Meaning::Surface => "the face",
            Meaning::ToolTip(_) => "the way of the tip",
        }
    }

    /// A grey picture of the same pixels, if the block is not all of them: white where it is, black
    /// beyond its outline, on which there are shades between.
    pub fn mask(&self) -> Option<GrayImage> {
        const POINTS: usize = 4;
        let (nx, ny) = (self.heights_mm.nx(), self.heights_mm.ny());
        let extent = self.contour.extent();
        let covered = |i: usize, j: usize| {
            let at = extent.node(i, ny - 1 - j, nx, ny);
            let points = (0..POINTS * POINTS).map(|k| DVec2::new((k % POINTS) as f64, (k / POINTS) as f64));
            let places = points.map(|p| at + ((p + 0.5) / POINTS as f64 - 0.5) * self.pitch_mm);
            places.filter(|at| self.contour.contains(*at)).count() as f64 / (POINTS * POINTS) as f64
        };
        let grey = |i: u32, j: u32| Luma([(255.0 * covered(i as usize, j as usize)).round() as u8]);
        (!self.contour.is_rectangle()).then(|| GrayImage::from_fn(nx as u32, ny as u32, grey))
    }

    /// Writes the map in the format that the extension names. The file appears whole or not at all.
    ///
    /// # Errors
    /// An unknown extension, or a file that cannot be written.
    #[cfg(feature = "files")]
    pub fn write(&self, path: &Path) -> Result<(), HeightMapError> {
        let bytes = self.to_bytes(HeightMapFormat::from_path(path)?);
        write_atomically(path, |out| out.write_all(&bytes?))?;
        Ok(())
    }

    /// The map as the content of a file.
    ///
    /// # Errors
    /// Those of the encoder.
    pub fn to_bytes(&self, format: HeightMapFormat) -> io::Result<Vec<u8>> {
        match format {
            HeightMapFormat::Png => self.png(),
            HeightMapFormat::Exr => self.exr(),
        }
    }

    /// Heights in the order of pictures: rows from `+y` down.
    fn pixels(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.heights_mm.ny()).rev().flat_map(|j| self.heights_mm.row(j).iter().copied())
    }

    fn png(&self) -> io::Result<Vec<u8>> {
        let (low, high) = self.range_mm();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.heights_mm.nx() as u32, self.heights_mm.ny() as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let per_metre = |pitch: f64| (1000.0 / pitch).round() as u32;
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: per_metre(self.pitch_mm.x),
            yppu: per_metre(self.pitch_mm.y),
            unit: png::Unit::Meter,
        }));
        for (name, value) in self.entries() {
            encoder.add_text_chunk(name.to_owned(), value).map_err(io::Error::other)?;
        }
        let levels: Vec<u8> =
            self.pixels().flat_map(|z| (((z - low) / (high - low) * 65535.0).round() as u16).to_be_bytes()).collect();
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&levels).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(bytes)
    }

    fn exr(&self) -> io::Result<Vec<u8>> {
        let size = (self.heights_mm.nx(), self.heights_mm.ny());
        let samples = self.pixels().map(|z| z as f32).collect();
        let channel = AnyChannel::new("Y", FlatSamples::F32(samples));
        let mut attributes = LayerAttributes::named("height in mm");
        for (name, value) in self.entries() {
            let text = |text: &str| Text::new_or_none(text).ok_or_else(|| io::Error::other("a text that is not Latin"));
            attributes.other.insert(text(name)?, AttributeValue::Text(text(&value)?));
        }
        let channels = AnyChannels::sort(std::iter::once(channel).collect());
        let layer = Layer::new(size, attributes, Encoding::FAST_LOSSLESS, channels);
        let mut bytes = Cursor::new(Vec::new());
        exr::prelude::Image::from_layers(ImageAttributes::with_size(size), vec![layer])
            .write()
            .to_buffered(&mut bytes)
            .map_err(io::Error::other)?;
        let mut bytes = bytes.into_inner();
        sort_attributes(&mut bytes).map_err(io::Error::other)?;
        Ok(bytes)
    }
}

/// Writes the header of an OpenEXR file of one layer anew, with its attributes in the order of
/// their names. The encoder keeps them in a hash map and asks for no order, and equal maps shall be
/// equal files. The new header is as long as the old one, and what follows does not depend on the
/// order within.
fn sort_attributes(file: &mut [u8]) -> exr::error::UnitResult {
    let meta = MetaData::read_from_buffered(Cursor::new(&*file), true)?;
    let mut attributes: Vec<_> = meta.headers.iter().flat_map(Header::all_named_attributes).collect();
    attributes.sort_by_key(|&(name, _)| name);
    let mut header = Vec::new();
    magic_number::write(&mut header)?;
    meta.requirements.write(&mut header)?;
    for (name, value) in attributes {
        attribute::write(name, &value, &mut header)?;
    }
    sequence_end::write(&mut header)?;
    file[..header.len()].copy_from_slice(&header);
    Ok(())
}
