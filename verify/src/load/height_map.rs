//! Height maps: a picture whose pixels are nodes, with its numbers beside it as text.

use super::{error::LoadError, outlined};
use crate::{image_file::read_exr_layer, mesh::Mesh};
use exr::prelude::AttributeValue;
use glam::{DVec2, DVec3};
use std::{collections::HashMap, io::Cursor};

fn malformed(reason: impl Into<String>) -> LoadError {
    LoadError::malformed("height map", reason)
}

/// Most pixels that are taken.
const MOST_PIXELS: usize = 1 << 27;

/// A 16-bit grey PNG: black and white stand for the heights that its text names.
pub(super) fn parse_png(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let failed = |error: png::DecodingError| malformed(error.to_string());
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(failed)?;
    let info = reader.info();
    let (nx, ny) = (info.width as usize, info.height as usize);
    if (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err(malformed("it is no picture of 16-bit grey"));
    }
    let notes: HashMap<String, String> =
        info.uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone())).collect();
    let notes = Notes::read(&notes, nx, ny)?;
    // No packing of PNG makes more of a byte than this, and the header is believed before the rest
    // is seen.
    if 2 * nx * ny > 1032 * bytes.len() {
        return Err(malformed(format!("{} bytes are too few for {nx} x {ny} pixels", bytes.len())));
    }
    let [black, white] = [notes.number("BlackZMm")?, notes.number("WhiteZMm")?];
    let mut levels = vec![0; 2 * nx * ny];
    reader.next_frame(&mut levels).map_err(failed)?;
    let (levels, _) = levels.as_chunks::<2>();
    let step = (white - black) / 65535.0;
    notes.mesh(levels.iter().map(|&level| black + step * f64::from(u16::from_be_bytes(level))).collect())
}

/// OpenEXR with a channel Y, mm.
pub(super) fn parse_exr(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let layer = read_exr_layer(bytes).map_err(|error| malformed(error.to_string()))?;
    let (nx, ny) = (layer.size.0, layer.size.1);
    let notes: HashMap<String, String> = layer
        .attributes
        .other
        .iter()
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    let notes = Notes::read(&notes, nx, ny)?;
    let channel = layer.channel_data.list.iter().find(|channel| channel.name.eq_case_insensitive("Y"));
    let channel = channel.ok_or_else(|| malformed("it has no channel Y"))?;
    notes.mesh(channel.sample_data.values_as_f32().map(f64::from).collect())
}

struct Notes<'a> {
    text: &'a HashMap<String, String>,
    nx: usize,
    ny: usize,
}

impl<'a> Notes<'a> {
    fn read(text: &'a HashMap<String, String>, nx: usize, ny: usize) -> Result<Self, LoadError> {
        if nx < 4 || ny < 4 || nx.saturating_mul(ny) > MOST_PIXELS {
            return Err(malformed(format!("it has {nx} x {ny} pixels; 4 x 4 to {MOST_PIXELS} are taken")));
        }
        Ok(Self { text, nx, ny })
    }

    fn number(&self, name: &str) -> Result<f64, LoadError> {
        let value = self.text.get(name).and_then(|text| text.trim().parse::<f64>().ok());
        value.filter(|value| value.is_finite()).ok_or_else(|| {
            malformed(format!("its metadata give no {name}: it is no height map, or a program has dropped its text"))
        })
    }

    /// Semi-axes of the corners, mm, if they are not sharp.
    fn corners(&self) -> Result<Option<DVec2>, LoadError> {
        if !self.text.contains_key("CornerRadiusXMm") {
            return Ok(None);
        }
        let radius = DVec2::new(self.number("CornerRadiusXMm")?, self.number("CornerRadiusYMm")?);
        if radius.min_element() <= 0.0 {
            return Err(malformed(format!("its corners have radii of {} x {} mm", radius.x, radius.y)));
        }
        Ok(Some(radius))
    }

    /// The block under heights in the order of pictures, left at `-x`.
    fn mesh(&self, heights: Vec<f64>) -> Result<Mesh, LoadError> {
        let (nx, ny) = (self.nx, self.ny);
        let (pitch_x, pitch_y) = (self.number("MmPerPixelX")?, self.number("MmPerPixelY")?);
        let entry_z = self.number("EntryZMm")?;
        if let Some(k) = heights.iter().position(|z| !z.is_finite()) {
            return Err(malformed(format!("the height of pixel ({}, {}) is not finite", k % nx, k / nx)));
        }
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        if pitch_x <= 0.0 || pitch_y <= 0.0 || lowest <= entry_z {
            return Err(malformed("its pitch is not positive, or its lowest place is below the entry face"));
        }
        if let Some(radius) = self.corners()? {
            let half = 0.5 * DVec2::new((nx - 1) as f64 * pitch_x, (ny - 1) as f64 * pitch_y);
            if radius.cmpgt(half * (1.0 + 1e-9)).any() {
                return Err(malformed(format!("corners of {} x {} mm do not fit its face", radius.x, radius.y)));
            }
            let curve = outlined::Curve { half, radius: radius.min(half) };
            let upwards: Vec<f64> = heights.chunks(nx).rev().flatten().copied().collect();
            let mesh = outlined::block(&upwards, (nx, ny), curve, entry_z);
            return mesh.ok_or_else(|| malformed("it has too few pixels within its outline"));
        }
        let place = |k: usize, n: usize, pitch: f64| (k as f64 - 0.5 * (n - 1) as f64) * pitch;
        // Row 0 is the top; in the mesh rows go along +y.
        let mut vertices: Vec<DVec3> = (0..nx * ny)
            .map(|k| (k % nx, k / nx))
            .map(|(i, j)| DVec3::new(place(i, nx, pitch_x), place(j, ny, pitch_y), heights[(ny - 1 - j) * nx + i]))
            .collect();
        let node = |i: usize, j: usize| (j * nx + i) as u32;
        let mut triangles = Vec::with_capacity(2 * nx * ny + 12 * (nx + ny));
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        // Once around the border, with a wall below every edge and a fan as the entry face.
        let mut border: Vec<u32> = (0..nx - 1).map(|i| node(i, 0)).collect();
        border.extend((0..ny - 1).map(|j| node(nx - 1, j)));
        border.extend((1..nx).rev().map(|i| node(i, ny - 1)));
        border.extend((1..ny).rev().map(|j| node(0, j)));
        let centre = vertices.len() as u32;
        vertices.push(DVec3::new(0.0, 0.0, entry_z));
        let below: Vec<u32> = border
            .iter()
            .map(|&v| {
                vertices.push(vertices[v as usize].truncate().extend(entry_z));
                vertices.len() as u32 - 1
            })
            .collect();
        for k in 0..border.len() {
            let next = (k + 1) % border.len();
            let (a, b, c, d) = (below[k], below[next], border[next], border[k]);
            triangles.extend([[a, b, c], [a, c, d], [centre, b, a]]);
        }
        Ok(Mesh { vertices, triangles, ..Mesh::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid;

    fn png_of(entries: &[(&str, &str)], depth: png::BitDepth) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 5, 4);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(depth);
        for (name, value) in entries {
            encoder.add_text_chunk((*name).to_owned(), (*value).to_owned()).unwrap();
        }
        let samples: Vec<u8> = (0..20u16).flat_map(|k| (k * 3000).to_be_bytes()).collect();
        let bytes_per_pixel = if depth == png::BitDepth::Sixteen { 2 } else { 1 };
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&samples[..20 * bytes_per_pixel]).unwrap();
        writer.finish().unwrap();
        bytes
    }

    const NOTES: [(&str, &str); 5] =
        [("MmPerPixelX", "2"), ("MmPerPixelY", "3"), ("BlackZMm", "-1"), ("WhiteZMm", "5.5535"), ("EntryZMm", "-4")];

    #[test]
    fn a_map_becomes_a_sound_block_with_the_top_row_at_plus_y() {
        let mesh = parse_png(&png_of(&NOTES, png::BitDepth::Sixteen)).unwrap();
        let report = solid::check(&mesh);
        assert!(report.is_sound(), "{report}");
        assert_eq!(
            (report.lower_mm, report.upper_mm.truncate()),
            (DVec3::new(-4.0, -4.5, -4.0), DVec3::new(4.0, 4.5, 0.0).truncate())
        );
        // The first pixel is black, at the left end of the top row: node (0, 3).
        assert_eq!(mesh.vertices[15], DVec3::new(-4.0, 4.5, -1.0));
        assert!((mesh.vertices[4].z - (-1.0 + 19.0 * 0.3)).abs() < 1e-12);
    }

    #[test]
    fn a_picture_that_is_no_map_is_named() {
        let without = |name: &str| NOTES.into_iter().filter(|(key, _)| *key != name).collect::<Vec<_>>();
        for (bytes, words) in [
            (png_of(&NOTES, png::BitDepth::Eight), "16-bit"),
            (png_of(&without("MmPerPixelY"), png::BitDepth::Sixteen), "MmPerPixelY"),
            (png_of(&without("EntryZMm"), png::BitDepth::Sixteen), "EntryZMm"),
            (png_of(&NOTES, png::BitDepth::Sixteen)[..90].to_vec(), ""),
        ] {
            let error = parse_png(&bytes).unwrap_err().to_string();
            assert!(error.contains("height map") && error.contains(words), "{error}");
        }
        assert!(parse_exr(b"v/1").is_err());
    }
}
