//! What a block does to a ray, whatever light it is of: the way from air to air, in the block's
//! frame.

use super::{
    face::{Face, Model, on_spline},
    imperfect::Finish,
    search::FaceSearch,
    walls::{WALL_MM, in_rectangle},
};
use crate::{
    block::{Block, Relief, node_normals},
    scene::{Fresnel, Geometry, Optics, Scene, SceneError, Surface, Traversal},
    trace::{
        accel::{Crossing, SearchRay},
        path::End,
        refraction::{Refraction, RefractionOutcome, reflect, refract},
        stand::Stand,
    },
};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// How far beyond the border of the face light may pass a rim above it, mm: that of the border
/// itself grazes the wall, and is straight to rounding only. No rim is made to a micrometre.
const GRAZE_MM: f64 = 1e-3;
/// How far before a face the way of a ray to it begins, mm.
const BEFORE_MM: f64 = 1.0;
/// A face that a ray meets nearer than this to where it begins is the one that it comes from, mm.
const AGAIN_MM: f64 = 1e-6;

/// A block as light finds it.
#[derive(Debug)]
pub(super) struct Body {
    pub(super) block: Block,
    pub(super) optics: Optics,
    pub(super) fresnel: Fresnel,
    pub(super) geometry: Geometry,
    pub(super) traversal: Traversal,
    pub(super) exit: Face,
    /// The entry face, if light meets one that is not planar.
    pub(super) entry: Option<Face>,
    lowest_mm: f64,
    pub(super) highest_mm: f64,
}

/// A ray behind a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) point: DVec3,
    /// Unit vector.
    pub(super) direction: DVec3,
    /// The part of its power that is left.
    pub(super) transmittance: f64,
}

impl Ray {
    /// The same ray in the frame in which its own stands so.
    #[inline]
    pub(super) fn on(self, stand: Option<&Stand>) -> Self {
        stand.map_or(self, |stand| Self {
            point: stand.point(self.point),
            direction: stand.direction(self.direction),
            ..self
        })
    }
}

impl Body {
    pub(super) fn new(block: &Block, scene: &Scene, optics: Optics) -> Result<Self, SceneError> {
        let lowest_mm = block.lowest_mm();
        let exit = match (scene.surface, &block.slopes) {
            (Surface::Spline, _) => Model::Spline(block.exit.spline()),
            (Surface::Facets, _) => Model::Facets,
            (Surface::Smooth, Some(slopes)) => Model::Sloped(Arc::clone(slopes)),
            (Surface::Smooth, None) => Model::Smooth(node_normals(block)),
        };
        let face = |model, relief, beyond| Face { model, search: FaceSearch::new(relief, scene.traversal, beyond) };
        let entry = match (&block.entry, optics) {
            (Some(relief), Optics::Refracts { .. }) => {
                Some(face(entry_model(relief, scene)?, relief, lowest_mm - BEFORE_MM))
            }
            _ => None,
        };
        Ok(Self {
            optics,
            fresnel: scene.fresnel,
            geometry: scene.geometry,
            traversal: scene.traversal,
            exit: face(exit, &block.exit, lowest_mm),
            entry,
            lowest_mm,
            highest_mm: block.height_range_mm().1,
            block: block.clone(),
        })
    }

    /// Builds the search structures.
    pub(super) fn prepare(&self) {
        [Some(&self.exit), self.entry.as_ref()].into_iter().flatten().for_each(|face| _ = face.search.hierarchy());
    }

    /// The way of a ray in air through all of the block: to the entry face, through the glass, out
    /// of the exit face. The number of the block among those that the light meets tells which
    /// random numbers a finish has.
    pub(super) fn through(&self, from: Ray, number: u32, finish: Option<Finish<'_>>) -> Result<Ray, (End, f64)> {
        let ended = |end| (end, from.transmittance);
        let (entered, normal) = self.arrive(from.point, from.direction).map_err(ended)?;
        let inside = self.enter(Ray { point: entered, ..from }, normal, number, finish)?;
        self.cross(inside, number, finish)
    }

    /// The way of a ray from the entry face through the exit face.
    pub(super) fn cross(&self, inside: Ray, number: u32, finish: Option<Finish<'_>>) -> Result<Ray, (End, f64)> {
        let Ray { point: entered, direction, transmittance } = inside;
        let ended = |end| (end, transmittance);
        let (point, normal) = self.exit(&SearchRay::new(entered, direction)).map_err(ended)?;
        if self.is_vignetted(point, entered, direction) {
            return Err(ended(End::Side));
        }
        let normal = finish.map_or(normal, |finish| finish.of_exit(number, normal, direction));
        self.leave(Ray { point, ..inside }, normal)
    }

    /// Where a ray in air meets the entry face, and the unit normal there.
    pub(super) fn arrive(&self, point: DVec3, direction: DVec3) -> Result<(DVec3, DVec3), End> {
        if direction.z <= 0.0 {
            return Err(End::Beside);
        }
        if let Some(entry) = &self.entry {
            let before = point + direction * ((self.lowest_mm - BEFORE_MM - point.z) / direction.z);
            let ray = SearchRay::new(before, direction);
            let hit = entry.search.first_crossing(&ray).ok_or(End::Beside)?;
            return Ok(entry.met(&ray, &hit));
        }
        let entry_z = self.block.entry_z;
        let at = (point + direction * ((entry_z - point.z) / direction.z)).truncate();
        let meets = if self.block.is_rectangular() {
            in_rectangle(at, self.block.entry_face_mm())
        } else {
            self.block.enters(at)
        };
        if meets { Ok((at.extend(entry_z), DVec3::Z)) } else { Err(End::Beside) }
    }

    /// Into the glass, from a point of the entry face to which a ray has come in air.
    pub(super) fn enter(
        &self,
        outside: Ray,
        normal: DVec3,
        number: u32,
        finish: Option<Finish<'_>>,
    ) -> Result<Ray, (End, f64)> {
        let Ray { point, direction, transmittance } = outside;
        let ended = |end| Err((end, transmittance));
        let Optics::Refracts { ior } = self.optics else { return ended(End::Side) };
        let normal = match (&self.entry, finish) {
            (Some(_), Some(finish)) => finish.of_entry(number, normal, direction),
            _ => normal,
        };
        match refract(direction, normal, 1.0 / ior) {
            RefractionOutcome::Refracted(inside) if inside.direction.z > 0.0 => {
                // By the same face out of the glass again.
                if self.meets_the_entry(point, inside.direction, false) {
                    return ended(End::Side);
                }
                let transmittance = transmittance * transmitted(self.fresnel, &inside);
                Ok(Ray { point, direction: inside.direction, transmittance })
            }
            _ => ended(End::Side),
        }
    }

    /// Whether light that comes through air to a point of an entry face with a relief has met another
    /// part of it before.
    pub(super) fn entry_is_hidden(&self, point: DVec3, direction: DVec3) -> bool {
        // Backwards, through air into the glass that the light has come through.
        self.meets_the_entry(point, -direction, true)
    }

    /// Whether a ray from a point of an entry face with a relief crosses it elsewhere: out of the air
    /// below, or out of the glass.
    fn meets_the_entry(&self, point: DVec3, direction: DVec3, out_of_air: bool) -> bool {
        let Some(Face { search, .. }) = self.entry.as_ref().filter(|entry| !entry.search.is_steep(direction)) else {
            return false;
        };
        let other = |crossing: &Crossing| crossing.outwards == out_of_air && crossing.t > AGAIN_MM;
        search.search(&SearchRay::new(point, direction), other).is_some()
    }

    /// From a point of the exit face, where light has come through the glass (or, before a mirror,
    /// through air), into the air behind.
    #[inline]
    pub(super) fn leave(&self, arrives: Ray, normal: DVec3) -> Result<Ray, (End, f64)> {
        let Ray { point, direction, transmittance } = arrives;
        let ended = |end| Err((end, transmittance));
        let (direction, passed) = match self.optics {
            Optics::Refracts { ior } => match refract(direction, normal, ior) {
                RefractionOutcome::Refracted(left) => (left.direction, transmitted(self.fresnel, &left)),
                RefractionOutcome::TotallyReflected => return ended(End::TotallyReflected),
            },
            Optics::Reflects if direction.dot(normal) < 0.0 => (reflect(direction, normal), 1.0),
            Optics::Reflects => return ended(End::Side),
        };
        if direction.z <= 0.0 || self.meets_the_face_again(point, direction) {
            return ended(End::Side);
        }
        if self.meets_the_rim(point, direction) {
            return ended(End::Side);
        }
        Ok(Ray { point, direction, transmittance: transmittance * passed })
    }

    /// Where light in the glass meets the exit face, and the unit normal there.
    #[inline]
    pub(super) fn exit(&self, ray: &SearchRay) -> Result<(DVec3, DVec3), End> {
        if self.geometry == Geometry::NormalMappedPlane {
            let point = ray.at(-ray.origin.z / ray.direction.z);
            return if self.is_below(point.truncate()) {
                Ok((point, self.exit.normal_above(point.truncate())))
            } else {
                Err(End::Side)
            };
        }
        if let (Model::Spline(spline), Traversal::Grid) = (&self.exit.model, self.traversal)
            && ray.direction.truncate() == DVec2::ZERO
            && self.is_below(ray.origin.truncate())
        {
            // Straight up from a point below the face there is one crossing, and no triangle is
            // needed to find it.
            return on_spline(spline, ray, 0.0).ok_or(End::Lost);
        }
        let Some(hit) = self.exit.search.first_crossing(ray) else { return Err(self.miss(ray)) };
        if !self.block.covers(ray.at(hit.crossing.t).truncate()) {
            // By the wall of a block that is no rectangle, beyond which its grid goes on.
            return Err(if self.is_below(ray.origin.truncate()) { End::Side } else { End::Beside });
        }
        Ok(self.exit.met(ray, &hit))
    }

    /// Whether the exit face reaches over a point.
    #[inline]
    fn is_below(&self, at: DVec2) -> bool {
        at.cmpge(self.block.exit.lower).all() && at.cmple(self.block.exit.upper).all() && self.block.covers(at)
    }

    /// Why a ray inside the glass met no triangle of the exit face: it passed a side wall, or else
    /// it was lost.
    #[cold]
    fn miss(&self, ray: &SearchRay) -> End {
        let (lower, upper) = (self.block.exit.lower, self.block.exit.upper);
        let d = ray.direction.truncate();
        // Distance to the wall that each component of the direction runs at.
        let wall = DVec2::select(d.cmpgt(DVec2::ZERO), upper, lower);
        let to_wall = (wall - ray.origin.truncate()) / d;
        let distances = to_wall.to_array().into_iter().filter(|t| t.is_finite() && *t >= 0.0);
        let leaves_at = ray.at(distances.fold(f64::INFINITY, f64::min));
        if !self.is_below(ray.origin.truncate()) {
            return End::Beside;
        }
        let margin = 1e-9 * (upper - lower).max_element();
        if leaves_at.is_finite() && leaves_at.z <= self.exit.height_above(leaves_at.truncate()) + margin {
            End::Side
        } else {
            End::Lost
        }
    }

    /// Whether light that has left the face at `point` hits the inner walls of a rim that stands
    /// above it.
    #[inline]
    pub(super) fn meets_the_rim(&self, point: DVec3, direction: DVec3) -> bool {
        let Some(top) = self.block.rim_z_mm().filter(|&z| z > point.z) else { return false };
        let passes = (point + direction * ((top - point.z) / direction.z)).truncate();
        if !self.block.is_rectangular() {
            // The outline is convex around its middle.
            let middle = 0.5 * (self.block.exit.lower + self.block.exit.upper);
            let from_middle = passes - middle;
            return !self.block.covers(passes - from_middle.clamp_length_max(GRAZE_MM));
        }
        !(passes.cmpge(self.block.exit.lower - GRAZE_MM).all() && passes.cmple(self.block.exit.upper + GRAZE_MM).all())
    }

    #[inline]
    fn meets_the_face_again(&self, point: DVec3, direction: DVec3) -> bool {
        if self.geometry == Geometry::NormalMappedPlane || self.exit.search.is_steep(direction) {
            return false;
        }
        let ray = SearchRay::new(point, direction);
        let again = self.exit.search.search(&ray, |crossing| !crossing.outwards && crossing.t > AGAIN_MM);
        again.is_some_and(|hit| self.block.covers(ray.at(hit.crossing.t).truncate()))
    }

    /// Whether light that meets the exit face at a point has come to it by a side wall of the solid,
    /// or past a rim that shades it.
    #[inline]
    pub(super) fn is_vignetted(&self, point: DVec3, entered: DVec3, direction: DVec3) -> bool {
        let block = &self.block;
        if self.optics == Optics::Reflects {
            return self.meets_the_rim(point, -direction);
        }
        let entered_z = entered.z;
        let entered = entered.truncate();
        if !block.is_rectangular() {
            if block.covers(entered) {
                return false;
            }
            // Through the rim: it must come in below its top.
            let back = || point.z + block.leaves_at(point.truncate(), entered) * (entered_z - point.z);
            return !block.enters(entered) || block.rim_z_mm().is_none_or(|top| back() > top + WALL_MM);
        }
        if in_rectangle(entered, (block.exit.lower, block.exit.upper)) {
            return false;
        }
        if !in_rectangle(entered, block.entry_face_mm()) {
            return true;
        }
        // Through the rim: it must come in below its top.
        let d = direction.truncate();
        let wall = DVec2::select(d.cmpgt(DVec2::ZERO), block.exit.lower, block.exit.upper);
        let back = ((point.truncate() - wall) / d).to_array();
        let back = back.into_iter().filter(|t| t.is_finite()).fold(f64::INFINITY, f64::min).max(0.0);
        block.rim_z_mm().is_some_and(|top| point.z - back * direction.z > top + WALL_MM)
    }
}

fn transmitted(fresnel: Fresnel, refraction: &Refraction) -> f64 {
    match fresnel {
        Fresnel::Off => 1.0,
        Fresnel::On => refraction.transmittance(),
    }
}

/// How an entry face that is not planar is understood.
fn entry_model(relief: &Relief, scene: &Scene) -> Result<Model, SceneError> {
    match (scene.geometry, scene.surface) {
        (Geometry::NormalMappedPlane, _) => Err(SceneError::Needs(
            "the normal-mapped plane is for a block with a planar entry face: trace this one displaced",
        )),
        (_, Surface::Facets) => Err(SceneError::Needs(
            "flat triangles are for a block with a planar entry face: trace this one as a spline or smooth, or its mesh as any solid",
        )),
        (_, Surface::Spline) => Ok(Model::Spline(relief.spline())),
        (_, Surface::Smooth) => Ok(Model::Smooth(relief.normals())),
    }
}
