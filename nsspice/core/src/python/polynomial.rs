//! What one block of a circuit hands to another, as a Python class.

use super::invalid;
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

    /// A value that is set at some instants, and held in between; a `steady` one is never changed.
    #[staticmethod]
    #[pyo3(signature = (value, steady=false))]
    fn held(value: f64, steady: bool) -> Self {
        Self { inner: Polynomial::held(value, steady) }
    }

    /// Holds a value from where it is known so far to an instant [s].
    fn hold(&self, value: f64, to: f64) -> PyResult<()> {
        if !(self.inner.is_held() && value.is_finite() && to > self.inner.end()) {
            return Err(invalid("a finite value is held to a later instant"));
        }
        self.inner.hold(value, to);
        Ok(())
    }

    /// Says what the value is before the first piece.
    fn begin_with(&self, value: f64) {
        self.inner.begin_with(value);
    }

    /// Adds a piece at the end by its Chebyshev coefficients; with a `kink` anything may jump at its begin.
    fn push(&self, begin: f64, length: f64, coefficients: Vec<f64>, kink: bool) -> PyResult<()> {
        let known = !coefficients.is_empty() && coefficients.iter().all(|c| c.is_finite());
        if !(known && length > 0.0 && begin.is_finite()) {
            return Err(invalid("a piece has a length and finite coefficients"));
        }
        self.inner.push(begin, length, &coefficients, kink);
        Ok(())
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
