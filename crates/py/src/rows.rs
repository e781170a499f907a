//! Two-dimensional arrays as rows of a known length.

use numpy::{Element, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The rows of an array that must have `N` columns; `name` is that of the argument.
pub fn rows<T: Element + Copy, const N: usize>(name: &str, array: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; N]>> {
    let array = array.as_array();
    if array.ncols() != N {
        return Err(PyValueError::new_err(format!("{name}: expected shape (n, {N}), found (n, {})", array.ncols())));
    }
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|column| row[column])).collect())
}
