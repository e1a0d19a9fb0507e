//! The light that falls on a face, told by the point of the face that it lights.
//!
//! Behind a planar entry face, and before a mirror, rays are counted over the plan of the exit face,
//! each with the flux that its part of the face gets: so all of the face is lit, however oblique or
//! wide the light is, and its border is where light ends. What reaches it by a side wall of the
//! file's solid instead of the entry face ends there. Before an entry face that is not planar rays
//! are counted over the plan of that.

use super::{body::Ray, imperfect::Finish, incident::IncidentFlux, tracer::BlockTracer};
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
    /// Flux per unit of area of the face's plan.
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
        if !self.body.block.covers(at) {
            return RayPath::DARK;
        }
        if self.even {
            return self.path(at);
        }
        let Some(lit) = self.lit(self.rays, at).filter(|lit| !self.is_hidden(lit)) else { return RayPath::DARK };
        self.follow(&lit, lit.point, lit.normal, None)
    }

    /// The same, but the way to the face is followed forwards, through the search structure, and
    /// light and face are as imperfect as the random numbers make them.
    #[inline]
    pub(in crate::trace) fn followed_at(&self, at: DVec2, random: &PhotonRandom) -> RayPath {
        if !self.body.block.covers(at) {
            return RayPath::DARK;
        }
        if self.even && self.imperfect.is_none() {
            return self.path(at);
        }
        let rays = self.imperfect.as_ref().map_or(self.rays, |i| self.illumination.in_block(i.rays(random)));
        let Some(lit) = self.lit(rays, at) else { return RayPath::DARK };
        if self.is_vignetted(&lit) {
            return self.follow(&lit, lit.point, lit.normal, None);
        }
        let direction = lit.arrival.direction;
        let met = match (&self.body.entry, self.body.optics) {
            (Some(_), _) => self.body.arrive(lit.point, direction),
            (None, Optics::Refracts { .. }) => self.body.exit(&SearchRay::new(lit.arrival.entered, direction)),
            (None, Optics::Reflects) => self.body.exit(&SearchRay::new(self.before(lit.point, direction), direction)),
        };
        let (point, normal) = match met {
            Ok((point, _)) if point.distance_squared(lit.point) > SAME_MM * SAME_MM => return RayPath::DARK,
            Ok(met) => met,
            // At the border the spline reaches beyond its triangles.
            Err(_) => (lit.point, lit.normal),
        };
        self.follow(&lit, point, normal, self.imperfect.as_ref().and_then(|i| i.finish(random)))
    }

    /// On from a point in the light, as it was found.
    #[inline]
    fn follow(&self, lit: &LitPoint, point: DVec3, normal: DVec3, finish: Option<Finish<'_>>) -> RayPath {
        let power = lit.flux / self.incident.mean;
        if self.is_vignetted(lit) {
            return RayPath { power, ..RayPath::ended(End::Side, 1.0) };
        }
        let Arrival { direction, transmittance, .. } = lit.arrival;
        let ray = Ray { point, direction, transmittance };
        let left = if self.body.entry.is_some() {
            self.body.enter(ray, normal, 0, finish).and_then(|inside| self.body.cross(inside, 0, finish))
        } else {
            self.body.leave(ray, finish.map_or(normal, |finish| finish.of_exit(0, normal, direction)))
        };
        RayPath { power, ..self.onwards(left, finish) }
    }

    /// Angle of the light above a point to the normal of the exit face where it meets that, radians.
    pub(in crate::trace) fn incidence_at(&self, at: DVec2) -> Option<f64> {
        let lit = self.lit(self.rays, at).filter(|lit| !self.is_hidden(lit))?;
        let Arrival { direction, transmittance, .. } = lit.arrival;
        let (direction, normal) = if self.body.entry.is_some() {
            let inside =
                self.body.enter(Ray { point: lit.point, direction, transmittance }, lit.normal, 0, None).ok()?;
            (inside.direction, self.body.exit(&SearchRay::new(inside.point, inside.direction)).ok()?.1)
        } else {
            (direction, lit.normal)
        };
        Some(direction.dot(normal).abs().min(1.0).acos())
    }

    /// How much light falls on the face.
    pub(super) fn incident(&self) -> IncidentFlux {
        let (lower, upper) = self.aperture();
        let size = upper - lower;
        let (mut sum, mut vignetted) = (0.0, 0.0);
        for j in 0..POINTS {
            let (mut row, mut row_vignetted) = (0.0, 0.0);
            for i in 0..POINTS {
                let place = (DVec2::new(i as f64, j as f64) + 0.5) / POINTS as f64;
                let Some(lit) = self.lit(self.rays, lower + place * size) else { continue };
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
        if !self.body.block.covers(at) {
            return None;
        }
        let ((point, facing, normal), arrival) = if let Some(entry) = &self.body.entry {
            let above = entry.above(at);
            (above, self.illumination.in_air(rays, above.0)?)
        } else if self.body.geometry == Geometry::NormalMappedPlane {
            let point = at.extend(0.0);
            ((point, DVec3::Z, self.body.exit.normal_above(at)), self.illumination.at(rays, point)?)
        } else {
            let above = self.body.exit.above(at);
            (above, self.illumination.at(rays, above.0)?)
        };
        let flux = arrival.flux * arrival.direction.dot(facing) / arrival.direction.z;
        (flux > 0.0).then_some(LitPoint { point, normal, arrival, flux })
    }

    /// Whether another part of the face is in the way of the light.
    #[inline]
    fn is_hidden(&self, lit: &LitPoint) -> bool {
        let direction = lit.arrival.direction;
        if self.body.entry.is_some() {
            return self.body.entry_is_hidden(lit.point, direction);
        }
        if self.body.geometry == Geometry::NormalMappedPlane || self.body.exit.search.is_steep(direction) {
            return false;
        }
        // Back from the face: out of the glass and into it again, or, before a mirror, into its
        // back.
        let leaves = matches!(self.body.optics, Optics::Refracts { .. });
        let back = SearchRay::new(lit.point, -direction);
        let before =
            self.body.exit.search.search(&back, |crossing| crossing.outwards == leaves && crossing.t > SAME_MM);
        before.is_some_and(|hit| self.body.block.covers(back.at(hit.crossing.t).truncate()))
    }

    /// Whether light comes to this point by a side wall of the solid, or past a rim that shades it.
    #[inline]
    fn is_vignetted(&self, lit: &LitPoint) -> bool {
        let Arrival { entered, direction, .. } = lit.arrival;
        self.body.entry.is_none() && self.body.is_vignetted(lit.point, entered, direction)
    }

    /// Where a ray begins that comes from the receiver's side to a point.
    #[inline]
    pub(super) fn before(&self, point: DVec3, direction: DVec3) -> DVec3 {
        point + direction * ((self.body.highest_mm + 1.0 - point.z) / direction.z)
    }
}
