//! Grids of heights over the ground.

use asbuilt_core::heights::Heights;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::{row_by_row, rows};

/// The height (n,), m, about each place (n, 2): of those after some steps (k, 2: to a side, along; m), in the directions
/// (n, 2) to its side and along, that are finite, the one at a `share` from the least to the greatest. Not a number where
/// fewer than `least` are; and 0 where a quarter of them lie nearer than `level` to 0. They are those of a grid (nx, ny)
/// of cells of `cell` metres, the first of index `low`; beyond it are the heights of its border.
#[pyfunction]
#[pyo3(signature = (grid, low, cell, steps, places, aside, along, *, share, least, level=0.0))]
#[allow(clippy::too_many_arguments, reason = "arrays in Python")]
pub fn height_about<'py>(
    py: Python<'py>,
    grid: PyReadonlyArray2<'py, f64>,
    low: [i64; 2],
    cell: f64,
    steps: PyReadonlyArray2<'py, f64>,
    places: PyReadonlyArray2<'py, f64>,
    aside: PyReadonlyArray2<'py, f64>,
    along: PyReadonlyArray2<'py, f64>,
    share: f64,
    least: usize,
    level: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (steps, places) = (rows("steps", &steps)?, rows("places", &places)?);
    let (aside, along) = (rows("aside", &aside)?, rows("along", &along)?);
    let shape = [grid.shape()[0], grid.shape()[1]];
    if aside.len() != places.len() || along.len() != places.len() || shape.contains(&0) {
        return Err(PyValueError::new_err("expected a cell or more, and two directions for each place"));
    }
    if !(0.0..=1.0).contains(&share) {
        return Err(PyValueError::new_err(format!("expected a share from 0 to 1, found {share}")));
    }
    let heights = row_by_row(&grid);
    let grid = Heights { heights: &heights, shape, low, cell };
    let ways = [&*places, &*aside, &*along];
    Ok(py.detach(|| grid.about(&steps, ways, share, least, level)).into_pyarray(py))
}
