//! Voxels put together to coarser ones.

use asbuilt_core::coarse;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::rows::rows;

/// The different voxels (m, 3) of `factor` times the size that voxels (n, 3) lie in, sorted.
#[pyfunction]
pub fn coarser<'py>(
    py: Python<'py>,
    index: PyReadonlyArray2<'py, i32>,
    factor: i32,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let index = rows("index", &index)?;
    check_factor(factor)?;
    let found = py.detach(|| coarse::coarser(&index, factor));
    let flat: Vec<i64> = found.iter().flatten().map(|&i| i64::from(i)).collect();
    flat.into_pyarray(py).reshape([found.len(), 3])
}

/// Which voxels (n, 3) lie in cubes of four voxels a side, each `factor` times the size, in which and in the 26 around
/// which there are `least` or more of those (n,).
#[pyfunction]
pub fn in_company<'py>(
    py: Python<'py>,
    index: PyReadonlyArray2<'py, i32>,
    factor: i32,
    least: u32,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let index = rows("index", &index)?;
    check_factor(factor)?;
    Ok(py.detach(|| coarse::in_company(&index, factor, least)).into_pyarray(py))
}

fn check_factor(factor: i32) -> PyResult<()> {
    if factor < 1 {
        Err(PyValueError::new_err(format!("expected a factor of 1 or more, found {factor}")))
    } else {
        Ok(())
    }
}
