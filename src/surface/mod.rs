//! The exit face: normals to slopes, slopes to heights, the spline through the heights, and the control net of CAD files.

mod axis;
mod extend;
mod integrate;
mod net;
mod polish;
mod spline;

pub use integrate::{EdgeRule, heights_of_slopes, least_squares, least_squares_by_conjugate_gradients};
pub use net::{ControlNet, DEGREE, FitError};
pub use polish::{Polish, PolishError};
pub use spline::{SurfaceSample, SurfaceSpline};

use crate::grid::{Contour, Extent, Field, Outline};

/// Heights of the exit face at nodes that span its extent edge to edge, mm, with the mean of all nodes within its outline at 0.
///
/// Nodes beyond the outline carry a smooth continuation, which the spline through the nodes needs.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    extent: Extent,
    outline: Outline,
    heights_mm: Field<f64>,
}

impl HeightField {
    /// Takes over node heights of a rectangular face, mm, and shifts them to the mean 0.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn new(extent: Extent, heights_mm: Field<f64>) -> Self {
        Self::outlined(extent, Outline::Rectangle, heights_mm)
    }

    /// Takes over node heights of a face of any outline, mm, and shifts them to the mean 0 of those within. Nodes beyond the
    /// outline that are not a number are given a smooth continuation.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn outlined(extent: Extent, outline: Outline, mut heights_mm: Field<f64>) -> Self {
        assert!(heights_mm.nx() >= 4 && heights_mm.ny() >= 4, "a height field needs 4 x 4 nodes");
        let contour = outline.within(extent);
        let mean = if contour.is_rectangle() {
            heights_mm.mean()
        } else {
            extend::fill_missing(&mut heights_mm);
            let (sum, count) = within(&contour, &heights_mm).fold((0.0, 0), |(sum, count), z| (sum + z, count + 1));
            sum / f64::from(count)
        };
        heights_mm.as_mut_slice().iter_mut().for_each(|z| *z -= mean);
        Self { extent, outline, heights_mm }
    }

    /// A face of the same extent and outline with other heights, mm, shifted to the mean 0.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side.
    pub fn with_heights(&self, heights_mm: Field<f64>) -> Self {
        Self::outlined(self.extent, self.outline, heights_mm)
    }

    /// Size of the face.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// The outline of the face within its extent.
    pub fn outline(&self) -> Outline {
        self.outline
    }

    /// The curve around the face.
    pub fn contour(&self) -> Contour {
        self.outline.within(self.extent)
    }

    /// Node heights, mm; beyond the outline, their continuation.
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
        self.with_heights(Field::from_vec(nx, ny, data))
    }

    /// Least and greatest node height within the outline, mm.
    pub fn range_mm(&self) -> (f64, f64) {
        let contour = self.contour();
        if contour.is_rectangle() {
            return self.heights_mm.min_max();
        }
        within(&contour, &self.heights_mm).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
            // Also where a height is not a number.
            if z.is_nan() { (z, z) } else { (low.min(z), high.max(z)) }
        })
    }

    /// Peak to valley, mm.
    pub fn relief_mm(&self) -> f64 {
        let (low, high) = self.range_mm();
        high - low
    }
}

/// The heights of the nodes within a contour, row by row.
fn within<'a>(contour: &'a Contour, heights: &'a Field<f64>) -> impl Iterator<Item = f64> + 'a {
    let (nx, ny) = (heights.nx(), heights.ny());
    let extent = contour.extent();
    heights
        .as_slice()
        .iter()
        .enumerate()
        .filter(move |(k, _)| contour.contains(extent.node(k % nx, k / nx, nx, ny)))
        .map(|(_, &z)| z)
}
