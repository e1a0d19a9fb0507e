//! Where the camera of map mode stands: its rays are the rays of the light.

use crate::{
    block::Block,
    scene::{Light, Optics, Scene},
};
use glam::{DMat3, DVec2, DVec3};

/// A camera before the entry face of glass, or before a mirror. In parallel light it is
/// orthographic and looks along the light; at a point source it stands there, and looks along the
/// axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    /// Where it stands; an orthographic camera stands anywhere.
    pub(super) source: Option<DVec3>,
    /// Unit vector along which it looks.
    pub(super) forward: DVec3,
    /// Middle of the picture, in the plane that all starts of rays are counted in or, orthographic,
    /// across the light through it.
    pub(super) centre: DVec3,
    /// From the left to the right of the picture, and from its bottom to its top, mm. Across
    /// `forward`.
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    /// The plane z = const where rays are told by their places: the entry face, or the mean plane
    /// of a mirror.
    plane_mm: f64,
}

impl Camera {
    /// The camera of all of the block's plan.
    pub(super) fn of(block: &Block, scene: &Scene) -> Self {
        let plane_mm = match scene.optics {
            Optics::Refracts { .. } => block.entry_z,
            Optics::Reflects => 0.0,
        };
        let middle = (0.5 * (block.exit.lower + block.exit.upper)).extend(plane_mm);
        let (source, forward) = light(scene);
        let up = (DVec3::Y - forward.y * forward).normalize();
        let right = forward.cross(up);
        let half = [DVec2::new(1.0, 1.0), DVec2::new(1.0, -1.0)]
            .map(|corner| (0.5 * corner * block.size_mm()).extend(0.0))
            .map(|corner| DVec2::new(corner.dot(right), corner.dot(up)).abs());
        let size = 2.0 * half[0].max(half[1]);
        Self { source, forward, centre: middle, right: size.x * right, up: size.y * up, plane_mm }
    }

    /// Where the ray of a pixel passes the plane, mm.
    pub(super) fn start(&self, column: usize, row: usize, (nx, ny): (usize, usize)) -> DVec2 {
        let across = (column as f64 + 0.5) / nx as f64 - 0.5;
        let along = 0.5 - (row as f64 + 0.5) / ny as f64;
        let at = self.centre + across * self.right + along * self.up;
        (at + self.forward * ((self.plane_mm - at.z) / self.forward.z)).truncate()
    }

    /// The camera of parallel light, moved back along the light until all of it is before the
    /// block, and close to it.
    pub(super) fn location(&self, block: &Block) -> DVec3 {
        if let Some(source) = self.source {
            return source;
        }
        let highest = if self.forward.z > 0.0 { 0.0 } else { block.height_range_mm().1 - self.plane_mm };
        // The picture leans against the plane.
        let lean = 0.5 * (self.right.z.abs() + self.up.z.abs());
        let before = if self.forward.z > 0.0 { 10.0 } else { 1.0 };
        self.centre - self.forward * ((highest + lean + before) / self.forward.z.abs())
    }
}

/// The source of the light, if it has one, and the unit vector along which parallel light travels,
/// or the bench's axis.
pub(super) fn light(scene: &Scene) -> (Option<DVec3>, DVec3) {
    match scene.light {
        Light::Parallel { direction } => (None, direction.normalize()),
        Light::Point { position_mm, .. } => (Some(position_mm), DVec3::new(0.0, 0.0, scene.sense())),
    }
}

/// The part of the entry face (least and greatest corner, mm) by which light of image mode comes:
/// all of it but a strip along the walls that oblique light would meet from inside. Renderers would
/// follow what a wall reflects; to the verifier it ends there.
pub(super) fn hole(block: &Block, scene: &Scene) -> [DVec2; 2] {
    let (source, along) = light(scene);
    let high = block.height_range_mm().1 - block.entry_z;
    let aside = |at: DVec2| {
        let air = source.map_or(along, |source| (at.extend(block.entry_z) - source).normalize());
        let inside = air.truncate() / scene.ior();
        inside * (high / (1.0 - inside.length_squared()).sqrt())
    };
    let (lower, upper) = (block.exit.lower, block.exit.upper);
    let middle = source.map_or(0.5 * (lower + upper), |source| source.truncate().clamp(lower, upper));
    let from = DVec2::new(-aside(DVec2::new(lower.x, middle.y)).x, -aside(DVec2::new(middle.x, lower.y)).y);
    let to = DVec2::new(aside(DVec2::new(upper.x, middle.y)).x, aside(DVec2::new(middle.x, upper.y)).y);
    [lower + from.max(DVec2::ZERO), upper - to.max(DVec2::ZERO)]
}

/// Half the side of a square about the axis that is three times as wide as block and window, mm.
pub(super) fn reach_mm(block: &Block, scene: &Scene) -> f64 {
    let [from, to] = scene.window.corners_mm();
    3.0 * [block.exit.lower, block.exit.upper, from, to]
        .map(|corner| corner.abs().max_element())
        .into_iter()
        .fold(0.0, f64::max)
}

/// The receiver's axes in the bench's frame, as columns.
pub(super) fn receiver(scene: &Scene) -> DMat3 {
    Scene::rotation(scene.receiver_turned).unwrap_or(DMat3::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Window;

    #[test]
    fn pixels_are_those_of_the_camera_that_the_picture_is_taken_with() {
        let block = Block::from_heights(DVec2::new(30.0, 20.0), -8.0, (5, 4), vec![0.0; 20]).unwrap();
        let window = Window { size_mm: DVec2::ONE, centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
        let straight = Scene::new(1.5, 100.0, window);
        let pixels = (30, 20);
        // Straight light: the picture's left is +x, its top +y.
        let camera = Camera::of(&block, &straight);
        assert!((camera.start(0, 0, pixels) - DVec2::new(14.5, 9.5)).length() < 1e-12);
        assert!((camera.start(29, 19, pixels) + DVec2::new(14.5, 9.5)).length() < 1e-12);
        let source = DVec3::new(4.0, 2.0, 90.0);
        for light in [
            Light::parallel(DVec3::new(0.4, 0.3, -1.0)),
            Light::Point { position_mm: source, emission: Default::default(), axis: None },
        ] {
            let scene = Scene { light, ..Scene::mirror(100.0, window) };
            let camera = Camera::of(&block, &scene);
            assert!(camera.right.cross(camera.up).dot(camera.forward) < 0.0, "seen as by an eye");
            let location = camera.location(&block);
            for (column, row) in [(0, 0), (7, 13), (29, 19)] {
                // The camera's ray through the pixel passes the place that is told.
                let across = (column as f64 + 0.5) / 30.0 - 0.5;
                let along = 0.5 - (row as f64 + 0.5) / 20.0;
                let aside = across * camera.right + along * camera.up;
                let (from, direction) = match camera.source {
                    Some(source) => (source, camera.centre + aside - source),
                    None => (location + aside, camera.forward),
                };
                let at = from - direction * (from.z / direction.z);
                assert!((at.truncate() - camera.start(column, row, pixels)).length() < 1e-12);
                assert!(from.z > 0.5, "before the mirror");
            }
        }
    }
}
