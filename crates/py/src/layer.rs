//! The voxels of a storey.

use asbuilt_core::layer;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::rows::rows;

/// Voxels (n, 3) of side `voxel`, whose points' means (n, 3) lie between two heights over a floor, m, those left out that
/// stand alone (see `in_company`): `kept` (k,), which they are; `origin` (2,), m; `cells` (k, 2), their ground cells, and
/// `xy` (k, 2), their means, m, both from the origin; and `z` (k,), their heights over the floor, m.
#[pyfunction]
#[pyo3(signature = (index, mean, voxel, *, floor, between, factor, least))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn layer_of<'py>(
    py: Python<'py>,
    index: PyReadonlyArray2<'py, i32>,
    mean: PyReadonlyArray2<'py, f64>,
    voxel: f64,
    floor: f64,
    between: [f64; 2],
    factor: i32,
    least: u32,
) -> PyResult<Bound<'py, PyDict>> {
    let (index, mean) = (rows("index", &index)?, rows("mean", &mean)?);
    if index.len() != mean.len() || factor < 1 {
        return Err(PyValueError::new_err("expected a mean for each voxel, and a factor of 1 or more"));
    }
    let voxels = layer::Voxels { index: &index, mean: &mean, voxel };
    let found = py.detach(|| voxels.layer(floor, between, factor, least));
    let count = found.kept.len();
    let arrays = PyDict::new(py);
    let kept: Vec<i64> = found.kept.into_iter().map(|i| i as i64).collect();
    arrays.set_item("kept", kept.into_pyarray(py))?;
    arrays.set_item("origin", found.origin.to_vec().into_pyarray(py))?;
    arrays.set_item("cells", found.cells.into_flattened().into_pyarray(py).reshape([count, 2])?)?;
    arrays.set_item("xy", found.xy.into_flattened().into_pyarray(py).reshape([count, 2])?)?;
    arrays.set_item("z", found.z.into_pyarray(py))?;
    Ok(arrays)
}
