//! The paper's general caustic mesh: quads on the receiver, given by the user, that take the place
//! of the rectangular window.
//!
//! Vertex `(i, j)` of the mesh gets the light of a point of the block that the solver looks for;
//! its border gets that of the block's border, its corners that of the corners. The mesh is
//! understood as the smooth map that passes through its vertices (a bicubic spline), and may fold,
//! turn over and overlap itself. Where several layers lie on top of each other, each is given its
//! part of the light, so that all of them together draw the picture.

mod mesh;
mod obj;
mod raster;

pub use mesh::{CausticMesh, CausticMeshError};

use super::TargetIrradiance;
use crate::{bench::Bench, grid::Field};
use glam::DVec2;
use raster::Layers;
use rayon::prelude::*;

/// By so much of the window's size a mesh may leave it: a spline swings.
const MARGIN: f64 = 1e-3;

impl CausticMesh {
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

    /// The picture where the mesh lies, and no light beside it: what the light of a block can be on
    /// the window.
    ///
    /// # Errors
    /// A picture that is black wherever the mesh lies.
    pub fn covered(&self, target: &TargetIrradiance, bench: &Bench) -> Result<TargetIrradiance, CausticMeshError> {
        let cells = target.cells();
        let covered = Layers::of(self, bench, (cells.nx(), cells.ny())).coverage();
        let light = Field::from_fn(cells.nx(), cells.ny(), |i, j| cells[(i, j)] * covered[(i, j)]);
        Ok(TargetIrradiance::new(light)?)
    }

    /// The flux that each of `quads` equal parts of the mesh shall get, mean 1: the light of the
    /// picture on it, shared with the layers above and below.
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
