//! Sparse LU factors: what is stored, and solving with it.

use super::{Csc, Ordering};
use crate::linear::Singular;
use std::sync::Arc;

/// Columns of a triangular factor; all indices are positions in the elimination order.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    pub start: Vec<u32>,
    pub index: Vec<u32>,
    pub value: Vec<f64>,
}

impl Columns {
    pub fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.index.clear();
        self.value.clear();
    }

    pub fn range(&self, c: usize) -> std::ops::Range<usize> {
        self.start[c] as usize..self.start[c + 1] as usize
    }

    pub fn col(&self, c: usize) -> impl DoubleEndedIterator<Item = (usize, f64)> + '_ {
        let range = self.range(c);
        let index = &self.index[range.clone()];
        index.iter().zip(&self.value[range]).map(|(&i, &v)| (i as usize, v))
    }

    pub fn close(&mut self) {
        self.start.push(u32::try_from(self.index.len()).expect("fewer than 2^32 entries"));
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
    /// strictly above the diagonal, each column in an order in which it can be eliminated
    pub(super) upper: Columns,
    /// rows of `upper`: start of each, and the positions of its columns
    pub(super) dependents: (Vec<u32>, Vec<u32>),
    /// reciprocals of the pivots
    pub(super) inverse: Vec<f64>,
    /// pivot over the sum of the magnitudes that were added up to it
    pub(super) survival: Vec<f64>,
    /// pivot row at each position, and the position of each row
    pub(super) row: Vec<u32>,
    pub(super) place: Vec<u32>,
    pub(super) singular: Option<usize>,
    pub(super) pivot_ratio: f64,
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
            singular: None,
            pivot_ratio: 0.0,
            x: vec![0.0; n],
            dirty: vec![0; n.div_ceil(64)],
        };
        out.factor(a);
        out
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.inverse.len()
    }

    /// Number of entries stored, the cost of a solve.
    pub fn entries(&self) -> usize {
        self.lower.index.len() + self.upper.index.len() + self.size()
    }

    /// How much of the pivots survived cancellation: the least ratio of a pivot to the sum of the
    /// magnitudes it was added up from.  0 if the matrix is singular, near the rounding unit if it
    /// is so within rounding.  Unlike the ratio of the extreme pivots, it does not depend on the
    /// scaling of rows and columns, which diagonal pivots would inherit.
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
        for k in 0..n {
            let f = y[k];
            if f != 0.0 {
                for (i, l) in self.lower.col(k) {
                    y[i] -= l * f;
                }
            }
        }
        for k in (0..n).rev() {
            let f = y[k] * self.inverse[k];
            x[self.ordering.order[k] as usize] = f;
            if f != 0.0 {
                for (i, u) in self.upper.col(k) {
                    y[i] -= u * f;
                }
            }
        }
        Ok(())
    }

    /// `x := A^-T x`; `work` holds at least `size()` numbers.  Leaves `x` alone if the matrix is
    /// singular.
    pub fn solve_transpose(&self, x: &mut [f64], work: &mut [f64]) -> Result<(), Singular> {
        self.singular().map_or(Ok(()), Err)?;
        let n = self.size();
        let (x, y) = (&mut x[..n], &mut work[..n]);
        for k in 0..n {
            let sum: f64 = self.upper.col(k).map(|(i, u)| u * y[i]).sum();
            y[k] = (x[self.ordering.order[k] as usize] - sum) * self.inverse[k];
        }
        for k in (0..n).rev() {
            let sum: f64 = self.lower.col(k).map(|(i, l)| l * y[i]).sum();
            y[k] -= sum;
            x[self.row[k] as usize] = y[k];
        }
        Ok(())
    }

    /// Sets `pivot_ratio` after all columns are known.
    pub(super) fn rate(&mut self) {
        self.pivot_ratio = self.survival.iter().fold(1.0, |m, &s| if s < m { s } else { m });
    }
}
