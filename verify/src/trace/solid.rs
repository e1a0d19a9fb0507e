//! Tracing any closed solid: light enters, is refracted, reflected inside, leaves, and may enter
//! again.

use super::{
    accel::{Crossing, SearchRay},
    facets::{Facets, Found, Place, Turns, rectangle},
    illumination::{Rays, SourceFlux},
    path::{End, RayEnd, RayExit, RayPath},
    receiver::Receiver,
    reentry::ReentryTest,
    refraction::{RefractionOutcome, reflect, refract},
};
use crate::{
    mesh::{CornerNormals, Mesh},
    scene::{Fresnel, Geometry, Scene, SceneError, Surface},
};
use glam::{DVec2, DVec3};

/// Interfaces after which a path is given up: a trapped ray can go round for ever.
const MOST_INTERFACES: u32 = 24;
/// Branches weaker than this part of the incident power are not followed.
const LEAST_POWER: f64 = 1e-4;
/// See [`SolidTracer::nudged`].
const NUDGE_MM: f64 = 1e-7;

#[derive(Debug)]
pub(super) struct SolidTracer {
    ior: f64,
    fresnel: Fresnel,
    receiver: Receiver,
    rays: Rays,
    lower: DVec3,
    upper: DVec3,
    aperture: (DVec2, DVec2),
    /// How bright the light is, where that is not the same everywhere, and its mean over the
    /// aperture.
    strength: Option<(SourceFlux, f64)>,
    /// Triangles in the lowest plane, which no light that travels up can meet from above it.
    floor: Facets,
    /// The floor, where it fills a rectangle: its corners, two opposite ones outermost, as a
    /// triangle that faces down.
    rectangle: Option<[DVec3; 3]>,
    /// All others.
    rest: Facets,
    shades: Option<CornerNormals>,
    reentry: ReentryTest,
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
struct Leg {
    origin: DVec3,
    direction: DVec3,
    medium: Medium,
    power: f64,
    interfaces: u32,
    reflections: u32,
    /// Whether it began as a partial reflection.
    partial: bool,
    /// The triangle where it began.
    from: Option<Place>,
}

impl Leg {
    /// The first of a ray that begins outside.
    fn outside(origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin,
            direction,
            medium: Medium::Outside,
            power: 1.0,
            interfaces: 0,
            reflections: 0,
            partial: false,
            from: None,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Medium {
    Outside,
    Glass,
}

/// What happens at the end of a leg: at most one way on by refraction, one by reflection.
#[allow(clippy::large_enum_variant, reason = "a box would allocate at every interface")]
enum Next {
    Ended(End),
    Split { refracted: Option<Leg>, reflected: Option<Leg> },
}

impl SolidTracer {
    pub(super) fn new(mesh: &Mesh, scene: &Scene) -> Result<Self, SceneError> {
        match (scene.surface, scene.geometry) {
            (Surface::Spline, _) => {
                return Err(SceneError::Needs("the spline surface needs an exit face on a regular grid"));
            }
            (_, Geometry::NormalMappedPlane) => {
                return Err(SceneError::Needs("the normal-mapped plane needs an exit face on a regular grid"));
            }
            (Surface::Smooth, _) if mesh.normals.is_none() => {
                return Err(SceneError::Needs("smooth shading needs vertex normals, and the file has none"));
            }
            _ => {}
        }
        let (lower, upper) = mesh.bounds();
        let rays = Rays::of(&scene.light);
        let aperture = aperture(rays, lower, upper);
        let reach =
            2.0 * lower.abs().max(upper.abs()).max_element() + aperture.0.abs().max(aperture.1.abs()).max_element();
        let in_floor = |k: &u32| mesh.corners(*k as usize).iter().all(|v| v.z == lower.z);
        let (floor, rest): (Vec<u32>, Vec<u32>) = (0..mesh.triangles.len() as u32).partition(in_floor);
        // Normals are told by corner.
        let turns = if scene.surface == Surface::Smooth { Turns::Fixed } else { Turns::Free };
        let uneven = scene.profile.is_some() || matches!(rays, Rays::From(_));
        let mut strength = uneven.then(|| (SourceFlux::of(scene, lower.z), 1.0));
        if let Some((strength, mean)) = &mut strength {
            *mean = mean_flux(strength, rays, aperture, lower.z);
            if mean.is_nan() || *mean <= 0.0 {
                return Err(SceneError::Dark);
            }
        }
        Ok(Self {
            ior: scene.ior(),
            fresnel: scene.fresnel,
            receiver: Receiver::of(scene),
            rays,
            lower,
            upper,
            aperture,
            strength,
            rectangle: rectangle(mesh, &floor),
            floor: Facets::new(mesh, &floor, turns, reach),
            rest: Facets::new(mesh, &rest, turns, reach),
            shades: mesh.normals.clone().filter(|_| scene.surface == Surface::Smooth),
            reentry: ReentryTest::new(mesh),
        })
    }

    /// The least and the greatest corner, mm.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        (self.lower, self.upper)
    }

    pub(super) fn aperture(&self) -> (DVec2, DVec2) {
        self.aperture
    }

    fn first_leg(&self, start: DVec2) -> Leg {
        let (start, before) = match self.rays {
            Rays::Parallel(_) => (start.extend(self.lower.z), 1.0),
            Rays::From(source) => (start.extend(self.lower.z), (0.5 * (self.lower.z - source.z)).min(1.0)),
        };
        let direction = self.rays.direction_at(start);
        // A little before the aperture, so that a face in its plane is met.
        let origin = start - before * direction;
        Leg::outside(origin, direction)
    }

    pub(super) fn path(&self, start: DVec2) -> RayPath {
        let mut leg = self.first_leg(start);
        loop {
            let signature = leg.interfaces << 8 | leg.reflections;
            match self.follow(&leg) {
                Next::Ended(end) => return RayPath { signature, ..RayPath::ended(end, leg.power) },
                Next::Split { refracted, reflected } => match refracted.or(reflected) {
                    Some(next) => leg = next,
                    None => return RayPath { signature, ..RayPath::ended(End::Lost, leg.power) },
                },
            }
        }
    }

    /// Follows a ray from any place to where it leaves the solid for good.
    pub(super) fn ray(&self, origin: DVec3, direction: DVec3) -> RayExit {
        let outside = Leg::outside(origin, direction);
        let mut leg = Leg { medium: self.medium_at(&outside), ..outside };
        loop {
            let end = match self.follow(&leg) {
                Next::Ended(end) => end,
                Next::Split { refracted, reflected } => match refracted.or(reflected) {
                    Some(next) => {
                        leg = next;
                        continue;
                    }
                    None => End::Lost,
                },
            };
            let how = match end {
                End::Beside => RayEnd::Missed,
                End::Lost => RayEnd::Lost,
                // What did not come to an end in time is still in the glass, or goes in and out of it.
                End::TotallyReflected | End::Side if leg.interfaces >= MOST_INTERFACES => RayEnd::Trapped,
                _ => RayEnd::Left,
            };
            let Leg { origin: point_mm, direction, power: transmittance, interfaces, .. } = leg;
            return RayExit { how, point_mm, direction, transmittance, interfaces };
        }
    }

    /// Where a ray begins: in the glass if the first triangle before it faces away.
    fn medium_at(&self, leg: &Leg) -> Medium {
        let within = leg.origin.cmpge(self.lower).all() && leg.origin.cmple(self.upper).all();
        if !within {
            return Medium::Outside;
        }
        let first = |medium| self.search(&Leg { medium, interfaces: 1, ..*leg }).map(|found| found.crossing.t);
        match (first(Medium::Outside), first(Medium::Glass)) {
            (None, Some(_)) => Medium::Glass,
            (Some(entering), Some(leaving)) if leaving < entering => Medium::Glass,
            _ => Medium::Outside,
        }
    }

    /// How bright the light is at a point of the aperture; 1 on average.
    #[inline]
    pub(super) fn power_at(&self, at: DVec2) -> f64 {
        let Some((strength, mean)) = &self.strength else { return 1.0 };
        flux_through(strength, self.rays, at.extend(self.lower.z)) / mean
    }

    /// [`path`](Self::path) with its power.
    #[inline]
    pub(super) fn path_at(&self, at: DVec2) -> RayPath {
        RayPath { power: self.power_at(at), ..self.path(at) }
    }

    pub(super) fn all_paths(&self, start: DVec2, mut sink: impl FnMut(End, f64)) {
        if self.fresnel == Fresnel::Off {
            let path = self.path(start);
            return sink(path.end, path.transmittance);
        }
        let mut waiting = [None; MOST_INTERFACES as usize + 1];
        let mut depth = 0;
        let mut current = Some(self.first_leg(start));
        while let Some(leg) = current.take() {
            match self.follow(&leg) {
                // What partial reflection sends away from the receiver is reflected light, not a
                // fault of the solid.
                Next::Ended(End::Side) if leg.partial => {}
                Next::Ended(end) => sink(end, leg.power),
                Next::Split { refracted: Some(on), reflected } => {
                    current = Some(on);
                    // Weak reflections are left out of the sum and so count as reflected.
                    if let Some(back) = reflected.filter(|leg| leg.power >= LEAST_POWER && depth < waiting.len()) {
                        waiting[depth] = Some(back);
                        depth += 1;
                    }
                }
                Next::Split { refracted: None, reflected } => current = reflected,
            }
            if current.is_none() && depth > 0 {
                depth -= 1;
                current = waiting[depth].take();
            }
        }
    }

    /// Follows one leg to the next interface, or to its end.
    #[inline]
    fn follow(&self, leg: &Leg) -> Next {
        if leg.medium == Medium::Outside && leg.interfaces > 0 && self.reentry.rules_out(leg.origin, leg.direction) {
            return Next::Ended(self.land(leg));
        }
        let (leg, found) = match self.search(leg) {
            None if leg.medium == Medium::Glass => {
                let nudged = self.nudged(leg);
                (nudged, self.search(&nudged))
            }
            found => (*leg, found),
        };
        let Some(Found { triangle, place, crossing }) = found else {
            return Next::Ended(match leg.medium {
                Medium::Glass => End::Lost,
                Medium::Outside if leg.interfaces == 0 => End::Beside,
                Medium::Outside => self.land(&leg),
            });
        };
        if leg.interfaces >= MOST_INTERFACES {
            return Next::Ended(if leg.reflections > 0 { End::TotallyReflected } else { End::Side });
        }
        let direction = leg.direction;
        let [a, b, c] = self.corners(place);
        let facet = (b - a).cross(c - a).normalize();
        // Towards where the light goes.
        let onwards = if crossing.outwards { 1.0 } else { -1.0 };
        let mut normal = onwards * self.shading(triangle as usize, facet, crossing.weights);
        if normal.dot(direction) <= 0.0 {
            normal = onwards * facet;
        }
        let (eta, beyond) = match leg.medium {
            Medium::Outside => (1.0 / self.ior, Medium::Glass),
            Medium::Glass => (self.ior, Medium::Outside),
        };
        let point = leg.origin + crossing.t * direction;
        let on = |direction: DVec3, medium, power, reflections| Leg {
            origin: point,
            direction,
            medium,
            power,
            interfaces: leg.interfaces + 1,
            reflections,
            partial: leg.partial,
            from: Some(place),
        };
        // An interpolated normal may send a grazing ray through the facet: then the facet itself
        // reflects.
        let mirrored = || {
            let by_shading = reflect(direction, normal);
            if onwards * by_shading.dot(facet) < 0.0 { by_shading } else { reflect(direction, facet) }
        };
        match refract(direction, normal, eta) {
            RefractionOutcome::Refracted(refraction) if onwards * refraction.direction.dot(facet) > 0.0 => {
                let t = match self.fresnel {
                    Fresnel::Off => 1.0,
                    Fresnel::On => refraction.transmittance(),
                };
                let reflected = (t < 1.0).then(|| Leg {
                    partial: true,
                    ..on(mirrored(), leg.medium, leg.power * (1.0 - t), leg.reflections + 1)
                });
                Next::Split {
                    refracted: Some(on(refraction.direction, beyond, leg.power * t, leg.reflections)),
                    reflected,
                }
            }
            _ => Next::Split {
                refracted: None,
                reflected: Some(on(mirrored(), leg.medium, leg.power, leg.reflections + 1)),
            },
        }
    }

    /// The nearest triangle that faces the way the medium demands. Orientation, not distance, tells
    /// the interface just passed from the next one, so a step through a crease cannot be skipped or
    /// taken twice.
    #[inline]
    fn search(&self, leg: &Leg) -> Option<Found> {
        let leaves = leg.medium == Medium::Glass;
        // At a convex edge a ray in the glass may leave where it entered. A ray outside may not
        // enter where it left: it only touches the other face of that edge.
        let least_t = if leaves { -1e-9 } else { 1e-9 };
        let arrives = leg.interfaces == 0 && !leaves;
        if arrives && let Some(found) = self.enter_rectangle(leg) {
            return Some(found);
        }
        let ray = SearchRay::new(leg.origin, leg.direction);
        let above = leg.direction.z > 0.0 && leg.origin.z >= self.lower.z;
        let mut found = None;
        if !above {
            found = self.floor.nearest(&ray, leaves, least_t, found, Place::Floor);
            if found.is_some() && arrives {
                return found; // Nothing lies before the lowest plane.
            }
        }
        self.rest.nearest(&ray, leaves, least_t, found, Place::Rest)
    }

    /// The same leg begun 0.1 nm further inside. A hit point on an edge of the solid is rounded,
    /// and may come to lie outside, from where no triangle is left to be met.
    #[cold]
    fn nudged(&self, leg: &Leg) -> Leg {
        let Some(place) = leg.from else { return *leg };
        let [a, b, c] = self.corners(place);
        let inwards = (a + b + c) / 3.0 - leg.origin;
        let normal = (b - a).cross(c - a);
        let step = NUDGE_MM * (inwards.normalize_or_zero() - normal.normalize_or_zero());
        Leg { origin: leg.origin + step, ..*leg }
    }

    #[inline]
    fn corners(&self, place: Place) -> [DVec3; 3] {
        match place {
            Place::Rectangle => self.rectangle.unwrap_or_default(),
            Place::Floor(at) => self.floor.triangle(at),
            Place::Rest(at) => self.rest.triangle(at),
        }
    }

    /// Where light first meets a floor that needs no search.
    #[inline]
    fn enter_rectangle(&self, leg: &Leg) -> Option<Found> {
        let corners = self.rectangle.filter(|_| self.shades.is_none() && leg.direction.z > 0.0)?;
        let t = (corners[0].z - leg.origin.z) / leg.direction.z;
        let at = (leg.origin + t * leg.direction).truncate();
        let within = at.cmpge(corners[0].truncate()).all() && at.cmple(corners[2].truncate()).all();
        (within && t > 0.0).then(|| {
            let crossing = Crossing { t, weights: DVec3::splat(1.0 / 3.0), outwards: false };
            Found { triangle: 0, place: Place::Rectangle, crossing }
        })
    }

    fn shading(&self, triangle: usize, facet: DVec3, weights: DVec3) -> DVec3 {
        let Some(normals) = &self.shades else { return facet };
        let [a, b, c] = normals.corners[triangle].map(|n| normals.directions[n as usize]);
        let blended = weights.x * a + weights.y * b + weights.z * c;
        blended.try_normalize().filter(|n| n.dot(facet) > 0.0).unwrap_or(facet)
    }

    fn land(&self, leg: &Leg) -> End {
        self.receiver.landing(leg.origin, leg.direction).map_or(End::Side, End::Receiver)
    }
}

/// The rectangle of the lowest plane that holds everything which light can meet, projected along
/// its rays.
fn aperture(rays: Rays, lower: DVec3, upper: DVec3) -> (DVec2, DVec2) {
    match rays {
        Rays::Parallel(light) => {
            let shift = -(upper.z - lower.z) / light.z * light.truncate();
            (lower.truncate().min(lower.truncate() + shift), upper.truncate().max(upper.truncate() + shift))
        }
        Rays::From(source) => {
            let shrunk = (lower.z - source.z) / (upper.z - source.z);
            let top = |corner: DVec3| source.truncate() + (corner - source).truncate() * shrunk;
            (lower.truncate().min(top(lower)), upper.truncate().max(top(upper)))
        }
    }
}

/// Flux per unit of area of the plane z = const through a point.
#[inline]
fn flux_through(strength: &SourceFlux, rays: Rays, at: DVec3) -> f64 {
    strength.across(rays, at) * rays.direction_at(at).z
}

/// Points along each side of the aperture from which its mean is taken.
const POINTS: usize = 128;

fn mean_flux(strength: &SourceFlux, rays: Rays, (lower, upper): (DVec2, DVec2), z: f64) -> f64 {
    let place = |i: usize, j: usize| (DVec2::new(i as f64, j as f64) + 0.5) / POINTS as f64;
    let row = |j: usize| -> f64 {
        let at = |i: usize| (lower + place(i, j) * (upper - lower)).extend(z);
        (0..POINTS).map(|i| flux_through(strength, rays, at(i))).sum()
    };
    (0..POINTS).map(row).sum::<f64>() / (POINTS * POINTS) as f64
}
