//! A solid on a bench: one front for the tracer of blocks and that of any solid.

use super::{
    block::{BlockTracer, FacetLines, Lattice, RayRow},
    path::{End, RayPath},
    row::Row,
    solid::SolidTracer,
};
use crate::{
    block::Block,
    mesh::Mesh,
    random::PhotonRandom,
    scene::{Optics, Scene, SceneError, SourceExtent, Window, in_range},
};
use glam::{DVec2, DVec3};

/// A solid on a bench, ready to be traced.
#[derive(Debug)]
pub struct Tracer {
    scene: Scene,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Block(Box<BlockTracer>),
    Solid(Box<SolidTracer>),
}

impl Tracer {
    /// Prepares a block, behind what its bench has before it: through the entry face, the exit face
    /// and the gap to the receiver, or from the light to the mirror and the receiver.
    ///
    /// # Errors
    /// A bench that cannot be, or no light on the block; for an entry face that is not planar flat
    /// triangles, or the normal-mapped plane.
    pub fn for_block(block: &Block, scene: &Scene) -> Result<Self, SceneError> {
        Self::for_row(&Row::behind(&scene.before, block), scene)
    }

    /// Prepares blocks in a row, from the light through one after the other to the receiver, whatever
    /// their bench has before them.
    ///
    /// # Errors
    /// As of [`for_block`](Self::for_block); a row that cannot be, blocks that meet, a mirror in a
    /// row.
    pub fn for_row(row: &Row<'_>, scene: &Scene) -> Result<Self, SceneError> {
        row.validate()?;
        scene.validate(&row.corners(&row.stands()).concat())?;
        if scene.optics == Optics::Reflects && row.blocks().len() > 1 {
            return Err(SceneError::Needs("a mirror stands alone: light does not go through it to another block"));
        }
        Ok(Self { scene: scene.clone(), kind: Kind::Block(Box::new(BlockTracer::new(row, scene)?)) })
    }

    /// The same light on its way, as it passes the plane across the axis at `z_mm` of the bench:
    /// before the receiver, beyond it, or between the blocks of a row, where z is negative. The
    /// blocks behind the plane are not in the way.
    ///
    /// # Errors
    /// [`SceneError::Plane`] for one that meets a block, or that lies before the first; a place or a
    /// window that cannot be; another solid than blocks.
    pub fn on_plane(&self, z_mm: f64, window: Window) -> Result<Self, SceneError> {
        in_range("the place of a plane (mm)", z_mm, -1e9, 1e9)?;
        window.validate()?;
        let Kind::Block(block) = &self.kind else {
            return Err(SceneError::Needs("only light behind a block can be seen on other planes than the receiver"));
        };
        let kind = Kind::Block(Box::new(block.on_plane(z_mm)?));
        let scene = Scene { distance_mm: z_mm, receiver_turned: DVec3::ZERO, window, ..self.scene.clone() };
        Ok(Self { scene, kind })
    }

    /// Prepares any sound solid: refraction anywhere, reflection inside, light that enters again.
    ///
    /// # Errors
    /// A bench that cannot be, a choice that only a block allows (mirror, spline, plane, turning,
    /// spread light, roughness), normals that the file has not, or no light.
    pub fn for_solid(mesh: &Mesh, scene: &Scene) -> Result<Self, SceneError> {
        let (lower, upper) = mesh.bounds();
        scene.validate(&Scene::corners(lower, upper))?;
        if scene.turned != DVec3::ZERO {
            return Err(SceneError::Needs("only a block can be turned on the bench"));
        }
        if !scene.before.is_empty() {
            return Err(SceneError::Needs("only a block is looked at behind other blocks"));
        }
        if scene.spread != SourceExtent::None || scene.roughness != 0.0 {
            return Err(SceneError::Needs(
                "only the light of a block can be spread, and only its exit face can be rough",
            ));
        }
        if scene.optics == Optics::Reflects {
            return Err(SceneError::Needs(
                "only a block can be a mirror: this solid has no exit face on a regular grid",
            ));
        }
        Ok(Self { scene: scene.clone(), kind: Kind::Solid(Box::new(SolidTracer::new(mesh, scene)?)) })
    }

    /// The bench.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The rectangle (least and greatest corner, mm) over which light is counted: the plan of the
    /// exit face of the first block (or of its entry face, if that is not planar), all of which is
    /// lit however oblique the light; of another solid, whatever
    /// of its lowest plane the light for any part of it passes.
    pub fn aperture_mm(&self) -> (DVec2, DVec2) {
        match &self.kind {
            Kind::Block(block) => block.aperture(),
            Kind::Solid(solid) => solid.aperture(),
        }
    }

    /// The part of the light for a block's exit face which comes to it by a side wall of the file's
    /// solid, or past a rim that shades it, and so is missing in the picture. Among what
    /// [`Flux::side`](crate::Flux::side) counts. 0 for other solids.
    pub fn vignetting(&self) -> f64 {
        match &self.kind {
            Kind::Block(block) => block.vignetting(),
            Kind::Solid(_) => 0.0,
        }
    }

    /// Follows the ray that passes `(x, y)` = `start_mm` in the plane of the lowest point of the
    /// solid (of a mirror, in the plane z = 0). Its power is not told: [`path_at`](Self::path_at)
    /// does.
    #[inline]
    pub fn path(&self, start_mm: DVec2) -> RayPath {
        match &self.kind {
            Kind::Block(block) => block.path(start_mm),
            Kind::Solid(solid) => solid.path(start_mm),
        }
    }

    /// Follows the ray that stands for the light at a point of the [aperture](Self::aperture_mm):
    /// in a block, the one that lights the exit face above `(x, y)` = `at_mm`.
    #[inline]
    pub fn path_at(&self, at_mm: DVec2) -> RayPath {
        match &self.kind {
            Kind::Block(block) => block.path_at(at_mm),
            Kind::Solid(solid) => solid.path_at(at_mm),
        }
    }

    /// Angle at which the light for a point `at_mm` of the [aperture](Self::aperture_mm) meets the
    /// normal of the first block's exit face, radians: in the glass, or before the mirror. None
    /// where no light comes, and in other solids.
    pub fn incidence_at(&self, at_mm: DVec2) -> Option<f64> {
        match &self.kind {
            Kind::Block(block) => block.incidence_at(at_mm),
            Kind::Solid(_) => None,
        }
    }

    /// How many blocks of a row light goes through; 1 for other solids.
    pub fn blocks(&self) -> usize {
        match &self.kind {
            Kind::Block(block) => block.blocks(),
            Kind::Solid(_) => 1,
        }
    }

    /// Makes ready what single rays need, before many ask for it at once.
    pub(crate) fn prepare(&self) {
        if let Kind::Block(block) = &self.kind {
            block.prepare();
        }
    }

    /// The same for beams, which ask less, and less still where it is known which part of the first
    /// face they meet.
    pub(crate) fn prepare_beams(&self, known: bool) {
        if let Kind::Block(block) = &self.kind {
            block.prepare_beams(known);
        }
    }

    /// What rows of rays at these places along x have in common, if [`path_row`](Self::path_row)
    /// can follow them.
    pub(crate) fn columns(&self, xs: &[f64]) -> Option<Lattice> {
        match &self.kind {
            Kind::Block(block) => block.columns(xs),
            Kind::Solid(_) => None,
        }
    }

    /// The paths of [`path_at`](Self::path_at) for a row of rays, up to rounding.
    pub(crate) fn path_row(&self, columns: &Lattice, y: f64, row: &mut RayRow) {
        if let Kind::Block(block) = &self.kind {
            block.path_row(columns, y, row);
        }
    }

    /// Follows light by the facets that it meets, where it is known which.
    pub(crate) fn facet_lines(&self) -> Option<FacetLines<'_>> {
        match &self.kind {
            Kind::Block(block) => block.facet_lines(),
            Kind::Solid(_) => None,
        }
    }

    /// Follows everything that the ray at a point of the aperture splits into. `sink` is told ends,
    /// the parts of the ray's power that arrive there, which sum to at most 1, and that power; the
    /// rest is light reflected out of the way. Returns the power. Light that is spread comes from
    /// where the random numbers say.
    #[inline]
    pub(crate) fn all_paths(&self, at_mm: DVec2, random: &PhotonRandom, mut sink: impl FnMut(End, f64, f64)) -> f64 {
        match &self.kind {
            Kind::Block(block) => {
                let path = block.followed_at(at_mm, random);
                sink(path.end, path.transmittance, path.power);
                path.power
            }
            Kind::Solid(solid) => {
                let power = solid.power_at(at_mm);
                solid.all_paths(at_mm, |end, part| sink(end, part, power));
                power
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_plate_shifts_the_light_and_a_turned_prism_bends_it_by_snells_law() {
        let (ior, distance, angle) = (1.5, 200.0, 0.03_f64);
        let window = Window { size_mm: DVec2::splat(20.0), centre_mm: DVec2::ZERO, nx: 8, ny: 8 };
        for slope in [0.0_f64, 0.1] {
            let heights = (0..25).map(|k| slope * (f64::from(k % 5) * 5.0 - 10.0)).collect();
            let block = Block::from_heights(DVec2::splat(20.0), -8.0, (5, 5), heights).unwrap();
            let mut scene = Scene::new(ior, distance, window);
            scene.turned = DVec3::new(0.0, angle, 0.0);
            let tracer = Tracer::for_block(&block, &scene).unwrap();
            let End::Receiver(landing) = tracer.path(DVec2::new(1.0, 2.0)).end else { panic!("no landing") };
            // By hand, in the plane of x and z: the turn takes +z towards +x.
            // From the normal of the entry face, towards -x of the block.
            let inside = (angle.sin() / ior).asin();
            // From the start on the entry face to the plane z = slope x of the exit face, in the
            // block's frame.
            let t = (8.0 + slope * 1.0) / (inside.cos() + slope * inside.sin());
            let (x, z) = (1.0 - t * inside.sin(), t * inside.cos() - 8.0);
            // The exit face's normal leans by the slope towards -x.
            let tilt = slope.atan();
            // From z of the block towards -x.
            let leaves = (ior * (inside - tilt).sin()).asin() + tilt;
            let (bench_x, bench_z) = (x * angle.cos() + z * angle.sin(), z * angle.cos() - x * angle.sin());
            let wanted = bench_x + (distance - bench_z) * (angle - leaves).tan();
            assert!((landing.x - wanted).abs() < 1e-9 && (landing.y - 2.0).abs() < 1e-9, "{landing} for {wanted}");
        }
    }
}
