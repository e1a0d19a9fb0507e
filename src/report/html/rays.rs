//! A few rays from the light through the block to the receiver.

use super::Model;
use crate::{
    bench::{Bench, ExitFace},
    forward,
    light::Light,
    surface::SurfaceSpline,
};
use glam::{DVec2, DVec3};

/// Rays along each side: odd, so that some run in the middle.
const ACROSS: usize = 21;

/// Where a ray starts, enters and leaves the block, and lands, mm.
pub(super) type Ray = [DVec3; 4];

/// A lattice of rays across the block, edge to edge.
pub(super) struct RayFan {
    rays: Vec<Option<Ray>>,
}

impl RayFan {
    pub(super) fn of(spline: &SurfaceSpline, model: &Model<'_>) -> Self {
        let bench = model.bench;
        let light = bench.incidence();
        let lead_mm = lead_mm(model);
        let ray = |k: usize| {
            let place = bench.block().node(k % ACROSS, k / ACROSS, ACROSS, ACROSS);
            let face = spline.sample(place);
            let exit = place.extend(face.height_mm);
            let incoming = light.at(exit);
            let landing = bench.receiver().point(forward::land(&incoming, bench, exit, face.slope));
            let inside = incoming.direction;
            let (entry, outside) = match bench.exit_face() {
                ExitFace::Refracts { ior } => {
                    let entry = exit - inside * ((exit.z - model.entry_z_mm) / inside.z);
                    let tangential = ior * inside.truncate();
                    (entry, tangential.extend((1.0 - tangential.length_squared()).max(0.0).sqrt()))
                }
                ExitFace::Reflects => (exit, inside),
            };
            let start = match bench.light() {
                Light::Point { position_mm, .. } if bench.known_faces().is_empty() => position_mm,
                _ => entry - outside * lead_mm,
            };
            let ray = [start, entry, exit, landing];
            ray.iter().all(|point| point.is_finite()).then_some(ray)
        };
        Self { rays: (0..ACROSS * ACROSS).map(ray).collect() }
    }

    /// Every second ray of every second row, the outermost among them: more hide what they light.
    pub(super) fn some(&self) -> impl Iterator<Item = &Ray> {
        let rows = self.rays.chunks(ACROSS).step_by(2);
        rows.flat_map(|row| row.iter().step_by(2)).flatten()
    }

    /// Those that leave the block in its middle row or column.
    pub(super) fn middle(&self, along_x: bool) -> impl Iterator<Item = &Ray> {
        let at = move |k: usize| if along_x { ACROSS / 2 * ACROSS + k } else { k * ACROSS + ACROSS / 2 };
        (0..ACROSS).filter_map(move |k| self.rays[at(k)].as_ref())
    }
}

/// Whence block and picture are seen at first, from their middle: from behind the block and above,
/// as nearly along the light as leaves neither before the other, so that the face is not seen
/// edge-on.
pub(super) fn look(model: &Model<'_>) -> DVec3 {
    const PITCH: f64 = 0.32;
    /// Degrees off the axis. Nearer to it the bench looks shorter than it is.
    const YAWS: [f64; 8] = [40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0];
    let (_, top) = model.surface.range_mm();
    let ends = [model.entry_z_mm, model.rim_z_mm.unwrap_or(top)];
    let block: Vec<DVec3> = ends.iter().flat_map(|&z| model.outline.iter().map(move |p| p.extend(z))).collect();
    let picture = window_corners(model.bench);
    let direction = |yaw: f64| {
        let (sin, cos) = yaw.to_radians().sin_cos();
        DVec3::new(-sin * PITCH.cos(), PITCH.sin(), -cos * PITCH.cos())
    };
    let yaws = YAWS.iter().flat_map(|&yaw| [yaw, -yaw]);
    yaws.map(direction).find(|&eye| are_apart(&block, &picture, eye)).unwrap_or_else(|| direction(60.0))
}

/// Whether two things lie beside or above each other for an eye far away, with some room between.
fn are_apart(one: &[DVec3], other: &[DVec3], eye: DVec3) -> bool {
    let right = DVec3::Y.cross(eye).normalize();
    let range = |points: &[DVec3], axis: DVec3| {
        let along = points.iter().map(|p| p.dot(axis));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    [right, eye.cross(right)].into_iter().any(|axis| {
        let [(a, b), (c, d)] = [range(one, axis), range(other, axis)];
        (a - d).max(c - b) > 0.08 * (b - a)
    })
}

/// How much of parallel light is shown before it meets the block, mm.
fn lead_mm(model: &Model<'_>) -> f64 {
    if let [.., before, entry] = model.bench.known_faces() {
        return entry.z_mm - before.z_mm;
    }
    (0.2 * model.bench.distance_mm()).max(0.4 * model.bench.block().as_vec().max_element()) - model.entry_z_mm
}

/// The corners of the window on the receiver as its picture is seen: top left, top right, bottom
/// right, bottom left.
pub(super) fn window_corners(bench: &Bench) -> [DVec3; 4] {
    let half = 0.5 * bench.window().as_vec();
    // Left is +x, top is +y.
    [DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0), DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0)]
        .map(|corner| bench.receiver().point(bench.window_centre_mm() + corner * half))
}
