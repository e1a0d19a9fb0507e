//! The exit face: normals to slopes, slopes to heights, the spline through the heights, and the control net of CAD files.

mod axis;
mod integrate;
mod net;
mod polish;
mod spline;

pub use integrate::{EdgeRule, heights_of_slopes, least_squares, least_squares_by_conjugate_gradients};
pub use net::{ControlNet, DEGREE, FitError};
pub use polish::{Polish, PolishError};
pub use spline::{SurfaceSample, SurfaceSpline};

use crate::grid::{Extent, Field};

/// Heights of the exit face at nodes that span it edge to edge, mm, with the mean of all nodes at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    extent: Extent,
    heights_mm: Field<f64>,
}

impl HeightField {
    /// Takes over node heights, mm, and shifts them to the mean 0.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn new(extent: Extent, mut heights_mm: Field<f64>) -> Self {
        assert!(heights_mm.nx() >= 4 && heights_mm.ny() >= 4, "a height field needs 4 x 4 nodes");
        let mean = heights_mm.mean();
        heights_mm.as_mut_slice().iter_mut().for_each(|z| *z -= mean);
        Self { extent, heights_mm }
    }

    /// Size of the face.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Node heights, mm.
    pub fn heights_mm(&self) -> &Field<f64> {
        &self.heights_mm
    }

    /// The same face on another number of nodes: the spline through its own, sampled.
    pub fn resampled(&self, nx: usize, ny: usize) -> Self {
        let spline = SurfaceSpline::through(self);
        let lattice = spline.lattice(nx, ny);
        let mut data = vec![0.0; nx * ny];
        let mut scratch = Vec::new();
        for (j, row) in data.chunks_mut(nx).enumerate() {
            lattice.row(j, &mut scratch, |i, height, _| row[i] = height);
        }
        Self::new(self.extent, Field::from_vec(nx, ny, data))
    }

    /// Peak to valley, mm.
    pub fn relief_mm(&self) -> f64 {
        let (low, high) = self.heights_mm.min_max();
        high - low
    }
}
