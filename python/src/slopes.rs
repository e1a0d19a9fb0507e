//! Heights from slopes.

use crate::{arrays, fault, work};
use glasswarp::{
    glam::DVec2,
    grid::{Extent, Field},
    surface::{EdgeRule, heights_of_slopes},
};
use numpy::{PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The heights of the nodes, mm, whose slopes along x and y fit these best. Rows lie along +y.
#[pyfunction]
pub(crate) fn heights<'py>(
    py: Python<'py>,
    along_x: PyReadonlyArray2<'py, f64>,
    along_y: PyReadonlyArray2<'py, f64>,
    size_mm: (f64, f64),
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (width_mm, height_mm) = size_mm;
    let [ny, nx] = [along_x.shape()[0], along_x.shape()[1]];
    if nx.min(ny) < 4 || along_y.shape() != along_x.shape() {
        return Err(fault::refused(
            py,
            format!("slopes of {nx} x {ny} nodes; both must be known at 4 x 4 nodes or more"),
        ));
    }
    if !(width_mm > 0.0 && height_mm > 0.0 && width_mm.is_finite() && height_mm.is_finite()) {
        return Err(fault::refused(py, format!("a face of {width_mm} x {height_mm} mm; both must be above 0")));
    }
    let (along_x, along_y) = (along_x.as_slice()?, along_y.as_slice()?);
    let heights = work::done_within(py, |_| {
        let slopes = Field::from_fn(nx, ny, |i, j| DVec2::new(along_x[j * nx + i], along_y[j * nx + i]));
        let heights = heights_of_slopes(&slopes, Extent::new(width_mm, height_mm), EdgeRule::FourPoint);
        heights.into_heights_mm().into_vec()
    })?;
    arrays::taken(py, (nx, ny), heights)
}
