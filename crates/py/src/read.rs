//! Headers and points of files.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, sync_channel};

use asbuilt_core::read::{Header, Scan, open, open_coarse};
use asbuilt_core::voxel::Kept;
use asbuilt_core::{Error, Result, store};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::to_python;

/// What a file says of itself: format, points, bounds, scans, crs, notes, and into how many parts it falls that can be
/// read alone; `scan_ends`, where its scans end (byte), if finding that took reading it. Of an evidence file also `evidence`: its voxel (m), whether it keeps occupancy alone, and what its writer
/// said. With a `spacing`, of a file with levels of detail only those down to it.
#[pyfunction]
#[pyo3(signature = (path, *, spacing=None))]
pub fn read_header<'py>(py: Python<'py>, path: PathBuf, spacing: Option<f64>) -> PyResult<Bound<'py, PyDict>> {
    let found = py.detach(|| describe(&path, spacing));
    let Described { header, parts, scan_ends, evidence } = found.map_err(|e| to_python(py, &e))?;
    let about = PyDict::new(py);
    about.set_item("format", header.format)?;
    about.set_item("points", header.points)?;
    about.set_item("bounds", header.bounds)?;
    about.set_item("crs", header.crs)?;
    about.set_item("notes", header.notes)?;
    let scans = header.scans.into_iter().map(|scan| (scan.number, scan.key, scan.position, scan.points));
    about.set_item("scans", scans.collect::<Vec<_>>())?;
    about.set_item("parts", parts)?;
    about.set_item("scan_ends", scan_ends)?;
    about.set_item("evidence", evidence)?;
    Ok(about)
}

struct Described {
    header: Header,
    parts: usize,
    scan_ends: Vec<u64>,
    /// Side of a voxel, whether only occupancy is kept, what its writer said.
    evidence: Option<(f64, bool, String)>,
}

fn describe(path: &Path, spacing: Option<f64>) -> Result<Described> {
    let mut head = [0; store::MAGIC.len()];
    let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
    if is_file && File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && store::is_evidence(&head)
    {
        let summary = store::summary(path)?;
        let scans = (0..).zip(summary.scans).map(|(number, scan)| Scan {
            number,
            key: scan.key,
            name: None,
            position: scan.position,
            points: Some(scan.points),
        });
        let header = Header {
            format: format!("asbuilt evidence, version {}", store::VERSION),
            points: Some(summary.points),
            scans: scans.collect(),
            ..Header::default()
        };
        let evidence = Some((summary.voxel, summary.kept == Kept::Occupancy, summary.about));
        return Ok(Described { header, parts: 0, scan_ends: Vec::new(), evidence });
    }
    let source = open_coarse(path, spacing)?;
    let (header, parts, scan_ends) = (source.header().clone(), source.parts(), source.scan_ends());
    Ok(Described { header, parts, scan_ends, evidence: None })
}

/// Points that Python gets together: enough to forget the cost of the call.
const TOGETHER: usize = 16 * 1024;

type Points = (Vec<[f64; 3]>, Vec<u32>);

/// Iterates over the points of a file, a batch at a time, decoded ahead on a thread of its own.
#[pyclass]
pub struct PointReader {
    batches: Mutex<Receiver<Result<Points>>>,
}

#[pymethods]
impl PointReader {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let source = py.detach(|| open(&path)).map_err(|e| to_python(py, &e))?;
        let (sender, receiver) = sync_channel(4);
        std::thread::spawn(move || {
            let mut seen = 0;
            let send = |ready: Points| match ready.0.is_empty() {
                true => Ok(()),
                false => sender.send(Ok(ready)).map_err(|_| Error::Interrupted), // nobody wants more
            };
            for part in 0..source.parts() {
                let (mut points, mut scans) = Points::default();
                let read = source.read(part, &mut |batch| {
                    seen += batch.points.len() as u64;
                    points.extend_from_slice(&batch.points);
                    scans.extend_from_slice(&batch.scans);
                    scans.resize(points.len(), batch.scan);
                    if points.len() < TOGETHER {
                        return Ok(());
                    }
                    send((std::mem::take(&mut points), std::mem::take(&mut scans)))
                });
                match read.and_then(|skipped| send((points, scans)).map(|()| skipped)) {
                    Ok(skipped) => seen += skipped.invalid + skipped.not_finite,
                    Err(error) => {
                        let _ = sender.send(Err(error));
                        return;
                    }
                }
            }
            if let Err(error) = source.header().check(&path, seen) {
                let _ = sender.send(Err(error));
            }
        });
        Ok(Self { batches: Mutex::new(receiver) })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    #[allow(clippy::type_complexity, reason = "the arrays that Python sees")]
    fn __next__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u32>>)>> {
        let received = py.detach(|| self.batches.lock().expect("no thread panics with the lock").recv());
        match received {
            Ok(Ok((points, scans))) => {
                Ok(Some((points.into_flattened().into_pyarray(py).reshape([scans.len(), 3])?, scans.into_pyarray(py))))
            }
            Ok(Err(error)) => Err(to_python(py, &error)),
            Err(_) => Ok(None),
        }
    }
}

/// Name and suffixes of each format that has a reader.
#[pyfunction]
pub fn formats() -> Vec<(&'static str, Vec<&'static str>)> {
    asbuilt_core::read::formats().iter().map(|(name, suffixes)| (*name, suffixes.to_vec())).collect()
}
