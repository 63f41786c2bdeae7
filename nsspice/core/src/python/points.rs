//! What engines record for the certificate, as Python objects whose arrays are made when first
//! read.

use super::system::Sizes;
use crate::audit::Taken;
use crate::integrate::Records;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyAny;
use pyo3::IntoPyObjectExt;

/// A copy of numbers in a shape.
fn array<'py, T: numpy::Element + Copy, const D: usize>(
    py: Python<'py>,
    values: &[T],
    shape: [usize; D],
) -> PyResult<Bound<'py, PyAny>>
where
    [usize; D]: numpy::ndarray::IntoDimension,
{
    Ok(PyArray1::from_slice(py, values).reshape(shape)?.into_any())
}

/// times [s], pairs, conducts from then on
pub(super) type EventArrays<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<usize>>, Bound<'py, PyArray1<bool>>);

/// In the order of time: an engine may show of one event behind the next.
pub(super) fn event_arrays<'py>(
    py: Python<'py>,
    events: &[(f64, usize, bool)],
) -> EventArrays<'py> {
    let mut events = std::borrow::Cow::Borrowed(events);
    if !events.is_sorted_by(|a, b| a.0 <= b.0) {
        events.to_mut().sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    (
        PyArray1::from_iter(py, events.iter().map(|e| e.0)),
        PyArray1::from_iter(py, events.iter().map(|e| e.1)),
        PyArray1::from_iter(py, events.iter().map(|e| e.2)),
    )
}

fn unknown(name: &str) -> PyErr {
    PyAttributeError::new_err(name.to_owned())
}

/// Recorded intervals with the attributes of `nsspice.solvers.intervals.Intervals`.
#[pyclass(name = "Intervals", module = "nsspice._core", frozen)]
pub(super) struct PyIntervals {
    pub taken: Taken,
    pub sizes: Sizes,
}

#[pymethods]
impl PyIntervals {
    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let t = &self.taken;
        let (k, s, [n, m, p, functions]) = (t.begin.len(), t.nodes, self.sizes);
        let inner = if t.inner.is_empty() { [0; 3] } else { [k, s, s] };
        let roles = if t.roles.is_empty() { [0, m] } else { [k, m] };
        let boundaries = |values: &[f64]| [values.len() / n.max(1), n];
        match name {
            "boundaries" => t.boundaries.into_bound_py_any(py),
            "known" => t.known.into_bound_py_any(py),
            "begin" => array(py, &t.begin, [k]),
            "end" => array(py, &t.end, [k]),
            "shortest" => array(py, &t.shortest, [k]),
            "swing" => array(py, &t.swing, [k]),
            "steps" => array(py, &t.steps, [k]),
            "signed" => array(py, &t.signed, [k]),
            "doubt" => array(py, &t.doubt, [k]),
            "first" => array(py, &t.first, [k, n]),
            "first_u" => array(py, &t.first_u, [k, p]),
            "time" => array(py, &t.time, [k, s]),
            "weight" => array(py, &t.weight, [k, s]),
            "inner" => array(py, &t.inner, inner),
            "z" => array(py, &t.z, [k, s, n]),
            "rate" => array(py, &t.rate, [k, s, n]),
            "lam" => array(py, &t.l, [k, s, m]),
            "u" => array(py, &t.u, [k, s, p]),
            "function_rate" => array(py, &t.function_rate, [k, s, functions]),
            "roles" => array(py, &t.roles, roles),
            "boundary_end" => array(py, &t.boundary_end, boundaries(&t.boundary_end)),
            "boundary_begin" => array(py, &t.boundary_begin, boundaries(&t.boundary_begin)),
            _ => Err(unknown(name)),
        }
    }
}

/// Recorded steps with the attributes of `nsspice.solvers.moreau.Records`.
#[pyclass(name = "Records", module = "nsspice._core", frozen)]
pub(super) struct PyRecords {
    pub records: Records,
    pub sizes: Sizes,
}

#[pymethods]
impl PyRecords {
    /// Number of steps.
    fn __len__(&self) -> usize {
        self.records.time.len()
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let r = &self.records;
        let (k, [n, m, p, _]) = (r.time.len(), self.sizes);
        match name {
            "time" => array(py, &r.time, [k]),
            "length" => array(py, &r.length, [k]),
            "z" => array(py, &r.z, [k, n]),
            "change" => array(py, &r.change, [k, n]),
            "lam" => array(py, &r.l, [k, m]),
            "u" => array(py, &r.u, [k, p]),
            "source_change" => array(py, &r.source_change, [k, p]),
            "roles" if r.roles.is_empty() => Ok(py.None().into_bound(py)),
            "roles" => array(py, &r.roles, [k, m]),
            _ => Err(unknown(name)),
        }
    }
}
