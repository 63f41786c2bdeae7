//! Bindings of tapes and generalized equations.

use super::{csc, invalid, tape, Floats, Matrix, SmoothSpec, TapeSpec};
use crate::descriptor::Smooth;
use crate::newton::{Points, Problem};
use crate::tape::{Linearisation, NAMES};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Names of the tape instructions in the order of their codes.
#[pyfunction]
pub(super) fn tape_instructions() -> Vec<&'static str> {
    NAMES.to_vec()
}

/// Values (k, p) and Jacobian entries of a tape at points: z (k, n), u (k, s), t (k,).
///
/// The Jacobian comes as lists of (function, variable) and an array (k, entries); variables count
/// unknowns, then sources, then the time.
#[pyfunction]
#[allow(clippy::type_complexity)] // what it returns is listed above
pub(super) fn tape_values<'py>(
    py: Python<'py>,
    spec: TapeSpec,
    z: PyReadonlyArray2<f64>,
    u: PyReadonlyArray2<f64>,
    t: Floats,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Vec<(usize, usize)>, Bound<'py, PyArray1<f64>>)> {
    let (z, u) = (z.as_array(), u.as_array());
    let mut tape = tape(&spec, z.ncols(), u.ncols())?;
    let program = tape.program().clone();
    let list: Vec<(usize, usize, usize)> = (0..program.len())
        .flat_map(|k| tape.derivatives(k).map(move |(v, slot)| (k, v, slot)))
        .collect();
    let (mut values, mut slopes) = (Vec::new(), Vec::new());
    for (k, &t) in t.as_slice()?.iter().enumerate() {
        if k >= z.nrows() || k >= u.nrows() {
            return Err(invalid("one row of z and u per time is needed"));
        }
        tape.evaluate(&z.row(k).to_vec(), &u.row(k).to_vec(), t, Linearisation::Exact);
        values.extend((0..program.len()).map(|k| tape.value(k)));
        slopes.extend(list.iter().map(|&(_, _, slot)| tape.slopes()[slot]));
    }
    Ok((
        PyArray1::from_vec(py, values),
        list.into_iter().map(|(k, v, _)| (k, v)).collect(),
        PyArray1::from_vec(py, slopes),
    ))
}

/// Solves or follows a generalized equation along given points; see
/// `nsspice.solvers.generalized`.
#[pyfunction]
#[pyo3(signature = (
    g, a, b, d, q, row_kind, smooth, times, right, rates, errors, follow, by_rate, correctors, start
))]
#[allow(clippy::too_many_arguments)] // one argument per array of the problem
pub(super) fn solve_path<'py>(
    py: Python<'py>,
    g: Matrix,
    a: Matrix,
    b: Matrix,
    d: Matrix,
    q: Floats,
    row_kind: PyReadonlyArray1<u8>,
    smooth: SmoothSpec,
    times: Floats,
    right: PyReadonlyArray2<f64>,
    rates: Option<PyReadonlyArray2<f64>>,
    errors: Option<PyReadonlyArray2<f64>>,
    follow: bool,
    by_rate: bool,
    correctors: Option<usize>,
    start: Option<(Floats, Floats)>,
) -> PyResult<Bound<'py, PyDict>> {
    let n = g.0;
    let problem = Problem {
        g: csc(&g)?,
        a: csc(&a)?,
        b: csc(&b)?,
        d: csc(&d)?,
        q: q.as_slice()?.to_vec(),
        row_kind: row_kind.as_slice()?.to_vec(),
        smooth: Smooth { tape: tape(&smooth.0, n, 0)?, f: csc(&smooth.1)?, q: csc(&smooth.2)? },
    };
    let m = problem.q.len();
    let count = times.as_slice()?.len();
    let functions = problem.smooth.tape.program().len();
    let shape = |c: &crate::sparse::Csc, r: usize, k: usize| c.nrows == r && c.ncols == k;
    let fits = shape(&problem.g, n, n)
        && shape(&problem.a, n, m)
        && shape(&problem.b, m, n)
        && shape(&problem.d, m, m)
        && shape(&problem.smooth.f, n, functions)
        && shape(&problem.smooth.q, n, functions)
        && problem.row_kind.len() == n
        && right.as_array().dim() == (count, n)
        && rates.iter().all(|r| r.as_array().dim() == (count, n))
        && errors.iter().all(|e| e.as_array().dim() == (count.saturating_sub(1), n));
    if !fits {
        return Err(invalid("the arrays of the problem do not fit together"));
    }
    let start = match &start {
        Some((z, l)) => {
            let (z, l) = (z.as_slice()?.to_vec(), l.as_slice()?.to_vec());
            if (z.len(), l.len()) != (n, m) {
                return Err(invalid("the starting point does not fit the problem"));
            }
            Some((z, l))
        }
        None => None,
    };
    let (times, right) = (times.as_slice()?.to_vec(), right.as_slice()?.to_vec());
    let optional = |array: &Option<PyReadonlyArray2<f64>>| -> PyResult<Option<Vec<f64>>> {
        array.as_ref().map(|a| Ok(a.as_slice()?.to_vec())).transpose()
    };
    let (rates, errors) = (optional(&rates)?, optional(&errors)?);
    let path = py.detach(move || {
        let points = Points {
            times: &times,
            right: &right,
            rates: rates.as_deref(),
            errors: errors.as_deref(),
        };
        let start = start.as_ref().map(|(z, l)| (z.as_slice(), l.as_slice()));
        problem.run(&points, follow.then_some((by_rate, correctors)), start)
    });
    let out = PyDict::new(py);
    out.set_item("reached", path.reached())?;
    out.set_item("linearised", path.linearised)?;
    out.set_item("worst", path.worst)?;
    out.set_item("failed", path.failed)?;
    out.set_item("z", PyArray1::from_vec(py, path.z))?;
    out.set_item("l", PyArray1::from_vec(py, path.l))?;
    out.set_item("residuals", PyArray1::from_vec(py, path.residuals))?;
    Ok(out)
}
