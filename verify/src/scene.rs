//! The bench on which a solid is examined.

use glam::{DVec2, DVec3};

/// How the exit face is understood between its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Surface {
    /// The not-a-knot bicubic spline through the vertices of a regular grid. Only for a [`Block`](crate::Block).
    #[default]
    Spline,
    /// Flat triangles with normals interpolated linearly between vertices, as renderers shade.
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

/// The optical bench: parallel light, a solid of glass, a receiver plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// Refractive index of the solid relative to its surroundings.
    pub ior: f64,
    /// The receiver is the plane z = `distance_mm`.
    pub distance_mm: f64,
    /// Direction of the light before it meets the solid; need not be a unit vector.
    pub light: DVec3,
    /// How the block is turned on the bench: a rotation vector, radians, about the centre of its mean exit plane (0, 0, 0). Light
    /// and receiver stay where they are. Only for a [`Block`](crate::Block).
    pub turned: DVec3,
    /// The part of the receiver that is looked at.
    pub window: Window,
    /// Partial reflection.
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
    /// The light does not come from the entry face's side.
    #[error("the light direction ({}, {}, {}) does not travel along +z", .0.x, .0.y, .0.z)]
    Light(DVec3),
    /// The receiver passes through the solid.
    #[error("the receiver at z = {distance_mm} mm is not beyond the solid, which reaches z = {top_mm} mm")]
    Receiver {
        /// Position of the receiver, mm.
        distance_mm: f64,
        /// Highest point of the solid, mm.
        top_mm: f64,
    },
    /// The choice needs more than this solid has.
    #[error("{0}")]
    Needs(&'static str),
}

impl Scene {
    /// Straight light, no partial reflection, the spline surface where it really is.
    pub fn new(ior: f64, distance_mm: f64, window: Window) -> Self {
        Self {
            ior,
            distance_mm,
            light: DVec3::Z,
            turned: DVec3::ZERO,
            window,
            fresnel: Fresnel::Off,
            surface: Surface::Spline,
            geometry: Geometry::Displaced,
            traversal: Traversal::Bvh,
        }
    }

    /// Checks everything that does not depend on the solid's shape, given its highest point.
    pub(crate) fn validate(&self, top_mm: f64) -> Result<(), SceneError> {
        let within = |what, value: f64, least: f64, greatest: f64| {
            if (least..=greatest).contains(&value) {
                Ok(())
            } else {
                Err(SceneError::Value { what, value, least, greatest })
            }
        };
        within("the refractive index", self.ior, 1.000_001, 10.0)?;
        within("the distance of the receiver (mm)", self.distance_mm, -1e9, 1e9)?;
        within("the width of the window (mm)", self.window.size_mm.x, 1e-6, 1e9)?;
        within("the height of the window (mm)", self.window.size_mm.y, 1e-6, 1e9)?;
        within("the centre of the window along x (mm)", self.window.centre_mm.x, -1e9, 1e9)?;
        within("the centre of the window along y (mm)", self.window.centre_mm.y, -1e9, 1e9)?;
        within("the number of pixels along x", self.window.nx as f64, 1.0, 32_768.0)?;
        within("the number of pixels along y", self.window.ny as f64, 1.0, 32_768.0)?;
        within("the angle by which the block is turned (radians)", self.turned.length(), 0.0, 1.0)?;
        let unit = self.light.normalize_or_zero();
        if !(self.light.is_finite() && unit.z > 1e-3) {
            return Err(SceneError::Light(self.light));
        }
        if self.distance_mm <= top_mm {
            return Err(SceneError::Receiver { distance_mm: self.distance_mm, top_mm });
        }
        Ok(())
    }
}
