//! Rust errors as the exceptions of `asbuilt.errors`.

use asbuilt_core::Error;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The exception for an error: its class says who must act.
pub fn to_python(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::Interrupted => return PyKeyboardInterrupt::new_err(()),
        Error::BadArgument(_) => "ParameterError",
        Error::BadFile { .. } | Error::Io { .. } | Error::Unsupported { .. } => "InputError",
    };
    exception(py, class, error.to_string())
}

/// An exception of `asbuilt.errors` by the name of its class.
pub fn exception(py: Python<'_>, class: &str, message: String) -> PyErr {
    let found = py.import("asbuilt.errors").and_then(|module| Ok(module.getattr(class)?.cast_into::<PyType>()?));
    match found {
        Ok(class) => PyErr::from_type(class, message),
        Err(missing) => missing,
    }
}
