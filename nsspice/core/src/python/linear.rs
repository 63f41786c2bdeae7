//! The matrices that every engine and the checks are made from, read and measured once.

use super::{csc, invalid, Floats, Matrix};
use crate::descriptor::Linear;
use crate::sparse::Csc;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

/// E, G, A, B, D, q, S, kinds of rows
pub(super) type LinearSpec<'py> = (
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Matrix<'py>,
    Floats<'py>,
    Matrix<'py>,
    PyReadonlyArray1<'py, u8>,
);

pub(super) fn has_shape(c: &Csc, rows: usize, columns: usize) -> bool {
    c.nrows == rows && c.ncols == columns
}

/// Reads the arrays; an error if their shapes do not fit together.
pub(super) fn read((e, g, a, b, d, q, s, row_kind): &LinearSpec) -> PyResult<Linear> {
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

pub(super) fn misfit() -> PyErr {
    invalid("the matrices of the system do not fit together")
}
