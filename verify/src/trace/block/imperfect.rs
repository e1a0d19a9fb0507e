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

    /// What the finish of faces makes of one photon.
    pub(super) fn finish<'a>(&self, random: &'a PhotonRandom) -> Option<Finish<'a>> {
        (self.roughness != 0.0).then_some(Finish { roughness: self.roughness, random })
    }
}

/// The finish of faces, as one photon finds it: independent on each of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish<'a> {
    roughness: f64,
    random: &'a PhotonRandom,
}

impl Finish<'_> {
    /// The normal of the exit face of a block, counted from 0.
    pub(super) fn of_exit(&self, block: u32, normal: DVec3, direction: DVec3) -> DVec3 {
        self.rough(2 * block, normal, direction)
    }

    /// The normal of its entry face, if that is not planar.
    pub(super) fn of_entry(&self, block: u32, normal: DVec3, direction: DVec3) -> DVec3 {
        self.rough(2 * block + 1, normal, direction)
    }

    /// A facet that faces away from the light is not met by it.
    fn rough(&self, face: u32, normal: DVec3, direction: DVec3) -> DVec3 {
        let slopes = normal.truncate() / normal.z + self.roughness * self.random.normal_pair(Purpose::Finish(face));
        let rough = slopes.extend(1.0).normalize();
        if rough.dot(direction) * normal.dot(direction) > 0.0 { rough } else { normal }
    }
}
