//! Following rays of light through a solid to the receiver.

mod block;
mod facets;
mod gate;
mod solid;

use crate::{
    block::Block,
    mesh::Mesh,
    scene::{Scene, SceneError},
};
use glam::DVec2;

/// How the way of a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// On the receiver plane, at this point, mm.
    Receiver(DVec2),
    /// At an interface, beyond the critical angle. (Traced as a full solid: after too many reflections inside.)
    TotallyReflected,
    /// At a side wall, or at the solid again after leaving it. (Traced as a full solid: anywhere but on the receiver.)
    Side,
    /// Past the solid without touching it.
    Beside,
    /// Nowhere: the tracer failed. Never happens with a sound solid.
    Lost,
}

/// Where a ray goes, following refraction wherever it is possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// How it ends.
    pub end: End,
    /// The part of its power that arrives there; the rest is reflected on the way.
    pub transmittance: f64,
    /// Rays of different signature took different kinds of ways: the map from aperture to receiver tears between them.
    pub(crate) signature: u32,
}

/// A solid on a bench, ready to be traced.
#[derive(Debug)]
pub struct Tracer {
    scene: Scene,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Block(Box<block::BlockTracer>),
    Solid(Box<solid::SolidTracer>),
}

impl Tracer {
    /// Prepares a block: straight through the entry face, the exit face and the gap to the receiver.
    ///
    /// # Errors
    /// A bench that cannot be, or [`Surface::Smooth`](crate::Surface::Smooth) without enough nodes.
    pub fn for_block(block: &Block, scene: &Scene) -> Result<Self, SceneError> {
        scene.validate(block.height_range_mm().1)?;
        Ok(Self { scene: *scene, kind: Kind::Block(Box::new(block::BlockTracer::new(block, scene)?)) })
    }

    /// Prepares any sound solid: refraction anywhere, reflection inside, light that enters again.
    ///
    /// # Errors
    /// A bench that cannot be, a choice that only a block allows (spline, plane), or normals that the file has not.
    pub fn for_solid(mesh: &Mesh, scene: &Scene) -> Result<Self, SceneError> {
        scene.validate(mesh.bounds().1.z)?;
        Ok(Self { scene: *scene, kind: Kind::Solid(Box::new(solid::SolidTracer::new(mesh, scene)?)) })
    }

    /// The bench.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The rectangle (least and greatest corner, mm) which the light fills evenly, in the plane of the lowest point of
    /// the solid.
    pub fn aperture_mm(&self) -> (DVec2, DVec2) {
        match &self.kind {
            Kind::Block(block) => block.aperture(),
            Kind::Solid(solid) => solid.aperture(),
        }
    }

    /// Follows the ray that passes `(x, y)` = `start_mm` in the plane of the aperture.
    #[inline]
    pub fn path(&self, start_mm: DVec2) -> Path {
        match &self.kind {
            Kind::Block(block) => block.path(start_mm),
            Kind::Solid(solid) => solid.path(start_mm),
        }
    }

    /// Follows everything that a ray splits into. `sink` is told ends and powers, which sum to at most 1; the rest is
    /// light reflected out of the way.
    #[inline]
    pub(crate) fn all_paths(&self, start_mm: DVec2, mut sink: impl FnMut(End, f64)) {
        match &self.kind {
            Kind::Block(block) => {
                let path = block.path(start_mm);
                sink(path.end, path.transmittance);
            }
            Kind::Solid(solid) => solid.all_paths(start_mm, sink),
        }
    }
}
