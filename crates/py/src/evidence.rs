//! Voxel evidence.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use asbuilt_core::Error;
use asbuilt_core::gather::{FileReport, Frame, Given, Options, Progress, gather, gather_parts};
use asbuilt_core::store::{self, Stored, Summary};
use asbuilt_core::voxel::{Kept, QUANTUM, SIDE, Voxel};
use bytemuck::cast_slice_mut;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PySlice};

use crate::error::{exception, to_python};
use crate::rows::rows;

/// The mergeable summary of a cloud. What a file holds is put together when more than its voxels is asked for.
#[pyclass(frozen)]
#[derive(Clone)]
pub struct Evidence {
    summary: Summary,
    file: Option<Arc<Stored>>,
    inner: OnceLock<Arc<asbuilt_core::voxel::Evidence>>,
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
    fn new(inner: Arc<asbuilt_core::voxel::Evidence>) -> Self {
        let (voxel, kept, points, scans) = (inner.voxel(), inner.kept(), inner.points(), inner.scans());
        let summary = Summary { voxel, kept, points, about: String::new(), scans };
        Self { summary, file: None, inner: OnceLock::from(inner) }
    }

    fn of_file(py: Python<'_>, file: impl Send + FnOnce() -> asbuilt_core::Result<Stored>) -> PyResult<(Self, String)> {
        let file = py.detach(file).map_err(|error| to_python(py, &error))?;
        let summary = file.summary.clone();
        let about = summary.about.clone();
        Ok((Self { summary, file: Some(Arc::new(file)), inner: OnceLock::new() }, about))
    }

    fn inner(&self, py: Python<'_>) -> PyResult<&Arc<asbuilt_core::voxel::Evidence>> {
        if let (None, Some(file)) = (self.inner.get(), &self.file) {
            let found = py.detach(|| file.evidence()).map_err(|error| to_python(py, &error))?;
            let _ = self.inner.set(Arc::new(found)); // unless another thread was faster
        }
        Ok(self.inner.get().expect("it is that of a file or was given"))
    }
}

#[pymethods]
impl Evidence {
    /// Gather the evidence of files, given with the `scan_ends` of their headers. `progress` is called with the number of points so far, some ten times a second;
    /// `on_file` with each file that is done: its number, its evidence, and points left out (invalid, not finite).
    #[staticmethod]
    #[pyo3(signature = (
        files, *, voxel, unit, axes, threads, occupancy=false, preview=false, progress=None, on_file=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "all by name")]
    fn gather(
        py: Python<'_>,
        files: Vec<(PathBuf, Vec<u64>)>,
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
        let files: Vec<_> = files.into_iter().map(|(path, scan_ends)| Given { path, scan_ends }).collect();
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
                    let arguments = (number, Self::new(evidence.clone()), skipped.invalid, skipped.not_finite);
                    call.call1(py, arguments).map(drop).map_err(|error| {
                        fail(error);
                        Error::Interrupted
                    })
                })
            };
        let result = py.detach(|| {
            std::thread::scope(|scope| {
                let pass = scope.spawn(|| gather(&files, &options, threads, &watched, &hand_on));
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
        Ok((Self::new(Arc::new(inner)), reports.collect()))
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
        Ok((Self::new(Arc::new(inner)), skipped.invalid, skipped.not_finite))
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
        Ok(Self::new(Arc::new(inner.map_err(|error| to_python(py, &error))?)))
    }

    /// Read an evidence file: the evidence, and what its writer said about it.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<(Self, String)> {
        Self::of_file(py, || Stored::open(&path))
    }

    /// Write an evidence file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf, about: &str) -> PyResult<()> {
        let inner = self.inner(py)?;
        py.detach(|| store::save(inner, about, &path)).map_err(|error| exception(py, "OutputError", error.to_string()))
    }

    /// The evidence in the bytes of a file, and what its writer said about it.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<(Self, String)> {
        Self::of_file(py, || Stored::of(data.to_vec(), Path::new("evidence")))
    }

    /// The bytes of an evidence file.
    fn to_bytes<'py>(&self, py: Python<'py>, about: &str) -> PyResult<Bound<'py, PyBytes>> {
        let inner = self.inner(py)?;
        Ok(PyBytes::new(py, &py.detach(|| store::to_bytes(inner, about))))
    }

    /// The evidence of all these clouds together.
    #[pyo3(signature = (*others))]
    fn merged(&self, py: Python<'_>, others: Vec<PyRef<'_, Self>>) -> PyResult<Self> {
        let all = || std::iter::once(self).chain(others.iter().map(|other| &**other));
        let is_alike =
            all().all(|part| (part.summary.voxel, part.summary.kept) == (self.summary.voxel, self.summary.kept));
        let mut some = all().filter(|part| !part.summary.scans.is_empty());
        if let (true, one, None) = (is_alike, some.next(), some.next()) {
            return Ok(one.unwrap_or(self).clone());
        }
        let mut parts = all().map(|part| part.inner(py).cloned()).collect::<PyResult<Vec<_>>>()?;
        let merged = py.detach(|| {
            // Into the largest: the order does not matter.
            parts.sort_by_key(|part| part.bricks());
            let mut merged = Arc::unwrap_or_clone(parts.pop().expect("there is self"));
            parts.into_iter().try_for_each(|part| merged.merge(Arc::unwrap_or_clone(part))).map(|()| merged)
        });
        Ok(Self::new(Arc::new(merged.map_err(|error| to_python(py, &error))?)))
    }

    /// Whether only occupancy is kept: then counts, means and covariances are zero.
    #[getter]
    fn occupancy(&self) -> bool {
        self.summary.kept == Kept::Occupancy
    }

    /// Side of a voxel, m.
    #[getter]
    fn voxel(&self) -> f64 {
        self.summary.voxel
    }

    /// Points that came in.
    #[getter]
    fn points(&self) -> u64 {
        self.summary.points
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.inner(py)?.len())
    }

    /// Key, position or None, and points of each scan, sorted by key.
    fn scans(&self) -> Vec<(String, Option<[f64; 3]>, u64)> {
        self.summary.scans.iter().map(|scan| (scan.key.clone(), scan.position, scan.points)).collect()
    }

    /// Arrays over the occupied voxels, sorted by index: `index` (n, 3) int32, `count` (n,) uint64, and in metres from
    /// the voxel's lower corner `mean` (n, 3) and `covariance` (n, 3: xx, xy, yy).
    fn voxels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let most = match (&self.file, self.inner.get()) {
            (Some(file), None) => file.most_voxels(),
            _ => self.inner(py)?.len(),
        };
        // numpy's own memory comes in large pages, which are filled in half the time.
        let index = PyArray2::<i32>::zeros(py, [most, 3], false);
        let count = PyArray1::<u64>::zeros(py, most, false);
        let [mean, covariance] = [(); 2].map(|()| PyArray2::<f64>::zeros(py, [most, 3], false));
        let mut found = 0;
        {
            let (mut index, mut count) = (index.readwrite(), count.readwrite());
            let (mut mean, mut covariance) = (mean.readwrite(), covariance.readwrite());
            let mut rows = cast_slice_mut::<_, [i32; 3]>(index.as_slice_mut()?)
                .iter_mut()
                .zip(count.as_slice_mut()?)
                .zip(cast_slice_mut::<_, [f64; 3]>(mean.as_slice_mut()?))
                .zip(cast_slice_mut::<_, [f64; 3]>(covariance.as_slice_mut()?));
            let mut take = |voxel: Voxel| {
                let Some((((index, count), mean), covariance)) = rows.next() else { return };
                let moments = voxel.moments;
                let n = moments.count.max(1) as f64; // 0 where only occupancy is kept
                let [x, y, z] = moments.sum.map(|sum| sum as f64 / n);
                let [xx, xy, yy] = moments.products.map(|sum| sum as f64 / n);
                *index = voxel.index;
                *count = moments.count;
                *mean = [x, y, z].map(|v| v * QUANTUM);
                *covariance = [xx - x * x, xy - x * y, yy - y * y].map(|v| v * QUANTUM * QUANTUM);
                found += 1;
            };
            match (&self.file, self.inner.get()) {
                (Some(file), None) => {
                    py.detach(|| file.each_voxel(&mut take)).map_err(|error| to_python(py, &error))?;
                }
                _ => {
                    let inner = self.inner(py)?;
                    py.detach(|| inner.each_voxel(&mut take));
                }
            }
        }
        let arrays = PyDict::new(py);
        let named = [
            ("index", index.as_any()),
            ("count", count.as_any()),
            ("mean", mean.as_any()),
            ("covariance", covariance.as_any()),
        ];
        for (name, array) in named {
            arrays.set_item(name, array.get_item(PySlice::new(py, 0, found, 1))?)?;
        }
        Ok(arrays)
    }

    /// Which scans hit which brick of 8 voxels a side: brick index (n, 3) int32 and the scan's index in `scans()` (n,).
    fn brick_scans<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.inner(py)?;
        let hits = py.detach(|| inner.brick_scans());
        let bricks: Vec<i32> = hits.iter().flat_map(|(brick, _)| *brick).collect();
        let scans: Vec<u32> = hits.iter().map(|&(_, scan)| scan).collect();
        let arrays = PyDict::new(py);
        arrays.set_item("brick", bricks.into_pyarray(py).reshape([scans.len(), 3])?)?;
        arrays.set_item("scan", scans.into_pyarray(py))?;
        arrays.set_item("side", SIDE)?;
        Ok(arrays)
    }
}
