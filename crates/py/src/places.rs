//! Points on a lattice of ground cells, found by place.

use asbuilt_core::trace::{Trace, trace};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::to_python;
use crate::hits::Hits;
use crate::rows::rows;

/// Points (n, 2), m, sorted by the ground cell (n, 2) of side `cell` (m) that each lies in.
#[pyclass(frozen, module = "asbuilt._core")]
pub struct Places {
    inner: asbuilt_core::places::Places,
}

impl Places {
    /// Whether a point does not lie between two heights; without heights none is out.
    fn is_out<'a>(
        &self,
        heights: Option<&'a [f64]>,
        between: Option<[f64; 2]>,
    ) -> PyResult<impl Fn(usize) -> bool + Send + Sync + 'a> {
        if heights.is_some_and(|heights| heights.len() != self.inner.points().len()) {
            return Err(PyValueError::new_err("expected a height for each point"));
        }
        let [low, high] = between.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        Ok(move |point: usize| heights.is_some_and(|heights| !(heights[point] > low && heights[point] < high)))
    }
}

#[pymethods]
impl Places {
    #[new]
    fn new(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        index: PyReadonlyArray2<'_, i32>,
        cell: f64,
    ) -> PyResult<Self> {
        let index = rows("index", &index)?;
        let inner = asbuilt_core::places::Places::new(rows("points", &points)?.into_owned(), &index, cell)
            .map_err(|error| to_python(py, &error))?;
        Ok(Self { inner })
    }

    /// Indices of the points in a rectangle (m), in order; of those, as in `strips`, that lie between two heights.
    #[pyo3(signature = (low, high, heights=None, between=None))]
    fn in_box<'py>(
        &self,
        py: Python<'py>,
        low: [f64; 2],
        high: [f64; 2],
        heights: Option<PyReadonlyArray1<'py, f64>>,
        between: Option<[f64; 2]>,
    ) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let heights = heights.as_ref().map(|heights| heights.as_slice()).transpose()?;
        let is_out = self.is_out(heights, between)?;
        let mut found = Vec::new();
        self.inner.in_box(low, high, |i| {
            if !is_out(i) {
                found.push(i as i64);
            }
        });
        Ok(found.into_pyarray(py))
    }

    /// The points within `half_width` of each segment (n, 4) and at most `margin` beyond its ends: segment index, point
    /// index, distance along, offset to the left; in order of segment and point. Of all points' `heights` (m,), those
    /// `between` two count, if they are given; the ends do not.
    #[pyo3(signature = (segments, half_width, margin, heights=None, between=None))]
    #[allow(clippy::type_complexity, reason = "arrays in Python")]
    fn strips<'py>(
        &self,
        py: Python<'py>,
        segments: PyReadonlyArray2<'py, f64>,
        half_width: f64,
        margin: f64,
        heights: Option<PyReadonlyArray1<'py, f64>>,
        between: Option<[f64; 2]>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let segments = rows("segments", &segments)?;
        let heights = heights.as_ref().map(|heights| heights.as_slice()).transpose()?;
        let is_out = self.is_out(heights, between)?;
        let mut columns = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        py.detach(|| {
            for (segment, &ends) in segments.iter().enumerate() {
                self.inner.in_strip(ends, half_width, margin, |point, along, offset| {
                    if is_out(point) {
                        return;
                    }
                    columns.0.push(segment as i64);
                    columns.1.push(point as i64);
                    columns.2.push(along);
                    columns.3.push(offset);
                });
            }
        });
        Ok((
            columns.0.into_pyarray(py),
            columns.1.into_pyarray(py),
            columns.2.into_pyarray(py),
            columns.3.into_pyarray(py),
        ))
    }

    /// Lines (n, 4), m, and their weights (n,), traced through the points, which weigh (m,), strongest place first.
    #[pyo3(signature = (weights, *, band, reach, gap, min_weight, min_length))]
    #[allow(clippy::too_many_arguments, clippy::type_complexity, reason = "keywords and arrays in Python")]
    fn trace_lines<'py>(
        &self,
        py: Python<'py>,
        weights: PyReadonlyArray1<'py, f64>,
        band: f64,
        reach: f64,
        gap: f64,
        min_weight: f64,
        min_length: f64,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
        let weights = weights.as_slice()?;
        if weights.len() != self.inner.points().len() {
            return Err(PyValueError::new_err("expected a weight for each point"));
        }
        let search = Trace { band, reach, gap, min_weight, min_length };
        let lines = py.detach(|| trace(&self.inner, weights, &search));
        let ends: Vec<f64> = lines.iter().flat_map(|line| line.ends).collect();
        let weights: Vec<f64> = lines.iter().map(|line| line.weight).collect();
        Ok((ends.into_pyarray(py).reshape([weights.len(), 4])?, weights.into_pyarray(py)))
    }

    /// The points within `half_width` of each line (n, 4) and at most `margin` beyond its ends, m, by the steps of
    /// `step` metres from the margin before its start: line i has those from `first[i]` to before `first[i + 1]`.
    /// `heights` (m,) are those of all points, m.
    #[allow(clippy::too_many_arguments, reason = "arrays in Python")]
    fn hits(
        &self,
        py: Python<'_>,
        heights: PyReadonlyArray1<'_, f64>,
        lines: PyReadonlyArray2<'_, f64>,
        half_width: f64,
        margin: f64,
        step: f64,
        first: PyReadonlyArray1<'_, i64>,
    ) -> PyResult<Hits> {
        let lines = rows("lines", &lines)?;
        let first: Vec<usize> = first.as_array().iter().map(|&i| i as usize).collect();
        let heights = heights.as_slice()?;
        if first.len() != lines.len() + 1 || heights.len() != self.inner.points().len() {
            return Err(PyValueError::new_err("expected a first step for each line, and a height for each point"));
        }
        let steps = first[lines.len()];
        let inner = py
            .detach(|| asbuilt_core::hits::Hits::new(&self.inner, heights, &lines, [half_width, margin], step, &first));
        Ok(Hits { inner, steps })
    }
}
