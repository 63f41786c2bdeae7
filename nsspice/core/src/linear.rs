//! One interface to the dense and the sparse LU factorisation.

use crate::dense::DenseLu;
use crate::pivots::Singular;
use crate::sparse::{Csc, Extent, Ordering, Packed, SparseLu};
use std::sync::Arc;

/// Systems up to this size are factorised densely.  Measured on circuit matrices, a first dense
/// factorisation is the faster one up to about 40 unknowns, and partial pivoting the more accurate
/// one; the sparse solve takes about 0.6 of the time of the dense one at any size.
pub const DENSE_LIMIT: usize = 32;

/// The elimination order of a matrix, the last `pairs` rows of which change with the mode; any will
/// do for dense factors, which choose their own pivots.
pub fn ordering(matrix: &Csc, pairs: usize) -> Ordering {
    if matrix.nrows <= DENSE_LIMIT {
        Ordering::natural(matrix, pairs)
    } else {
        Ordering::new(matrix, pairs)
    }
}

/// LU factors of a square matrix.
#[derive(Clone, Debug)]
pub enum Factor {
    /// all entries stored
    Dense(DenseLu),
    /// only the entries of the pattern stored
    Sparse(Box<SparseLu>),
}

impl Factor {
    /// Factorises `a`; a singular matrix is reported by `pivot_ratio` and `singular`.
    pub fn new(a: &Csc, ordering: &Arc<Ordering>) -> Self {
        if a.nrows <= DENSE_LIMIT {
            Factor::Dense(DenseLu::new(a))
        } else {
            Factor::Sparse(Box::new(SparseLu::new(a, ordering)))
        }
    }

    /// From now on a column that depends on those before it (up to rounding) gets the pivot `hold`,
    /// relative to the size of its entries: what such a matrix leaves open hardly moves, all other
    /// equations hold exactly.  Zero: such a matrix is singular.
    pub fn set_hold(&mut self, hold: f64) {
        match self {
            Factor::Dense(f) => f.set_hold(hold),
            Factor::Sparse(f) => f.set_hold(hold),
        }
    }

    /// The columns that have got the pivot `hold`.
    pub fn held(&self) -> Vec<usize> {
        match self {
            Factor::Dense(f) => f.held(),
            Factor::Sparse(f) => f.held(),
        }
    }

    /// Factorises another matrix with the same pattern into the same storage, with new pivots.
    pub fn factor(&mut self, a: &Csc) {
        match self {
            Factor::Dense(f) => f.factor(a),
            Factor::Sparse(f) => f.factor(a),
        }
    }

    /// Like `factor`, but the sparse factorisation keeps its pivots if they serve, which takes a
    /// quarter of the time.
    pub fn refactor(&mut self, a: &Csc) {
        match self {
            Factor::Dense(f) => f.factor(a),
            Factor::Sparse(f) => {
                f.refactor(a);
            }
        }
    }

    /// Factorises a matrix that differs from the last one in the given columns only, as `refactor`.
    pub fn refactor_columns(&mut self, a: &Csc, columns: &[usize]) {
        match self {
            Factor::Dense(_) if columns.is_empty() => {}
            Factor::Dense(f) => f.factor(a),
            Factor::Sparse(f) => {
                f.refactor_columns(a, columns);
            }
        }
    }

    /// Factorises a matrix that differs from the last one in the given rows only; the sparse
    /// factorisation computes only what depends on them, as long as the old pivots serve.  Returns how much.
    pub fn refactor_rows(&mut self, a: &Csc, rows: &[usize]) -> Extent {
        match self {
            Factor::Dense(f) => {
                f.factor(a);
                Extent::Full
            }
            Factor::Sparse(f) => f.refactor_rows(a, rows),
        }
    }

    /// A number between 0 (singular) and 1: the part of the smallest pivot that survived
    /// cancellation.
    pub fn pivot_ratio(&self) -> f64 {
        match self {
            Factor::Dense(f) => f.pivot_ratio(),
            Factor::Sparse(f) => f.pivot_ratio(),
        }
    }

    /// The column at which the factorisation had to stop, if it had to.
    pub fn singular(&self) -> Option<Singular> {
        match self {
            Factor::Dense(f) => f.singular(),
            Factor::Sparse(f) => f.singular(),
        }
    }

    /// `x := A^-1 x` without allocating; `work` holds at least a number for each row.
    pub fn solve(&self, x: &mut [f64], work: &mut [f64]) -> Result<(), Singular> {
        match self {
            Factor::Dense(f) => f.solve(x),
            Factor::Sparse(f) => f.solve(x, work),
        }
    }

    /// `x := A^-T x`, as `solve`.
    pub fn solve_transposed(&self, x: &mut [f64], work: &mut [f64]) -> Result<(), Singular> {
        match self {
            Factor::Dense(f) => f.solve_transposed(x),
            Factor::Sparse(f) => f.solve_transposed(x, work),
        }
    }

    /// A copy for many scaled solves, if the factors are sparse and regular; see `Packed::new`.
    pub fn packed(
        &self,
        row: impl Fn(usize) -> Option<f64>,
        column: impl Fn(usize) -> f64,
    ) -> Option<Packed> {
        match self {
            Factor::Sparse(f) if f.singular().is_none() => Some(Packed::new(f, row, column)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::examples::Rng;

    /// `b' (A^-1 c) = (A^-T b)' c`, dense and sparse, also where a column is held.
    #[test]
    fn transposed_solves_match_solves() {
        for n in [3, 9, DENSE_LIMIT + 20] {
            let mut rng = Rng(1);
            let near = |r: usize, c: usize| r == c || (r * 7 + c * 3) % n < 3;
            let places = (0..n).flat_map(|r| (0..n).map(move |c| (r, c)));
            let mut entries: Vec<_> =
                places.filter(|&(r, c)| near(r, c)).map(|(r, c)| (r, c, rng.signed())).collect();
            for held in [false, true] {
                if held {
                    entries.iter_mut().filter(|e| e.1 == 1).for_each(|e| e.2 = 0.0);
                }
                let a = Csc::from_triplets(n, n, &entries);
                let mut factor = Factor::new(&a, &Arc::new(ordering(&a, 0)));
                if held {
                    factor.set_hold(1e-3);
                    factor.factor(&a);
                    assert_eq!(factor.held(), [1]);
                }
                let [b, c] = [(); 2].map(|()| rng.vector(n));
                let (mut x, mut y, mut work) = (c.clone(), b.clone(), vec![0.0; n]);
                factor.solve(&mut x, &mut work).unwrap();
                factor.solve_transposed(&mut y, &mut work).unwrap();
                let product =
                    |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let [one, two] = [product(&b, &x), product(&y, &c)];
                assert!((one - two).abs() < 1e-9 * (one.abs() + 1.0), "{n} {held} {one} {two}");
            }
        }
    }
}
