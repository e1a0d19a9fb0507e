//! The mesh itself, as the smooth map that it is understood as.

use crate::{
    grid::{Extent, Field},
    irradiance::TargetError,
    surface::{HeightField, SurfaceSpline},
};
use glam::{DMat2, DVec2};
use std::path::PathBuf;

/// Least number of vertices along a side.
const LEAST_VERTICES: usize = 5;

/// A grid of quads on the receiver.
#[derive(Clone, Debug)]
pub struct CausticMesh {
    pub(super) vertices: Field<DVec2>,
    /// Mean of each coordinate, and the spline through what is left of it, over the mesh's own
    /// coordinates in quads.
    pub(super) coordinates: [(f64, SurfaceSpline); 2],
}

impl PartialEq for CausticMesh {
    fn eq(&self, other: &Self) -> bool {
        self.vertices == other.vertices
    }
}

/// Why a mesh cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CausticMeshError {
    /// The file cannot be read as an OBJ.
    #[error("{} is no readable OBJ file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: tobj::LoadError,
    },
    /// The bytes are no OBJ.
    #[error("the caustic mesh is no readable OBJ")]
    Parse(#[source] tobj::LoadError),
    /// A face is no quad.
    #[error("face {face} of the caustic mesh has {corners} corners; all must have 4")]
    NotQuads {
        /// Which face, from 1.
        face: usize,
        /// Its corners.
        corners: usize,
    },
    /// More than one mesh.
    #[error("the file holds several objects, groups or materials with faces; a caustic mesh is a single one")]
    Objects,
    /// There are no faces.
    #[error("the caustic mesh has no faces")]
    Empty,
    /// The quads do not form rows and columns.
    #[error("the caustic mesh is no grid of m x n quads: {why} (face {face})")]
    NotAGrid {
        /// What is wrong.
        why: &'static str,
        /// Where, from 1.
        face: usize,
    },
    /// Too few vertices for a smooth map.
    #[error("the caustic mesh has {nx} x {ny} vertices; at least {least} x {least} are needed", least = LEAST_VERTICES)]
    TooSmall {
        /// Vertices along one side.
        nx: usize,
        /// Vertices along the other.
        ny: usize,
    },
    /// A vertex is nowhere.
    #[error(
        "vertex {column}, {row} of the caustic mesh is no point of a plane: ({x}, {y}, {z}); all must have the same finite z"
    )]
    Vertex {
        /// Its column.
        column: usize,
        /// Its row.
        row: usize,
        /// Coordinates, mm.
        x: f64,
        /// Coordinates, mm.
        y: f64,
        /// Coordinates, mm.
        z: f64,
    },
    /// The mesh leaves the window, where there is no picture.
    #[error(
        "the caustic mesh reaches x = {:.3} mm, y = {:.3} mm, {by_mm:.3} mm beyond the picture of {:.2} x {:.2} mm: scale the mesh, or take a larger window",
        at_mm.x, at_mm.y, window_mm.x, window_mm.y
    )]
    BeyondWindow {
        /// The furthest point, mm.
        at_mm: DVec2,
        /// How far it is outside, mm.
        by_mm: f64,
        /// Size of the window, mm.
        window_mm: DVec2,
    },
    /// The picture is black wherever the mesh lies.
    #[error(transparent)]
    Target(#[from] TargetError),
}

impl CausticMesh {
    /// Least number of vertices along a side.
    pub const LEAST_VERTICES: usize = LEAST_VERTICES;

    /// Takes vertices on the receiver, mm, row `j` and column `i` as the light of the block's rows
    /// along `+y` and columns along `+x`.
    ///
    /// # Errors
    /// Too few vertices, or one that is not finite.
    pub fn new(vertices: Field<DVec2>) -> Result<Self, CausticMeshError> {
        let (nx, ny) = (vertices.nx(), vertices.ny());
        if nx.min(ny) < Self::LEAST_VERTICES {
            return Err(CausticMeshError::TooSmall { nx, ny });
        }
        if let Some(k) = vertices.as_slice().iter().position(|v| !v.is_finite()) {
            let at = vertices.as_slice()[k];
            return Err(CausticMeshError::Vertex { column: k % nx, row: k / nx, x: at.x, y: at.y, z: 0.0 });
        }
        let over = Extent::new((nx - 1) as f64, (ny - 1) as f64);
        let coordinates = [0, 1].map(|axis| {
            let field = vertices.map(|v| v[axis]);
            (field.mean(), SurfaceSpline::through(&HeightField::new(over, field)))
        });
        Ok(Self { vertices, coordinates })
    }

    /// Vertices along both sides.
    pub fn size(&self) -> (usize, usize) {
        (self.vertices.nx(), self.vertices.ny())
    }

    /// The vertices as they were given, mm.
    pub fn vertices(&self) -> &Field<DVec2> {
        &self.vertices
    }

    /// How many quads lie with their front, and how many with their back to the block. Both, if the
    /// light folds.
    pub fn sides(&self) -> (usize, usize) {
        let v = &self.vertices;
        let is_front =
            |i: usize, j: usize| (v[(i + 1, j + 1)] - v[(i, j)]).perp_dot(v[(i, j + 1)] - v[(i + 1, j)]) > 0.0;
        let quads = (v.nx() - 1) * (v.ny() - 1);
        let front = (0..v.ny() - 1).map(|j| (0..v.nx() - 1).filter(|&i| is_front(i, j)).count()).sum::<usize>();
        (front, quads - front)
    }

    /// The point of the receiver at a place of the mesh, 0 to 1 along both sides, mm, and its
    /// derivative.
    pub(crate) fn at(&self, place: DVec2) -> (DVec2, DMat2) {
        let quads = DVec2::new((self.vertices.nx() - 1) as f64, (self.vertices.ny() - 1) as f64);
        let [x, y] = self.coordinates.each_ref().map(|(mean, spline)| {
            let sample = spline.sample((place - 0.5) * quads);
            (mean + sample.height_mm, sample.slope * quads)
        });
        (DVec2::new(x.0, y.0), DMat2::from_cols(DVec2::new(x.1.x, y.1.x), DVec2::new(x.1.y, y.1.y)))
    }

    /// How many pixels of this size there are along its sides, in the mean.
    pub(crate) fn pixels(&self, pixel_mm: DVec2) -> (usize, usize) {
        let v = &self.vertices;
        let length = |a: DVec2, b: DVec2| ((b - a) / pixel_mm).length();
        let along = |rows: usize, steps: usize, at: &dyn Fn(usize, usize) -> DVec2| {
            let sum: f64 = (0..rows)
                .flat_map(|r| (1..steps).map(move |s| (r, s)))
                .map(|(r, s)| length(at(r, s - 1), at(r, s)))
                .sum();
            ((sum / rows as f64).round() as usize).max(4)
        };
        (along(v.ny(), v.nx(), &|j, i| v[(i, j)]), along(v.nx(), v.ny(), &|i, j| v[(i, j)]))
    }
}
