//! Voxel evidence.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use asbuilt_core::gather::{FileReport, Frame, Options, Progress, gather, gather_parts};
use asbuilt_core::voxel::{Kept, QUANTUM, SIDE, Voxel};
use asbuilt_core::{Error, store};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error::{exception, to_python};
use crate::rows::rows;

/// The mergeable summary of a cloud.
#[pyclass(frozen)]
pub struct Evidence {
    inner: Arc<asbuilt_core::voxel::Evidence>,
}

/// Path, points left out (invalid, not finite), and the exception if the file is bad.
type Report = (PathBuf, u64, u64, Option<PyErr>);

fn options(voxel: f64, unit: f64, axes: [i8; 3], occupancy: bool, preview: bool) -> PyResult<Options> {
    let mut sorted = axes.map(i8::abs);
    sorted.sort_unstable();
    if sorted != [1, 2, 3] {
        return Err(PyValueError::new_err(format!("axes: expected signed 1, 2, 3 in some order, found {axes:?}")));
    }
    Ok(Options { voxel, kept: kept(occupancy), frame: Frame { unit, axes }, preview })
}

fn kept(occupancy: bool) -> Kept {
    if occupancy { Kept::Occupancy } else { Kept::Moments }
}

impl Evidence {
    fn new(inner: asbuilt_core::voxel::Evidence) -> Self {
        Self { inner: Arc::new(inner) }
    }
}

#[pymethods]
impl Evidence {
    /// Gather the evidence of files. `progress` is called with the number of points so far, some ten times a second;
    /// `on_file` with each file that is done: its number, its evidence, and points left out (invalid, not finite).
    #[staticmethod]
    #[pyo3(signature = (
        paths, *, voxel, unit, axes, threads, occupancy=false, preview=false, progress=None, on_file=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "all by name")]
    fn gather(
        py: Python<'_>,
        paths: Vec<PathBuf>,
        voxel: f64,
        unit: f64,
        axes: [i8; 3],
        threads: usize,
        occupancy: bool,
        preview: bool,
        progress: Option<Py<PyAny>>,
        on_file: Option<Py<PyAny>>,
    ) -> PyResult<(Self, Vec<Report>)> {
        let options = options(voxel, unit, axes, occupancy, preview)?;
        let watched = Progress::default();
        let failed: Mutex<Option<PyErr>> = Mutex::new(None);
        let fail = |error| {
            watched.stop.store(true, Ordering::Relaxed);
            failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        };
        let hand_on =
            |number: usize, evidence: &Arc<asbuilt_core::voxel::Evidence>, skipped: asbuilt_core::read::Skipped| {
                let Some(call) = &on_file else { return Ok(()) };
                Python::attach(|py| {
                    let arguments = (number, Self { inner: evidence.clone() }, skipped.invalid, skipped.not_finite);
                    call.call1(py, arguments).map(drop).map_err(|error| {
                        fail(error);
                        Error::Interrupted
                    })
                })
            };
        let result = py.detach(|| {
            std::thread::scope(|scope| {
                let pass = scope.spawn(|| gather(&paths, &options, threads, &watched, &hand_on));
                while !pass.is_finished() {
                    let is_stopped = watched.stop.load(Ordering::Relaxed);
                    std::thread::park_timeout(Duration::from_millis(if is_stopped { 10 } else { 100 }));
                    let seen = Python::attach(|py| {
                        py.check_signals()?;
                        let points = watched.points.load(Ordering::Relaxed);
                        progress.as_ref().map_or(Ok(()), |call| call.call1(py, (points,)).map(drop))
                    });
                    seen.unwrap_or_else(fail);
                }
                pass.join().expect("the pass does not panic")
            })
        });
        if let Some(error) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        let (inner, files) = result.map_err(|error| to_python(py, &error))?;
        let reports = files.into_iter().map(|FileReport { path, outcome }| match outcome {
            Ok(skipped) => (path, skipped.invalid, skipped.not_finite, None),
            Err(error) => (path, 0, 0, Some(to_python(py, &error))),
        });
        Ok((Self::new(inner), reports.collect()))
    }

    /// The evidence of some parts of a file (`first` up to but not with `end`), and points left out (invalid, not
    /// finite). Whether all parts together are the whole file is for the caller to check.
    #[staticmethod]
    #[pyo3(signature = (path, first, end, *, voxel, unit, axes, occupancy=false, preview=false))]
    #[allow(clippy::too_many_arguments, reason = "all by name")]
    fn gather_parts(
        py: Python<'_>,
        path: PathBuf,
        first: usize,
        end: usize,
        voxel: f64,
        unit: f64,
        axes: [i8; 3],
        occupancy: bool,
        preview: bool,
    ) -> PyResult<(Self, u64, u64)> {
        let options = options(voxel, unit, axes, occupancy, preview)?;
        let found = py.detach(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            let pool = pool.map_err(|error| Error::BadArgument(format!("cannot start a thread: {error}")))?;
            pool.install(|| gather_parts(&path, first..end, &options))
        });
        let (inner, skipped) = found.map_err(|error| to_python(py, &error))?;
        Ok((Self::new(inner), skipped.invalid, skipped.not_finite))
    }

    /// The evidence of points (n, 3), m, as one scan.
    #[staticmethod]
    #[pyo3(signature = (points, *, voxel, scan, position=None, occupancy=false))]
    fn from_points(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        voxel: f64,
        scan: &str,
        position: Option<[f64; 3]>,
        occupancy: bool,
    ) -> PyResult<Self> {
        let points = rows("points", &points)?;
        let inner = asbuilt_core::voxel::Evidence::new(voxel, kept(occupancy)).map(|mut inner| {
            let scan = inner.scan(scan, position);
            inner.add(&points, scan);
            inner
        });
        Ok(Self::new(inner.map_err(|error| to_python(py, &error))?))
    }

    /// Read an evidence file: the evidence, and what its writer said about it.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<(Self, String)> {
        let (inner, about) = py.detach(|| store::load(&path)).map_err(|error| to_python(py, &error))?;
        Ok((Self::new(inner), about))
    }

    /// Write an evidence file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf, about: &str) -> PyResult<()> {
        py.detach(|| store::save(&self.inner, about, &path))
            .map_err(|error| exception(py, "OutputError", error.to_string()))
    }

    /// The evidence in the bytes of a file, and what its writer said about it.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<(Self, String)> {
        let found = store::from_bytes(data, Path::new("evidence"));
        let (inner, about) = found.map_err(|error| to_python(py, &error))?;
        Ok((Self::new(inner), about))
    }

    /// The bytes of an evidence file.
    fn to_bytes<'py>(&self, py: Python<'py>, about: &str) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &py.detach(|| store::to_bytes(&self.inner, about)))
    }

    /// The evidence of all these clouds together.
    #[pyo3(signature = (*others))]
    fn merged(&self, py: Python<'_>, others: Vec<PyRef<'_, Self>>) -> PyResult<Self> {
        if others.is_empty() {
            return Ok(Self { inner: self.inner.clone() });
        }
        let mut parts: Vec<_> = others.iter().map(|other| other.inner.clone()).collect();
        parts.push(self.inner.clone());
        let merged = py.detach(|| {
            // Into the largest: the order does not matter.
            parts.sort_by_key(|part| part.bricks());
            let mut merged = Arc::unwrap_or_clone(parts.pop().expect("there is self"));
            parts.into_iter().try_for_each(|part| merged.merge(Arc::unwrap_or_clone(part))).map(|()| merged)
        });
        Ok(Self::new(merged.map_err(|error| to_python(py, &error))?))
    }

    /// Whether only occupancy is kept: then counts, means and covariances are zero.
    #[getter]
    fn occupancy(&self) -> bool {
        self.inner.kept() == Kept::Occupancy
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
        let count = self.inner.len();
        let mut indices = Vec::with_capacity(3 * count);
        let mut counts = Vec::with_capacity(count);
        let mut means = Vec::with_capacity(3 * count);
        let mut covariances = Vec::with_capacity(3 * count);
        py.detach(|| {
            self.inner.each_voxel(|Voxel { index, moments }| {
                let n = moments.count.max(1) as f64; // 0 where only occupancy is kept
                let [x, y, z] = moments.sum.map(|sum| sum as f64 / n);
                let [xx, xy, yy] = moments.products.map(|sum| sum as f64 / n);
                indices.extend(index);
                counts.push(moments.count);
                means.extend([x, y, z].map(|v| v * QUANTUM));
                covariances.extend([xx - x * x, xy - x * y, yy - y * y].map(|v| v * QUANTUM * QUANTUM));
            });
        });
        let arrays = PyDict::new(py);
        arrays.set_item("index", indices.into_pyarray(py).reshape([count, 3])?)?;
        arrays.set_item("count", counts.into_pyarray(py))?;
        arrays.set_item("mean", means.into_pyarray(py).reshape([count, 3])?)?;
        arrays.set_item("covariance", covariances.into_pyarray(py).reshape([count, 3])?)?;
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
