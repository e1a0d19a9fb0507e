//! The bench on which a solid is examined.

mod error;
mod extent;
mod light;
mod optics;
mod standing;
mod surface;
mod window;

pub use error::SceneError;
pub use extent::SourceExtent;
pub use light::{BeamProfile, Emission, IntensityTable, Light};
pub use optics::{Fresnel, Optics};
pub use standing::{Displacement, Standing};
pub use surface::{Geometry, Surface, Traversal};
pub use window::Window;

use error::GREATEST_TILT_DEG;
pub(crate) use error::in_range;
use glam::{DMat3, DQuat, DVec3};
use std::fmt;

/// The optical bench: light, a solid of glass or a mirror, a receiver plane.
///
/// The receiver is the plane through `(0, 0, distance_mm)`, turned about that point by
/// [`receiver_turned`](Self::receiver_turned). Points on it are told in its own coordinates:
/// `(y1, y2)` lies at `(0, 0, distance_mm) + R (y1, y2, 0)`.
///
/// ```
/// use glam::{DVec2, DVec3};
/// use glasswarp_verify::{Block, Emission, Light, Scene, Tracer, Window, beams};
///
/// let block = Block::from_heights(DVec2::splat(40.0), -10.0, (5, 5), vec![0.0; 25])?;
/// let window = Window { size_mm: DVec2::splat(60.0), centre_mm: DVec2::ZERO, nx: 64, ny: 64 };
/// // A torch half a metre before the block, aimed a little aside, and a wall that leans back by 0.2 radians.
/// let light = Light::Point {
///     position_mm: DVec3::new(0.0, 0.0, -500.0),
///     emission: Emission::Gaussian { half_angle: 0.1 },
///     axis: Some(DVec3::new(0.01, 0.0, 1.0)),
/// };
/// let scene = Scene { light, receiver_turned: DVec3::new(-0.2, 0.0, 0.0), ..Scene::new(1.49, 200.0, window) };
/// let seen = beams(&Tracer::for_block(&block, &scene)?, 256, 256);
/// assert!((seen.flux.total() - 1.0).abs() < 1e-12 && seen.flux.window > 0.95);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Tallies of photons name their bench by the [`Debug`](std::fmt::Debug) form of a scene: a field
/// under another name would keep those of an earlier version from being merged.
#[derive(Clone, PartialEq)]
pub struct Scene {
    /// Glass or mirror.
    pub optics: Optics,
    /// Where the receiver meets the axis, mm from the mean exit plane.
    pub distance_mm: f64,
    /// How the receiver is turned: a rotation vector, radians, about `(0, 0, distance_mm)`.
    pub receiver_turned: DVec3,
    /// The light before it meets the solid.
    pub light: Light,
    /// The irradiance of the beam, where it was measured.
    pub profile: Option<BeamProfile>,
    /// The blocks that light passes before the one that is looked at, in its order. Only for a
    /// [`Block`](crate::Block).
    pub before: Vec<Standing>,
    /// The extent of the light: only [`photons`](crate::photons) see it. Only for a
    /// [`Block`](crate::Block).
    pub spread: SourceExtent,
    /// Roughness of the exit face, and of an entry face that is not planar: the root of the mean
    /// square, along x and along y, of slopes that are added to those of the face, normally
    /// distributed and independent from ray to ray and from face to face. Only
    /// [`photons`](crate::photons) see it. Only for a [`Block`](crate::Block).
    pub roughness: f64,
    /// How the block, or all of a [row](crate::Row), is turned on the bench: a rotation vector,
    /// radians, about (0, 0, 0), the centre of the (last) mean exit plane. Light and receiver stay
    /// where they are. Only for a
    /// [`Block`](crate::Block).
    pub turned: DVec3,
    /// The part of the receiver that is imaged, in the receiver's own coordinates.
    pub window: Window,
    /// Partial reflection. A mirror reflects everything.
    pub fresnel: Fresnel,
    /// The surface between vertices.
    pub surface: Surface,
    /// True or flattened surface.
    pub geometry: Geometry,
    /// How crossings are found.
    pub traversal: Traversal,
}

/// Least distance between a source and the block, mm.
const CLEARANCE_MM: f64 = 1e-3;

impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut all = f.debug_struct("Scene");
        all.field("optics", &self.optics)
            .field("distance_mm", &self.distance_mm)
            .field("receiver_turned", &self.receiver_turned)
            .field("light", &self.light)
            .field("profile", &self.profile);
        // Tallies from before there were rows are still those of a block alone.
        if !self.before.is_empty() {
            all.field("before", &self.before);
        }
        all.field("spread", &self.spread)
            .field("roughness", &self.roughness)
            .field("turned", &self.turned)
            .field("window", &self.window)
            .field("fresnel", &self.fresnel)
            .field("surface", &self.surface)
            .field("geometry", &self.geometry)
            .field("traversal", &self.traversal)
            .finish()
    }
}

impl Scene {
    /// Greatest tilt of parallel light and of the receiver against the axis, degrees.
    pub const GREATEST_TILT_DEG: f64 = GREATEST_TILT_DEG;

    /// Straight light through glass, no partial reflection, the spline surface where it really is.
    pub fn new(ior: f64, distance_mm: f64, window: Window) -> Self {
        Self {
            optics: Optics::Refracts { ior },
            distance_mm,
            receiver_turned: DVec3::ZERO,
            light: Light::Parallel { direction: DVec3::Z },
            profile: None,
            before: Vec::new(),
            spread: SourceExtent::None,
            roughness: 0.0,
            turned: DVec3::ZERO,
            window,
            fresnel: Fresnel::Off,
            surface: Surface::Spline,
            geometry: Geometry::Displaced,
            traversal: Traversal::Bvh,
        }
    }

    /// A mirror in straight light, travelling -z.
    pub fn mirror(distance_mm: f64, window: Window) -> Self {
        Self {
            optics: Optics::Reflects,
            light: Light::Parallel { direction: DVec3::NEG_Z },
            ..Self::new(1.0, distance_mm, window)
        }
    }

    /// Refractive index of the solid; 1 for a mirror, which light does not enter.
    pub fn ior(&self) -> f64 {
        match self.optics {
            Optics::Refracts { ior } => ior,
            Optics::Reflects => 1.0,
        }
    }

    /// Whether all light travels straight along +z into glass, evenly, to a receiver across the
    /// axis.
    pub fn is_straight(&self) -> bool {
        let up = matches!(&self.light, Light::Parallel { direction } if direction.normalize_or_zero() == DVec3::Z);
        let glass = matches!(self.optics, Optics::Refracts { .. });
        glass
            && up
            && self.before.is_empty()
            && self.profile.is_none()
            && self.turned == DVec3::ZERO
            && self.receiver_turned == DVec3::ZERO
    }

    /// Where light has to travel along the axis: +1 into glass, -1 onto a mirror.
    pub(crate) fn sense(&self) -> f64 {
        match self.optics {
            Optics::Refracts { .. } => 1.0,
            Optics::Reflects => -1.0,
        }
    }

    /// The rotation that a vector means; none for none.
    pub(crate) fn rotation(turned: DVec3) -> Option<DMat3> {
        (turned != DVec3::ZERO).then(|| DMat3::from_quat(DQuat::from_scaled_axis(turned)))
    }

    /// The corners of a box, given its least and greatest.
    pub(crate) fn corners(lower: DVec3, upper: DVec3) -> [DVec3; 8] {
        std::array::from_fn(|k| {
            let pick = |bit: usize, lo: f64, hi: f64| if k >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(pick(0, lower.x, upper.x), pick(1, lower.y, upper.y), pick(2, lower.z, upper.z))
        })
    }

    /// Checks everything that does not depend on the solid's shape, given the corners of what holds
    /// it before it is turned.
    pub(crate) fn validate(&self, corners: &[DVec3]) -> Result<(), SceneError> {
        if let Optics::Refracts { ior } = self.optics {
            in_range("the refractive index", ior, 1.000_001, 10.0)?;
        }
        in_range("the distance of the receiver (mm)", self.distance_mm, -1e9, 1e9)?;
        self.window.validate()?;
        in_range("the angle by which the block is turned (radians)", self.turned.length(), 0.0, 1.0)?;
        in_range("the roughness (rms slope)", self.roughness, 0.0, 1.0)?;
        self.spread.validate(&self.light)?;
        in_range("the angle by which the receiver is turned (radians)", self.receiver_turned.length(), 0.0, 7.0)?;
        let top_mm = corners.iter().map(|corner| corner.z).fold(f64::NEG_INFINITY, f64::max);
        let block = Self::rotation(self.turned).unwrap_or(DMat3::IDENTITY);
        let corners: Vec<DVec3> = corners.iter().map(|&corner| block * corner).collect();
        self.validate_light(&corners)?;
        self.validate_receiver(&corners, top_mm)
    }

    fn validate_light(&self, corners: &[DVec3]) -> Result<(), SceneError> {
        let sense = self.sense();
        match &self.light {
            &Light::Parallel { direction } => {
                let along = sense * direction.normalize_or_zero().z;
                // The square of a lesser length loses digits, until none is left.
                let has_length = (1e-100..1e100).contains(&direction.length());
                if !has_length || along.is_nan() || along <= 0.0 {
                    let towards = if sense > 0.0 { "+z" } else { "-z" };
                    return Err(SceneError::Light { direction, towards });
                }
                tilt("the light", along)?;
            }
            Light::Point { position_mm, emission, axis } => {
                for (what, value) in [
                    ("the light source along x (mm)", position_mm.x),
                    ("the light source along y (mm)", position_mm.y),
                    ("the light source along z (mm)", position_mm.z),
                ] {
                    in_range(what, value, -1e9, 1e9)?;
                }
                if let Emission::Gaussian { half_angle } = emission {
                    in_range("the half angle of the light source (radians)", *half_angle, 1e-4, 100.0)?;
                }
                if let Some(axis) = axis {
                    in_range("the length of the light source's axis", axis.length(), 1e-9, 1e9)?;
                }
                // The end of the block that faces the source.
                let end = corners.iter().map(|c| -sense * c.z).fold(f64::NEG_INFINITY, f64::max);
                if -sense * position_mm.z < end + CLEARANCE_MM {
                    let side = if sense > 0.0 { "below" } else { "above" };
                    let limit_mm = -sense * (end + CLEARANCE_MM);
                    return Err(SceneError::Source { z_mm: position_mm.z, side, limit_mm });
                }
            }
        }
        Ok(())
    }

    fn validate_receiver(&self, corners: &[DVec3], top_mm: f64) -> Result<(), SceneError> {
        let distance_mm = self.distance_mm;
        if distance_mm <= top_mm {
            return Err(SceneError::Receiver { distance_mm, top_mm });
        }
        let normal = Self::rotation(self.receiver_turned).map_or(DVec3::Z, |turned| turned * DVec3::Z);
        tilt("the receiver", normal.z)?;
        let centre = DVec3::new(0.0, 0.0, distance_mm);
        let by_mm = corners.iter().map(|&c| (c - centre).dot(normal)).fold(f64::NEG_INFINITY, f64::max);
        if by_mm >= 0.0 { Err(SceneError::ReceiverCuts { distance_mm, by_mm }) } else { Ok(()) }
    }
}

/// Refuses what is tilted too far, by the cosine of its angle.
fn tilt(what: &'static str, cos: f64) -> Result<(), SceneError> {
    let degrees = cos.clamp(-1.0, 1.0).acos().to_degrees();
    if degrees <= Scene::GREATEST_TILT_DEG { Ok(()) } else { Err(SceneError::Tilt { what, degrees }) }
}
