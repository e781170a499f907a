//! Points near lines, counted by the steps of the lines.

use asbuilt_core::hits::{self, Hits as Inner, Range};
use asbuilt_core::sparse;
use numpy::ndarray::ArrayView1;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::row_by_row;

/// Points near lines, each at a step of its line; made by `Places.hits`.
///
/// What counts at a step is given by `ranges`, arrays over the steps (m,): on which side of the line (1: left, -1:
/// right), from and to which depth to that side, about which height and from and to how far above it, m; ends do not
/// count.
#[pyclass(frozen, module = "asbuilt._core")]
pub struct Hits {
    pub inner: Inner,
    pub steps: usize,
}

type Values<'py> = PyReadonlyArray1<'py, f64>;
type Ranges<'py> = (Values<'py>, (Values<'py>, Values<'py>), Values<'py>, (Values<'py>, Values<'py>));

impl Hits {
    /// Sides, ends of depths, middle heights and ends of heights, each over all steps.
    fn views<'a>(&self, (side, depth, about, height): &'a Ranges) -> PyResult<[ArrayView1<'a, f64>; 6]> {
        let arrays = [side, &depth.0, &depth.1, about, &height.0, &height.1].map(|array| array.as_array());
        if let Some(wrong) = arrays.iter().find(|array| array.len() != self.steps) {
            return Err(PyValueError::new_err(format!("expected {} steps, found {}", self.steps, wrong.len())));
        }
        Ok(arrays)
    }

    fn ranges(&self, ranges: &Ranges) -> PyResult<Vec<Range>> {
        let views = self.views(ranges)?;
        Ok((0..self.steps).map(|step| at(&views, step)).collect())
    }
}

fn at([side, from, to, about, low, high]: &[ArrayView1<'_, f64>; 6], step: usize) -> Range {
    Range { side: side[step], depth: [from[step], to[step]], about: about[step], height: [low[step], high[step]] }
}

#[pymethods]
impl Hits {
    /// The height of the highest point, m; minus infinity without any.
    #[getter]
    fn highest(&self) -> f64 {
        self.inner.highest()
    }

    /// How many points each step has (m,) in each of some ranges.
    fn counts<'py>(&self, py: Python<'py>, ranges: Vec<Ranges<'py>>) -> PyResult<Vec<Bound<'py, PyArray1<u32>>>> {
        let views = ranges.iter().map(|ranges| self.views(ranges)).collect::<PyResult<Vec<_>>>()?;
        let counts = py.detach(|| self.inner.counts(self.steps, views.len(), |number, step| at(&views[number], step)));
        Ok(counts.into_iter().map(|counts| counts.into_pyarray(py)).collect())
    }

    /// How many points each step has in each of `cells` depths of `cell` metres (m, cells).
    fn by_depth<'py>(
        &self,
        py: Python<'py>,
        ranges: Ranges<'py>,
        cell: f64,
        cells: usize,
    ) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let ranges = self.ranges(&ranges)?;
        py.detach(|| self.inner.by_depth(&ranges, cell, cells)).into_pyarray(py).reshape([self.steps, cells])
    }

    /// How many points each step has in each of `cells` heights of `cell` metres, from 0 up (m, cells).
    fn by_height<'py>(
        &self,
        py: Python<'py>,
        ranges: Ranges<'py>,
        cell: f64,
        cells: usize,
    ) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let ranges = self.ranges(&ranges)?;
        py.detach(|| self.inner.by_height(&ranges, cell, cells)).into_pyarray(py).reshape([self.steps, cells])
    }
}

/// Means (m, k) over the `width` steps about each step of values (m, k), never across lines; line i has the steps from
/// `first[i]` to before `first[i + 1]`.
#[pyfunction]
pub fn means_along<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
    first: PyReadonlyArray1<'py, i64>,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let shape = [values.shape()[0], values.shape()[1]];
    let first = line_starts(&first, shape[0])?;
    let values = row_by_row(&values);
    py.detach(|| hits::means_along(&values, shape[1], &first, width)).into_pyarray(py).reshape(shape)
}

/// Values (m,), 0 or more, with gaps of fewer than `width` (odd) steps filled to the level of their shores, never across
/// lines; line i has the steps from `first[i]` to before `first[i + 1]`.
#[pyfunction]
pub fn close_gaps<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
    first: PyReadonlyArray1<'py, i64>,
    width: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let first = line_starts(&first, values.len())?;
    let values = values.as_slice()?;
    Ok(py.detach(|| hits::close_gaps(values, &first, width)).into_pyarray(py))
}

/// Cells (m, rows) with the gaps closed between filled ones where few are filled, never across lines.
///
/// Of `around` x `around` cells less than a `share` is filled there; the closing is by `width` x `width` cells; both
/// are odd. Line i has the steps from `first[i]` to before `first[i + 1]`.
#[pyfunction]
#[pyo3(signature = (filled, first, *, around, share, width))]
pub fn close_sparse<'py>(
    py: Python<'py>,
    filled: PyReadonlyArray2<'py, bool>,
    first: PyReadonlyArray1<'py, i64>,
    around: usize,
    share: f64,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<bool>>> {
    let shape = [filled.shape()[0], filled.shape()[1]];
    let first = line_starts(&first, shape[0])?;
    let filled = row_by_row(&filled);
    py.detach(|| sparse::close_sparse(&filled, shape[1], &first, around, share, width)).into_pyarray(py).reshape(shape)
}

/// Where each line's steps begin, and where the last one's end.
fn line_starts(first: &PyReadonlyArray1<'_, i64>, steps: usize) -> PyResult<Vec<usize>> {
    let first: Vec<usize> = first.as_array().iter().map(|&i| i as usize).collect();
    if first.last() != Some(&steps) || !first.is_sorted() {
        return Err(PyValueError::new_err("first: expected where each line begins, and where the last one ends"));
    }
    Ok(first)
}
