//! The light that falls on the exit face, told by the point of the face that it lights.
//!
//! Rays are counted over the plan of the exit face, each with the flux that its part of the face
//! gets: so all of the face is lit, however oblique or wide the light is, and its border is where
//! light ends. What reaches it by a side wall of the file's solid instead of the entry face ends
//! there.

use super::{
    incident::IncidentFlux,
    tracer::{BlockTracer, Face},
    walls::{WALL_MM, in_rectangle},
};
use crate::{
    random::PhotonRandom,
    scene::{Geometry, Optics},
    trace::{
        accel::SearchRay,
        illumination::{Arrival, Rays},
        path::{End, RayPath},
    },
};
use glam::{DVec2, DVec3};

/// A point of the face in the light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitPoint {
    point: DVec3,
    /// Unit normal that turns the light.
    normal: DVec3,
    arrival: Arrival,
    /// Flux per unit of area of the face's plan, less what [`Spent`] says.
    flux: f64,
}

/// Points of the quadrature along each side.
const POINTS: usize = 128;
/// Two crossings nearer to each other than this are one, mm.
const SAME_MM: f64 = 1e-6;
impl BlockTracer {
    /// The ray of ideal light that lights the face above a point of its plan.
    #[inline]
    pub(in crate::trace) fn path_at(&self, at: DVec2) -> RayPath {
        if !self.block.covers(at) {
            return RayPath::DARK;
        }
        if self.even {
            return self.path(at);
        }
        let Some(lit) = self.lit(self.rays, at).filter(|lit| !self.is_hidden(lit)) else { return RayPath::DARK };
        let power = lit.flux / self.incident.mean;
        if self.is_vignetted(&lit) {
            return RayPath { power, ..RayPath::ended(End::Side, 1.0) };
        }
        RayPath { power, ..self.leave(lit.point, lit.normal, lit.arrival.direction, lit.arrival.transmittance) }
    }

    /// The same, but the way to the face is followed forwards, through the search structure, and
    /// light and face are as imperfect as the random numbers make them.
    #[inline]
    pub(in crate::trace) fn followed_at(&self, at: DVec2, random: &PhotonRandom) -> RayPath {
        if !self.block.covers(at) {
            return RayPath::DARK;
        }
        if self.even && self.imperfect.is_none() {
            return self.path(at);
        }
        let rays = self.imperfect.as_ref().map_or(self.rays, |i| self.illumination.in_block(i.rays(random)));
        let Some(lit) = self.lit(rays, at) else { return RayPath::DARK };
        let power = lit.flux / self.incident.mean;
        if self.is_vignetted(&lit) {
            return RayPath { power, ..RayPath::ended(End::Side, 1.0) };
        }
        let direction = lit.arrival.direction;
        let origin = match self.optics {
            Optics::Refracts { .. } => lit.arrival.entered,
            Optics::Reflects => self.before(lit.point, direction),
        };
        let (point, normal) = match self.exit(&SearchRay::new(origin, direction)) {
            Ok((point, _)) if point.distance_squared(lit.point) > SAME_MM * SAME_MM => return RayPath::DARK,
            Ok(met) => met,
            // At the border the spline reaches beyond its triangles.
            Err(_) => (lit.point, lit.normal),
        };
        let normal = self.imperfect.as_ref().map_or(normal, |i| i.rough(normal, direction, random));
        RayPath { power, ..self.leave(point, normal, direction, lit.arrival.transmittance) }
    }

    /// Angle of the light above a point to the normal of the face there, radians.
    pub(in crate::trace) fn incidence_at(&self, at: DVec2) -> Option<f64> {
        let lit = self.lit(self.rays, at).filter(|lit| !self.is_hidden(lit))?;
        Some(lit.arrival.direction.dot(lit.normal).abs().min(1.0).acos())
    }

    /// How much light falls on the face.
    pub(super) fn incident(&self) -> IncidentFlux {
        let size = self.block.upper - self.block.lower;
        let (mut sum, mut vignetted) = (0.0, 0.0);
        for j in 0..POINTS {
            let (mut row, mut row_vignetted) = (0.0, 0.0);
            for i in 0..POINTS {
                let place = (DVec2::new(i as f64, j as f64) + 0.5) / POINTS as f64;
                let Some(lit) = self.lit(self.rays, self.block.lower + place * size) else { continue };
                row += lit.flux;
                row_vignetted += if self.is_vignetted(&lit) { lit.flux } else { 0.0 };
            }
            sum += row;
            vignetted += row_vignetted;
        }
        IncidentFlux { mean: sum / (POINTS * POINTS) as f64, vignetted: if sum > 0.0 { vignetted / sum } else { 0.0 } }
    }

    /// The face above a point of its plan, in the light of these rays. None where it faces away
    /// from them.
    #[inline]
    fn lit(&self, rays: Rays, at: DVec2) -> Option<LitPoint> {
        if !self.block.covers(at) {
            return None;
        }
        let (point, facing, normal) = self.face_above(at);
        let arrival = self.illumination.at(rays, point)?;
        let flux = arrival.flux * arrival.direction.dot(facing) / arrival.direction.z;
        (flux > 0.0).then_some(LitPoint { point, normal, arrival, flux })
    }

    /// A point of the face, the normal of its shape (with z = 1), and the unit normal that turns
    /// light.
    #[inline]
    fn face_above(&self, at: DVec2) -> (DVec3, DVec3, DVec3) {
        if self.geometry == Geometry::NormalMappedPlane {
            return (at.extend(0.0), DVec3::Z, self.normal_above(at));
        }
        match &self.face {
            Face::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                let facing = DVec3::new(-jet.zx, -jet.zy, 1.0);
                (at.extend(jet.z), facing, facing.normalize())
            }
            _ => {
                let hit = self.hit_at(at);
                let [a, b, c] = self.nodes_of(&hit).map(|(i, j)| self.block.node(i, j));
                let facing = (b - a).cross(c - a);
                let z = hit.crossing.weights.dot(DVec3::new(a.z, b.z, c.z));
                (at.extend(z), facing / facing.z, self.flat_normal(&hit))
            }
        }
    }

    /// Whether another part of the face is in the way of the light.
    #[inline]
    fn is_hidden(&self, lit: &LitPoint) -> bool {
        let direction = lit.arrival.direction;
        if self.geometry == Geometry::NormalMappedPlane || self.is_steep(direction) {
            return false;
        }
        // Back from the face: out of the glass and into it again, or, before a mirror, into its
        // back.
        let leaves = matches!(self.optics, Optics::Refracts { .. });
        let back = SearchRay::new(lit.point, -direction);
        let before = self.search(&back, |crossing| crossing.outwards == leaves && crossing.t > SAME_MM);
        before.is_some_and(|hit| self.block.covers(back.at(hit.crossing.t).truncate()))
    }

    /// Whether light comes to this point by a side wall of the solid, or past a rim that shades it.
    #[inline]
    fn is_vignetted(&self, lit: &LitPoint) -> bool {
        let (point, entered, direction) = (lit.point, lit.arrival.entered, lit.arrival.direction);
        let block = &self.block;
        if self.optics == Optics::Reflects {
            return self.meets_the_rim(point, -direction);
        }
        let entered = entered.truncate();
        if !block.is_rectangular() {
            if block.covers(entered) {
                return false;
            }
            // Through the rim: it must come in below its top.
            let back = || point.z + block.leaves_at(point.truncate(), entered) * (lit.arrival.entered.z - point.z);
            return !block.enters(entered) || block.rim_z_mm().is_none_or(|top| back() > top + WALL_MM);
        }
        if in_rectangle(entered, (block.lower, block.upper)) {
            return false;
        }
        if !in_rectangle(entered, block.entry_face_mm()) {
            return true;
        }
        // Through the rim: it must come in below its top.
        let d = direction.truncate();
        let wall = DVec2::select(d.cmpgt(DVec2::ZERO), block.lower, block.upper);
        let back = ((point.truncate() - wall) / d).to_array();
        let back = back.into_iter().filter(|t| t.is_finite()).fold(f64::INFINITY, f64::min).max(0.0);
        block.rim_z_mm().is_some_and(|top| point.z - back * direction.z > top + WALL_MM)
    }

    /// Where a ray begins that comes from the receiver's side to a point.
    #[inline]
    pub(super) fn before(&self, point: DVec3, direction: DVec3) -> DVec3 {
        point + direction * ((self.highest_mm + 1.0 - point.z) / direction.z)
    }
}
