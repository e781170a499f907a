//! The voxels of a storey.

use asbuilt_core::layer;
use bytemuck::cast_slice_mut;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::rows::rows;

/// Voxels (n, 3) of side `voxel`, whose points' means (n, 3) lie between two heights over a floor, m, those left out that
/// stand alone (see `in_company`): `kept` (k,), which they are; `origin` (2,), m; `cells` (k, 2), their ground cells, and
/// `xy` (k, 2), their means, m, both from the origin. `height` (n,) is that of the means, m.
#[pyfunction]
#[pyo3(signature = (index, mean, height, voxel, *, floor, between, factor, least))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn layer_of<'py>(
    py: Python<'py>,
    index: PyReadonlyArray2<'py, i32>,
    mean: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    voxel: f64,
    floor: f64,
    between: [f64; 2],
    factor: i32,
    least: u32,
) -> PyResult<Bound<'py, PyDict>> {
    let (index, mean, height) = (rows("index", &index)?, rows("mean", &mean)?, height.as_slice()?);
    if index.len() != mean.len() || index.len() != height.len() || factor < 1 {
        return Err(PyValueError::new_err("expected a mean and a height for each voxel, and a factor of 1 or more"));
    }
    let voxels = layer::Voxels { index: &index, mean: &mean, height, voxel };
    let found = py.detach(|| voxels.layer(floor, between, factor, least));
    let count = found.kept.len();
    let kept = PyArray1::<i64>::zeros(py, count, false);
    let cells = PyArray2::<i32>::zeros(py, [count, 2], false);
    let xy = PyArray2::<f64>::zeros(py, [count, 2], false);
    {
        let (mut kept, mut cells, mut xy) = (kept.readwrite(), cells.readwrite(), xy.readwrite());
        let kept = kept.as_slice_mut()?.iter_mut().zip(&found.kept);
        kept.for_each(|(to, &from)| *to = from as i64);
        let cells = cast_slice_mut::<_, [i32; 2]>(cells.as_slice_mut()?).iter_mut();
        let places = cells.zip(cast_slice_mut::<_, [f64; 2]>(xy.as_slice_mut()?));
        places.zip(voxels.places(&found)).for_each(|((cell, xy), place)| (*cell, *xy) = place);
    }
    let arrays = PyDict::new(py);
    arrays.set_item("kept", kept)?;
    arrays.set_item("origin", found.corner.map(|cell| cell * voxel).to_vec().into_pyarray(py))?;
    arrays.set_item("cells", cells)?;
    arrays.set_item("xy", xy)?;
    Ok(arrays)
}
