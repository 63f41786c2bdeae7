//! The Python interface of the core; all bindings are in this file and in its folder.

mod audit;
#[cfg(feature = "faults")]
mod faults;
mod mlcp;
mod modewise;
mod newton;
mod points;
mod polynomial;
mod rows;
mod steady;
mod system;
mod written;

use crate::audit::Taken;
use crate::pieces::Pieces;
use points::{event_arrays, EventArrays, PyIntervals, PyRecords};
use polynomial::PyPolynomial;
use system::{guessed, misfit, PySystem, Sizes};
use written::{fill, turn_specs, RowSumSpec, TurnSpec, Written};

use crate::integrate::{Accuracy, Clock, Failure, Outputs, Part, Plan, Sdirk, Stepper};
use crate::integrate::{Samples, System, Tableau};
use crate::mlcp::Role;
use crate::sparse::Csc;
use crate::tape::{Program, Tape};
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::sync::Arc;

type Ints<'py> = PyReadonlyArray1<'py, i64>;
type Floats<'py> = PyReadonlyArray1<'py, f64>;
/// rows, columns, indptr, indices, data
type Matrix<'py> = (usize, usize, Ints<'py>, Ints<'py>, Floats<'py>);

fn invalid(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

fn csc(m: &Matrix) -> PyResult<Csc> {
    let (nrows, ncols) = (m.0, m.1);
    let convert = |a: &Ints| -> PyResult<Vec<usize>> {
        a.as_slice()?
            .iter()
            .map(|&i| usize::try_from(i).map_err(|e| invalid(e.to_string())))
            .collect()
    };
    let (colptr, rowidx) = (convert(&m.2)?, convert(&m.3)?);
    let values = m.4.as_slice()?.to_vec();
    let consistent = colptr.len() == ncols + 1
        && colptr.first() == Some(&0)
        && colptr.last() == Some(&rowidx.len())
        && colptr.windows(2).all(|w| w[0] <= w[1])
        && rowidx.len() == values.len()
        && rowidx.iter().all(|&r| r < nrows);
    if !consistent {
        return Err(invalid("inconsistent sparse matrix"));
    }
    Ok(Csc { nrows, ncols, colptr, rowidx, values })
}

fn role(code: u8) -> PyResult<Role> {
    Ok(match code {
        0 => Role::Diode,
        1 => Role::Closed,
        2 => Role::Open,
        _ => return Err(invalid("a role is 0 (diode), 1 (closed) or 2 (open)")),
    })
}

/// One output as lists of (index, coefficient) for z, lam, dz, u, f, df.
type OutputSpec = [Vec<(usize, f64)>; 6];

/// codes, arguments, constants, outputs of a tape
type TapeSpec<'py> = (
    PyReadonlyArray1<'py, u8>,
    PyReadonlyArray2<'py, i32>,
    Floats<'py>,
    PyReadonlyArray1<'py, i32>,
);

/// tape, F, Q
type SmoothSpec<'py> = (TapeSpec<'py>, Matrix<'py>, Matrix<'py>);

fn tape(spec: &TapeSpec, unknowns: usize, sources: usize) -> PyResult<Tape> {
    let args: Vec<[i32; 3]> =
        spec.1.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
    let program = Program::new(
        spec.0.as_slice()?,
        &args,
        spec.2.as_slice()?,
        spec.3.as_slice()?,
        unknowns,
        sources,
    )
    .map_err(invalid)?;
    Ok(Tape::new(Arc::new(program)))
}

/// pair, control, on_above, off_below, state of the gate, inverted, latching, state of the gate at the
/// threshold (None: it turns when the control has come there)
type SwitchSpec = (usize, Vec<(usize, f64)>, f64, f64, bool, bool, bool, Option<bool>);

/// kind, values, repeat, scale, and what another block hands on
type WaveformSpec<'py> = (String, Vec<f64>, f64, f64, Option<PyRef<'py, PyPolynomial>>);

#[pyclass(name = "Stepper", module = "nsspice._core")]
struct PyStepper {
    inner: Stepper,
    /// controls the steps of a run by SDIRK
    sdirk: Option<Box<Sdirk>>,
    sizes: Sizes,
    written: Written,
}

fn failure_dict<'py>(py: Python<'py>, f: &Failure) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("time", f.time)?;
    out.set_item("length", f.length)?;
    out.set_item("rhs", PyArray1::from_slice(py, &f.rhs))?;
    out.set_item("roles", PyArray1::from_slice(py, &f.roles))?;
    out.set_item("residual", f.residual)?;
    out.set_item("suspect", f.suspect)?;
    let best = f.best.as_deref();
    out.set_item("worst_row", best.map(|b| b.worst_row))?;
    out.set_item("point", best.map(|b| PyArray1::from_slice(py, &b.point)))?;
    out.set_item("restless", f.restless)?;
    Ok(out)
}

fn jump_dict<'py>(py: Python<'py>, j: &crate::integrate::Jump) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("time", j.time)?;
    out.set_item("before", PyArray1::from_slice(py, &j.before))?;
    out.set_item("after", PyArray1::from_slice(py, &j.after))?;
    out.set_item("multipliers", PyArray1::from_slice(py, &j.multipliers))?;
    out.set_item("functions", PyArray1::from_slice(py, &j.functions))?;
    out.set_item("unknowns", PyArray1::from_slice(py, &j.unknowns))?;
    out.set_item("sources", PyArray1::from_slice(py, &j.sources))?;
    out.set_item("length", j.length)?;
    out.set_item("span", j.span)?;
    Ok(out)
}

#[pymethods]
impl PyStepper {
    #[new]
    fn new(
        system: &PySystem,
        averaging: Option<(Matrix, Matrix)>,
        outputs: Vec<OutputSpec>,
    ) -> PyResult<Self> {
        let [n, m, p, functions] = system.sizes();
        if system.waveforms.len() != p {
            return Err(misfit());
        }
        let zeros = || (Csc::zeros(n, n), Csc::zeros(n, p));
        let (h, hs) = system.averaging(&averaging)?.unwrap_or_else(zeros);
        let linear = system.linear.clone();
        let mut sys = System::new(linear, h, hs, system.smooth.clone(), system.dominant());
        sys.tree = (!system.coordinates.are_potentials()).then(|| system.coordinates.clone());
        let sizes = [n, m, n, p, functions, functions];
        let mut terms = Vec::with_capacity(outputs.len());
        for output in &outputs {
            let mut list = Vec::new();
            for ((entries, part), size) in output.iter().zip(Part::ALL).zip(sizes) {
                if entries.iter().any(|e| e.0 >= size) {
                    return Err(invalid("an output refers to a quantity that does not exist"));
                }
                list.extend(entries.iter().map(|&(j, c)| (part, j, c)));
            }
            terms.push(list);
        }
        let (waveforms, switches) = (system.waveforms.clone(), system.switches_of_engines());
        let (gates, outputs) = (system.gates_of_engines(), Outputs::new(&terms, sizes));
        let mut inner = Stepper::new(sys, waveforms, switches, gates, outputs);
        inner.know_elements(&system.capacitors, &system.conductors, &system.coordinates);
        Ok(PyStepper { inner, sdirk: None, sizes: system.sizes(), written: Written::default() })
    }

    /// Returns None, or the failure as a dict.
    #[pyo3(signature = (time, guess=None))]
    fn start_dc<'py>(
        &mut self,
        py: Python<'py>,
        time: f64,
        guess: Option<(Floats, Floats)>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let guess = guessed(&guess, &self.sizes)?;
        let inner = &mut self.inner;
        let result = py.detach(move || {
            inner.start_dc(time, guess.as_ref().map(|(z, l)| (z.as_slice(), l.as_slice())))
        });
        result.err().map(|f| failure_dict(py, &f)).transpose()
    }

    /// Lets edges of sources at the start act; returns None, or the failure as a dict.
    fn leave_dc<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let inner = &mut self.inner;
        let result = py.detach(move || inner.leave_dc());
        result.err().map(|f| failure_dict(py, &f)).transpose()
    }

    #[pyo3(signature = (time, charges, step, guess=None))]
    fn start_charges<'py>(
        &mut self,
        py: Python<'py>,
        time: f64,
        charges: Floats,
        step: f64,
        guess: Option<(Floats, Floats)>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let charges = charges.as_slice()?.to_vec();
        #[cfg(feature = "faults")]
        let charges = faults::damaged(charges, crate::faults::damage::start);
        if charges.len() != self.inner.state().0.len() {
            return Err(invalid("one charge or flux per unknown is needed"));
        }
        let guess = guessed(&guess, &self.sizes)?;
        let inner = &mut self.inner;
        let result = py.detach(move || {
            let guess = guess.as_ref().map(|(z, l)| (z.as_slice(), l.as_slice()));
            inner.start_charges(time, &charges, step, guess)
        });
        result.err().map(|f| failure_dict(py, &f)).transpose()
    }

    /// What to leave for the certificate: one of `every` steps, `window` steps from each change of
    /// mode; `sides`: rows on both sides of jumps.
    fn watch(&mut self, every: u64, window: u32, sides: bool) {
        let size = self.inner.state().0.len() + self.inner.state().1.len();
        self.inner.recorder.samples = Samples::new(every, window, sides, size);
    }

    /// Records all steps with error control, for who goes along them once more.
    fn record_all(&mut self) {
        self.inner.recorder.samples.all = true;
    }

    /// Keeps some outputs between two instants as polynomials through so many points of steps with error
    /// control.
    fn keep_pieces(&mut self, outputs: Vec<usize>, from_time: f64, to_time: f64, points: usize) {
        self.inner.recorder.samples.pieces =
            Pieces::new(outputs, [from_time, to_time], points.max(4));
    }

    /// The pieces since the last call: beginning, length and values at the points, output by output.
    fn take_pieces<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (size, table) =
            (self.inner.recorder.samples.pieces.size(), self.inner.recorder.samples.pieces.take());
        let rows = table.len() / size;
        PyArray1::from_vec(py, table).reshape([rows, size])
    }

    /// Keeps the ends of steps of fixed length between the rows, too, within two instants.
    fn keep_between(&mut self, from_time: f64, to_time: f64) {
        self.inner.recorder.samples.keep_between([from_time, to_time]);
    }

    /// Lets the balance of energy of an auditor go with the run.
    fn accompany(&mut self, auditor: &mut audit::PyAuditor) {
        self.inner.recorder.sums = auditor.sums.take().map(Box::new);
    }

    /// The balance of energy of the run up to now, None without one.
    fn balance<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.inner.balance().map(|b| audit::balance_dict(py, &b)).transpose()
    }

    fn show_all_points(&mut self, from_time: f64) {
        self.inner.show_all_points(from_time);
    }

    /// Numbers that wait to be taken.
    fn waiting(&self) -> usize {
        self.inner.recorder.samples.waiting() + self.sdirk.as_ref().map_or(0, |s| s.waiting())
    }

    /// The steps with error control recorded since the last call.
    fn take_intervals(&mut self) -> PyIntervals {
        let taken = self.sdirk.as_mut().map_or_else(Taken::default, |s| s.take_intervals());
        PyIntervals { taken, sizes: self.sizes }
    }

    /// The recorded steps since the last call.
    fn take_records(&mut self) -> PyRecords {
        PyRecords { records: self.inner.recorder.samples.take_records(), sizes: self.sizes }
    }

    /// Rows of both sides of jumps since the last call, flat.
    fn take_sides<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner.recorder.samples.take_sides())
    }

    fn plan_grid(
        &mut self,
        start: f64,
        stop: f64,
        step: f64,
        out_start: f64,
        out_step: f64,
    ) -> u64 {
        let clock = Clock::grid(start, stop, step, out_start, out_step);
        self.sdirk = None;
        self.inner.plan(Plan::Grid(clock), step)
    }

    /// Steps of order 2 or 4 with error control, from the present time; returns the number of rows.
    #[pyo3(signature = (order, stop, longest, out_start, out_step, reltol, vntol, abstol, energy))]
    #[allow(clippy::too_many_arguments)] // numbers all of them, named by the caller
    fn plan_sdirk(
        &mut self,
        order: u32,
        stop: f64,
        longest: f64,
        out_start: f64,
        out_step: f64,
        reltol: f64,
        vntol: f64,
        abstol: f64,
        energy: bool,
    ) -> PyResult<u64> {
        let tableau = Tableau::of_order(order).ok_or_else(|| invalid("the order is 2 or 4"))?;
        let accuracy = Accuracy { relative: reltol, voltage: vntol, current: abstol, energy };
        let rows = (out_start, out_step);
        let made = Sdirk::new(&mut self.inner, tableau, accuracy, stop, longest, rows);
        let count = made.row_count();
        self.sdirk = Some(Box::new(made));
        Ok(count)
    }

    fn plan_points(&mut self, times: Floats) -> PyResult<u64> {
        let times = times.as_slice()?.to_vec();
        self.sdirk = None;
        Ok(self.inner.plan(Plan::Points { times, next: 0 }, f64::INFINITY))
    }

    /// The outputs at the `begin` of the run, or where it waits for a source, after the time.
    #[pyo3(signature = (begin=false))]
    fn sample<'py>(&mut self, py: Python<'py>, begin: bool) -> Bound<'py, PyArray1<f64>> {
        let mut row = vec![0.0; self.inner.recorder.columns()];
        match &mut self.sdirk {
            Some(sdirk) if !begin => sdirk.at_wait(&mut self.inner, &mut row),
            _ => self.inner.at_wait(&mut row),
        }
        PyArray1::from_vec(py, row)
    }

    /// Fills rows of `out`; returns (rows, state) with state 0 more, 1 done, 2 failed.
    fn advance(
        &mut self,
        py: Python<'_>,
        out: PyReadwriteArray2<f64>,
        budget: f64,
    ) -> PyResult<(usize, u8)> {
        let (inner, sdirk) = (&mut self.inner, &mut self.sdirk);
        let columns = inner.recorder.columns();
        fill(py, out, columns, budget, &mut self.written, move |slice, budget| match sdirk {
            Some(sdirk) => sdirk.advance(inner, slice, budget),
            None => inner.advance(slice, budget),
        })
    }

    fn failure<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.inner.failure.as_ref().map(|f| failure_dict(py, f)).transpose()
    }

    fn accept_large(&mut self) {
        self.inner.accept_large();
    }

    fn state<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let (z, l) = self.inner.state();
        (PyArray1::from_slice(py, z), PyArray1::from_slice(py, l))
    }

    fn freeze_time(&mut self, time: f64) {
        self.inner.freeze_time(time);
    }

    #[pyo3(signature = (by_rate, correctors=None))]
    fn follow_path(&mut self, by_rate: bool, correctors: Option<usize>) {
        self.inner.follow_path(by_rate, correctors);
    }

    fn time(&self) -> f64 {
        self.inner.time()
    }

    /// State of each switch's gate.
    fn gates(&self) -> Vec<bool> {
        self.inner.gate_states().to_vec()
    }

    fn jumps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.inner.recorder.jumps.iter().map(|j| jump_dict(py, j)).collect()
    }

    /// Keeps also what only checks of rows and of turning gates need; call it before the start.
    fn watch_closely(&mut self) {
        self.inner.watch_closely();
        self.written.begin();
    }

    /// See `RowSumSpec`.
    fn written(&mut self) -> RowSumSpec {
        self.written.sums_beside(self.inner.recorder.expected_sums())
    }

    /// Gates that have turned: time, switch, the gate before, its control, what the pair carried, whether located.
    fn turns(&self) -> Vec<TurnSpec> {
        turn_specs(self.inner.switching_turns())
    }

    /// Changes of pairs as (time, pair, conducts from then on).
    fn events<'py>(&self, py: Python<'py>) -> EventArrays<'py> {
        event_arrays(py, &self.inner.recorder.events)
    }

    /// Pairs of the switches that chatter and are sampled, and the time between two of their looks [s].
    fn chattering(&self) -> (Vec<(usize, u64, f64)>, f64) {
        self.sdirk.as_ref().map_or((Vec::new(), 0.0), |c| c.chattering(&self.inner))
    }

    /// Pairs of the switches whose controls have come to rest at thresholds, and when first [s].
    fn resting(&self) -> Vec<(usize, f64)> {
        self.inner.resting()
    }

    /// The unknown that no step could follow first, and when [s].
    fn unbounded(&self) -> Option<(usize, f64)> {
        self.sdirk.as_ref().and_then(|c| c.control.unbounded)
    }

    /// The modes of steps since the last call: since when each [s], and its conducting pairs.
    fn visited(&mut self) -> Vec<(f64, Vec<bool>)> {
        self.sdirk.as_mut().map(|c| c.visited.take()).unwrap_or_default()
    }

    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let s = self.inner.statistics();
        let out = PyDict::new(py);
        out.set_item("steps", s.steps)?;
        out.set_item("events", s.events)?;
        out.set_item("mode_changes", s.mode_changes)?;
        let sdirk = self.sdirk.as_ref();
        out.set_item("modes", sdirk.map_or(0, |c| c.mode_count()).max(self.inner.mode_count()))?;
        if let Some(c) = sdirk.map(|c| c.counters) {
            out.set_item("rejected", c.rejected)?;
            out.set_item("located", c.located)?;
            out.set_item("passed", c.passed)?;
            out.set_item("forced", c.forced)?;
            out.set_item("matrices", c.matrices)?;
        }
        if sdirk.is_some_and(|c| c.measures_energies()) {
            out.set_item("energies", 1)?;
        }
        out.set_item("quick_steps", s.quick_steps)?;
        out.set_item("problems", s.problems)?;
        out.set_item("undetermined", s.undetermined)?;
        out.set_item("worst_stage", s.worst_stage)?;
        out.set_item("switchings", s.switchings)?;
        out.set_item("jumps", s.jumps)?;
        out.set_item("short_steps", s.short_steps)?;
        out.set_item("chatter", s.chatter)?;
        out.set_item("residual_rows", s.residual_rows)?;
        out.set_item("residual_complementarity", s.residual_complementarity)?;
        out.set_item("checks", s.checks)?;
        out.set_item("linearised", s.linearised)?;
        out.set_item("grid_residual", s.grid_residual)?;
        Ok(out)
    }
}

/// Rows of numbers as CSV text.
#[pyfunction]
fn format_rows<'py>(py: Python<'py>, rows: PyReadonlyArray2<f64>) -> PyResult<Bound<'py, PyBytes>> {
    let view = rows.as_array();
    let columns = view.ncols();
    let slice = view.as_slice().ok_or_else(|| invalid("the array must be contiguous"))?;
    let mut out = Vec::with_capacity(slice.len() * 12);
    py.detach(|| crate::format::rows(slice, columns, &mut out));
    Ok(PyBytes::new(py, &out))
}

/// Value of a waveform at some times; `side` is -1 for the left limit, else the right one.
#[pyfunction]
fn waveform_values<'py>(
    py: Python<'py>,
    spec: WaveformSpec<'py>,
    times: Floats,
    side: i8,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let waveform = system::waveform(&spec)?;
    let side = if side < 0 { crate::waveform::Side::Left } else { crate::waveform::Side::Right };
    let out: Vec<f64> = times.as_slice()?.iter().map(|&t| waveform.value(t, side)).collect();
    Ok(PyArray1::from_slice(py, &out))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySystem>()?;
    module.add_class::<PyIntervals>()?;
    module.add_class::<PyRecords>()?;
    module.add_class::<PyPolynomial>()?;
    module.add_class::<PyStepper>()?;
    module.add_class::<modewise::PyModewise>()?;
    module.add_class::<steady::PyOrbit>()?;
    module.add_class::<audit::PyAuditor>()?;
    module.add_class::<rows::PyRows>()?;
    module.add_class::<written::PyColumnSums>()?;
    #[cfg(feature = "faults")]
    {
        module.add_function(wrap_pyfunction!(faults::choose_fault, module)?)?;
        module.add_function(wrap_pyfunction!(faults::faults, module)?)?;
    }
    module.add_function(wrap_pyfunction!(mlcp::solve_mlcp, module)?)?;
    module.add_function(wrap_pyfunction!(format_rows, module)?)?;
    module.add_function(wrap_pyfunction!(waveform_values, module)?)?;
    module.add_function(wrap_pyfunction!(newton::tape_instructions, module)?)?;
    module.add_function(wrap_pyfunction!(newton::tape_values, module)?)?;
    module.add_function(wrap_pyfunction!(newton::solve_path, module)?)?;
    Ok(())
}
