//! OpenEXR: which of the layers and channels are the colour of the picture.

use super::{
    super::{
        colour::{Meaning, REC_709, luminances},
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
        tone::Tone,
    },
    decoded::{Decoded, believe},
};
use crate::exr_blocks;
use exr::prelude::{AnyChannel, FlatSamples, ReadChannels, ReadLayers};
use std::{collections::BTreeMap, io::Cursor};

const NAME: &str = "OpenEXR";
/// No packing makes more of a byte than deflate does, and a sample has at least two.
const PER_BYTE: usize = 1032 / 2;

pub(super) fn decode(bytes: &[u8], wanted: Option<&str>) -> Result<Decoded, ReferenceError> {
    let failed = |error: exr::error::Error| ReferenceError::malformed(NAME, error);
    let claimed = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &claimed.headers {
        let size = header.layer_size;
        let channels = header.channels.list.len().max(1);
        believe(size.width().saturating_mul(channels), size.height(), bytes.len(), PER_BYTE)?;
        let window = header.shared_attributes.display_window.size;
        believe(window.width(), window.height(), bytes.len(), PER_BYTE)?;
        if header.channels.list.iter().any(|channel| (channel.sampling.x(), channel.sampling.y()) != (1, 1)) {
            return Err(ReferenceError::malformed(NAME, "channels with fewer samples than pixels (RY and BY)"));
        }
    }
    exr_blocks::check(bytes).map_err(failed)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;

    // Channels by the layer that they belong to: of a part, and of what stands in front of the last
    // dot of their name.
    let mut layers: BTreeMap<String, (usize, BTreeMap<String, &AnyChannel<FlatSamples>>)> = BTreeMap::new();
    let mut singles = Vec::new();
    for (part, layer) in image.layer_data.iter().enumerate() {
        let of_part = layer.attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let (prefix, own) = name.rsplit_once('.').unwrap_or(("", &name));
            // A file of one part may be named, too; channels are told apart by their own names
            // then.
            let key = match (image.layer_data.len(), of_part.as_str(), prefix) {
                (1, _, _) | (_, "", _) => prefix.to_owned(),
                (_, _, "") => of_part.clone(),
                _ if prefix == of_part => of_part.clone(),
                _ => format!("{of_part}.{prefix}"),
            };
            singles.push((if key.is_empty() { own.to_owned() } else { format!("{key}.{own}") }, part, channel));
            layers.entry(key).or_insert_with(|| (part, BTreeMap::new())).1.insert(own.to_ascii_uppercase(), channel);
        }
    }
    layers.retain(|_, (_, channels)| {
        ["R", "G", "B"].iter().all(|name| channels.contains_key(*name)) || channels.contains_key("Y")
    });
    let names = || layers.keys().map(|name| if name.is_empty() { "(unnamed)".into() } else { name.clone() }).collect();
    // A channel that is taken alone is grey.
    let alone = |(_, part, channel): &(String, usize, _)| (*part, BTreeMap::from([("Y".to_owned(), *channel)]));
    let found = match wanted {
        Some(name) => layers
            .get(name)
            .cloned()
            .or_else(|| singles.iter().find(|(full, ..)| full == name).map(alone))
            .ok_or_else(|| ReferenceError::NoLayer { name: name.into(), names: names() })?,
        None => match (layers.get(""), layers.len(), singles.as_slice()) {
            (Some(unnamed), ..) => Some(unnamed.clone()),
            (None, 1, _) => layers.values().next().cloned(),
            (None, 0, [only]) => Some(alone(only)),
            (None, 0, _) => None,
            _ => return Err(ReferenceError::Layers { names: names() }),
        }
        .ok_or_else(|| ReferenceError::malformed(NAME, "no layer has colour: neither R, G and B, nor Y"))?,
    };
    let (part, channels) = found;
    let layer = &image.layer_data[part];

    let colours = ["R", "G", "B"].iter().filter_map(|name| channels.get(*name)).collect::<Vec<_>>();
    let (inks, mut used) = if colours.len() == 3 {
        (Inks::Rgb, colours.into_iter().map(|channel| floats(channel)).collect::<Vec<_>>())
    } else {
        (Inks::Grey, channels.get("Y").map(|channel| floats(channel)).into_iter().collect())
    };
    // The picture is the display window; around the data there is nothing.
    let window = image.attributes.display_window;
    let (nx, ny) = (window.size.width(), window.size.height());
    let from = layer.attributes.layer_position;
    let left = i64::from(from.x()) - i64::from(window.position.x());
    let top = i64::from(from.y()) - i64::from(window.position.y());
    let (wide, high) = (layer.size.width(), layer.size.height());
    let covers = (left, top) == (0, 0) && (wide, high) == (nx, ny);
    let alpha = match channels.get("A") {
        Some(channel) => {
            used.push(floats(channel));
            Alpha::Premultiplied
        }
        None if covers => Alpha::None,
        None => {
            used.push(vec![1.0; wide * high]);
            Alpha::Premultiplied
        }
    };
    if used.iter().any(|channel| channel.len() != wide * high) {
        return Err(ReferenceError::malformed(NAME, "a channel has another number of samples than there are pixels"));
    }
    let count = used.len();
    let mut samples = vec![0.0; nx * ny * count];
    for y in 0..high as i64 {
        for x in 0..wide as i64 {
            let (column, row) = (x + left, y + top);
            if (0..nx as i64).contains(&column) && (0..ny as i64).contains(&row) {
                let at = (row as usize * nx + column as usize) * count;
                let k = y as usize * wide + x as usize;
                samples[at..at + count].iter_mut().zip(&used).for_each(|(value, channel)| *value = channel[k]);
            }
        }
    }
    let weights = match image.attributes.chromaticities {
        None => Some(REC_709),
        Some(c) => {
            let point = |v: exr::math::Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
            luminances([point(c.red), point(c.green), point(c.blue)], point(c.white))
        }
    };
    let weights = weights.ok_or_else(|| ReferenceError::malformed(NAME, "its chromaticities make no white"))?;
    Ok(Decoded {
        raster: Raster { nx, ny, inks, alpha, samples: Samples::Float(samples) },
        orientation: 1,
        meaning: Ok(Meaning::of(Tone::Linear, weights)),
        scaled_to_peak: true,
        lossy: false,
    })
}

fn floats(channel: &AnyChannel<FlatSamples>) -> Vec<f32> {
    channel.sample_data.values_as_f32().collect()
}
