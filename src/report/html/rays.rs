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
                Light::Point { position_mm, .. } => position_mm,
                Light::Parallel { .. } => entry - outside * lead_mm,
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

/// How much of parallel light is shown before it meets the block, mm.
fn lead_mm(model: &Model<'_>) -> f64 {
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
