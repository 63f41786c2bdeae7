//! Runs that are differentiated, as a Python class.

use super::system::{misfit, PySystem};
use super::{failure_dict, invalid, Floats};
use crate::dense::{complex, eigen, Complex, Matrix};
use crate::modewise::Passed;
use crate::steady::{Driver, Goal, Limit, Orbit};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pyclass(name = "Orbit", module = "nsspice._core")]
pub(super) struct PyOrbit {
    inner: Orbit,
    switches: usize,
    unknowns: usize,
}

/// Time, outputs before and after, pairs that conduct before and after.
type Event = (f64, Vec<f64>, Vec<f64>, Vec<usize>, Vec<usize>);

/// By drivers, by charges at the beginning, by instants of sources, by the period.
type Derivatives<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Vec<(f64, f64)>, f64);

type Complexes<'py> = Bound<'py, PyArray1<f64>>;

/// Real and imaginary parts in turn.
fn interleaved<'py>(py: Python<'py>, values: &[Complex]) -> Complexes<'py> {
    PyArray1::from_iter(py, values.iter().flat_map(|v| [v.re, v.im]))
}

fn square<'py>(py: Python<'py>, m: &Matrix) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, &m.data)
}

#[pymethods]
impl PyOrbit {
    /// Stimuli are sources by number; `offsets` adds some to the slacks of pairs, and in rows after these to the
    /// controls of switches that are below their thresholds, then of those above: row, source, factor.
    #[new]
    #[pyo3(signature = (system, outputs, stimuli, offsets=Vec::new()))]
    fn new(
        system: &PySystem,
        outputs: Vec<[Vec<(usize, f64)>; 4]>,
        stimuli: Vec<usize>,
        offsets: Vec<(usize, usize, f64)>,
    ) -> PyResult<Self> {
        let [n, m, p, _] = system.sizes();
        let inside = |o: &[Vec<(usize, f64)>; 4]| {
            o.iter().zip([n, m, n, p]).all(|(part, size)| part.iter().all(|e| e.0 < size))
        };
        let fits = system.waveforms.len() == p
            && outputs.iter().all(inside)
            && stimuli.iter().all(|&s| s < p)
            && offsets.iter().all(|o| o.0 < m + 2 * system.gates.len() && o.1 < p);
        if !fits {
            return Err(misfit());
        }
        let prepared = system.prepared().map_err(invalid)?;
        let (switches, unknowns) = (system.gates.len(), n);
        let prepared = prepared.clone().with_offsets(&offsets).map_err(invalid)?;
        Ok(PyOrbit { inner: Orbit::new(&prepared, outputs, &stimuli), switches, unknowns })
    }

    /// Number of energy coordinates.
    fn states(&self) -> usize {
        self.inner.states()
    }

    /// Energy coordinates of charges and fluxes.
    fn energy_of<'py>(
        &self,
        py: Python<'py>,
        charges: Floats,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let charges = charges.as_slice()?;
        if charges.len() != self.unknowns {
            return Err(invalid("one charge or flux per unknown"));
        }
        Ok(PyArray1::from_vec(py, self.inner.energy_of(charges)))
    }

    /// Charges and fluxes of energy coordinates.
    fn charges_of<'py>(&self, py: Python<'py>, a: Floats) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.inner.charges_of(self.state(&a)?)))
    }

    /// Runs from energy coordinates at time 0 to `stop`, or until the gate of a switch goes up. Returns how it
    /// ended, or the failure.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        a: Floats,
        gates: Vec<bool>,
        stop: f64,
        trigger: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let start = self.state(&a)?.to_vec();
        if gates.len() != self.switches || trigger.is_some_and(|s| s >= self.switches) {
            return Err(invalid("one state per switch"));
        }
        let inner = &mut self.inner;
        let result = py.detach(move || inner.run(&start, &gates, stop, trigger));
        match result {
            Err(failure) => failure_dict(py, &failure),
            Ok(passed) => {
                let out = PyDict::new(py);
                let word = match passed {
                    Passed::Stop => "stop",
                    Passed::Trigger => "trigger",
                    Passed::Unproved => "unproved",
                    Passed::Many => "many",
                };
                out.set_item("passed", word)?;
                Ok(out)
            }
        }
    }

    /// Energy coordinates at the end of the last run.
    fn end<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.end())
    }

    /// Largest energy coordinates of the last run.
    fn sizes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.sizes())
    }

    /// States of the gates at the end of the last run.
    fn gates(&self) -> Vec<bool> {
        self.inner.gates().to_vec()
    }

    /// Duration of the last run [s].
    fn period(&self) -> f64 {
        self.inner.period()
    }

    /// Segments of the last run.
    fn segments(&self) -> usize {
        self.inner.passages().len()
    }

    /// Derives the events of the last run; why there is no derivative as (kind, time, pairs).
    fn differentiate(&mut self) -> Option<(&'static str, f64, Vec<usize>)> {
        self.inner.differentiate().err().map(|f| (f.kind, f.time, f.pairs))
    }

    /// Derivative of the end of the run by its beginning, at a `moving` end or at a fixed time.
    fn derivative<'py>(&self, py: Python<'py>, moving: bool) -> Bound<'py, PyArray1<f64>> {
        square(py, &self.inner.derivative(moving))
    }

    /// Parts of a direction of the beginning at which guards vanish: pair, first and last part.
    fn margins(&self, direction: Floats) -> PyResult<Vec<(usize, f64, f64)>> {
        let found = self.inner.margins(self.state(&direction)?);
        Ok(found.into_iter().map(|m| (m.pair, m.first, m.last)).collect())
    }

    /// Floquet multipliers, real and imaginary parts in turn.
    fn multipliers<'py>(&self, py: Python<'py>) -> Option<Complexes<'py>> {
        let monodromy = self.inner.monodromy();
        if monodromy.rows == 0 {
            return Some(interleaved(py, &[]));
        }
        eigen(&monodromy).map(|found| interleaved(py, &found.values))
    }

    /// Responses by frequency, multiple, output and stimulus; frequencies in real and imaginary parts.
    fn responses<'py>(
        &self,
        py: Python<'py>,
        frequencies: Floats,
        multiples: Floats,
    ) -> PyResult<Option<Complexes<'py>>> {
        let s: Vec<Complex> =
            frequencies.as_slice()?.chunks_exact(2).map(|p| complex(p[0], p[1])).collect();
        let multiples = multiples.as_slice()?.to_vec();
        let found = py.detach(|| self.inner.responses(&s, &multiples));
        Ok(found.map(|values| interleaved(py, &values)))
    }

    /// Derivatives of a sum of weighted integrals, values, products and waves. Drivers are stimulus, output that it
    /// carries, charge behind the rates in that, constant; values are output, instant, side (-1 and 1 limits at an
    /// event, 0 at a fixed instant), factor.
    #[pyo3(signature = (drivers, periodic, integrals=Vec::new(), values=Vec::new(), products=Vec::new(), waves=Vec::new()))]
    #[allow(clippy::too_many_arguments)] // the parts of a functional
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        drivers: Vec<(usize, Option<usize>, Option<usize>, f64)>,
        periodic: bool,
        integrals: Vec<(usize, [f64; 2], f64)>,
        values: Vec<(usize, f64, i8, f64)>,
        products: Vec<(usize, usize, [f64; 2], f64)>,
        waves: Vec<(usize, [f64; 2], f64, f64, f64)>,
    ) -> PyResult<Option<Derivatives<'py>>> {
        let limit = |side: i8| match side {
            0 => Limit::Fixed,
            1.. => Limit::Right,
            _ => Limit::Left,
        };
        let values = values.into_iter().map(|(o, t, side, f)| (o, t, limit(side), f)).collect();
        let goal = Goal { integrals, values, products, waves };
        let drivers: Vec<Driver> = drivers
            .into_iter()
            .map(|(stimulus, output, stored, constant)| Driver {
                stimulus,
                output,
                stored,
                constant,
            })
            .collect();
        if !self.inner.carries(&goal, &drivers) {
            return Err(invalid("drivers and functionals name outputs and stimuli"));
        }
        let found = py.detach(|| self.inner.gradient(&goal, &drivers, periodic));
        let array = |list| PyArray1::from_vec(py, list);
        Ok(found.map(|g| (array(g.drivers), array(g.charges), g.instants, g.period)))
    }

    /// Fourier coefficients over a window, by output and order.
    fn coefficients<'py>(
        &self,
        py: Python<'py>,
        orders: PyReadonlyArray1<f64>,
        start: f64,
        stop: f64,
    ) -> PyResult<Complexes<'py>> {
        let orders = orders.to_vec()?;
        let found = py.detach(|| self.inner.coefficients(&orders, [start, stop]));
        Ok(interleaved(py, &found))
    }

    /// Averages of products of outputs over a window.
    fn products<'py>(
        &self,
        py: Python<'py>,
        pairs: Vec<(usize, usize)>,
        start: f64,
        stop: f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, py.detach(|| self.inner.products(&pairs, [start, stop])))
    }

    /// Integrals of products of outputs between neighbouring instants, instant by instant.
    fn products_between<'py>(
        &self,
        py: Python<'py>,
        pairs: Vec<(usize, usize)>,
        instants: PyReadonlyArray1<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let instants = instants.to_vec()?;
        Ok(PyArray1::from_vec(py, py.detach(|| self.inner.products_between(&pairs, &instants))))
    }

    /// Events of the last run: time, outputs before and after, pairs that conduct before and after.
    fn commutations(&self, py: Python<'_>, periodic: bool) -> Vec<Event> {
        let found = py.detach(|| self.inner.commutations(periodic));
        found
            .into_iter()
            .map(|c| {
                let ([before, after], [on, then]) = (c.outputs, c.active);
                (c.time, before, after, on, then)
            })
            .collect()
    }
}

impl PyOrbit {
    fn state<'a>(&self, a: &'a Floats) -> PyResult<&'a [f64]> {
        let a = a.as_slice()?;
        if a.len() == self.inner.states() {
            Ok(a)
        } else {
            Err(invalid("one value per energy coordinate"))
        }
    }
}
