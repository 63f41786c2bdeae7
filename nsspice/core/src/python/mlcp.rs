//! One mixed linear complementarity problem, for Python.

use super::{csc, invalid, role, Floats, Matrix};
use crate::mlcp::{Driver, Problem, Start};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Solves one mixed LCP; see `nsspice.solvers.mlcp`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one argument per array of the problem
pub(super) fn solve_mlcp<'py>(
    py: Python<'py>,
    k: Matrix,
    a: Matrix,
    b: Matrix,
    d: Matrix,
    rhs: Floats,
    q: Floats,
    roles: PyReadonlyArray1<u8>,
    row_kind: PyReadonlyArray1<u8>,
    start: Option<(Floats, Floats)>,
) -> PyResult<Bound<'py, PyDict>> {
    let problem = Problem {
        k: csc(&k)?,
        a: csc(&a)?,
        b: csc(&b)?,
        d: csc(&d)?,
        row_kind: row_kind.as_slice()?.to_vec(),
    };
    let (n, m) = (problem.k.nrows, problem.a.ncols);
    let fits = problem.k.ncols == n
        && problem.a.nrows == n
        && (problem.b.nrows, problem.b.ncols) == (m, n)
        && (problem.d.nrows, problem.d.ncols) == (m, m)
        && rhs.as_slice()?.len() == n
        && q.as_slice()?.len() == m
        && roles.as_slice()?.len() == m
        && problem.row_kind.len() == n;
    if !fits {
        return Err(invalid("the arrays of the problem do not fit together"));
    }
    let roles = roles.as_slice()?.iter().map(|&c| role(c)).collect::<PyResult<Vec<_>>>()?;
    let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
    let mode = match &start {
        Some((z0, l0)) => {
            if z0.as_slice()?.len() != n || l0.as_slice()?.len() != m {
                return Err(invalid("the starting point does not fit the problem"));
            }
            z.copy_from_slice(z0.as_slice()?);
            l.copy_from_slice(l0.as_slice()?);
            Start::Warm
        }
        None => Start::Cold,
    };
    let mut driver = Driver::new(problem);
    let result = driver.solve(rhs.as_slice()?, q.as_slice()?, &roles, &mut z, &mut l, mode);
    let out = PyDict::new(py);
    let residual = match result {
        Ok(s) => {
            out.set_item("solved", true)?;
            out.set_item("stage", s.stage)?;
            out.set_item("iterations", s.iterations)?;
            out.set_item("needs_certificate", s.needs_certificate)?;
            s.residual
        }
        Err(u) => {
            out.set_item("solved", false)?;
            u.residual
        }
    };
    out.set_item("residual_rows", residual.rows)?;
    out.set_item("residual_complementarity", residual.complementarity)?;
    out.set_item("z", PyArray1::from_slice(py, &z))?;
    out.set_item("l", PyArray1::from_slice(py, &l))?;
    Ok(out)
}
