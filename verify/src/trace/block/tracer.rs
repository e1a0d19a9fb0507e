//! Blocks in a row on a bench, and the way of one ray through them to the receiver.

use super::{
    body::{Body, Ray},
    imperfect::{Finish, Imperfect},
    incident::IncidentFlux,
    walls::in_rectangle,
};
use crate::{
    scene::{Optics, Scene, SceneError, Traversal},
    trace::{
        accel::SearchRay,
        illumination::{Illumination, Rays},
        path::{End, RayPath},
        receiver::Receiver,
        row::{Row, span},
        stand::Stand,
    },
};
use glam::{DVec2, DVec3};
use std::{f64::consts::FRAC_PI_2, sync::Arc};

/// The block that light meets first with its light inside, those behind it, and the receiver.
#[derive(Clone, Debug)]
pub(in crate::trace) struct BlockTracer {
    pub(super) body: Arc<Body>,
    /// How it stands on the bench, where its frame is not the bench's.
    pub(super) stand: Option<Stand>,
    /// The blocks behind it.
    pub(super) later: Vec<Later>,
    pub(super) receiver: Receiver,
    /// Ideal light, in the frame of the block, and how much of it there is.
    pub(super) rays: Rays,
    pub(super) illumination: Illumination,
    /// Whether every part of the exit face's plan gets the same light, which has come straight up
    /// to it.
    pub(super) even: bool,
    pub(super) incident: IncidentFlux,
    pub(super) imperfect: Option<Imperfect>,
    /// Least and greatest z of every block on the bench, mm.
    spans: Vec<(f64, f64)>,
}

/// A block behind another.
#[derive(Clone, Debug)]
pub(super) struct Later {
    body: Arc<Body>,
    /// How it stands on the bench, and how the bench stands to it.
    stand: Stand,
    bench: Stand,
}

impl BlockTracer {
    pub(in crate::trace) fn new(row: &Row<'_>, scene: &Scene) -> Result<Self, SceneError> {
        let turned = Scene::rotation(scene.turned).map(|turn| Stand { turn, shift: DVec3::ZERO });
        let stands = row.stands().into_iter().map(|stand| turned.map_or(stand, |turned| stand.within(&turned)));
        let stands: Vec<Stand> = stands.collect();
        let optics = |ior: Option<f64>| match (scene.optics, ior) {
            (Optics::Refracts { .. }, Some(ior)) => Optics::Refracts { ior },
            (optics, _) => optics,
        };
        let bodies = row.blocks().iter().map(|of| Ok(Arc::new(Body::new(of.block, scene, optics(of.ior))?)));
        let mut bodies = bodies.collect::<Result<Vec<_>, SceneError>>()?.into_iter();
        let Some(body) = bodies.next() else { return Err(SceneError::Needs("a row has one block at least")) };
        let stand = (stands[0] != Stand::NONE).then_some(stands[0]);
        let illumination = Illumination::of(scene, body.optics, body.block.entry_z, stand, row.places_mm()[0]);
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
        let through_plane = matches!(scene.optics, Optics::Refracts { .. }) && body.entry.is_none();
        let even = up && through_plane && scene.profile.is_none();
        let mut tracer = Self {
            later: bodies
                .zip(&stands[1..])
                .map(|(body, &stand)| Later { body, stand, bench: stand.inverse() })
                .collect(),
            spans: row.corners(&stands).iter().map(|corners| span(corners)).collect(),
            receiver: Receiver::of(scene),
            body,
            stand,
            rays,
            illumination,
            even,
            incident: IncidentFlux { mean: 1.0, vignetted: 0.0 },
            imperfect: Imperfect::of(scene),
        };
        if !even {
            tracer.incident = tracer.incident();
            if tracer.incident.mean.is_nan() || tracer.incident.mean <= 0.0 {
                return Err(SceneError::Dark);
            }
        }
        Ok(tracer)
    }

    /// The same light on its way, as it passes a plane across the axis.
    pub(in crate::trace) fn on_plane(&self, z_mm: f64) -> Result<Self, SceneError> {
        // Blocks of a row stand clear of each other, so that those before the plane are the first.
        let before = self.spans.iter().take_while(|(_, to)| *to < z_mm).count();
        let next = self.spans.get(before).filter(|(from, _)| *from <= z_mm || before == 0);
        if let Some(&(from_mm, to_mm)) = next {
            return Err(SceneError::Plane { z_mm, block: before + 1, from_mm, to_mm });
        }
        let later = self.later[..before - 1].to_vec();
        Ok(Self { later, receiver: Receiver::across_axis(z_mm), ..self.clone() })
    }

    /// The part of the light for the face that meets a side wall, or a rim, before it.
    pub(in crate::trace) fn vignetting(&self) -> f64 {
        self.incident.vignetted
    }

    /// How many blocks there are.
    pub(in crate::trace) fn blocks(&self) -> usize {
        1 + self.later.len()
    }

    pub(in crate::trace) fn aperture(&self) -> (DVec2, DVec2) {
        let plan = self.body.entry.as_ref().unwrap_or(&self.body.exit).relief();
        (plan.lower, plan.upper)
    }

    /// Builds the search structures that will be needed for sure.
    pub(in crate::trace) fn prepare(&self) {
        if !self.even || self.body.traversal == Traversal::Bvh {
            self.body.prepare();
        }
        self.prepare_later();
    }

    /// The same for beams, which look for the face a second time only where light runs flat over
    /// it, and not at all where it is known what they meet.
    pub(in crate::trace) fn prepare_beams(&self, known: bool) {
        let needed = if self.even {
            self.body.traversal == Traversal::Bvh
        } else {
            self.body.entry.is_some() || self.may_meet_twice()
        };
        if needed && !known {
            self.body.prepare();
        }
        self.prepare_later();
    }

    /// Those of the blocks behind the first, which light meets at any angle.
    fn prepare_later(&self) {
        self.later.iter().for_each(|later| later.body.prepare());
    }

    /// Whether light may run so flat that it meets the face a second time, by bounds for its angles
    /// to the axis.
    fn may_meet_twice(&self) -> bool {
        let (exit, steepest) = (self.body.exit.relief(), self.body.exit.search.steepest);
        let mirror = self.body.optics == Optics::Reflects;
        let arrives = match self.rays {
            Rays::Parallel(direction) => direction.z.abs().clamp(0.0, 1.0).acos(),
            Rays::From(source) => {
                let aside = (exit.upper - source.truncate()).abs().max((exit.lower - source.truncate()).abs());
                let away = if mirror { source.z - self.body.highest_mm } else { self.body.block.entry_z - source.z };
                aside.length().atan2(away)
            }
        };
        let turns = steepest.atan();
        let (within, leaves) = match self.body.optics {
            Optics::Reflects => (arrives, arrives + 2.0 * turns),
            Optics::Refracts { ior } => {
                let within = (arrives.sin() / ior).asin();
                let sin = ior * (within + turns).min(FRAC_PI_2).sin();
                (within, sin.min(1.0).asin() + turns)
            }
        };
        // False where an angle is not a number.
        let steep = |angle: f64| angle < FRAC_PI_2 && angle.tan() * steepest < 1.0;
        !(steep(within) && steep(leaves))
    }

    #[inline]
    pub(in crate::trace) fn path(&self, start: DVec2) -> RayPath {
        let block = &self.body.block;
        if self.body.entry.is_some() {
            let point = start.extend(block.lowest_mm());
            let direction = self.rays.direction_at(point);
            return self.onwards(self.body.through(Ray { point, direction, transmittance: 1.0 }, 0, None), None);
        }
        let (origin, direction, transmittance) = match self.body.optics {
            Optics::Refracts { .. } => {
                let entered = start.extend(block.entry_z);
                let beside = if block.is_rectangular() {
                    !self.even && !in_rectangle(start, block.entry_face_mm())
                } else {
                    !block.enters(start)
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
        match self.body.exit(&SearchRay::new(origin, direction)) {
            Ok((point, normal)) => self.leave(Ray { point, direction, transmittance }, normal, None),
            Err(end) => RayPath::ended(end, transmittance),
        }
    }

    /// From the exit face of the first block, where light has arrived, to the receiver.
    #[inline]
    pub(super) fn leave(&self, arrives: Ray, normal: DVec3, finish: Option<Finish<'_>>) -> RayPath {
        self.onwards(self.body.leave(arrives, normal), finish)
    }

    /// From behind the first block through those that follow to the receiver.
    #[inline]
    pub(super) fn onwards(&self, left: Result<Ray, (End, f64)>, finish: Option<Finish<'_>>) -> RayPath {
        let mut ray = match left {
            Ok(ray) => ray.on(self.stand.as_ref()),
            Err((end, transmittance)) => return RayPath::ended(end, transmittance),
        };
        for (before, Later { body, stand, bench }) in self.later.iter().enumerate() {
            let block = before as u32 + 1;
            match body.through(ray.on(Some(bench)), block, finish) {
                Ok(left) => ray = left.on(Some(stand)),
                Err((end, transmittance)) => return RayPath { block, ..RayPath::ended(end, transmittance) },
            }
        }
        let end = self.receiver.landing(ray.point, ray.direction).map_or(End::Side, End::Receiver);
        let transmittance = ray.transmittance;
        RayPath { block: self.later.len() as u32, ..RayPath::ended(end, transmittance) }
    }
}
