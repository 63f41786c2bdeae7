//! Faults of the engines from Python.

use super::invalid;
use pyo3::prelude::*;

/// A list after what a fault makes of it.
pub(super) fn damaged(mut list: Vec<f64>, damage: impl FnOnce(&mut [f64])) -> Vec<f64> {
    damage(&mut list);
    list
}

/// Lets the engines make one of the faults from here on, or none.
#[pyfunction]
#[pyo3(signature = (name=None))]
pub(super) fn choose_fault(name: Option<&str>) -> PyResult<()> {
    crate::faults::choose(name).then_some(()).ok_or_else(|| invalid("no fault has that name"))
}

/// Names, classes, methods and descriptions of all faults.
#[pyfunction]
pub(super) fn faults() -> Vec<(&'static str, &'static str, &'static str, &'static str)> {
    crate::faults::FAULTS.to_vec()
}
