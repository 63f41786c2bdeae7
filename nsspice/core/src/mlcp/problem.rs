//! The mixed linear complementarity problem and the roles of its pairs.

use crate::sparse::Csc;

/// The matrices of `K z + A l = b`, `w = q - B z + D l`.
#[derive(Clone, Debug)]
pub struct Problem {
    /// n x n
    pub k: Csc,
    /// n x m
    pub a: Csc,
    /// m x n
    pub b: Csc,
    /// m x m
    pub d: Csc,
    /// 0 for a current row (its unknown is a node voltage), 1 for a voltage row (its unknown is a
    /// branch current); residuals are scaled per kind
    pub row_kind: Vec<u8>,
}

impl Problem {
    /// Number of unknowns `z`.
    pub fn n(&self) -> usize {
        self.k.nrows
    }

    /// Number of pairs.
    pub fn m(&self) -> usize {
        self.d.nrows
    }

    /// The matrix `[[K, A], [-B, D]]` of all rows with every pair active.
    pub(crate) fn matrix(&self) -> Csc {
        let (n, m) = (self.n(), self.m());
        let mut entries = Vec::new();
        entries.extend(self.k.iter());
        entries.extend(self.a.iter().map(|(r, c, v)| (r, n + c, v)));
        entries.extend(self.b.iter().map(|(r, c, v)| (n + r, c, -v)));
        entries.extend(self.d.iter().map(|(r, c, v)| (n + r, n + c, v)));
        Csc::from_triplets(n + m, n + m, &entries)
    }
}

/// What a pair may do during one solve.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// `0 <= l` perpendicular to `w >= 0`
    Diode,
    /// closed switch: `w = 0`, `l` of either sign
    Closed,
    /// open switch: `l = 0`, `w` of either sign
    Open,
}

/// Where the iteration starts, and which of several solutions is preferred.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Start {
    /// from the previous solution, towards the nearest one
    Warm,
    /// from zero, towards the solution of least norm
    Cold,
}
