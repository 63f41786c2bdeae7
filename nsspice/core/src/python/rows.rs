//! The laws of the elements of a deck at the rows of a table, as a Python class.

use super::system::described;
use super::{invalid, WaveformSpec};
use crate::audit::rows::{Gate, Line, Rows, Source, Sum, Terms, Unit, Valve, Worst};
use crate::audit::Described;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

/// terms, conductance at its node, whether it is a current
type SumSpec = (Terms, f64, bool);
/// `v`, `i`, constant; whether it is a current
type FormSpec = ([f64; 3], bool);
/// voltage, current, lines with their bounds, resistance and conductance at its nodes
type ValveSpec = (Terms, Terms, Vec<(FormSpec, Vec<FormSpec>)>, [f64; 2]);
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
    /// Of a table with the time and columns that are currents or voltages, known to a part of the largest and of what
    /// voltages drive through a conductance.
    #[new]
    fn new(
        currents: Vec<bool>,
        known: f64,
        siemens: f64,
        sums: Vec<SumSpec>,
        valves: Vec<ValveSpec>,
        gates: Vec<GateSpec>,
        sources: Vec<SourceSpec>,
    ) -> PyResult<Self> {
        let kinds: Vec<Unit> = std::iter::once(false).chain(currents).map(unit).collect();
        let mut inner = Rows::new(kinds[1..].to_vec(), known, siemens);
        let columns = inner.columns();
        let lists = sums.iter().map(|s| &s.0);
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
        inner.sums =
            sums.into_iter().map(|(terms, siemens, i)| Sum::new(terms, siemens, unit(i))).collect();
        let valve = |(v, i, lines, reach): ValveSpec| {
            Valve::new(v, i, lines.into_iter().map(line).collect(), reach)
        };
        inner.valves = valves.into_iter().map(valve).collect();
        let gate = |(valve, control, edges, inverted): GateSpec| {
            let kind = control.first().map_or(Unit::Volts, |term| kinds[term.0]);
            Gate::new(valve, (control, kind), edges, inverted)
        };
        inner.gates = gates.into_iter().map(gate).collect();
        for (terms, waveforms, amperes) in &sources {
            let waveforms = waveforms.iter().map(described).collect::<PyResult<Vec<_>>>()?;
            let mut largest = [0.0; 2];
            largest[usize::from(*amperes)] = waveforms.iter().map(Described::bound).sum();
            inner.see(largest);
            inner.sources.push(Source::new(terms.clone(), waveforms, unit(*amperes)));
        }
        Ok(PyRows { inner })
    }

    /// Measures errors as a table of the same run does; `same` are numbers of laws here and there: sums, valves, gates,
    /// sources.
    fn measure_as(
        &mut self,
        other: PyRef<'_, PyRows>,
        same: [Vec<(usize, usize)>; 4],
    ) -> PyResult<()> {
        let counts = |rows: &Rows| {
            [rows.sums.len(), rows.valves.len(), rows.gates.len(), rows.sources.len()]
        };
        let (own, its) = (counts(&self.inner), counts(&other.inner));
        let fits = |k: usize| same[k].iter().all(|&(i, j)| i < own[k] && j < its[k]);
        if !(0..4).all(fits) {
            return Err(invalid("there are no such laws"));
        }
        self.inner.measure_as(&other.inner, &same);
        Ok(())
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
