//! A system as engines and checks take it: its arrays, read and measured once for all of its runs.

use super::{csc, invalid, tape, Floats, Matrix, SmoothSpec, SwitchSpec, WaveformSpec};
use crate::audit::Described;
use crate::descriptor::{Linear, Smooth};
use crate::modewise::modes::mode::HIGH_INDEX;
use crate::modewise::{Assembly, Inputs, Prepared};
use crate::sparse::Csc;
use crate::structure::{Coordinates, Edge};
use crate::switch::{AtThreshold, Switch};
use crate::waveform::Waveform;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, OnceLock};

/// E, G, A, B, D, q, S, kinds of rows
type LinearSpec<'py> = (
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Floats<'py>,
    Matrix<'py>,
    PyReadonlyArray1<'py, u8>,
);

/// Unknowns, pairs, sources, smooth functions.
pub(super) type Sizes = [usize; 4];

#[pyclass(name = "System", module = "nsspice._core", frozen)]
pub(super) struct PySystem {
    pub linear: Linear,
    pub waveforms: Vec<Waveform>,
    /// the same for the checks
    pub described: Vec<Described>,
    pub switches: Arc<[Switch]>,
    /// their states before the start
    pub gates: Vec<bool>,
    pub smooth: Option<Smooth>,
    /// the elements behind the matrices
    pub capacitors: Vec<Edge>,
    pub conductors: Vec<Edge>,
    pub coordinates: Coordinates,
    /// whether conductances and diagonals show that the network is passive, once it is asked for
    dominant: OnceLock<bool>,
    /// what the mode-wise engine makes of it, when it is asked for the first time
    prepared: OnceLock<Result<Prepared, String>>,
}

#[pymethods]
impl PySystem {
    #[new]
    fn new(
        linear: LinearSpec,
        waveforms: Vec<WaveformSpec>,
        switches: Vec<SwitchSpec>,
        smooth: Option<SmoothSpec>,
        capacitors: Vec<Edge>,
        conductors: Vec<Edge>,
        before: Option<Vec<isize>>,
    ) -> PyResult<Self> {
        let linear = read(&linear)?;
        let (n, m, p) = linear.sizes();
        let smooth = match &smooth {
            Some((spec, f, q)) => Some(Smooth { tape: tape(spec, n, p)?, f: csc(f)?, q: csc(q)? }),
            None => None,
        };
        let coordinates = match before {
            None => Coordinates::of_nodes(n),
            Some(list) if list.len() == n => Coordinates::new(list).ok_or_else(misfit)?,
            Some(_) => return Err(misfit()),
        };
        let inside = |&(i, j, _): &Edge| i < n as isize && j < n as isize;
        let (switches, gates): (Vec<Switch>, Vec<bool>) = switches.into_iter().map(switch).unzip();
        let system = PySystem {
            linear,
            described: waveforms.iter().map(described).collect::<PyResult<_>>()?,
            waveforms: waveforms.iter().map(waveform).collect::<PyResult<_>>()?,
            switches: switches.into(),
            gates,
            smooth,
            capacitors,
            conductors,
            coordinates,
            dominant: OnceLock::new(),
            prepared: OnceLock::new(),
        };
        let [.., functions] = system.sizes();
        let fits = system.linear.row_kind.iter().all(|&k| k < 2)
            && system.capacitors.iter().all(inside)
            && system.conductors.iter().all(inside)
            && system.switches.iter().all(|s| s.pair < m && s.control.iter().all(|c| c.0 < n))
            && system
                .smooth
                .iter()
                .all(|s| [&s.f, &s.q].iter().all(|c| has_shape(c, n, functions)));
        if fits {
            Ok(system)
        } else {
            Err(misfit())
        }
    }

    /// Whether a mode has an index above 2: by pairs that conduct and switches that are on.
    fn above_two(&self, on: Vec<bool>, gates: Vec<bool>) -> bool {
        self.prepared().is_ok_and(|p| {
            let mode = p.modes.mode(&p.net, &p.switches, &on, &gates);
            mode.is_err_and(|why| why == HIGH_INDEX)
        })
    }

    /// Whether conductances and diagonals show that the network is passive.
    pub fn dominant(&self) -> bool {
        *self.dominant.get_or_init(|| {
            let rest = self.coordinates.remainder(&self.linear.g, &self.conductors);
            self.conductors.iter().all(|e| e.2 >= 0.0) && self.linear.dominant_beside(&rest)
        })
    }
}

impl PySystem {
    pub fn sizes(&self) -> Sizes {
        let (n, m, p) = self.linear.sizes();
        [n, m, p, self.smooth.as_ref().map_or(0, |s| s.tape.program().len())]
    }

    /// The system as the mode-wise engine sees it, or why it cannot treat it.
    pub fn prepared(&self) -> Result<&Prepared, String> {
        let made = self.prepared.get_or_init(|| {
            let sys = Assembly {
                linear: self.linear.clone(),
                capacitors: self.capacitors.clone(),
                conductors: self.conductors.clone(),
                coordinates: self.coordinates.clone(),
            };
            let inputs = Inputs::new(self.waveforms.clone())?;
            Prepared::new(sys, inputs, self.switches_of_engines())
        });
        made.as_ref().map_err(String::clone)
    }

    /// The switches as engines see them.
    pub fn switches_of_engines(&self) -> Arc<[Switch]> {
        #[cfg(feature = "faults")]
        return crate::faults::damage::switches(&self.switches);
        #[cfg(not(feature = "faults"))]
        self.switches.clone()
    }

    /// The states of their gates before the start.
    pub fn gates_of_engines(&self) -> Vec<bool> {
        #[cfg(feature = "faults")]
        return crate::faults::damage::gates(&self.gates);
        #[cfg(not(feature = "faults"))]
        self.gates.clone()
    }

    /// Averaging terms of a theta scheme, by unknowns and by sources.
    pub fn averaging(&self, given: &Option<(Matrix, Matrix)>) -> PyResult<Option<(Csc, Csc)>> {
        let Some((h, hs)) = given else { return Ok(None) };
        let (n, _, p) = self.linear.sizes();
        let (h, hs) = (csc(h)?, csc(hs)?);
        if has_shape(&h, n, n) && has_shape(&hs, n, p) {
            Ok(Some((h, hs)))
        } else {
            Err(misfit())
        }
    }
}

fn has_shape(c: &Csc, rows: usize, columns: usize) -> bool {
    c.nrows == rows && c.ncols == columns
}

/// Reads the arrays; an error if their shapes do not fit together.
fn read((e, g, a, b, d, q, s, row_kind): &LinearSpec) -> PyResult<Linear> {
    let linear = Linear {
        e: csc(e)?,
        g: csc(g)?,
        a: csc(a)?,
        b: csc(b)?,
        d: csc(d)?,
        q: q.as_slice()?.to_vec(),
        s: csc(s)?,
        row_kind: row_kind.as_slice()?.to_vec(),
    };
    let (n, m, p) = linear.sizes();
    let fits = [&linear.e, &linear.g].iter().all(|c| has_shape(c, n, n))
        && has_shape(&linear.a, n, m)
        && has_shape(&linear.b, m, n)
        && has_shape(&linear.d, m, m)
        && has_shape(&linear.s, n, p)
        && linear.q.len() == m
        && linear.row_kind.len() == n;
    if fits {
        Ok(linear)
    } else {
        Err(misfit())
    }
}

/// A waveform from its kind, values, repeat and scale, or from what another block hands on.
pub(super) fn waveform((kind, values, repeat, scale, handed): &WaveformSpec) -> PyResult<Waveform> {
    match handed {
        Some(polynomial) => Ok(Waveform::Polynomial(polynomial.inner.clone())),
        #[cfg(feature = "faults")]
        None => {
            let (values, scale) = crate::faults::damage::waveform(kind, values, *scale);
            Waveform::new(kind, &values, *repeat, scale).map_err(invalid)
        }
        #[cfg(not(feature = "faults"))]
        None => Waveform::new(kind, values, *repeat, *scale).map_err(invalid),
    }
}

/// The same for the checks.
pub(super) fn described(
    (kind, values, repeat, scale, handed): &WaveformSpec,
) -> PyResult<Described> {
    match handed {
        Some(polynomial) => Ok(Described::polynomial(polynomial.inner.clone())),
        None => Described::new(kind, values, *repeat, *scale).map_err(invalid),
    }
}

/// A switch and the state of its gate.
fn switch(spec: SwitchSpec) -> (Switch, bool) {
    let (pair, control, on_above, off_below, gate, inverted, latching, at_threshold) = spec;
    let at_threshold = at_threshold.map_or(AtThreshold::Reached, AtThreshold::Is);
    (Switch { pair, control, on_above, off_below, inverted, latching, at_threshold }, gate)
}

pub(super) fn misfit() -> PyErr {
    invalid("the matrices of the system do not fit together")
}

/// Unknowns and multipliers that a caller guesses.
pub(super) fn guessed(
    guess: &Option<(Floats, Floats)>,
    sizes: &Sizes,
) -> PyResult<Option<(Vec<f64>, Vec<f64>)>> {
    let Some((z, l)) = guess else { return Ok(None) };
    let (z, l) = (z.as_slice()?, l.as_slice()?);
    if z.len() != sizes[0] || l.len() != sizes[1] {
        return Err(invalid("the guess does not fit the system"));
    }
    Ok(Some((z.to_vec(), l.to_vec())))
}
