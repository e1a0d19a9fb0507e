//! Block, light and picture in parallel projection: for paper, and where nothing can be turned.

use super::{
    Model, data,
    rays::{RayFan, look, window_corners},
};
use crate::report::svg::{self, Px, ring};
use askama::Template;
use glam::{DVec2, DVec3};
use image::{DynamicImage, GrayImage};

#[derive(Template)]
#[template(path = "still.svg")]
pub(super) struct Still {
    width: Px,
    height: Px,
    rays: Vec<String>,
    /// Faces of the block from back to front.
    faces: Vec<String>,
    face: Placed,
    picture: Placed,
    frame: String,
}

/// A picture drawn into a parallelogram.
struct Placed {
    uri: String,
    matrix: String,
}

const SIZE: DVec2 = DVec2::new(900.0, 520.0);
const MARGIN: f64 = 24.0;
/// Longer side of the picture on the receiver, pixels.
const PICTURE_PX: u32 = 320;

impl Still {
    pub(super) fn of(model: &Model<'_>, fan: &RayFan, shaded: &GrayImage, caustic: &GrayImage) -> Self {
        let towards = -look(model);
        let right = towards.cross(DVec3::Y).normalize();
        let up = right.cross(towards);
        let flat = |p: DVec3| DVec2::new(p.dot(right), -p.dot(up));
        let (_, top) = model.surface.range_mm();
        let level = |z: f64| model.outline.iter().map(|p| p.extend(z)).collect::<Vec<_>>();
        let (entry, exit) = (level(model.entry_z_mm), level(model.rim_z_mm.unwrap_or(top)));
        let corners = window_corners(model.bench);
        let shown = entry.iter().chain(&exit).chain(&corners).map(|p| flat(*p));
        let rays: Vec<[DVec2; 4]> = fan.some().step_by(2).map(|ray| ray.map(flat)).collect();
        let (low, high) = shown
            .chain(rays.iter().flatten().copied())
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        let scale = ((SIZE - 2.0 * MARGIN) / (high - low).max(DVec2::splat(1e-9))).min_element();
        let size = (high - low) * scale + 2.0 * MARGIN;
        let place = |p: DVec2| (p - low) * scale + MARGIN;
        let path = |points: &[DVec2]| svg::path(points.iter().map(|p| place(*p)));
        let of_3d = |points: &[DVec3]| ring(points.iter().map(|p| place(flat(*p))));
        let n = entry.len();
        let mut faces = vec![of_3d(&entry)];
        faces.extend((0..n).map(|k| of_3d(&[entry[k], entry[(k + 1) % n], exit[(k + 1) % n], exit[k]])));
        let half = 0.5 * model.surface.extent().as_vec();
        // As the picture on the wall: left is +x, top is +y.
        let on_face = |x: f64, y: f64| (half * DVec2::new(x, y)).extend(top);
        let put = |picture: &GrayImage, corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|p| place(flat(p)));
            let (along, down) = ((b - a) / f64::from(picture.width()), (c - a) / f64::from(picture.height()));
            let matrix = [along.x, along.y, down.x, down.y, a.x, a.y].map(|v| format!("{v:.6}")).join(" ");
            Placed { uri: svg::png_uri(&DynamicImage::from(picture.clone())), matrix }
        };
        Self {
            width: Px(size.x),
            height: Px(size.y),
            rays: rays.iter().map(|ray| path(ray)).collect(),
            faces,
            face: put(shaded, [on_face(1.0, 1.0), on_face(-1.0, 1.0), on_face(1.0, -1.0)]),
            picture: put(&data::shrunk(caustic, PICTURE_PX), [corners[0], corners[1], corners[3]]),
            frame: of_3d(&corners),
        }
    }
}
