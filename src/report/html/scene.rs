//! What the viewer needs of a block and its bench: heights in 16 bits, and a few lines.

use super::{
    Model,
    data::script_json,
    rays::{RayFan, look, window_corners},
};
use crate::{bench::ExitFace, report::svg::base64, surface::SurfaceSpline};
use glam::{DVec2, DVec3};
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
    /// What 32767 stands for, and the slopes along x and y of every node, little-endian 16-bit
    /// numbers with a sign, as base64.
    steepest: f64,
    slopes: String,
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
    let mut slopes = vec![DVec2::ZERO; nx * ny];
    let mut scratch = Vec::new();
    for (j, (row, slopes)) in heights.chunks_mut(nx).zip(slopes.chunks_mut(nx)).enumerate() {
        lattice.row(j, &mut scratch, |i, height, slope| (row[i], slopes[i]) = (height, slope));
    }
    let steepest = slopes.iter().fold(0.0, |most: f64, slope| most.max(slope.abs().max_element()));
    let part = |slope: f64| if steepest > 0.0 { (f64::from(i16::MAX) * slope / steepest).round() as i16 } else { 0 };
    let slopes: Vec<u8> = slopes.iter().flat_map(DVec2::to_array).flat_map(|slope| part(slope).to_le_bytes()).collect();
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
        steepest,
        slopes: base64(&slopes),
        outline: model.outline.iter().map(glam::DVec2::to_array).collect(),
        rim: model.rim_z_mm,
        receiver: window_corners(model.bench).iter().map(point).collect(),
        look: point(&look(model)),
        rays: base64(&rays),
    };
    script_json(&scene)
}
