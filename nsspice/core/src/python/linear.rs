//! The matrices that every engine and the checks are made from, read and measured once.

use super::{csc, invalid, Floats, Matrix};
use crate::sparse::Csc;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

/// The linear part of a complementarity descriptor system.
pub(super) struct Linear {
    pub e: Csc,
    pub g: Csc,
    pub a: Csc,
    pub b: Csc,
    pub d: Csc,
    pub q: Vec<f64>,
    pub s: Csc,
    pub row_kind: Vec<u8>,
}

pub(super) fn has_shape(c: &Csc, rows: usize, columns: usize) -> bool {
    c.nrows == rows && c.ncols == columns
}

impl Linear {
    /// Reads the arrays; an error if their shapes do not fit together.
    #[allow(clippy::too_many_arguments)] // one argument per matrix of the system
    pub fn read(
        e: &Matrix,
        g: &Matrix,
        a: &Matrix,
        b: &Matrix,
        d: &Matrix,
        q: &Floats,
        s: &Matrix,
        row_kind: &PyReadonlyArray1<u8>,
    ) -> PyResult<Linear> {
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

    /// Numbers of unknowns, pairs and sources.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.g.nrows, self.a.ncols, self.s.ncols)
    }
}

pub(super) fn misfit() -> PyErr {
    invalid("the matrices of the system do not fit together")
}
