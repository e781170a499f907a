//! Boxes about points.

use asbuilt_core::boxes;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::rows::rows;

/// How far (k, n) each point (n, 2), m, lies from the nearest side of the box about all of them that is turned by each of
/// some directions (k, 2: cosine, sine), its sides where `shares` of the points lie below.
#[pyfunction]
pub fn from_box_sides<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    shares: [f64; 2],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (points, directions) = (rows("points", &points)?, rows("directions", &directions)?);
    let found = py.detach(|| boxes::from_sides(&points, &directions, shares));
    found.into_pyarray(py).reshape([directions.len(), points.len()])
}
