//! Least-norm corrections for singular systems.

use crate::sparse::Csc;
use nalgebra::{DMatrix, SVD};

/// Singular values below this part of the largest count as zero.
pub const RANK_TOLERANCE: f64 = 1e-12;

/// The pseudo-inverse of a matrix, applied as a correction: `x += J^+ (rhs - J x)` moves `x` to the
/// nearest point that solves `J x = rhs` in the least-squares sense.
#[derive(Clone, Debug)]
pub struct LeastNorm {
    matrix: Csc,
    /// `J^+`, column-major, `ncols x nrows`
    inverse: Vec<f64>,
    rank: usize,
}

impl LeastNorm {
    /// Decomposes a matrix; `None` if an entry is not finite.
    pub fn new(matrix: &Csc) -> Option<Self> {
        let (rows, columns) = (matrix.nrows, matrix.ncols);
        if matrix.values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut out =
            LeastNorm { matrix: matrix.clone(), inverse: vec![0.0; rows * columns], rank: 0 };
        if rows == 0 || columns == 0 {
            return Some(out);
        }
        let mut dense = DMatrix::zeros(rows, columns);
        for (r, c, v) in matrix.iter() {
            dense[(r, c)] = v;
        }
        let limit = 100 * (rows + columns);
        let svd = SVD::try_new_unordered(dense, true, true, f64::EPSILON, limit)?;
        let (u, v) = (svd.u?, svd.v_t?.transpose());
        let smallest = RANK_TOLERANCE * svd.singular_values.max();
        for (k, &s) in svd.singular_values.iter().enumerate() {
            if s > smallest {
                out.rank += 1;
                for (column, u) in out.inverse.chunks_exact_mut(columns).zip(u.column(k).iter()) {
                    for (entry, v) in column.iter_mut().zip(v.column(k).iter()) {
                        *entry += v * (u / s);
                    }
                }
            }
        }
        Some(out)
    }

    /// Number of independent rows.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Length of the work slice that `correct` needs.
    pub fn work_size(&self) -> usize {
        self.matrix.nrows
    }

    /// Corrects `x` in two sweeps (the second removes the rounding errors of the first) and returns
    /// the consistency residual: the largest remaining `|rhs - J x|` as a part of the largest
    /// `|rhs| + |J| |x|`.  It is of the size of rounding errors exactly if `rhs` lies in the range of
    /// `J`.  Does not allocate; `work` holds at least `work_size()` numbers.
    pub fn correct(&self, rhs: &[f64], x: &mut [f64], work: &mut [f64]) -> f64 {
        let residual = &mut work[..self.matrix.nrows];
        let columns = self.matrix.ncols;
        for _ in 0..2 {
            residual.copy_from_slice(rhs);
            self.matrix.mul_add(-1.0, x, residual);
            for (&r, column) in residual.iter().zip(self.inverse.chunks_exact(columns.max(1))) {
                if r != 0.0 {
                    for (x, v) in x.iter_mut().zip(column) {
                        *x += v * r;
                    }
                }
            }
        }
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        residual.copy_from_slice(rhs);
        self.matrix.mul_add(-1.0, x, residual);
        let left = largest(residual);
        for (r, v) in residual.iter_mut().zip(rhs) {
            *r = v.abs();
        }
        self.matrix.abs_mul_add(x, residual);
        let scale = largest(residual);
        if scale > 0.0 {
            left / scale
        } else {
            0.0
        }
    }
}
