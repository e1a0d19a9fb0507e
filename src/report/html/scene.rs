//! What the viewer needs of a block and its bench: heights in 16 bits, and a few lines.

use super::{
    Model,
    rays::{RayFan, look, window_corners},
};
use crate::{bench::ExitFace, report::svg::base64, surface::SurfaceSpline};
use glam::DVec3;
use serde::Serialize;

/// Most nodes along a side.
const MOST_NODES: usize = 257;

#[derive(Serialize)]
struct Scene {
    size: [f64; 2],
    entry: f64,
    mirror: bool,
    nodes: [usize; 2],
    /// Heights that 0 and 65535 stand for, mm.
    range: [f64; 2],
    /// Little-endian 16-bit numbers, row by row along +y, as base64.
    heights: String,
    outline: Vec<[f64; 2]>,
    rim: Option<f64>,
    /// Top left, top right, bottom right, bottom left of the picture.
    receiver: Vec<[f32; 3]>,
    /// Whence it is seen at first.
    look: [f32; 3],
    /// Four points each, little-endian 32-bit numbers, as base64.
    rays: String,
}

/// The scene as JSON that can stand in a script element.
pub(super) fn json(model: &Model<'_>, spline: &SurfaceSpline, fan: &RayFan) -> String {
    let nodes = spline.nodes();
    let [nx, ny] = [nodes.0, nodes.1].map(|n| n.min(MOST_NODES));
    let lattice = spline.lattice(nx, ny);
    let mut heights = vec![0.0; nx * ny];
    let mut scratch = Vec::new();
    for (j, row) in heights.chunks_mut(nx).enumerate() {
        lattice.row(j, &mut scratch, |i, height, _| row[i] = height);
    }
    let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &h| (lo.min(h), hi.max(h)));
    let scale = if high > low { 65_535.0 / (high - low) } else { 0.0 };
    let steps: Vec<u8> = heights.iter().flat_map(|h| (((h - low) * scale).round() as u16).to_le_bytes()).collect();
    let point = |p: &DVec3| p.as_vec3().to_array();
    let rays: Vec<u8> = fan.some().flatten().flat_map(point).flat_map(f32::to_le_bytes).collect();
    let extent = model.surface.extent();
    let scene = Scene {
        size: [extent.width_mm, extent.height_mm],
        entry: model.entry_z_mm,
        mirror: model.bench.exit_face() == ExitFace::Reflects,
        nodes: [nx, ny],
        range: [low, high],
        heights: base64(&steps),
        outline: model.outline.iter().map(glam::DVec2::to_array).collect(),
        rim: model.rim_z_mm,
        receiver: window_corners(model.bench).iter().map(point).collect(),
        look: point(&look(model)),
        rays: base64(&rays),
    };
    // Nothing in it can fail to become JSON. A `<` would end the element that it stands in.
    serde_json::to_string(&scene).unwrap_or_default().replace('<', "\\u003c")
}
