//! Grids of heights over the ground.

use asbuilt_core::heights::Heights;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::rows;

/// The heights (k, n) about places (n, 2), m, after each of some steps (k, 2: to a side, along; m), in the directions
/// (n, 2) to each place's side and along; of a grid (nx, ny) of cells of `cell` metres, the first of index `low`. Beyond
/// it are the heights of its border.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "arrays in Python")]
pub fn heights_about<'py>(
    py: Python<'py>,
    grid: PyReadonlyArray2<'py, f64>,
    low: [i64; 2],
    cell: f64,
    steps: PyReadonlyArray2<'py, f64>,
    places: PyReadonlyArray2<'py, f64>,
    aside: PyReadonlyArray2<'py, f64>,
    along: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (steps, places) = (rows("steps", &steps)?, rows("places", &places)?);
    let (aside, along) = (rows("aside", &aside)?, rows("along", &along)?);
    let shape = [grid.shape()[0], grid.shape()[1]];
    if aside.len() != places.len() || along.len() != places.len() || shape.contains(&0) {
        return Err(PyValueError::new_err("expected a cell or more, and two directions for each place"));
    }
    let heights = grid.as_slice()?;
    let found = py.detach(|| Heights { heights, shape, low, cell }.about(&steps, &places, &aside, &along));
    found.into_pyarray(py).reshape([steps.len(), places.len()])
}
