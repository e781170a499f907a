//! Voxel evidence.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use asbuilt_core::gather::{FileReport, Frame, Progress, gather};
use asbuilt_core::voxel::{QUANTUM, SIDE};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::to_python;

/// The mergeable summary of a cloud.
#[pyclass(frozen)]
pub struct Evidence {
    inner: asbuilt_core::voxel::Evidence,
}

/// Path, points left out (invalid, not finite), and the exception if the file is bad.
type Report = (PathBuf, u64, u64, Option<PyErr>);

#[pymethods]
impl Evidence {
    /// Gather the evidence of files. `progress` is called with the number of points so far, some ten times a second.
    #[staticmethod]
    #[pyo3(signature = (paths, *, voxel, unit, axes, threads, progress=None))]
    fn gather(
        py: Python<'_>,
        paths: Vec<PathBuf>,
        voxel: f64,
        unit: f64,
        axes: [i8; 3],
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Self, Vec<Report>)> {
        let mut sorted = axes.map(i8::abs);
        sorted.sort_unstable();
        if sorted != [1, 2, 3] {
            return Err(PyValueError::new_err(format!("axes: expected signed 1, 2, 3 in some order, found {axes:?}")));
        }
        let frame = Frame { unit, axes };
        let watched = Progress::default();
        let result = py.detach(|| {
            std::thread::scope(|scope| {
                let pass = scope.spawn(|| gather(&paths, voxel, frame, threads, &watched));
                let mut failed = None;
                while !pass.is_finished() {
                    std::thread::park_timeout(Duration::from_millis(if failed.is_some() { 10 } else { 100 }));
                    let seen = Python::attach(|py| {
                        py.check_signals()?;
                        let points = watched.points.load(Ordering::Relaxed);
                        progress.as_ref().map_or(Ok(()), |call| call.call1(py, (points,)).map(drop))
                    });
                    if let Err(error) = seen {
                        watched.stop.store(true, Ordering::Relaxed);
                        failed = Some(error);
                    }
                }
                match failed {
                    Some(error) => Err(error),
                    None => Ok(pass.join().expect("the pass does not panic")),
                }
            })
        })?;
        let (inner, files) = result.map_err(|error| to_python(py, &error))?;
        let reports = files.into_iter().map(|FileReport { path, outcome }| match outcome {
            Ok(skipped) => (path, skipped.invalid, skipped.not_finite, None),
            Err(error) => (path, 0, 0, Some(to_python(py, &error))),
        });
        Ok((Self { inner }, reports.collect()))
    }

    /// The evidence of points (n, 3), m, as one scan.
    #[staticmethod]
    #[pyo3(signature = (points, *, voxel, scan, position=None))]
    fn from_points(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        voxel: f64,
        scan: &str,
        position: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let array = points.as_array();
        if array.ncols() != 3 {
            return Err(PyValueError::new_err(format!("points: expected shape (n, 3), found (n, {})", array.ncols())));
        }
        let points: Vec<[f64; 3]> = array.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
        let inner = asbuilt_core::voxel::Evidence::new(voxel).map(|mut inner| {
            let scan = inner.scan(scan, position);
            inner.add(&points, scan);
            inner
        });
        Ok(Self { inner: inner.map_err(|error| to_python(py, &error))? })
    }

    /// The evidence of both clouds.
    fn merged(&self, py: Python<'_>, other: &Self) -> PyResult<Self> {
        let mut inner = self.inner.clone();
        inner.merge(&other.inner).map_err(|error| to_python(py, &error))?;
        Ok(Self { inner })
    }

    /// Side of a voxel, m.
    #[getter]
    fn voxel(&self) -> f64 {
        self.inner.voxel()
    }

    /// Points that came in.
    #[getter]
    fn points(&self) -> u64 {
        self.inner.points()
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    /// Key, position or None, and points of each scan, sorted by key.
    fn scans(&self) -> Vec<(String, Option<[f64; 3]>, u64)> {
        self.inner.scans().into_iter().map(|scan| (scan.key, scan.position, scan.points)).collect()
    }

    /// Arrays over the occupied voxels, sorted by index: `index` (n, 3) int32, `count` (n,) uint64, and in metres from
    /// the voxel's lower corner `mean` (n, 3) and `covariance` (n, 3: xx, xy, yy).
    fn voxels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let voxels = py.detach(|| self.inner.voxels());
        let mut index = Vec::with_capacity(3 * voxels.len());
        let mut count = Vec::with_capacity(voxels.len());
        let mut mean = Vec::with_capacity(3 * voxels.len());
        let mut covariance = Vec::with_capacity(3 * voxels.len());
        for voxel in &voxels {
            let moments = &voxel.moments;
            let n = moments.count as f64;
            let [x, y, z] = moments.sum.map(|sum| sum as f64 / n);
            let [xx, xy, yy] = moments.products.map(|sum| sum as f64 / n);
            index.extend(voxel.index);
            count.push(moments.count);
            mean.extend([x, y, z].map(|v| v * QUANTUM));
            covariance.extend([xx - x * x, xy - x * y, yy - y * y].map(|v| v * QUANTUM * QUANTUM));
        }
        let arrays = PyDict::new(py);
        arrays.set_item("index", index.into_pyarray(py).reshape([voxels.len(), 3])?)?;
        arrays.set_item("count", count.into_pyarray(py))?;
        arrays.set_item("mean", mean.into_pyarray(py).reshape([voxels.len(), 3])?)?;
        arrays.set_item("covariance", covariance.into_pyarray(py).reshape([voxels.len(), 3])?)?;
        Ok(arrays)
    }

    /// Which scans hit which brick of 8 voxels a side: brick index (n, 3) int32 and the scan's index in `scans()` (n,).
    fn brick_scans<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let hits = py.detach(|| self.inner.brick_scans());
        let bricks: Vec<i32> = hits.iter().flat_map(|(brick, _)| *brick).collect();
        let scans: Vec<u32> = hits.iter().map(|&(_, scan)| scan).collect();
        let arrays = PyDict::new(py);
        arrays.set_item("brick", bricks.into_pyarray(py).reshape([scans.len(), 3])?)?;
        arrays.set_item("scan", scans.into_pyarray(py))?;
        arrays.set_item("side", SIDE)?;
        Ok(arrays)
    }
}
