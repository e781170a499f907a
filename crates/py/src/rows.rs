//! Two-dimensional arrays as rows of a known length.

use std::borrow::Cow;

use bytemuck::Pod;
use numpy::{Element, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The rows of an array that must have `N` columns, as they lie where they lie one after the other; `name` is that of the
/// argument.
pub fn rows<'a, T: Element + Pod, const N: usize>(
    name: &str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> PyResult<Cow<'a, [[T; N]]>> {
    let view = array.as_array();
    if view.ncols() != N {
        return Err(PyValueError::new_err(format!("{name}: expected shape (n, {N}), found (n, {})", view.ncols())));
    }
    if let Some(rows) = array.as_slice().ok().and_then(|values| bytemuck::try_cast_slice(values).ok()) {
        return Ok(Cow::Borrowed(rows));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|column| row[column])).collect())
}
