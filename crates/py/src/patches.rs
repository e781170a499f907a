//! What hangs together.

use asbuilt_core::patches;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::row_by_row;

/// The number (count,) of the group that each of so many things is in, by pairs of things that hang together, the first
/// (k,) and the second (k,) of each; groups are numbered by their first thing.
#[pyfunction]
pub fn groups<'py>(
    py: Python<'py>,
    count: usize,
    first: PyReadonlyArray1<'py, i64>,
    second: PyReadonlyArray1<'py, i64>,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    let (first, second) = (first.as_array(), second.as_array());
    let pairs: Vec<_> = first.iter().zip(second).map(|(&one, &other)| [one as usize, other as usize]).collect();
    if first.len() != second.len() || pairs.iter().flatten().any(|&thing| thing >= count) {
        return Err(PyValueError::new_err(format!("expected pairs of things below {count}")));
    }
    Ok(py.detach(|| patches::groups(count, pairs)).into_pyarray(py))
}

/// The number (n, k) of the patch that each filled cell (n, k) of a picture is in, from 1 on in the order of their first
/// cells, and 0 for the others. Cells that touch by a corner hang together.
#[pyfunction]
pub fn patches_of<'py>(py: Python<'py>, filled: PyReadonlyArray2<'py, bool>) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let shape = [filled.shape()[0], filled.shape()[1]];
    let cells = row_by_row(&filled);
    py.detach(|| patches::patches(&cells, shape[1])).into_pyarray(py).reshape(shape)
}
