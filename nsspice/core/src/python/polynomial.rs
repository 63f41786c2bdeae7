//! What one block of a circuit hands to another, as a Python class.

use crate::waveform::{Polynomial, Side};
use pyo3::prelude::*;

#[pyclass(name = "Polynomial", module = "nsspice._core", frozen)]
#[derive(Default)]
pub(super) struct PyPolynomial {
    pub inner: Polynomial,
}

#[pymethods]
impl PyPolynomial {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Says what the value is before the first piece.
    fn begin_with(&self, value: f64) {
        self.inner.begin_with(value);
    }

    /// The value at an instant; `side` is -1 for the left limit, else the right one.
    #[pyo3(signature = (time, side=1))]
    fn value(&self, time: f64, side: i8) -> f64 {
        self.inner.value(time, if side < 0 { Side::Left } else { Side::Right })
    }

    /// Number of pieces.
    fn count(&self) -> usize {
        self.inner.count()
    }

    /// Up to where it is known [s].
    fn end(&self) -> f64 {
        self.inner.end()
    }

    /// The largest difference from the closed forms, as a part of the largest value.
    fn error(&self) -> f64 {
        self.inner.error()
    }
}
