use super::{profile::Profile, source::Light, wave::PointWave};
use crate::{bench::ExitFace, grid::Extent};
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
    wave: Wave,
    profile: Option<&'a Profile>,
}

/// How light travels.
#[derive(Clone, Copy, Debug)]
enum Wave {
    /// The same everywhere.
    Parallel(Incoming),
    /// Of a point source.
    Point(PointWave),
}

impl<'a> Incidence<'a> {
    /// Light on a block with this face, spread evenly but for what its geometry gives.
    pub(crate) fn even(light: Light, exit_face: ExitFace, block: Extent) -> Self {
        let wave = match light {
            Light::Parallel { direction } => Wave::Parallel(Incoming { direction, density: 1.0 }),
            Light::Point { position_mm, thickness_mm, intensity } => {
                Wave::Point(PointWave::new((position_mm, thickness_mm), intensity, exit_face, block))
            }
        };
        Self { wave, profile: None }
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

impl Wave {
    #[inline(always)]
    fn at(&self, at: DVec3) -> Incoming {
        match self {
            Self::Parallel(incoming) => *incoming,
            Self::Point(wave) => match wave.at(at.truncate(), at.z) {
                Some(arrival) => {
                    let direction = arrival.tangential.extend(arrival.axial) / wave.index;
                    Incoming { direction, density: wave.footprint(&arrival).determinant() / direction.z.abs() }
                }
                None => Incoming { direction: DVec3::NAN, density: 0.0 },
            },
        }
    }
}
