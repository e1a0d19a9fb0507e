use super::{congruence::Congruence, profile::Profile};
use glam::{DVec2, DVec3};

/// The light at one point of the structured face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Incoming {
    /// Unit vector along which it travels; not a number where none arrives.
    pub(crate) direction: DVec3,
    /// Flux per area across it. Only its course over the face has a meaning.
    pub(crate) density: f64,
}

impl Incoming {
    /// Flux through the face per unit of area in the xy plane, where it has these slopes.
    pub(crate) fn flux(&self, slope: DVec2) -> f64 {
        self.density * self.direction.dot(DVec3::new(-slope.x, -slope.y, 1.0)).abs()
    }
}

/// The light of a bench, ready to be asked point by point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Incidence<'a> {
    wave: Wave<'a>,
    profile: Option<&'a Profile>,
}

/// How light travels.
#[derive(Clone, Copy, Debug)]
enum Wave<'a> {
    /// The same everywhere.
    Parallel(Incoming),
    /// Another way at every point.
    Curved(Congruence<'a>),
}

impl<'a> Incidence<'a> {
    /// Light that travels along a unit vector everywhere.
    pub(crate) fn parallel(direction: DVec3) -> Self {
        Self { wave: Wave::Parallel(Incoming { direction, density: 1.0 }), profile: None }
    }

    /// Light that is a congruence of rays.
    pub(crate) fn curved(congruence: Congruence<'a>) -> Self {
        Self { wave: Wave::Curved(congruence), profile: None }
    }

    /// The same, spread by a profile.
    pub(crate) fn spread(self, profile: Option<&'a Profile>) -> Self {
        Self { profile, ..self }
    }

    /// The light at the point `at` of the structured face, mm.
    #[inline(always)]
    pub(crate) fn at(&self, at: DVec3) -> Incoming {
        let mut incoming = self.wave.at(at);
        if let Some(profile) = self.profile {
            let direction = incoming.direction;
            incoming.density *= profile.at(at.truncate() - direction.truncate() * (at.z / direction.z));
        }
        incoming
    }
}

impl Wave<'_> {
    #[inline(always)]
    fn at(&self, at: DVec3) -> Incoming {
        match self {
            Self::Parallel(incoming) => *incoming,
            Self::Curved(congruence) => of_congruence(congruence, at),
        }
    }
}

fn of_congruence(congruence: &Congruence<'_>, at: DVec3) -> Incoming {
    let arrival = congruence.at(at.truncate(), at.z);
    let known = arrival.and_then(|arrival| Some((arrival.incident(), congruence.label(&arrival)?.density())));
    known.map_or(Incoming { direction: DVec3::NAN, density: 0.0 }, |(incident, density)| {
        let direction = incident / congruence.index();
        Incoming { direction, density: density / direction.z.abs() }
    })
}
