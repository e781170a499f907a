//! The Hough transform's two searches.

use asbuilt_core::hough::{self, Search};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::rows;

type Found<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u32>>);

/// Segments (n, 4) in cells and their votes (n,), strongest peak first: one by one, each cell used once, if
/// `incremental`, else of all peaks at once.
#[pyfunction]
#[pyo3(signature = (cells, *, incremental, orientations, rho_step, fill_gap, min_length, min_votes, max_lines))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn hough_lines<'py>(
    py: Python<'py>,
    cells: PyReadonlyArray2<'py, i32>,
    incremental: bool,
    orientations: usize,
    rho_step: f64,
    fill_gap: f64,
    min_length: f64,
    min_votes: u32,
    max_lines: usize,
) -> PyResult<Found<'py>> {
    let search = Search { orientations, rho_step, fill_gap, min_length, min_votes, max_lines };
    let find = if incremental { hough::incremental } else { hough::batch };
    let cells = rows("cells", &cells)?;
    if search.orientations == 0 || search.rho_step.is_nan() || search.rho_step <= 0.0 {
        return Err(PyValueError::new_err("expected at least one orientation and a positive rho step"));
    }
    let segments = py.detach(|| find(&cells, &search));
    let ends: Vec<f64> = segments.iter().flat_map(|segment| segment.ends).collect();
    let votes: Vec<u32> = segments.iter().map(|segment| segment.votes).collect();
    Ok((ends.into_pyarray(py).reshape([votes.len(), 4])?, votes.into_pyarray(py)))
}
