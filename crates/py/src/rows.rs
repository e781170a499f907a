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
    // Not `array.as_slice()`, which also takes arrays that lie column by column.
    if let Some(rows) = view.to_slice().and_then(|values| bytemuck::try_cast_slice(values).ok()) {
        return Ok(Cow::Borrowed(rows));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|column| row[column])).collect())
}

/// The values of an array, row by row.
pub fn row_by_row<'a, T: Element + Copy>(array: &'a PyReadonlyArray2<'_, T>) -> Cow<'a, [T]> {
    let view = array.as_array();
    view.to_slice().map_or_else(|| view.iter().copied().collect(), Cow::Borrowed)
}
