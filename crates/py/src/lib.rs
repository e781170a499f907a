//! Python bindings: check shapes, release the interpreter, call `asbuilt_core`, wrap the result. Private; the public
//! interface is the Python package.

mod coarse;
mod error;
mod evidence;
mod heights;
mod hits;
mod hough;
mod layer;
mod patches;
mod places;
mod read;
mod rows;
mod shapes;

use pyo3::prelude::*;

#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::coarse::{coarser, in_company};
    #[pymodule_export]
    use crate::evidence::Evidence;
    #[pymodule_export]
    use crate::heights::height_about;
    #[pymodule_export]
    use crate::hits::{Hits, close_gaps, close_sparse, means_along};
    #[pymodule_export]
    use crate::hough::hough_lines;
    #[pymodule_export]
    use crate::layer::layer_of;
    #[pymodule_export]
    use crate::patches::{groups, patches_of};
    #[pymodule_export]
    use crate::places::Places;
    #[pymodule_export]
    use crate::read::{PointReader, formats, read_header};

    #[pymodule_export]
    use crate::shapes::from_box_sides;

    /// Version of the package.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
