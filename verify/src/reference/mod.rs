//! The picture that a block is judged by, read by the verifier itself.
//!
//! ```text
//! file -> decoded numbers -> luminance -> upright -> reduced, cropped, turned, graded -> framed -> Image, mean 1
//! ```
//!
//! `docs/pictures.md` says what a file means as light. This module is written from that page and
//! from the specifications of the formats, and shares nothing with the designer's reader: PNG goes
//! through lodepng, JPEG through jpeg-decoder, WebP, GIF and OpenEXR through their crates without
//! the front that the designer has before them; TIFF, BMP and PNM are taken apart here, and so are
//! EXIF, PNG's chunks, and ICC profiles. A mistake of one reader is found by the other.
//!
//! # Guarantees
//!
//! - What a file is, is told by its content, never by its name.
//! - A [`Reference`] is upright, linear luminance, row 0 on top, every value finite and not
//!   negative, its mean 1.
//! - What is not understood is refused by name ([`ReferenceError`]); no file makes the reader
//!   panic, and none takes more memory than its length or its claimed pixels, whichever are fewer,
//!   pay for.
//! - The same bytes and [`ReadOptions`] give the same light to the last bit, for any number of threads.

mod colour;
mod decode;
mod edit;
mod error;
mod frame;
mod icc;
mod plane;
mod raster;
mod tiff_tags;
mod tone;

pub use edit::{Crop, Flip, Levels, Measure, Turn};
pub use error::ReferenceError;
pub use frame::Frame;
pub use plane::resampled;

use crate::image::Image;
use colour::{Meaning, REC_709};
use decode::{Decoded, Format};
use plane::Plane;
use raster::{Alpha, Samples};
use rayon::prelude::*;
use std::{fs, path::Path};
use tone::{Tone, light_to_srgb, srgb_to_light};

/// Most pixels along a side; larger pictures are reduced.
const MOST_SIDE: usize = 16384;
/// Relative spread of light below which a picture is flat.
const FLAT: f64 = 1e-6;

/// How numbers become light, whatever the file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// The curve of sRGB.
    Srgb,
    /// Numbers are light.
    Linear,
}

/// What is done to a picture on its way to light.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReadOptions {
    /// In place of what the file says of its numbers.
    pub transfer: Option<Transfer>,
    /// Which layer of an OpenEXR file, if there are several with colour.
    pub layer: Option<String>,
    /// Behind transparent parts, as an sRGB colour [default: black; for SVG white].
    pub background: Option<[u8; 3]>,
    /// Pixels across at which an SVG is drawn.
    pub svg_width: usize,
    /// What part of the picture.
    pub crop: Option<Crop>,
    /// Then turned.
    pub turn: Option<Turn>,
    /// Then mirrored.
    pub flip: Option<Flip>,
    /// Then graded.
    pub levels: Option<Levels>,
    /// Then black for white.
    pub invert: bool,
    /// Then framed.
    pub frame: Frame,
    /// At last this much light is added everywhere, white being 1.
    pub offset: f64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            transfer: None,
            layer: None,
            background: None,
            svg_width: 512,
            crop: None,
            turn: None,
            flip: None,
            levels: None,
            invert: false,
            frame: Frame::default(),
            offset: 0.0,
        }
    }
}

/// The light that a picture asks for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reference {
    /// Irradiance by pixels of the framed picture, mean 1.
    pub light: Image,
    /// How far two right readers of this file may be apart, as relative RMS: a rounding for exact
    /// formats, about one level of 255 for lossy ones, whose standards leave that to the decoder.
    pub tolerance: f64,
    /// By how much it was reduced, 1 if not.
    pub reduced: usize,
}

/// What rounding makes of the same numbers read twice, as relative RMS.
const EXACT: f64 = 1e-3;

impl Reference {
    /// Reads a picture.
    ///
    /// # Errors
    /// See [`ReferenceError`].
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Self, ReferenceError> {
        let bytes = fs::read(path).map_err(|source| ReferenceError::Read { path: path.into(), source })?;
        Self::parse(&bytes, options)
    }

    /// Reads a picture in memory.
    ///
    /// # Errors
    /// See [`ReferenceError`].
    pub fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Self, ReferenceError> {
        let refused = |what, value, must, flag| Err(ReferenceError::Option { what, value, must, flag });
        if !(options.offset.is_finite() && options.offset >= 0.0) {
            return refused("the constant that is added", options.offset, "not negative and finite", "--offset");
        }
        let decoded = match decode::sniff(bytes)? {
            #[cfg(feature = "svg")]
            Format::Svg => {
                let page = options.background.unwrap_or([255; 3]);
                decode::svg::draw(bytes, page, options.svg_width, MOST_SIDE)?
            }
            #[cfg(not(feature = "svg"))]
            Format::Svg => {
                let remedy = "rsvg-convert -w 1024 picture.svg -o picture.png";
                return Err(ReferenceError::Foreign { format: "SVG", remedy });
            }
            format => decode::decode(format, bytes, options.layer.as_deref())?,
        };
        let (lossy, differs_in_alpha) = (decoded.lossy, differs_in_alpha(&decoded));
        let linear = match options.transfer {
            Some(transfer) => transfer == Transfer::Linear,
            None => decoded.meaning.as_ref().is_ok_and(Meaning::is_linear),
        };
        let plane = light_of(decoded, options)?;
        let flat_as_stored = is_flat(&plane);
        let reduced = plane.nx.max(plane.ny).div_ceil(MOST_SIDE);
        let upright = plane.reduced(reduced).cropped(options.crop)?.turned(options.turn, options.flip);
        let edited = |plane: Plane| options.frame.around(plane.graded(options.levels, options.invert)?);
        // Edits may stretch a decoder's last level over all of the scale, so they are done again to
        // a picture that is one level brighter, and to one that is one darker.
        let neighbour = |levels: f64| {
            let mut plane = upright.clone();
            plane.map(|light| levels_away(light, levels, linear));
            edited(plane)
        };
        let neighbours = if lossy { Some([neighbour(1.0)?, neighbour(-1.0)?]) } else { None };
        let framed = edited(upright)?;
        if is_flat(&framed) {
            let (cause, remedy) = match (flat_as_stored, differs_in_alpha) {
                (true, true) => {
                    ("its colours differ in transparency alone", "give it another background (--background white)")
                }
                (true, false) => ("all of its pixels are alike", "choose another picture"),
                (false, _) => ("the crop, the levels or the vignette leave nothing of it", "change --crop or --levels"),
            };
            return Err(ReferenceError::Flat { cause, remedy });
        }
        let values = framed.values.par_iter().map(|light| f64::from(*light) + options.offset).collect();
        let mut light = Image::new(framed.nx, framed.ny, values);
        let mean = light.mean();
        light.values.par_iter_mut().for_each(|value| *value /= mean);
        let off = neighbours.map_or(0.0, |of| greatest_rms_distance(&framed, &of) / mean);
        let tolerance = EXACT.max(off);
        Ok(Self { light, tolerance, reduced })
    }
}

/// The light of a picture, upright.
fn light_of(decoded: Decoded, options: &ReadOptions) -> Result<Plane, ReferenceError> {
    let Decoded { raster, orientation, meaning, scaled_to_peak, .. } = decoded;
    let meaning = match options.transfer {
        Some(Transfer::Srgb) => Meaning::of(Tone::Srgb, REC_709),
        Some(Transfer::Linear) => Meaning::linear(),
        None => meaning?,
    };
    let background = options.background.unwrap_or_default();
    let background: f64 = (0..3).map(|k| REC_709[k] * srgb_to_light(f64::from(background[k]) / 255.0)).sum();
    let mut plane = meaning.linearised(&raster, if scaled_to_peak { 0.0 } else { background });
    if scaled_to_peak {
        let peak = plane.values.par_iter().copied().reduce(|| 0.0, f32::max);
        let channels = raster.channels();
        let free = |k: usize| match (&raster.samples, raster.alpha) {
            (Samples::Float(samples), Alpha::Premultiplied | Alpha::Straight) => {
                1.0 - f64::from(samples[(k + 1) * channels - 1])
            }
            _ => 0.0,
        };
        if peak > 0.0 {
            plane.values.par_iter_mut().enumerate().for_each(|(k, light)| {
                *light = (f64::from(*light) / f64::from(peak) + free(k) * background) as f32;
            });
        }
    }
    let plane = plane.upright(orientation);
    match plane.values.par_iter().position_first(|light| !(light.is_finite() && *light >= 0.0)) {
        None => Ok(plane),
        Some(k) => {
            let (value, column, row) = (f64::from(plane.values[k]), k % plane.nx, k / plane.nx);
            Err(ReferenceError::Value { value, column, row })
        }
    }
}

/// Whether a picture is not equally transparent everywhere.
fn differs_in_alpha(decoded: &Decoded) -> bool {
    fn differs<T: PartialEq>(samples: &[T], channels: usize) -> bool {
        samples.chunks_exact(channels).any(|pixel| pixel[channels - 1] != samples[channels - 1])
    }
    let raster = &decoded.raster;
    raster.alpha != Alpha::None
        && match &raster.samples {
            Samples::Bits8(samples) => differs(samples, raster.channels()),
            Samples::Bits16(samples) => differs(samples, raster.channels()),
            Samples::Float(samples) => differs(samples, raster.channels()),
        }
}

fn is_flat(plane: &Plane) -> bool {
    let ends = plane.values.par_iter().fold(|| (f32::MAX, 0.0_f32), |(low, high), v| (low.min(*v), high.max(*v)));
    let (low, high) = ends.reduce(|| (f32::MAX, 0.0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    f64::from(high - low) <= FLAT * f64::from(high)
}

/// The light of a number that is some levels of 255 higher, on the curve of sRGB or on none.
fn levels_away(light: f64, levels: f64, linear: bool) -> f64 {
    if linear {
        (light + levels / 255.0).max(0.0)
    } else {
        srgb_to_light((light_to_srgb(light) + levels / 255.0).max(0.0))
    }
}

/// Root mean square of how far a pixel is from the furthest of others.
fn greatest_rms_distance(from: &Plane, others: &[Plane]) -> f64 {
    // Row by row, so that the order of adding up is always the same.
    let rows = (0..from.ny).into_par_iter().map(|row| {
        let further = |k: usize| {
            let squares = others.iter().map(|to| f64::from(to.values[k] - from.values[k]).powi(2));
            squares.fold(0.0, f64::max)
        };
        (row * from.nx..(row + 1) * from.nx).map(further).sum::<f64>()
    });
    (rows.collect::<Vec<_>>().iter().sum::<f64>() / from.values.len() as f64).sqrt()
}
