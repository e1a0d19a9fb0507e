//! The paper's general caustic mesh: quads on the receiver, given by the user, that take the place of the rectangular window.
//!
//! Vertex `(i, j)` of the mesh gets the light of a point of the block that the solver looks for; its border gets that of the
//! block's border, its corners that of the corners. The mesh is understood as the smooth map that passes through its vertices
//! (a bicubic spline), and may fold, turn over and overlap itself. Where several layers lie on top of each other, each is
//! given its part of the light, so that all of them together draw the picture.

mod obj;
mod raster;

use super::{TargetError, TargetIrradiance};
use crate::{
    bench::Bench,
    grid::{Extent, Field},
    surface::{HeightField, SurfaceSpline},
};
use glam::{DMat2, DVec2};
use raster::Layers;
use rayon::prelude::*;
use std::path::PathBuf;

/// A grid of quads on the receiver.
#[derive(Clone, Debug)]
pub struct CausticMesh {
    vertices: Field<DVec2>,
    /// Mean of each coordinate, and the spline through what is left of it, over the mesh's own coordinates in quads.
    coordinates: [(f64, SurfaceSpline); 2],
}

impl PartialEq for CausticMesh {
    fn eq(&self, other: &Self) -> bool {
        self.vertices == other.vertices
    }
}

/// Why a mesh cannot be used.
#[derive(Debug, thiserror::Error)]
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
    #[error("the caustic mesh has {nx} x {ny} vertices; at least {least} x {least} are needed", least = CausticMesh::LEAST_VERTICES)]
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
        "the caustic mesh reaches x = {:.3} mm, y = {:.3} mm, {by_mm:.3} mm beyond the picture of {:.2} x {:.2} mm: scale the mesh, or take a larger --window",
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

/// By so much of the window's size a mesh may leave it: a spline swings.
const MARGIN: f64 = 1e-3;

impl CausticMesh {
    /// Least number of vertices along a side.
    pub const LEAST_VERTICES: usize = 5;

    /// Takes vertices on the receiver, mm, row `j` and column `i` as the light of the block's rows along `+y` and columns along
    /// `+x`.
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

    /// How many quads lie with their front, and how many with their back to the block. Both, if the light folds.
    pub fn sides(&self) -> (usize, usize) {
        let v = &self.vertices;
        let is_front =
            |i: usize, j: usize| (v[(i + 1, j + 1)] - v[(i, j)]).perp_dot(v[(i, j + 1)] - v[(i + 1, j)]) > 0.0;
        let quads = (v.nx() - 1) * (v.ny() - 1);
        let front = (0..v.ny() - 1).map(|j| (0..v.nx() - 1).filter(|&i| is_front(i, j)).count()).sum::<usize>();
        (front, quads - front)
    }

    /// The point of the receiver at a place of the mesh, 0 to 1 along both sides, mm, and its derivative.
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

    /// Refuses a mesh that leaves the window of a bench.
    ///
    /// # Errors
    /// [`CausticMeshError::BeyondWindow`].
    pub fn check(&self, bench: &Bench) -> Result<(), CausticMeshError> {
        let (centre, window) = (bench.window_centre_mm(), bench.window().as_vec());
        let (nx, ny) = (4 * (self.vertices.nx() - 1), 4 * (self.vertices.ny() - 1));
        let mut worst = (MARGIN * window.max_element(), DVec2::ZERO);
        for k in 0..(nx + 1) * (ny + 1) {
            let place = DVec2::new((k % (nx + 1)) as f64 / nx as f64, (k / (nx + 1)) as f64 / ny as f64);
            let at = self.at(place).0;
            let by = ((at - centre).abs() - 0.5 * window).max_element();
            if by > worst.0 {
                worst = (by, at);
            }
        }
        if worst.1 == DVec2::ZERO {
            return Ok(());
        }
        Err(CausticMeshError::BeyondWindow { at_mm: worst.1, by_mm: worst.0, window_mm: window })
    }

    /// The picture where the mesh lies, and no light beside it: what the light of a block can be on the window.
    ///
    /// # Errors
    /// A picture that is black wherever the mesh lies.
    pub fn covered(&self, target: &TargetIrradiance, bench: &Bench) -> Result<TargetIrradiance, CausticMeshError> {
        let cells = target.cells();
        let covered = Layers::of(self, bench, (cells.nx(), cells.ny())).coverage();
        let light = Field::from_fn(cells.nx(), cells.ny(), |i, j| cells[(i, j)] * covered[(i, j)]);
        Ok(TargetIrradiance::new(light)?)
    }

    /// The flux that each of `quads` equal parts of the mesh shall get, mean 1: the light of the picture on it, shared with
    /// the layers above and below.
    pub(crate) fn flux(&self, target: &TargetIrradiance, bench: &Bench, quads: (usize, usize)) -> Field<f64> {
        let cells = target.cells();
        let layers = Layers::of(self, bench, (cells.nx(), cells.ny()));
        let corner = bench.window_centre_mm() + bench.window().lower();
        let pixel = bench.window().as_vec() / DVec2::new(cells.nx() as f64, cells.ny() as f64);
        let (px, py) = self.pixels(pixel);
        // Half a pixel from point to point.
        let parts = (2 * px).div_ceil(quads.0).max((2 * py).div_ceil(quads.1)).max(2);
        let size = DVec2::new((quads.0 * parts) as f64, (quads.1 * parts) as f64);
        let mut flux = vec![0.0; quads.0 * quads.1];
        flux.par_chunks_mut(quads.0).enumerate().for_each(|(j, row)| {
            for (i, sum) in row.iter_mut().enumerate() {
                for k in 0..parts * parts {
                    let part = DVec2::new((i * parts + k % parts) as f64, (j * parts + k / parts) as f64);
                    let (at, by_place) = self.at((part + 0.5) / size);
                    let cell = ((at - corner) / pixel).max(DVec2::ZERO);
                    let cell = ((cell.x as usize).min(cells.nx() - 1), (cell.y as usize).min(cells.ny() - 1));
                    *sum += by_place.determinant().abs() * cells[cell] / layers.at(at);
                }
            }
        });
        let flux = Field::from_vec(quads.0, quads.1, flux);
        let mean = flux.mean();
        flux.map(|v| v / mean)
    }
}

#[cfg(test)]
mod tests;
