//! Fields of the library as arrays of numpy.

use glasswarp::grid::Field;
use glasswarp_verify::Image;
use numpy::{
    PyArray2,
    ndarray::{Array2, ArrayView2},
};
use pyo3::{PyClass, exceptions::PyRuntimeError, prelude::*, pyclass::boolean_struct::True};

/// An array that takes a vector over, row by row.
pub(crate) fn taken(py: Python<'_>, (nx, ny): (usize, usize), values: Vec<f64>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = Array2::from_shape_vec((ny, nx), values);
    let rows = rows.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(PyArray2::from_owned_array(py, rows))
}

/// An image as an array, its top row first.
pub(crate) fn of_image(py: Python<'_>, image: Image) -> PyResult<Bound<'_, PyArray2<f64>>> {
    taken(py, (image.nx, image.ny), image.values)
}

/// A field that an object of Python owns, seen as an array that cannot be written to; nothing is
/// copied.
///
/// The owner is frozen: what it lends never changes, and lives as long as the array does.
pub(crate) fn lent<'py, T: PyClass<Frozen = True> + Sync>(
    owner: &Bound<'py, T>,
    field: impl FnOnce(&T) -> &Field<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let field = field(owner.get());
    let view = ArrayView2::from_shape((field.ny(), field.nx()), field.as_slice());
    let view = view.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    // SAFETY: the field is part of the frozen `owner`, which the array keeps alive, and nobody
    // writes to it: not the library, which has no other access, nor numpy, which is told below
    // before anybody else has the array.
    #[allow(unsafe_code)]
    let array = unsafe { PyArray2::borrow_from_array(&view, owner.clone().into_any()) };
    array.call_method1("setflags", (false,))?;
    Ok(array)
}
