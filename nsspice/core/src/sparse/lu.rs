//! Sparse LU factors: what is stored, and solving with it.

use super::{Csc, Ordering};
use crate::pivots::{Singular, Sizes};
use std::sync::Arc;

/// One entry of a triangular factor, by positions in the elimination order.  It names its column
/// too: then a solve is one loop over all entries, and the processor need not guess the ends of
/// thousands of short columns (measured: 1.5 times as fast).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub row: u32,
    pub column: u32,
    pub value: f64,
}

/// Columns of a triangular factor.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    pub start: Vec<u32>,
    pub entries: Vec<Entry>,
}

impl Columns {
    pub fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.entries.clear();
    }

    pub fn range(&self, c: usize) -> std::ops::Range<usize> {
        self.start[c] as usize..self.start[c + 1] as usize
    }

    pub fn col(&self, c: usize) -> &[Entry] {
        &self.entries[self.range(c)]
    }

    pub fn close(&mut self) {
        self.start.push(u32::try_from(self.entries.len()).expect("fewer than 2^32 entries"));
    }
}

/// `P A Q = L U` by left-looking elimination, with threshold pivoting that prefers the diagonal.
///
/// Factorising again (`factor`, `refactor_rows`) reuses the storage; solving does not allocate.
#[derive(Clone, Debug)]
pub struct SparseLu {
    pub(super) ordering: Arc<Ordering>,
    /// strictly below the unit diagonal
    pub(super) lower: Columns,
    /// strictly above the diagonal, each column divided by its pivot and in an order in which it
    /// can be eliminated
    pub(super) upper: Columns,
    /// rows of `upper`: start of each, and the positions of its columns
    pub(super) dependents: (Vec<u32>, Vec<u32>),
    /// reciprocals of the pivots
    pub(super) inverse: Vec<f64>,
    /// `pivot_ratio` of each column
    pub(super) survival: Vec<f64>,
    /// pivot row at each position, and the position of each row
    pub(super) row: Vec<u32>,
    pub(super) place: Vec<u32>,
    /// whether the column at each position depends on others: it has got its row last
    pub(super) late: Vec<bool>,
    pub(super) singular: Option<usize>,
    pub(super) pivot_ratio: f64,
    pub(super) hold: f64,
    /// all alike where nothing is to be held
    pub(super) sizes: Sizes,
    /// dense column, all zero between calls
    pub(super) x: Vec<f64>,
    /// one bit per position to recompute, all zero between calls
    pub(super) dirty: Vec<u64>,
}

impl SparseLu {
    /// Factorises a square matrix whose pattern was ordered.
    pub fn new(a: &Csc, ordering: &Arc<Ordering>) -> Self {
        let n = ordering.size();
        let mut out = SparseLu {
            ordering: Arc::clone(ordering),
            lower: Columns::default(),
            upper: Columns::default(),
            dependents: Default::default(),
            inverse: vec![0.0; n],
            survival: vec![0.0; n],
            row: vec![0; n],
            place: vec![0; n],
            late: vec![false; n],
            singular: None,
            pivot_ratio: 0.0,
            hold: 0.0,
            sizes: Sizes::default(),
            x: vec![0.0; n],
            dirty: vec![0; n.div_ceil(64)],
        };
        out.sizes.forget(n);
        out.factor(a);
        out
    }

    /// See `Factor::set_hold`.
    pub fn set_hold(&mut self, hold: f64) {
        if hold == 0.0 && self.hold != 0.0 {
            self.sizes.forget(self.size());
        }
        self.hold = hold;
    }

    /// Measures the rows of the matrix that is to be factorised, if something is to be held.
    pub(super) fn measure_rows(&mut self, a: &Csc) {
        if self.hold > 0.0 {
            self.sizes.measure(self.size(), a.iter());
        }
    }

    /// See `Factor::held`.
    pub fn held(&self) -> Vec<usize> {
        let columns = self.ordering.order.iter().zip(&self.survival);
        columns.filter(|e| *e.1 == self.hold).map(|e| *e.0 as usize).collect()
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.inverse.len()
    }

    /// How much of the pivots survived cancellation: the least ratio of a pivot to the sum of the
    /// magnitudes it was added up from, and to the largest entry of its column of the matrix.  0 if
    /// the matrix is singular, near the rounding unit if it is so within rounding.  The ratio of the
    /// extreme pivots would not do: a small diagonal pivot is followed by a large one.  Meant for
    /// matrices with equilibrated rows.
    pub fn pivot_ratio(&self) -> f64 {
        self.pivot_ratio
    }

    /// The column at which no pivot was left (or not a finite one).
    pub fn singular(&self) -> Option<Singular> {
        self.singular.map(|column| Singular { column })
    }

    /// `x := A^-1 x`; `work` holds at least `size()` numbers.  Leaves `x` alone if the matrix is
    /// singular.
    pub fn solve(&self, x: &mut [f64], work: &mut [f64]) -> Result<(), Singular> {
        self.singular().map_or(Ok(()), Err)?;
        let n = self.size();
        let (x, y) = (&mut x[..n], &mut work[..n]);
        for (y, &r) in y.iter_mut().zip(&self.row) {
            *y = x[r as usize];
        }
        for e in &self.lower.entries {
            y[e.row as usize] -= e.value * y[e.column as usize];
        }
        for e in self.upper.entries.iter().rev() {
            y[e.row as usize] -= e.value * y[e.column as usize];
        }
        for ((&c, y), inverse) in self.ordering.order.iter().zip(y).zip(&self.inverse) {
            x[c as usize] = *y * inverse;
        }
        Ok(())
    }

    /// `x := A^-T x`, as `solve`.
    pub fn solve_transposed(&self, x: &mut [f64], work: &mut [f64]) -> Result<(), Singular> {
        self.singular().map_or(Ok(()), Err)?;
        let n = self.size();
        let (x, y) = (&mut x[..n], &mut work[..n]);
        for ((&c, y), inverse) in self.ordering.order.iter().zip(&mut *y).zip(&self.inverse) {
            *y = x[c as usize] * inverse;
        }
        for e in &self.upper.entries {
            y[e.column as usize] -= e.value * y[e.row as usize];
        }
        for e in self.lower.entries.iter().rev() {
            y[e.column as usize] -= e.value * y[e.row as usize];
        }
        for (y, &r) in y.iter().zip(&self.row) {
            x[r as usize] = *y;
        }
        Ok(())
    }

    /// Sets `pivot_ratio` after all columns are known; in several lanes, because a partial
    /// refactorisation may take less time than one comparison after the other.
    pub(super) fn rate(&mut self) {
        let least = |m: f64, s: f64| if s < m { s } else { m };
        let mut lanes = [1.0f64; 8];
        let chunks = self.survival.chunks_exact(8);
        let rest = chunks.remainder().iter().fold(1.0, |m, &s| least(m, s));
        for chunk in chunks {
            for (m, &s) in lanes.iter_mut().zip(chunk) {
                *m = least(*m, s);
            }
        }
        self.pivot_ratio = lanes.into_iter().fold(rest, least);
    }
}
