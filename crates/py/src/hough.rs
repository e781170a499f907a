//! The Hough transform's two searches.

use asbuilt_core::hough::{Search, Segment, batch, incremental};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Found<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u32>>);

/// Segments (n, 4) in cells and their votes (n,), strongest first, each cell used once.
#[pyfunction]
#[pyo3(signature = (cells, *, orientations, rho_step, fill_gap, min_length, min_votes, max_lines))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn hough_incremental<'py>(
    py: Python<'py>,
    cells: PyReadonlyArray2<'py, i32>,
    orientations: usize,
    rho_step: f64,
    fill_gap: f64,
    min_length: f64,
    min_votes: u32,
    max_lines: usize,
) -> PyResult<Found<'py>> {
    let search = Search { orientations, rho_step, fill_gap, min_length, min_votes, max_lines };
    run(py, &cells, search, incremental)
}

/// Segments (n, 4) in cells and their votes (n,), of all peaks at once, strongest peak first.
#[pyfunction]
#[pyo3(signature = (cells, *, orientations, rho_step, fill_gap, min_length, min_votes, max_lines))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn hough_batch<'py>(
    py: Python<'py>,
    cells: PyReadonlyArray2<'py, i32>,
    orientations: usize,
    rho_step: f64,
    fill_gap: f64,
    min_length: f64,
    min_votes: u32,
    max_lines: usize,
) -> PyResult<Found<'py>> {
    let search = Search { orientations, rho_step, fill_gap, min_length, min_votes, max_lines };
    run(py, &cells, search, batch)
}

fn run<'py>(
    py: Python<'py>,
    cells: &PyReadonlyArray2<'py, i32>,
    search: Search,
    find: fn(&[[i32; 2]], &Search) -> Vec<Segment>,
) -> PyResult<Found<'py>> {
    let array = cells.as_array();
    if array.ncols() != 2 {
        return Err(PyValueError::new_err(format!("cells: expected shape (n, 2), found (n, {})", array.ncols())));
    }
    if search.orientations == 0 || search.rho_step.is_nan() || search.rho_step <= 0.0 {
        return Err(PyValueError::new_err("expected at least one orientation and a positive rho step"));
    }
    let cells: Vec<[i32; 2]> = array.rows().into_iter().map(|row| [row[0], row[1]]).collect();
    let segments = py.detach(|| find(&cells, &search));
    let ends: Vec<f64> = segments.iter().flat_map(|segment| segment.ends).collect();
    let votes: Vec<u32> = segments.iter().map(|segment| segment.votes).collect();
    Ok((ends.into_pyarray(py).reshape([votes.len(), 4])?, votes.into_pyarray(py)))
}
