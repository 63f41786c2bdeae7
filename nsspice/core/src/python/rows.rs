//! The laws of the elements of a deck at the rows of a table, as a Python class.

use super::system::described;
use super::{invalid, WaveformSpec};
use crate::audit::rows::{Gate, Line, Rows, Source, Sum, Terms, Unit, Valve, Worst};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

/// terms, terms of the rounding, whether it is a current
type SumSpec = (Terms, Terms, bool);
/// `v`, `i`, constant; whether it is a current
type FormSpec = ([f64; 3], bool);
/// voltage, current, lines with their bounds, resistance at its nodes
type ValveSpec = (Terms, Terms, Vec<(FormSpec, Vec<FormSpec>)>, f64);
/// number of the valve, control, thresholds, whether it conducts while the control is low
type GateSpec = (usize, Terms, [f64; 2], bool);
/// terms, waveforms, whether it is a current
type SourceSpec<'py> = (Terms, Vec<WaveformSpec<'py>>, bool);
/// error and time
type Found = Vec<(f64, f64)>;

fn unit(amperes: bool) -> Unit {
    if amperes {
        Unit::Amperes
    } else {
        Unit::Volts
    }
}

#[pyclass(name = "Rows", module = "nsspice._core")]
pub(super) struct PyRows {
    inner: Rows,
}

#[pymethods]
impl PyRows {
    /// Of a table with the time and columns that are currents or voltages, known to a part of the largest.
    #[new]
    fn new(
        currents: Vec<bool>,
        known: f64,
        sums: Vec<SumSpec>,
        valves: Vec<ValveSpec>,
        gates: Vec<GateSpec>,
        sources: Vec<SourceSpec>,
    ) -> PyResult<Self> {
        let mut inner = Rows::new(currents.into_iter().map(unit).collect(), known);
        let columns = inner.columns();
        let lists = sums.iter().flat_map(|s| [&s.0, &s.1]);
        let lists = lists.chain(valves.iter().flat_map(|v| [&v.0, &v.1]));
        let lists = lists.chain(gates.iter().map(|g| &g.1)).chain(sources.iter().map(|s| &s.0));
        let inside = lists.flatten().all(|term| term.0 < columns);
        let lined = gates.iter().all(|g| valves.get(g.0).is_some_and(|v| v.2.len() > 1));
        if !inside || !lined {
            return Err(invalid("the laws do not fit the columns"));
        }
        let form = |(numbers, amperes): FormSpec| (numbers, unit(amperes));
        let line = |(law, bounds): (FormSpec, Vec<FormSpec>)| Line {
            law: form(law),
            bounds: bounds.into_iter().map(form).collect(),
        };
        inner.sums = sums.into_iter().map(|(t, r, i)| Sum::new(t, r, unit(i))).collect();
        let valve = |(v, i, lines, resists): ValveSpec| {
            Valve::new(v, i, lines.into_iter().map(line).collect(), resists)
        };
        inner.valves = valves.into_iter().map(valve).collect();
        let gate = |(valve, control, edges, inverted)| Gate::new(valve, control, edges, inverted);
        inner.gates = gates.into_iter().map(gate).collect();
        for (terms, waveforms, amperes) in &sources {
            let waveforms = waveforms.iter().map(described).collect::<PyResult<_>>()?;
            inner.sources.push(Source::new(terms.clone(), waveforms, unit(*amperes)));
        }
        Ok(PyRows { inner })
    }

    /// Measures errors as a table of the same run does.
    fn see(&mut self, other: PyRef<'_, PyRows>) {
        self.inner.see(other.inner.largest());
    }

    /// Takes the next rows of the table.
    fn take(&mut self, rows: PyReadonlyArray2<f64>) -> PyResult<()> {
        let view = rows.as_array();
        if view.ncols() != self.inner.columns() {
            return Err(invalid("the rows do not have these columns"));
        }
        let slice = view.as_slice().ok_or_else(|| invalid("the array must be contiguous"))?;
        self.inner.take(slice);
        Ok(())
    }

    /// Worst errors and their times, of sums, valves, gates and sources.
    fn worst(&self) -> [Found; 4] {
        let pair = |worst: &Worst| (worst.error, worst.time);
        self.inner.worst().map(|list| list.iter().map(pair).collect())
    }
}
