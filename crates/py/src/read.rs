//! Headers and points of files.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, sync_channel};

use asbuilt_core::read::{Header, open};
use asbuilt_core::{Error, Result};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::to_python;

/// What a file says of itself: format, points, bounds, scans, crs, notes.
#[pyfunction]
pub fn read_header<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let header: Header =
        py.detach(|| open(&path).map(|source| source.header().clone())).map_err(|e| to_python(py, &e))?;
    let about = PyDict::new(py);
    about.set_item("format", header.format)?;
    about.set_item("points", header.points)?;
    about.set_item("bounds", header.bounds)?;
    about.set_item("crs", header.crs)?;
    about.set_item("notes", header.notes)?;
    let scans = header.scans.into_iter().map(|scan| (scan.number, scan.key, scan.position, scan.points));
    about.set_item("scans", scans.collect::<Vec<_>>())?;
    Ok(about)
}

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
            for part in 0..source.parts() {
                let read = source.read(part, &mut |batch| {
                    seen += batch.points.len() as u64;
                    let scans = match batch.scans.is_empty() {
                        true => vec![batch.scan; batch.points.len()],
                        false => batch.scans.clone(),
                    };
                    // The receiver is gone: nobody wants more.
                    sender.send(Ok((batch.points.clone(), scans))).map_err(|_| Error::Interrupted)
                });
                match read {
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
