//! The two meshes of section 3: fixed vertices `x` on the receiver, moving vertices `u` on the
//! specular plane.

use super::limits::LEAST_TARGET;
use crate::{
    bench::Bench,
    grid::{Extent, Field, area_resample, bilinear_resample},
    irradiance::{CausticMesh, TargetIrradiance},
};
use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh of quads that tiles the block, deformed; its partner on the receiver stays as it is.
///
/// Border vertices lie on their border, corners in their corner.
#[derive(Clone, Debug, PartialEq)]
pub struct WarpMesh {
    nx: usize,
    ny: usize,
    /// See [`unknowns`](Self::unknowns).
    pub(crate) coordinates: Vec<f64>,
}

/// Quads that light does not come through as the objective assumes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FoldCount {
    /// Quads of negative area.
    pub inverted: usize,
    /// Quads of positive area with a reflex corner.
    pub concave: usize,
}

impl WarpMesh {
    /// The regular mesh of `quads.0` by `quads.1` quads on the block.
    pub fn regular(block: Extent, quads: (usize, usize)) -> Self {
        let (nx, ny) = (quads.0 + 1, quads.1 + 1);
        let mut coordinates = Vec::with_capacity(2 * nx * ny);
        for axis in 0..2 {
            coordinates.extend((0..nx * ny).map(|k| block.node(k % nx, k / nx, nx, ny)[axis]));
        }
        Self { nx, ny, coordinates }
    }

    /// Vertices along x and y.
    pub fn vertices(&self) -> (usize, usize) {
        (self.nx, self.ny)
    }

    /// Vertex `u(i, j)`, mm.
    pub fn vertex(&self, i: usize, j: usize) -> DVec2 {
        let k = j * self.nx + i;
        DVec2::new(self.coordinates[k], self.coordinates[self.nx * self.ny + k])
    }

    /// The unknowns of the minimisation: all x, row by row, then all y, mm.
    pub fn unknowns(&self) -> &[f64] {
        &self.coordinates
    }

    /// One coordinate (0 for x, 1 for y) of all vertices.
    pub(crate) fn coordinate(&self, axis: usize) -> Field<f64> {
        let n = self.nx * self.ny;
        Field::from_vec(self.nx, self.ny, self.coordinates[axis * n..][..n].to_vec())
    }

    /// The same deformation with another number of quads, subdivided bilinearly.
    pub fn prolonged(&self, quads: (usize, usize)) -> Self {
        let (nx, ny) = (quads.0 + 1, quads.1 + 1);
        let mut coordinates = bilinear_resample(&self.coordinate(0), nx, ny).into_vec();
        coordinates.extend(bilinear_resample(&self.coordinate(1), nx, ny).into_vec());
        Self { nx, ny, coordinates }
    }

    /// Corners of quad `(i, j)`, counterclockwise from its lower left.
    pub fn quad(&self, i: usize, j: usize) -> [DVec2; 4] {
        [self.vertex(i, j), self.vertex(i + 1, j), self.vertex(i + 1, j + 1), self.vertex(i, j + 1)]
    }

    /// Areas of all quads, mm².
    pub fn areas_mm2(&self) -> Field<f64> {
        let width = self.nx - 1;
        let mut areas = vec![0.0; width * (self.ny - 1)];
        areas.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
            for (i, area) in row.iter_mut().enumerate() {
                let [a, b, c, d] = self.quad(i, j);
                *area = 0.5 * (c - a).perp_dot(d - b);
            }
        });
        Field::from_vec(width, self.ny - 1, areas)
    }

    /// Counts inverted and concave quads.
    pub fn folds(&self) -> FoldCount {
        let in_row = |j: usize| {
            let mut count = FoldCount::default();
            for i in 0..self.nx - 1 {
                let q = self.quad(i, j);
                if (q[2] - q[0]).perp_dot(q[3] - q[1]) <= 0.0 {
                    count.inverted += 1;
                } else if (0..4).any(|k| (q[(k + 1) % 4] - q[k]).perp_dot(q[(k + 3) % 4] - q[k]) < 0.0) {
                    count.concave += 1;
                }
            }
            count
        };
        (0..self.ny - 1).into_par_iter().map(in_row).reduce(FoldCount::default, |a, b| FoldCount {
            inverted: a.inverted + b.inverted,
            concave: a.concave + b.concave,
        })
    }
}

/// The fixed mesh on the receiver, at any number of quads.
#[derive(Clone, Debug)]
pub(crate) enum ReceiverMesh {
    /// Regular quads that tile the bench's window.
    Window {
        /// Its corner of least x and y, mm.
        corner: DVec2,
        /// Its centre, mm.
        centre: DVec2,
        /// Its size.
        extent: Extent,
    },
    /// What the user gave.
    Given(Arc<CausticMesh>),
}

impl ReceiverMesh {
    /// The window of a bench.
    pub(crate) fn window(bench: &Bench) -> Self {
        let (centre, extent) = (bench.window_centre_mm(), bench.window());
        Self::Window { corner: centre + extent.lower(), centre, extent }
    }

    /// The mesh that a solver works with: one that is given, or the window.
    pub(crate) fn of(given: Option<&Arc<CausticMesh>>, bench: &Bench) -> Self {
        given.map_or_else(|| Self::window(bench), |mesh| Self::Given(Arc::clone(mesh)))
    }

    /// Vertex `(i, j)` of `nx` by `ny`, mm.
    pub(crate) fn vertex(&self, i: usize, j: usize, nx: usize, ny: usize) -> DVec2 {
        match self {
            Self::Window { centre, extent, .. } => *centre + extent.node(i, j, nx, ny),
            Self::Given(mesh) => mesh.at(DVec2::new(i as f64 / (nx - 1) as f64, j as f64 / (ny - 1) as f64)).0,
        }
    }

    /// The point at a place counted in quads, of `quads` in all, mm.
    pub(crate) fn at(&self, place: DVec2, quads: (usize, usize)) -> DVec2 {
        let quads = DVec2::new(quads.0 as f64, quads.1 as f64);
        match self {
            Self::Window { corner, extent, .. } => *corner + place * (extent.as_vec() / quads),
            Self::Given(mesh) => mesh.at(place / quads).0,
        }
    }

    /// Whether vertex `(i, j)` of `nx` by `ny` lies where the mesh shows its front to the block.
    pub(crate) fn is_front(&self, i: usize, j: usize, nx: usize, ny: usize) -> bool {
        match self {
            Self::Window { .. } => true,
            Self::Given(mesh) => {
                let place = DVec2::new(i as f64 / (nx - 1) as f64, j as f64 / (ny - 1) as f64);
                mesh.at(place).1.determinant() >= 0.0
            }
        }
    }

    /// All vertices, mm.
    pub(crate) fn vertices(&self, nx: usize, ny: usize) -> Field<DVec2> {
        let mut data = vec![DVec2::ZERO; nx * ny];
        data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            row.iter_mut().enumerate().for_each(|(i, at)| *at = self.vertex(i, j, nx, ny));
        });
        Field::from_vec(nx, ny, data)
    }

    /// Flux that each of `quads` shall get, mean 1.
    pub(crate) fn flux(&self, target: &TargetIrradiance, bench: &Bench, quads: (usize, usize)) -> Field<f64> {
        match self {
            Self::Window { .. } => area_resample(target.cells(), quads.0, quads.1),
            // Where the light turns over a quad has next to no area, and gets next to no light.
            Self::Given(mesh) => mesh.flux(target, bench, quads).map(|v| v.max(2.0 * LEAST_TARGET)),
        }
    }

    /// How many pixels of the target there are along both sides.
    pub(crate) fn pixels(&self, target: &TargetIrradiance, bench: &Bench) -> (usize, usize) {
        let (nx, ny) = (target.cells().nx(), target.cells().ny());
        match self {
            Self::Window { .. } => (nx, ny),
            Self::Given(mesh) => mesh.pixels(bench.window().as_vec() / DVec2::new(nx as f64, ny as f64)),
        }
    }
}

/// Numbers of quads from the coarsest level to `finest`: each level has half the quads of the next,
/// rounded up, down to at most four along the shorter side.
pub fn pyramid(finest: (usize, usize)) -> Vec<(usize, usize)> {
    let mut levels = vec![finest];
    let (mut mx, mut my) = finest;
    while mx.min(my) > 4 {
        (mx, my) = (mx.div_ceil(2), my.div_ceil(2));
        levels.push((mx, my));
    }
    levels.reverse();
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: Extent = Extent::new(30.0, 20.0);

    #[test]
    fn areas_tile_the_block_however_the_mesh_is_deformed_inside() {
        let mut mesh = WarpMesh::regular(BLOCK, (9, 7));
        let n = 10 * 8;
        for j in 1..7 {
            for i in 1..9 {
                mesh.coordinates[j * 10 + i] += 0.9 * ((i * 3 + j * 5) as f64).sin();
                mesh.coordinates[n + j * 10 + i] -= 0.7 * ((i * 2 + j * 7) as f64).cos();
            }
        }
        let total: f64 = mesh.areas_mm2().as_slice().iter().sum();
        assert!((total - 600.0).abs() < 1e-10);
        let fine = mesh.prolonged((18, 14));
        assert_eq!(fine.vertex(6, 4), mesh.vertex(3, 2));
        assert!((fine.areas_mm2().as_slice().iter().sum::<f64>() - 600.0).abs() < 1e-10);
    }

    #[test]
    fn folds_are_told_from_dents() {
        let mut mesh = WarpMesh::regular(BLOCK, (6, 4));
        assert_eq!(mesh.folds(), FoldCount::default());
        let n = 7 * 5;
        // Push a vertex a little beyond the diagonal of one of its quads, then far beyond.
        for (share, expected) in
            [(0.6, FoldCount { inverted: 0, concave: 1 }), (1.4, FoldCount { inverted: 1, concave: 2 })]
        {
            let mut dented = mesh.clone();
            dented.coordinates[2 * 7 + 3] += share * 5.0;
            dented.coordinates[n + 2 * 7 + 3] += share * 5.0;
            assert_eq!(dented.folds(), expected, "{share}");
        }
        mesh.coordinates.swap(8, 9);
        assert!(mesh.folds().inverted > 0);
    }

    #[test]
    fn the_pyramid_takes_any_size() {
        assert_eq!(
            pyramid((640, 640)),
            [(3, 3), (5, 5), (10, 10), (20, 20), (40, 40), (80, 80), (160, 160), (320, 320), (640, 640)]
        );
        assert_eq!(pyramid((451, 299)).last(), Some(&(451, 299)));
        assert_eq!(pyramid((3, 200)), [(3, 200)]);
    }
}
