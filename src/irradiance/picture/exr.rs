//! OpenEXR: one layer of a file that may hold many.

use super::{
    PictureError, Transfer, blocks,
    canvas::{Canvas, Orientation},
    colour::Shown,
    primaries::{Primaries, REC_709},
    sampling::Sampling,
};
use ::exr::{
    block::{self, UncompressedBlock, reader::ChunksReader},
    error::Error,
    math::Vec2,
    meta::{
        attribute::{ChannelDescription, Chromaticities, SampleType},
        header::Header,
    },
    prelude::f16,
};
use glam::DVec2;
use std::io::Cursor;

/// What is asked of a file, and what it is allowed.
pub(super) struct Request<'a> {
    pub(super) transfer: Option<Transfer>,
    pub(super) layer: Option<&'a str>,
    /// Light behind transparent parts.
    pub(super) background: f64,
    pub(super) greatest_side: usize,
    /// Checks a size, and memory besides the light, bytes.
    pub(super) check: &'a dyn Fn((usize, usize), u64) -> Result<(), PictureError>,
}

/// Light that was read.
pub(super) struct Reading {
    pub(super) canvas: Canvas,
    pub(super) size: (usize, usize),
    /// The layer, if it has a name.
    pub(super) layer: Option<String>,
}

fn failed(error: Error) -> PictureError {
    broken(&error)
}

fn broken(says: &dyn std::fmt::Display) -> PictureError {
    PictureError::broken("OpenEXR", says)
}

/// The channels of a colour layer, by their number in the header of their part.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    name: String,
    part: usize,
    /// One for grey, three for RGB.
    colours: Vec<usize>,
    alpha: Option<usize>,
}

/// Reads the light of a layer.
pub(super) fn read(bytes: &mut [u8], request: &Request<'_>) -> Result<Reading, PictureError> {
    let sampling = Sampling::take(bytes);
    let reader = block::read(Cursor::new(&*bytes), false).map_err(failed)?;
    let mut meta = reader.meta_data().clone();
    sampling.restore(&mut meta);
    blocks::check_size(&meta, bytes.len()).map_err(failed)?;
    let layer = chosen(&meta.headers, request.layer)?;
    let header = meta.headers[layer.part].clone();
    if header.deep {
        return Err(broken(&"it has deep data; flatten it in the program that made it"));
    }
    let (window, display) = (header.data_window(), header.shared_attributes.display_window);
    let size = (display.size.0, display.size.1);
    let data = (window.size.0, window.size.1);
    let wanted: Vec<usize> = layer.colours.iter().copied().chain(layer.alpha).collect();
    if wanted.iter().any(|k| header.channels.list[*k].sampling != Vec2(1, 1)) {
        return Err(broken(&"its colours have fewer samples than pixels"));
    }
    check_shown(size, data)?;
    (request.check)(size, (4 * wanted.len() as u64).saturating_mul(data.0 as u64).saturating_mul(data.1 as u64))?;
    let mut planes: Vec<Vec<f32>> = wanted.iter().map(|_| vec![0.0; data.0 * data.1]).collect();
    let whole = Vec2(0, 0);
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == layer.part && tile.level_index == whole)
        .map_err(failed)?;
    while let Some(chunk) = chunks.read_next_chunk() {
        let block = sampling.unpack(chunk.map_err(failed)?, &mut meta).map_err(failed)?;
        if (block.index.layer, block.index.level) != (layer.part, whole) {
            return Err(broken(&"a block of it lies elsewhere"));
        }
        copy(&block, &header, &wanted, &mut planes)?;
    }
    let weights = header.shared_attributes.chromaticities.and_then(|of| primaries(&of).weights()).unwrap_or(REC_709);
    let (transfer, weights) = match request.transfer {
        Some(transfer) => (transfer, REC_709),
        None => (Transfer::Linear, weights),
    };
    let colour = |at: usize| -> f64 {
        let light = |k: usize| transfer.to_linear(f64::from(planes[k][at]));
        if layer.colours.len() == 1 { light(0) } else { (0..3).map(|k| weights[k] * light(k)).sum() }
    };
    // Where pixel (i, j) of the picture lies in the data, if it does.
    let shift = |at: i32, from: i32, k: usize, n: usize| {
        usize::try_from(i64::from(at) - i64::from(from) + k as i64).ok().filter(|k| *k < n)
    };
    let place = |i: usize, j: usize| {
        let column = shift(display.position.0, window.position.0, i, data.0)?;
        Some(column + data.0 * shift(display.position.1, window.position.1, j, data.1)?)
    };
    let mut peak = 0.0_f64;
    for at in (0..size.1).flat_map(|j| (0..size.0).filter_map(move |i| place(i, j))) {
        peak = peak.max(colour(at));
    }
    let scale = if peak > 0.0 && peak.is_finite() { peak } else { 1.0 };
    let mut canvas = Canvas::new(size, Orientation::UPRIGHT, request.greatest_side);
    let alpha = layer.alpha.map(|_| &planes[layer.colours.len()]);
    for j in 0..size.1 {
        for i in 0..size.0 {
            let shown = match place(i, j) {
                None => Shown { light: request.background, colour: 0.0, alpha: 0.0 },
                Some(at) => {
                    let (colour, alpha) =
                        (colour(at) / scale, alpha.map_or(1.0, |of| f64::from(of[at]).clamp(0.0, 1.0)));
                    Shown { light: colour + (1.0 - alpha) * request.background, colour, alpha }
                }
            };
            canvas.spread().add(shown);
            canvas.put((i, j), shown.light)?;
        }
    }
    Ok(Reading { canvas, size, layer: Some(layer.name).filter(|name| !name.is_empty()) })
}

/// What of a picture may lie beyond its data without a word, pixels, and as a multiple of them: nothing
/// in a file pays for it.
const SHOWN: u128 = 1 << 24;
const SHOWN_PER_PIXEL: u128 = 64;

/// Refuses a display window that is out of all proportion to the data.
fn check_shown(shown: (usize, usize), data: (usize, usize)) -> Result<(), PictureError> {
    let pixels = |(nx, ny): (usize, usize)| nx as u128 * ny as u128;
    if pixels(shown) <= SHOWN.max(SHOWN_PER_PIXEL * pixels(data)) {
        return Ok(());
    }
    let says = format!(
        "it shows {} x {} pixels, of which it holds {} x {}; crop it in the program that made it",
        shown.0, shown.1, data.0, data.1
    );
    Err(broken(&says))
}

fn primaries(of: &Chromaticities) -> Primaries {
    let at = |of: Vec2<f32>| DVec2::new(f64::from(of.0), f64::from(of.1));
    Primaries { rgb: [at(of.red), at(of.green), at(of.blue)], white: at(of.white) }
}

/// Copies the channels that are wanted. Lines hold one channel after the other; those with fewer
/// samples have fewer lines.
fn copy(
    block: &UncompressedBlock,
    header: &Header,
    wanted: &[usize],
    planes: &mut [Vec<f32>],
) -> Result<(), PictureError> {
    let short = || broken(&"a block of it is too short");
    let (nx, position, size) = (header.layer_size.0, block.index.pixel_position, block.index.pixel_size);
    let mut data = &block.data[..];
    for row in position.1..position.1 + size.1 {
        let y = i64::from(header.own_attributes.layer_position.1) + row as i64;
        for (k, channel) in header.channels.list.iter().enumerate() {
            if y.rem_euclid(channel.sampling.1 as i64) != 0 {
                continue;
            }
            let n = size.0 / channel.sampling.0;
            let (line, rest) = data.split_at_checked(n * channel.sample_type.bytes_per_sample()).ok_or_else(short)?;
            data = rest;
            let Some(plane) = wanted.iter().position(|of| *of == k) else { continue };
            let start = row * nx + position.0;
            let to = planes[plane].get_mut(start..start + n).ok_or_else(short)?;
            read_line(line, channel, to);
        }
    }
    Ok(())
}

fn read_line(line: &[u8], channel: &ChannelDescription, to: &mut [f32]) {
    match channel.sample_type {
        SampleType::F16 => {
            for (to, from) in to.iter_mut().zip(line.as_chunks::<2>().0) {
                *to = f16::from_ne_bytes(*from).to_f32();
            }
        }
        SampleType::F32 => {
            for (to, from) in to.iter_mut().zip(line.as_chunks::<4>().0) {
                *to = f32::from_ne_bytes(*from);
            }
        }
        SampleType::U32 => {
            for (to, from) in to.iter_mut().zip(line.as_chunks::<4>().0) {
                *to = u32::from_ne_bytes(*from) as f32;
            }
        }
    }
}

/// The layer that is asked for, or the one that is meant.
fn chosen(headers: &[Header], asked: Option<&str>) -> Result<Layer, PictureError> {
    let names: Vec<Vec<String>> = headers.iter().map(names).collect();
    let layers = colour_layers(&names);
    let single = |part: usize, k: usize| Layer { name: names[part][k].clone(), part, colours: vec![k], alpha: None };
    if let Some(asked) = asked {
        let channels = names.iter().enumerate().flat_map(|(part, of)| (0..of.len()).map(move |k| (part, k)));
        let found = layers.iter().find(|layer| layer.name == asked).cloned();
        return found
            .or_else(|| {
                channels.into_iter().find(|(part, k)| names[*part][*k] == asked).map(|(part, k)| single(part, k))
            })
            .ok_or_else(|| PictureError::NoLayer { asked: asked.into(), known: known(&layers, &names) });
    }
    if let Some(layer) = layers.iter().find(|layer| layer.name.is_empty()) {
        return Ok(layer.clone());
    }
    match (&layers[..], &names[..]) {
        ([only], _) => Ok(only.clone()),
        ([], [of]) if of.len() == 1 => Ok(single(0, 0)),
        ([], _) => Err(PictureError::NoColour { known: known(&layers, &names) }),
        _ => Err(PictureError::Layers { known: known(&layers, &names) }),
    }
}

/// What may be asked for, in words.
fn known(layers: &[Layer], names: &[Vec<String>]) -> String {
    const MOST: usize = 40;
    let all: Vec<String> = if layers.is_empty() {
        names.iter().flatten().cloned().collect()
    } else {
        layers.iter().map(|layer| layer.name.clone()).collect()
    };
    let more = if all.len() > MOST { format!(" and {} more", all.len() - MOST) } else { String::new() };
    all.iter().take(MOST).map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ") + &more
}

/// Full names of the channels of a part: those without a layer belong to the layer that the part is
/// named for.
fn names(header: &Header) -> Vec<String> {
    let part = header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
    let full = |channel: &ChannelDescription| {
        let name = channel.name.to_string();
        if part.is_empty() || name.contains('.') { name } else { format!("{part}.{name}") }
    };
    header.channels.list.iter().map(full).collect()
}

/// The layers that hold colours.
fn colour_layers(names: &[Vec<String>]) -> Vec<Layer> {
    let mut layers: Vec<Layer> = Vec::new();
    for (part, of) in names.iter().enumerate() {
        let split =
            |name: &str| name.rsplit_once('.').map_or((String::new(), name.to_owned()), |(a, b)| (a.into(), b.into()));
        let parts: Vec<(String, String)> = of.iter().map(|name| split(name)).collect();
        let mut seen: Vec<&str> = parts.iter().map(|(layer, _)| layer.as_str()).collect();
        seen.sort_unstable();
        seen.dedup();
        for layer in seen {
            let find = |known: &[&str]| {
                parts
                    .iter()
                    .position(|(of, name)| of == layer && known.iter().any(|known| name.eq_ignore_ascii_case(known)))
            };
            let rgb = [find(&["R", "red"]), find(&["G", "green"]), find(&["B", "blue"])];
            let colours = match rgb {
                [Some(r), Some(g), Some(b)] => vec![r, g, b],
                // A layer of vectors has x and z beside its y.
                _ if find(&["X"]).is_some() => continue,
                _ => match find(&["Y", "L", "luminance"]) {
                    Some(grey) => vec![grey],
                    None => continue,
                },
            };
            layers.push(Layer { name: layer.into(), part, colours, alpha: find(&["A", "alpha"]) });
        }
    }
    layers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(names: &[&str]) -> Vec<(String, usize, bool)> {
        let names = vec![names.iter().map(|name| (*name).to_owned()).collect()];
        colour_layers(&names).into_iter().map(|of| (of.name, of.colours.len(), of.alpha.is_some())).collect()
    }

    #[test]
    fn depth_vectors_and_ids_are_no_colour() {
        let found = layers(&["A", "B", "G", "R", "Z", "id", "N.X", "N.Y", "N.Z", "ViewLayer.Depth.Z", "crypto00.r"]);
        assert_eq!(found, [(String::new(), 3, true)]);
        assert_eq!(layers(&["BY", "RY", "Y"]), [(String::new(), 1, false)]);
        assert_eq!(layers(&["Z", "depth.Z"]), []);
    }

    #[test]
    fn layers_are_named_as_blender_names_them() {
        let found =
            layers(&["ViewLayer.Combined.A", "ViewLayer.Combined.B", "ViewLayer.Combined.G", "ViewLayer.Combined.R"]);
        assert_eq!(found, [("ViewLayer.Combined".to_owned(), 3, true)]);
        assert_eq!(layers(&["a.R", "a.G", "a.B", "b.Y"]).len(), 2);
    }
}
