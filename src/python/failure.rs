//! The library's errors as Python's exceptions, with the same sentences.

use isomorph::{Error, ErrorKind};
use pyo3::PyErr;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};

pyo3::create_exception!(
    isomorph,
    TrainingError,
    PyRuntimeError,
    "The work could not be done: a disk is full, a term is not a number."
);

/// A mistake in what was asked for or in a file is a `ValueError`, work that failed a `TrainingError`, and work that was
/// stopped a `KeyboardInterrupt`.
pub(crate) fn raised(error: Error) -> PyErr {
    let text = error.to_string();
    match error.kind() {
        ErrorKind::Usage | ErrorKind::Input => PyValueError::new_err(text),
        ErrorKind::Failure => TrainingError::new_err(text),
        ErrorKind::Interruption => PyKeyboardInterrupt::new_err(text),
    }
}
