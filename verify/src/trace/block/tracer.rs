//! A block on a bench, and the way of one ray through it: entry plane, exit face over a regular
//! grid, receiver.

use super::{
    hit::{Hierarchy, Hit},
    imperfect::Imperfect,
    incident::IncidentFlux,
    walls::in_rectangle,
};
use crate::{
    block::{Block, node_normals},
    scene::{Fresnel, Geometry, Optics, Scene, SceneError, Surface, Traversal},
    spline::Bicubic,
    trace::{
        accel::SearchRay,
        illumination::{Illumination, Rays},
        path::{End, RayPath},
        receiver::Receiver,
        refraction::{Refraction, RefractionOutcome, reflect, refract},
    },
};
use glam::{DMat3, DVec2, DVec3};
use std::sync::{Arc, OnceLock};

/// How far beyond the border of the face light may pass a rim above it, mm: that of the border
/// itself grazes the wall, and is straight to rounding only. No rim is made to a micrometre.
const GRAZE_MM: f64 = 1e-3;

/// A block with its light inside, its exit face and the search structure over the cells of that
/// face.
#[derive(Debug)]
pub(in crate::trace) struct BlockTracer {
    pub(super) block: Block,
    pub(super) optics: Optics,
    pub(super) receiver: Receiver,
    pub(super) fresnel: Fresnel,
    pub(super) geometry: Geometry,
    pub(super) traversal: Traversal,
    pub(super) face: Face,
    /// From the frame of the block to that of the bench, where they differ.
    pub(super) turned: Option<DMat3>,
    /// Ideal light, in the frame of the block, and how much of it there is.
    pub(super) rays: Rays,
    pub(super) illumination: Illumination,
    /// Whether every part of the exit face's plan gets the same light, which has come straight up
    /// to it.
    pub(super) even: bool,
    pub(super) incident: IncidentFlux,
    pub(super) imperfect: Option<Imperfect>,
    pub(super) cells_per_mm: DVec2,
    /// Greatest slope of the exit face: light that leaves steeper than this cannot meet the face
    /// again.
    pub(super) steepest: f64,
    pub(super) highest_mm: f64,
    /// Built when first needed, see [`BlockTracer::hierarchy`].
    pub(super) hierarchy: OnceLock<Hierarchy>,
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

impl BlockTracer {
    pub(in crate::trace) fn new(block: &Block, scene: &Scene) -> Result<Self, SceneError> {
        let illumination = Illumination::of(scene, block.entry_z);
        let rays = illumination.in_block(Rays::of(&scene.light));
        let up = match rays {
            Rays::Parallel(direction) => {
                if scene.sense() * direction.z <= 1e-3 {
                    let towards = if scene.sense() > 0.0 { "+z of the block" } else { "-z of the block" };
                    return Err(SceneError::Light { direction, towards });
                }
                direction.truncate() == DVec2::ZERO
            }
            Rays::From(_) => false,
        };
        let even = up && matches!(scene.optics, Optics::Refracts { .. }) && scene.profile.is_none();
        let face = match scene.surface {
            Surface::Spline => Face::Spline(block.spline()),
            Surface::Facets => Face::Facets,
            Surface::Smooth => match &block.slopes {
                Some(slopes) => Face::Sloped(Arc::clone(slopes)),
                None => Face::Smooth(node_normals(block)),
            },
        };
        let mut tracer = Self {
            optics: scene.optics,
            receiver: Receiver::of(scene),
            fresnel: scene.fresnel,
            geometry: scene.geometry,
            traversal: scene.traversal,
            face,
            turned: Scene::rotation(scene.turned),
            rays,
            illumination,
            even,
            incident: IncidentFlux { mean: 1.0, vignetted: 0.0 },
            imperfect: Imperfect::of(scene),
            cells_per_mm: DVec2::new((block.nx - 1) as f64, (block.ny - 1) as f64) / (block.upper - block.lower),
            steepest: steepest(block),
            highest_mm: block.height_range_mm().1,
            hierarchy: OnceLock::new(),
            block: block.clone(),
        };
        if !even {
            tracer.incident = tracer.incident();
            if tracer.incident.mean.is_nan() || tracer.incident.mean <= 0.0 {
                return Err(SceneError::Dark);
            }
        }
        Ok(tracer)
    }

    /// The part of the light for the exit face that meets a side wall, or a rim, before it.
    pub(in crate::trace) fn vignetting(&self) -> f64 {
        self.incident.vignetted
    }

    pub(in crate::trace) fn aperture(&self) -> (DVec2, DVec2) {
        (self.block.lower, self.block.upper)
    }

    #[inline]
    pub(in crate::trace) fn path(&self, start: DVec2) -> RayPath {
        let (origin, direction, transmittance) = match self.optics {
            Optics::Refracts { .. } => {
                let entered = start.extend(self.block.entry_z);
                let beside = if self.block.is_rectangular() {
                    !self.even && !in_rectangle(start, self.block.entry_face_mm())
                } else {
                    !self.block.enters(start)
                };
                if beside {
                    return RayPath::ended(End::Beside, 1.0);
                }
                let Some((inside, transmittance)) = self.illumination.enter(self.rays, entered) else {
                    return RayPath::ended(End::Beside, 1.0);
                };
                (entered, inside, transmittance)
            }
            Optics::Reflects => {
                let direction = self.rays.direction_at(start.extend(0.0));
                (self.before(start.extend(0.0), direction), direction, 1.0)
            }
        };
        match self.exit(&SearchRay::new(origin, direction)) {
            Ok((point, normal)) => self.leave(point, normal, direction, transmittance),
            Err(end) => RayPath::ended(end, transmittance),
        }
    }

    /// From the exit face, where light arrives along `direction`, to the receiver.
    #[inline]
    pub(super) fn leave(&self, point: DVec3, normal: DVec3, direction: DVec3, transmittance: f64) -> RayPath {
        let ended = |end| RayPath::ended(end, transmittance);
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
        let (point, direction) = self.turned.map_or((point, direction), |turned| (turned * point, turned * direction));
        match self.receiver.landing(point, direction) {
            Some(landing) => RayPath::ended(End::Receiver(landing), transmittance * passed),
            None => ended(End::Side),
        }
    }

    /// Where light leaves the glass, and the unit normal there.
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
        let Some(hit) = self.first_crossing(ray) else { return Err(self.miss(ray)) };
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
        at.cmpge(self.block.lower).all() && at.cmple(self.block.upper).all() && self.block.covers(at)
    }

    /// Why a ray inside the glass met no triangle of the exit face: it passed a side wall, or else
    /// it was lost.
    #[cold]
    fn miss(&self, ray: &SearchRay) -> End {
        let (lower, upper) = (self.block.lower, self.block.upper);
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
            let middle = 0.5 * (self.block.lower + self.block.upper);
            let from_middle = passes - middle;
            return !self.block.covers(passes - from_middle.clamp_length_max(GRAZE_MM));
        }
        !(passes.cmpge(self.block.lower - GRAZE_MM).all() && passes.cmple(self.block.upper + GRAZE_MM).all())
    }

    #[inline]
    fn meets_the_face_again(&self, point: DVec3, direction: DVec3) -> bool {
        if self.geometry == Geometry::NormalMappedPlane || self.is_steep(direction) {
            return false;
        }
        let ray = SearchRay::new(point, direction);
        let again = self.search(&ray, |crossing| !crossing.outwards && crossing.t > 1e-6);
        again.is_some_and(|hit| self.block.covers(ray.at(hit.crossing.t).truncate()))
    }

    /// Whether a ray runs so much along the axis that it crosses the face once at most.
    #[inline]
    pub(super) fn is_steep(&self, direction: DVec3) -> bool {
        direction.z.abs() > self.steepest * direction.truncate().length()
    }

    fn height_above(&self, at: DVec2) -> f64 {
        let hit = self.hit_at(at);
        let z = self.nodes_of(&hit).map(|(i, j)| self.block.node(i, j).z);
        hit.crossing.weights.dot(DVec3::from_array(z))
    }

    pub(super) fn normal_above(&self, at: DVec2) -> DVec3 {
        match &self.face {
            Face::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
            }
            _ => self.flat_normal(&self.hit_at(at)),
        }
    }

    /// The normal at a point of a triangle: its own, or interpolated.
    #[inline]
    pub(super) fn flat_normal(&self, hit: &Hit) -> DVec3 {
        let nodes = self.nodes_of(hit).map(|(i, j)| j * self.block.nx + i);
        let w = hit.crossing.weights.to_array();
        match &self.face {
            Face::Smooth(normals) => {
                return (w[0] * normals[nodes[0]] + w[1] * normals[nodes[1]] + w[2] * normals[nodes[2]]).normalize();
            }
            Face::Sloped(slopes) => return (-mixed(slopes, nodes, w)).extend(1.0).normalize(),
            _ => {}
        }
        let [a, b, c] = self.nodes_of(hit).map(|(i, j)| self.block.node(i, j));
        (b - a).cross(c - a).normalize()
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

/// A bound for the slope between any two points of the exit face, from its grid lines.
fn steepest(block: &Block) -> f64 {
    let spacing = (block.upper - block.lower) / DVec2::new((block.nx - 1) as f64, (block.ny - 1) as f64);
    let (mut along_x, mut along_y) = (0f64, 0f64);
    for j in 0..block.ny {
        let row = &block.heights[j * block.nx..(j + 1) * block.nx];
        row.windows(2).for_each(|w| along_x = along_x.max((w[1] - w[0]).abs()));
        if j + 1 < block.ny {
            let above = &block.heights[(j + 1) * block.nx..(j + 2) * block.nx];
            row.iter().zip(above).for_each(|(a, b)| along_y = along_y.max((b - a).abs()));
        }
    }
    // The spline may be steeper than its nodes suggest; this only decides whether to look.
    1.5 * (DVec2::new(along_x, along_y) / spacing).length()
}
