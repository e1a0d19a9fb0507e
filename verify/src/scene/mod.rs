//! The bench on which a solid is examined.

use crate::{
    light::{BeamProfile, Emission, Light},
    spread::Spread,
};
use glam::{DMat3, DQuat, DVec2, DVec3};

/// How the exit face is understood between its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Surface {
    /// The not-a-knot bicubic spline through the vertices of a regular grid. Only for a [`Block`](crate::Block).
    #[default]
    Spline,
    /// Flat triangles with normals interpolated linearly between vertices, as renderers shade; of a block whose
    /// [slopes](crate::Block::with_slopes) are known, with these.
    Smooth,
    /// Flat triangles with their own normals: the geometry of the file taken literally.
    Facets,
}

/// Where the light leaves the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Geometry {
    /// From the surface where it really is.
    #[default]
    Displaced,
    /// From the mean exit plane z = 0 with the normals of the surface: the assumption of the paper's section 2.1. Only
    /// for a [`Block`](crate::Block).
    NormalMappedPlane,
}

/// How the crossing of a ray with the exit face is found. Both ways give the same landing points, to the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Traversal {
    /// By a bounding volume hierarchy over the face, as for any mesh.
    #[default]
    Bvh,
    /// Light along the axis looks at the cell above it, which in a height field on a grid is the one that it meets; all other
    /// rays go through the hierarchy. Only for a [`Block`](crate::Block); two to three times as fast.
    Grid,
}

/// Whether interfaces reflect a part of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Fresnel {
    /// Everything that can be refracted is: a perfect coating.
    #[default]
    Off,
    /// Fresnel's equations for unpolarised light.
    On,
}

/// The part of the receiver on which the picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Size along x and y, mm.
    pub size_mm: DVec2,
    /// Centre, mm from the axis.
    pub centre_mm: DVec2,
    /// Pixels along x.
    pub nx: usize,
    /// Pixels along y.
    pub ny: usize,
}

/// What the exit face does to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Optics {
    /// Light enters the solid by its entry face and leaves it by the exit face.
    Refracts {
        /// Refractive index of the solid relative to its surroundings.
        ior: f64,
    },
    /// The exit face of a [`Block`](crate::Block) is a perfect front-surface mirror. Light comes from the receiver's side,
    /// travelling -z, and what is behind the face plays no part. The receiver does not shade the mirror.
    Reflects,
}

/// The optical bench: light, a solid of glass or a mirror, a receiver plane.
///
/// The receiver is the plane through `(0, 0, distance_mm)`, turned about that point by [`receiver_turned`](Self::receiver_turned). Points
/// on it are told in its own coordinates: `(y1, y2)` lies at `(0, 0, distance_mm) + R (y1, y2, 0)`.
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
#[derive(Clone, Debug, PartialEq)]
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
    /// The extent of the light: only [`photons`](crate::photons) see it. Only for a [`Block`](crate::Block).
    pub spread: Spread,
    /// Roughness of the exit face: the root of the mean square, along x and along y, of slopes that are added to those of
    /// the face, normally distributed and independent from ray to ray. Only [`photons`](crate::photons) see it. Only for a
    /// [`Block`](crate::Block).
    pub roughness: f64,
    /// How the block is turned on the bench: a rotation vector, radians, about the centre of its mean exit plane (0, 0, 0). Light
    /// and receiver stay where they are. Only for a [`Block`](crate::Block).
    pub turned: DVec3,
    /// The part of the receiver that is looked at, in the receiver's own coordinates.
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

/// Why a solid cannot be examined on a bench.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A number that no bench can have.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Value {
        /// Which number, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Least accepted value.
        least: f64,
        /// Greatest accepted value.
        greatest: f64,
    },
    /// The light does not come from the side that the optics ask for.
    #[error("the light direction ({}, {}, {}) does not travel along {towards}", .direction.x, .direction.y, .direction.z)]
    Light {
        /// The direction.
        direction: DVec3,
        /// Where light has to travel: `+z` into glass, `-z` onto a mirror.
        towards: &'static str,
    },
    /// Something is tilted so far that light grazes it.
    #[error(
        "{what} is tilted by {degrees:.2} degrees against the axis; at most {} degrees are accepted",
        Scene::GREATEST_TILT_DEG
    )]
    Tilt {
        /// What: the light, the receiver.
        what: &'static str,
        /// By how much, degrees.
        degrees: f64,
    },
    /// The source is inside of the block, or on the wrong side of it.
    #[error(
        "the light source at z = {z_mm} mm must lie {side} z = {limit_mm:.3} mm, where the block ends: move it away from the block"
    )]
    Source {
        /// Its place along the axis, mm.
        z_mm: f64,
        /// On which side of the limit it must lie.
        side: &'static str,
        /// The limit, mm.
        limit_mm: f64,
    },
    /// The receiver passes through the solid.
    #[error("the receiver at z = {distance_mm} mm is not beyond the solid, which reaches z = {top_mm} mm")]
    Receiver {
        /// Position of the receiver, mm.
        distance_mm: f64,
        /// Highest point of the solid, mm.
        top_mm: f64,
    },
    /// The turned receiver passes through the solid.
    #[error(
        "the turned receiver at z = {distance_mm} mm cuts the solid, which reaches {by_mm:.3} mm beyond it: move it away or turn it less"
    )]
    ReceiverCuts {
        /// Where the receiver meets the axis, mm.
        distance_mm: f64,
        /// How far the solid reaches through it, mm.
        by_mm: f64,
    },
    /// A table of intensities that is none.
    #[error(
        "row {row} of the table of intensities: angles must ascend within 0 and pi, intensities must not be negative, and one must be positive"
    )]
    Table {
        /// Which row, counted from 0; the number of rows if it is the whole that gives no light.
        row: usize,
    },
    /// A picture of a beam that is none.
    #[error(
        "the beam's picture has the value {value} at column {column}, row {row}: irradiance is finite and not negative"
    )]
    Profile {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// No light at all.
    #[error("no light falls on the solid: the source, its axis or the beam's picture leaves it in the dark")]
    Dark,
    /// The choice needs more than this solid has.
    #[error("{0}")]
    Needs(&'static str),
}

pub(crate) fn within(what: &'static str, value: f64, least: f64, greatest: f64) -> Result<(), SceneError> {
    if (least..=greatest).contains(&value) { Ok(()) } else { Err(SceneError::Value { what, value, least, greatest }) }
}

/// Least distance between a source and the block, mm.
const CLEARANCE_MM: f64 = 1e-3;

impl Window {
    /// Most pixels along a side.
    pub const MOST_ALONG: usize = 32_768;
    /// Most pixels in all: a film of them takes half a gigabyte.
    pub const MOST_PIXELS: usize = 1 << 26;

    fn validate(&self) -> Result<(), SceneError> {
        within("the width of the window (mm)", self.size_mm.x, 1e-6, 1e9)?;
        within("the height of the window (mm)", self.size_mm.y, 1e-6, 1e9)?;
        within("the centre of the window along x (mm)", self.centre_mm.x, -1e9, 1e9)?;
        within("the centre of the window along y (mm)", self.centre_mm.y, -1e9, 1e9)?;
        within("the number of pixels along x", self.nx as f64, 1.0, Self::MOST_ALONG as f64)?;
        within("the number of pixels along y", self.ny as f64, 1.0, Self::MOST_ALONG as f64)?;
        self.holds_at_most(Self::MOST_PIXELS)
    }

    /// Refuses more pixels than that.
    pub(crate) fn holds_at_most(&self, most: usize) -> Result<(), SceneError> {
        let pixels = self.nx.saturating_mul(self.ny);
        within("the number of pixels of the window, columns times rows,", pixels as f64, 1.0, most as f64)
    }
}

impl Scene {
    /// Greatest tilt of parallel light and of the receiver against the axis, degrees.
    pub const GREATEST_TILT_DEG: f64 = 85.0;

    /// Straight light through glass, no partial reflection, the spline surface where it really is.
    pub fn new(ior: f64, distance_mm: f64, window: Window) -> Self {
        Self {
            optics: Optics::Refracts { ior },
            distance_mm,
            receiver_turned: DVec3::ZERO,
            light: Light::Parallel { direction: DVec3::Z },
            profile: None,
            spread: Spread::None,
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

    /// Whether all light travels straight along +z into glass, evenly, to a receiver across the axis.
    pub fn is_straight(&self) -> bool {
        let up = matches!(&self.light, Light::Parallel { direction } if direction.normalize_or_zero() == DVec3::Z);
        let glass = matches!(self.optics, Optics::Refracts { .. });
        glass && up && self.profile.is_none() && self.turned == DVec3::ZERO && self.receiver_turned == DVec3::ZERO
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

    /// Checks everything that does not depend on the solid's shape, given its least and greatest corner.
    pub(crate) fn validate(&self, lower: DVec3, upper: DVec3) -> Result<(), SceneError> {
        if let Optics::Refracts { ior } = self.optics {
            within("the refractive index", ior, 1.000_001, 10.0)?;
        }
        within("the distance of the receiver (mm)", self.distance_mm, -1e9, 1e9)?;
        self.window.validate()?;
        within("the angle by which the block is turned (radians)", self.turned.length(), 0.0, 1.0)?;
        within("the roughness (rms slope)", self.roughness, 0.0, 1.0)?;
        self.spread.validate(&self.light)?;
        within("the angle by which the receiver is turned (radians)", self.receiver_turned.length(), 0.0, 7.0)?;
        let block = Self::rotation(self.turned).unwrap_or(DMat3::IDENTITY);
        let corners = std::array::from_fn(|k: usize| {
            let pick = |bit: usize, lo: f64, hi: f64| if k >> bit & 1 == 0 { lo } else { hi };
            block * DVec3::new(pick(0, lower.x, upper.x), pick(1, lower.y, upper.y), pick(2, lower.z, upper.z))
        });
        self.validate_light(&corners)?;
        self.validate_receiver(&corners, upper.z)
    }

    fn validate_light(&self, corners: &[DVec3; 8]) -> Result<(), SceneError> {
        let sense = self.sense();
        match &self.light {
            &Light::Parallel { direction } => {
                let along = sense * direction.normalize_or_zero().z;
                if !direction.is_finite() || along.is_nan() || along <= 0.0 {
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
                    within(what, value, -1e9, 1e9)?;
                }
                if let Emission::Gaussian { half_angle } = emission {
                    within("the half angle of the light source (radians)", *half_angle, 1e-4, 100.0)?;
                }
                if let Some(axis) = axis {
                    within("the length of the light source's axis", axis.length(), 1e-9, 1e9)?;
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

    fn validate_receiver(&self, corners: &[DVec3; 8], top_mm: f64) -> Result<(), SceneError> {
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
