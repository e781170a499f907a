//! Lines traced through weighted points, and the points along segments.

use asbuilt_core::neighbours::Neighbours;
use asbuilt_core::trace::{Trace, trace};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::rows::rows;

/// Lines (n, 4), m, and their weights (n,), traced through points (m, 2) of weights (m,), strongest place first.
#[pyfunction]
#[pyo3(signature = (points, weights, *, band, reach, gap, min_weight, min_length))]
#[allow(clippy::too_many_arguments, clippy::type_complexity, reason = "keywords and arrays in Python")]
pub fn trace_lines<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    weights: PyReadonlyArray1<'py, f64>,
    band: f64,
    reach: f64,
    gap: f64,
    min_weight: f64,
    min_length: f64,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
    let points: Vec<[f64; 2]> = rows("points", &points)?;
    let weights = weights.as_array().to_vec();
    if points.len() != weights.len() {
        return Err(PyValueError::new_err(format!("{} points, {} weights", points.len(), weights.len())));
    }
    let search = Trace { band, reach, gap, min_weight, min_length };
    let lines = py.detach(|| trace(&points, &weights, &search));
    let ends: Vec<f64> = lines.iter().flat_map(|line| line.ends).collect();
    let weights: Vec<f64> = lines.iter().map(|line| line.weight).collect();
    Ok((ends.into_pyarray(py).reshape([weights.len(), 4])?, weights.into_pyarray(py)))
}

/// The points (m, 2) within `half_width` of each segment (n, 4) and at most `margin` beyond its ends: segment index,
/// point index, distance along, offset to the left; in order of segment and point.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "arrays in Python")]
pub fn strips<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    segments: PyReadonlyArray2<'py, f64>,
    half_width: f64,
    margin: f64,
) -> PyResult<(
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
)> {
    let points: Vec<[f64; 2]> = rows("points", &points)?;
    let segments: Vec<[f64; 4]> = rows("segments", &segments)?;
    let found: Vec<Vec<(usize, f64, f64)>> = py.detach(|| {
        let neighbours = Neighbours::new(&points, half_width.max(0.25));
        segments
            .par_iter()
            .map(|&segment| {
                let mut found = Vec::new();
                neighbours.in_strip(segment, half_width, margin, |i, along, offset| found.push((i, along, offset)));
                found.sort_unstable_by_key(|f| f.0);
                found
            })
            .collect()
    });
    let total = found.iter().map(Vec::len).sum();
    let mut columns =
        (Vec::with_capacity(total), Vec::with_capacity(total), Vec::with_capacity(total), Vec::with_capacity(total));
    for (segment, strip) in found.into_iter().enumerate() {
        for (point, along, offset) in strip {
            columns.0.push(segment as i64);
            columns.1.push(point as i64);
            columns.2.push(along);
            columns.3.push(offset);
        }
    }
    Ok((columns.0.into_pyarray(py), columns.1.into_pyarray(py), columns.2.into_pyarray(py), columns.3.into_pyarray(py)))
}
