//! Points from numpy and to it, without a copy on the way in.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The rows of an array `[n, 3]`, as they lie in memory.
///
/// # Errors
/// `ValueError` for another shape, or rows that are not one after the other.
pub(crate) fn rows<'a, T: numpy::Element>(
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; 3]]> {
    if array.shape()[1] != 3 {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!(
            "{name}: shape {shape:?}: must be (n, 3)"
        )));
    }
    let values = array
        .as_slice()
        .map_err(|_not_contiguous| PyValueError::new_err(format!("{name}: must be contiguous")))?;
    Ok(values.as_chunks().0)
}

/// Rows as an array `[n, N]`.
pub(crate) fn array<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}
