//! The mode-wise engine as a Python class.

use super::audit::{balance_dict, points_dict, PyAuditor};
use super::points::{event_arrays, EventArrays, PyIntervals, PyRecords};
use super::polynomial::PyPolynomial;
use super::system::{misfit, PySystem, Sizes};
use super::written::{fill, turn_specs, RowSumSpec, Written};
use super::{failure_dict, invalid, Floats, TurnSpec};
use crate::modewise::Engine;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadwriteArray2};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pyclass(name = "Modewise", module = "nsspice._core")]
pub(super) struct PyModewise {
    inner: Engine,
    /// states of the switches before the start
    gates: Vec<bool>,
    sizes: Sizes,
    written: Written,
}

#[pymethods]
impl PyModewise {
    #[new]
    fn new(system: &PySystem, outputs: Vec<[Vec<(usize, f64)>; 4]>) -> PyResult<Self> {
        let [n, m, p, _] = system.sizes();
        let inside = |o: &[Vec<(usize, f64)>; 4]| {
            o.iter().zip([n, m, n, p]).all(|(part, size)| part.iter().all(|e| e.0 < size))
        };
        let fits = system.waveforms.len() == p && outputs.iter().all(inside);
        if !fits {
            return Err(misfit());
        }
        let inner = Engine::new(system.prepared().map_err(invalid)?, outputs);
        Ok(PyModewise {
            inner,
            gates: system.gates_of_engines(),
            sizes: system.sizes(),
            written: Written::default(),
        })
    }

    /// Rows from `out_start` to `stop`; implicit steps, where needed, of at most `fixed_step`.
    fn plan(&mut self, stop: f64, out_start: f64, out_step: f64, fixed_step: f64) -> u64 {
        self.inner.plan(stop, out_start, out_step, fixed_step)
    }

    /// States of the switches at the start, None if more than sources decides about them.
    fn gates_by_sources(&self) -> Option<Vec<bool>> {
        self.inner.gates_by_sources(&self.gates)
    }

    /// Starts at 0 from charges and fluxes, and from the pairs that conduct if these are known; returns
    /// None, or the failure as a dict.
    #[pyo3(signature = (charges, gates, active=None))]
    fn start<'py>(
        &mut self,
        py: Python<'py>,
        charges: Floats,
        gates: Vec<bool>,
        active: Option<Vec<bool>>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let pairs = self.sizes[1];
        if active.as_ref().is_some_and(|active| active.len() != pairs) {
            return Err(invalid("one state per pair"));
        }
        let charges = charges.as_slice()?.to_vec();
        #[cfg(feature = "faults")]
        let charges = super::faults::damaged(charges, crate::faults::damage::start);
        if !self.inner.fits(charges.len(), gates.len()) {
            return Err(invalid("one charge or flux per unknown and one state per switch"));
        }
        let inner = &mut self.inner;
        let result = py.detach(move || inner.start(&charges, &gates, active));
        result.err().map(|f| failure_dict(py, &f)).transpose()
    }

    /// Fills rows of `out`; returns (rows, state) with state 0 more, 1 done, 2 failed.
    fn advance(
        &mut self,
        py: Python<'_>,
        out: PyReadwriteArray2<f64>,
        budget: f64,
    ) -> PyResult<(usize, u8)> {
        let (inner, written) = (&mut self.inner, &mut self.written);
        let columns = inner.columns();
        fill(py, out, columns, budget, written, move |slice, budget| inner.advance(slice, budget))
    }

    /// The outputs where the run waits for a source, left limits, after the time; at the `begin` of the run
    /// right limits, None where it begins with implicit steps.
    #[pyo3(signature = (begin=false))]
    fn sample<'py>(&mut self, py: Python<'py>, begin: bool) -> Option<Bound<'py, PyArray1<f64>>> {
        self.inner.at_wait(begin).map(|row| PyArray1::from_vec(py, row))
    }

    fn failure<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.inner.log.failure.as_ref().map(|f| failure_dict(py, f)).transpose()
    }

    fn state<'py>(
        &mut self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let (z, l) = self.inner.state();
        (PyArray1::from_slice(py, &z), PyArray1::from_slice(py, &l))
    }

    /// As `state`, at the begin of the present segment.
    fn beginning<'py>(
        &mut self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let (z, l) = self.inner.beginning();
        (PyArray1::from_slice(py, &z), PyArray1::from_slice(py, &l))
    }

    fn time(&self) -> f64 {
        self.inner.time()
    }

    /// The present states of the gates.
    fn gates(&self) -> Vec<bool> {
        self.inner.gates().to_vec()
    }

    /// Active pairs of the present mode.
    fn active(&self) -> Vec<bool> {
        self.inner.active()
    }

    /// Whether points are left for the certificate.
    fn watch(&mut self, watches: bool) {
        self.inner.watch(watches);
    }

    /// Keeps also what only checks of rows and of turning gates need; call it before the start.
    fn watch_closely(&mut self) {
        self.inner.watch_closely();
        self.written.begin();
    }

    /// Lets the balance of energy of an auditor go with the run.
    fn accompany(&mut self, auditor: &mut PyAuditor) {
        self.inner.accompany(auditor.sums.take());
    }

    /// Lets an auditor look at all segments of the run.
    fn look_at_all(&mut self, auditor: &mut PyAuditor) {
        self.inner.look_at_all(auditor.points.take());
    }

    /// What was found in the segments up to now, None if nobody looks at them.
    fn looked_at<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.inner.looked_at().map(|points| points_dict(py, points)).transpose()
    }

    /// The balance of energy of the run up to now, None without one.
    fn balance<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.inner.balance().map(|b| balance_dict(py, &b)).transpose()
    }

    /// Numbers that wait to be taken.
    fn waiting(&self) -> usize {
        self.inner.waiting()
    }

    /// The intervals recorded since the last call.
    fn take_intervals(&mut self) -> PyIntervals {
        PyIntervals { taken: self.inner.take_intervals(), sizes: self.sizes }
    }

    /// The implicit steps recorded since the last call.
    fn take_records(&mut self) -> PyRecords {
        PyRecords { records: self.inner.take_records(), sizes: self.sizes }
    }

    /// Whether rows on both sides of jumps are kept.
    fn keep_sides(&mut self, keep: bool) {
        self.inner.keep_sides(keep);
    }

    /// Keeps some outputs between two instants as polynomials.
    fn keep_pieces(&mut self, outputs: Vec<usize>, from_time: f64, to_time: f64) {
        self.inner.keep_pieces(outputs, [from_time, to_time]);
    }

    /// The pieces since the last call: beginning, length and values at the points, output by output.
    fn take_pieces<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (size, table) = (self.inner.table.pieces.size(), self.inner.table.pieces.take());
        let rows = table.len() / size;
        PyArray1::from_vec(py, table).reshape([rows, size])
    }

    /// Hands some outputs on to other blocks.
    fn hand_on(&mut self, outputs: Vec<usize>, to: Vec<PyRef<'_, PyPolynomial>>) -> PyResult<()> {
        let last = self.inner.columns() - 1;
        if outputs.len() != to.len() || outputs.iter().any(|&output| output >= last) {
            return Err(invalid("one polynomial for each output"));
        }
        self.inner.hand_on(outputs, to.iter().map(|to| to.inner.clone()).collect());
        Ok(())
    }

    /// Makes the end of every segment from a time on a row, and two where something jumps.
    fn show_all_points(&mut self, from_time: f64) {
        self.inner.show_all_points(from_time);
    }

    /// The rows on both sides of jumps since the last call, one after the other.
    fn take_sides<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.take_sides())
    }

    /// Why a mode could not be reduced, None if all could.
    fn trouble(&self) -> Option<String> {
        self.inner.trouble().map(str::to_owned)
    }

    /// Pairs of the switches that chatter and are sampled, and the time between two of their looks [s].
    fn chattering(&self) -> (Vec<(usize, u64, f64)>, f64) {
        self.inner.chattering()
    }

    /// Pairs of the switches whose controls have come to rest at thresholds, and when first [s].
    fn resting(&self) -> Vec<(usize, f64)> {
        self.inner.control.resting.told(&self.inner.prepared.switches)
    }

    fn jumps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.inner.log.jumps.iter().map(|j| super::jump_dict(py, j)).collect()
    }

    /// Number of rows handed out, of each column the sum of its values and of their sizes, weighted, and what the
    /// values must add up to by what rows are made of.
    fn written(&mut self) -> RowSumSpec {
        self.written.sums_beside(self.inner.expected_sums())
    }

    /// Some rows once more, from the unknowns, since the last call.
    fn take_references<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.take_references())
    }

    /// Gates that have turned: time, switch, the gate before, its control, what the pair carried, whether located.
    fn turns(&self) -> Vec<TurnSpec> {
        turn_specs(&self.inner.log.turns)
    }

    /// Changes of pairs as (time, pair, conducts from then on).
    fn events<'py>(&self, py: Python<'py>) -> EventArrays<'py> {
        event_arrays(py, &self.inner.log.events)
    }

    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let s = &self.inner.stats;
        let out = PyDict::new(py);
        out.set_item(intern!(py, "fixed_steps"), s.fixed_steps)?;
        out.set_item(intern!(py, "taken"), s.taken)?;
        out.set_item(intern!(py, "accumulation"), u8::from(self.inner.accumulation()))?;
        out.set_item(intern!(py, "doublings"), self.inner.doublings())?;
        out.set_item(intern!(py, "work"), self.inner.work())?;
        out.set_item(intern!(py, "segments"), s.segments)?;
        out.set_item(intern!(py, "events"), s.events)?;
        out.set_item(intern!(py, "breakpoints"), s.breakpoints)?;
        out.set_item(intern!(py, "mode_changes"), s.mode_changes)?;
        out.set_item(intern!(py, "modes"), self.inner.modes())?;
        out.set_item(intern!(py, "reduced"), self.inner.reduced())?;
        out.set_item(intern!(py, "intervals"), self.inner.intervals())?;
        out.set_item(intern!(py, "problems"), self.inner.problems())?;
        out.set_item(intern!(py, "undetermined"), s.undetermined)?;
        out.set_item(intern!(py, "switchings"), s.switchings)?;
        out.set_item(intern!(py, "jumps"), s.jumps)?;
        out.set_item(intern!(py, "chatter"), s.chatter)?;
        out.set_item(intern!(py, "residual_rows"), s.residual_rows)?;
        out.set_item(intern!(py, "residual_complementarity"), s.residual_complementarity)?;
        out.set_item(intern!(py, "checks"), s.checks)?;
        Ok(out)
    }
}
