//! The linear part of a complementarity descriptor system, which all engines and the checks share.

use crate::sparse::Csc;

/// `E z' + G z + A l = S u`, `w = q - B z + D l`.
pub struct Linear {
    /// storage matrix
    pub e: Csc,
    /// conductance-like matrix
    pub g: Csc,
    /// multiplier columns
    pub a: Csc,
    /// slack rows
    pub b: Csc,
    /// series resistance of the pairs
    pub d: Csc,
    /// constant slack
    pub q: Vec<f64>,
    /// source columns
    pub s: Csc,
    /// 0 for laws of currents, 1 for laws of voltages
    pub row_kind: Vec<u8>,
}

impl Linear {
    /// Numbers of unknowns, pairs and sources.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.g.nrows, self.a.ncols, self.s.ncols)
    }

    /// `w = q - B z + D l`
    pub fn slacks(&self, z: &[f64], l: &[f64], w: &mut [f64]) {
        w.copy_from_slice(&self.q);
        self.b.mul_add(-1.0, z, w);
        self.d.mul_add(1.0, l, w);
    }
}
