//! Boxes about points, and points within polygons.

use asbuilt_core::{boxes, polygon};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
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

/// Which points (n, 2) lie within the rings, (k, 2) each, of a polygon or of several; holes are rings, too.
#[pyfunction]
pub fn within<'py>(
    py: Python<'py>,
    rings: Vec<PyReadonlyArray2<'py, f64>>,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let rings = rings.iter().map(|ring| Ok(rows("ring", ring)?.into_owned())).collect::<PyResult<Vec<_>>>()?;
    let points = rows("points", &points)?;
    Ok(py.detach(|| polygon::within(&rings, &points)).into_pyarray(py))
}
