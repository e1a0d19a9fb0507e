//! What a block does to a ray, whatever light it is of: the way from air to air, in the block's
//! frame.

use super::{
    hit::Hit,
    imperfect::Finish,
    search::FaceSearch,
    walls::{WALL_MM, in_rectangle},
};
use crate::{
    block::{Block, Relief, node_normals},
    scene::{Fresnel, Geometry, Optics, Scene, SceneError, Surface, Traversal},
    spline::Bicubic,
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
    /// How the exit face is understood.
    pub(super) face: Face,
    pub(super) exit: FaceSearch,
    /// The entry face, if light meets one that is not planar.
    pub(super) entry: Option<EntryRelief>,
    pub(super) highest_mm: f64,
}

#[derive(Debug)]
pub(super) enum Face {
    Spline(Arc<Bicubic>),
    /// Normals at the nodes.
    Smooth(Vec<DVec3>),
    /// Slopes at the nodes.
    Sloped(Arc<Vec<DVec2>>),
    Facets,
}

/// An entry face that is not planar.
#[derive(Debug)]
pub(super) struct EntryRelief {
    spline: Arc<Bicubic>,
    search: FaceSearch,
    lowest_mm: f64,
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
        let face = match scene.surface {
            Surface::Spline => Face::Spline(block.exit.spline()),
            Surface::Facets => Face::Facets,
            Surface::Smooth => match &block.slopes {
                Some(slopes) => Face::Sloped(Arc::clone(slopes)),
                None => Face::Smooth(node_normals(block)),
            },
        };
        let entry = match (&block.entry, optics) {
            (Some(relief), Optics::Refracts { .. }) => Some(EntryRelief::new(relief, scene)?),
            _ => None,
        };
        Ok(Self {
            optics,
            fresnel: scene.fresnel,
            geometry: scene.geometry,
            traversal: scene.traversal,
            face,
            exit: FaceSearch::new(&block.exit, scene.traversal, block.lowest_mm()),
            entry,
            highest_mm: block.height_range_mm().1,
            block: block.clone(),
        })
    }

    /// Builds the search structures.
    pub(super) fn prepare(&self) {
        self.exit.hierarchy();
        if let Some(entry) = &self.entry {
            entry.search.hierarchy();
        }
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
    fn arrive(&self, point: DVec3, direction: DVec3) -> Result<(DVec3, DVec3), End> {
        if direction.z <= 0.0 {
            return Err(End::Beside);
        }
        if let Some(entry) = &self.entry {
            return entry.arrive(point, direction);
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
                if self.entry.as_ref().is_some_and(|entry| entry.meets_again(point, inside.direction)) {
                    return ended(End::Side);
                }
                let transmittance = transmittance * transmitted(self.fresnel, &inside);
                Ok(Ray { point, direction: inside.direction, transmittance })
            }
            _ => ended(End::Side),
        }
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
                Ok((point, self.normal_above(point.truncate())))
            } else {
                Err(End::Side)
            };
        }
        if let (Face::Spline(spline), Traversal::Grid) = (&self.face, self.traversal)
            && ray.direction.truncate() == DVec2::ZERO
            && self.is_below(ray.origin.truncate())
        {
            // Straight up from a point below the face there is one crossing, and no triangle is
            // needed to find it.
            return on_spline(spline, ray, 0.0).ok_or(End::Lost);
        }
        let Some(hit) = self.exit.first_crossing(ray) else { return Err(self.miss(ray)) };
        if !self.block.covers(ray.at(hit.crossing.t).truncate()) {
            // By the wall of a block that is no rectangle, beyond which its grid goes on.
            return Err(if self.is_below(ray.origin.truncate()) { End::Side } else { End::Beside });
        }
        match &self.face {
            Face::Spline(spline) => on_spline(spline, ray, hit.crossing.t).ok_or(End::Lost),
            _ => Ok((ray.at(hit.crossing.t), self.flat_normal(&hit))),
        }
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
        if leaves_at.is_finite() && leaves_at.z <= self.height_above(leaves_at.truncate()) + margin {
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
        if self.geometry == Geometry::NormalMappedPlane || self.exit.is_steep(direction) {
            return false;
        }
        let ray = SearchRay::new(point, direction);
        let again = self.exit.search(&ray, |crossing| !crossing.outwards && crossing.t > AGAIN_MM);
        again.is_some_and(|hit| self.block.covers(ray.at(hit.crossing.t).truncate()))
    }

    fn height_above(&self, at: DVec2) -> f64 {
        let hit = self.exit.hit_at(at);
        let z = self.exit.nodes_of(&hit).map(|(i, j)| self.block.exit.node(i, j).z);
        hit.crossing.weights.dot(DVec3::from_array(z))
    }

    pub(super) fn normal_above(&self, at: DVec2) -> DVec3 {
        match &self.face {
            Face::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
            }
            _ => self.flat_normal(&self.exit.hit_at(at)),
        }
    }

    /// The normal at a point of a triangle: its own, or interpolated.
    #[inline]
    pub(super) fn flat_normal(&self, hit: &Hit) -> DVec3 {
        let nodes = self.exit.nodes_of(hit).map(|(i, j)| j * self.block.exit.nx + i);
        let w = hit.crossing.weights.to_array();
        match &self.face {
            Face::Smooth(normals) => {
                return (w[0] * normals[nodes[0]] + w[1] * normals[nodes[1]] + w[2] * normals[nodes[2]]).normalize();
            }
            Face::Sloped(slopes) => return (-mixed(slopes, nodes, w)).extend(1.0).normalize(),
            _ => {}
        }
        let [a, b, c] = self.exit.nodes_of(hit).map(|(i, j)| self.block.exit.node(i, j));
        (b - a).cross(c - a).normalize()
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

impl EntryRelief {
    fn new(relief: &Relief, scene: &Scene) -> Result<Self, SceneError> {
        if scene.geometry != Geometry::Displaced {
            return Err(SceneError::Needs(
                "the normal-mapped plane is for a block with a planar entry face: trace this one displaced",
            ));
        }
        if scene.surface != Surface::Spline {
            return Err(SceneError::Needs(
                "an entry face that is not planar is traced as a spline: ask for that surface, or trace the file as any solid",
            ));
        }
        let lowest_mm = relief.range_mm().0;
        let search = FaceSearch::new(relief, scene.traversal, lowest_mm - BEFORE_MM);
        Ok(Self { spline: relief.spline(), search, lowest_mm })
    }

    /// Where a ray in air meets the face, and the unit normal there.
    pub(super) fn arrive(&self, point: DVec3, direction: DVec3) -> Result<(DVec3, DVec3), End> {
        let before = point + direction * ((self.lowest_mm - BEFORE_MM - point.z) / direction.z);
        let ray = SearchRay::new(before, direction);
        let hit = self.search.first_crossing(&ray).ok_or(End::Beside)?;
        on_spline(&self.spline, &ray, hit.crossing.t).ok_or(End::Lost)
    }

    /// The face above a point of its plan: the point, and the normal of its shape, with z = 1.
    #[inline]
    pub(super) fn above(&self, at: DVec2) -> (DVec3, DVec3) {
        let jet = self.spline.jet(at.x, at.y);
        (at.extend(jet.z), DVec3::new(-jet.zx, -jet.zy, 1.0))
    }

    /// Whether light that comes to a point in air has met another part of the face before.
    pub(super) fn is_hidden(&self, point: DVec3, direction: DVec3) -> bool {
        // Back through air, out of glass.
        self.meets(point, -direction, true)
    }

    /// Whether light that has entered at a point leaves the glass by the same face.
    fn meets_again(&self, point: DVec3, direction: DVec3) -> bool {
        self.meets(point, direction, false)
    }

    fn meets(&self, point: DVec3, direction: DVec3, outwards: bool) -> bool {
        let ray = || SearchRay::new(point, direction);
        let other = |crossing: &Crossing| crossing.outwards == outwards && crossing.t > AGAIN_MM;
        !self.search.is_steep(direction) && self.search.search(&ray(), other).is_some()
    }
}

/// Slopes between three nodes.
#[inline(always)]
pub(super) fn mixed(slopes: &[DVec2], [a, b, c]: [usize; 3], [u, v, w]: [f64; 3]) -> DVec2 {
    u * slopes[a] + v * slopes[b] + w * slopes[c]
}

/// The point where a ray meets the spline, and the normal there: Newton's iteration for z(t) =
/// s(x(t), y(t)), from the triangle's `t`. A ray along the axis needs one evaluation. `None` where
/// the iteration does not converge.
#[inline]
fn on_spline(spline: &Bicubic, ray: &SearchRay, mut t: f64) -> Option<(DVec3, DVec3)> {
    let d = ray.direction;
    let normal = |zx: f64, zy: f64| DVec3::new(-zx, -zy, 1.0) / (1.0 + zx * zx + zy * zy).sqrt();
    if d.x == 0.0 && d.y == 0.0 {
        let jet = spline.jet(ray.origin.x, ray.origin.y);
        return Some((ray.origin.truncate().extend(jet.z), normal(jet.zx, jet.zy)));
    }
    let tolerance = 1e-13 * (1.0 + ray.origin.abs().max_element());
    for _ in 0..20 {
        let p = ray.at(t);
        let jet = spline.jet(p.x, p.y);
        let step = (jet.z - p.z) / (d.z - jet.zx * d.x - jet.zy * d.y);
        t += step;
        if step.abs() <= tolerance {
            return Some((ray.at(t), normal(jet.zx, jet.zy)));
        }
    }
    None
}

fn transmitted(fresnel: Fresnel, refraction: &Refraction) -> f64 {
    match fresnel {
        Fresnel::Off => 1.0,
        Fresnel::On => refraction.transmittance(),
    }
}
