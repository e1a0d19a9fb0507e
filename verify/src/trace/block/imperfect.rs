//! Light with an extent, and a face with a finish: what they make of the ray of one photon.

use crate::{
    random::{Dice, Draw},
    scene::{Scene, Spread},
    trace::illumination::{Rays, axis_of},
};
use glam::DVec3;

/// Light with an extent, a face with a finish.
#[derive(Clone, Copy, Debug)]
pub(super) struct Imperfect {
    spread: Spread,
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
        (spread != Spread::None || roughness != 0.0).then_some(Self { spread, rays, axis, roughness })
    }

    /// The light that one photon is of.
    pub(super) fn rays(&self, dice: &Dice) -> Rays {
        match self.rays {
            Rays::Parallel(direction) => Rays::Parallel(self.spread.direction(direction, dice)),
            Rays::From(source) => Rays::From(self.spread.place(source, self.axis, dice)),
        }
    }

    /// The normal that one photon finds. A facet that faces away from the light is not met by it.
    pub(super) fn rough(&self, normal: DVec3, direction: DVec3, dice: &Dice) -> DVec3 {
        if self.roughness == 0.0 {
            return normal;
        }
        let slopes = normal.truncate() / normal.z + self.roughness * dice.normal_pair(Draw::Finish);
        let rough = slopes.extend(1.0).normalize();
        if rough.dot(direction) * normal.dot(direction) > 0.0 { rough } else { normal }
    }
}
