//! Light with an extent, and a face with a finish: what they make of the ray of one photon.

use crate::{
    random::{PhotonRandom, Purpose},
    scene::{Scene, SourceExtent},
    trace::illumination::{Rays, axis_of},
};
use glam::DVec3;

/// Light with an extent, a face with a finish.
#[derive(Clone, Copy, Debug)]
pub(super) struct Imperfect {
    spread: SourceExtent,
    /// Ideal light, in the bench's frame.
    rays: Rays,
    axis: DVec3,
    roughness: f64,
}

impl Imperfect {
    /// None on an ideal bench.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let Scene { spread, roughness, .. } = *scene;
        let (rays, axis) = (Rays::of(&scene.light), axis_of(scene));
        (spread != SourceExtent::None || roughness != 0.0).then_some(Self { spread, rays, axis, roughness })
    }

    /// The light that one photon is of.
    pub(super) fn rays(&self, random: &PhotonRandom) -> Rays {
        match self.rays {
            Rays::Parallel(direction) => Rays::Parallel(self.spread.direction(direction, random)),
            Rays::From(source) => Rays::From(self.spread.place(source, self.axis, random)),
        }
    }

    /// The normal that one photon finds. A facet that faces away from the light is not met by it.
    pub(super) fn rough(&self, normal: DVec3, direction: DVec3, random: &PhotonRandom) -> DVec3 {
        if self.roughness == 0.0 {
            return normal;
        }
        let slopes = normal.truncate() / normal.z + self.roughness * random.normal_pair(Purpose::Finish);
        let rough = slopes.extend(1.0).normalize();
        if rough.dot(direction) * normal.dot(direction) > 0.0 { rough } else { normal }
    }
}
