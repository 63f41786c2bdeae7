//! Least-norm corrections for singular systems.

use super::orthogonal::Triangularisation;
use crate::rounding::of_elimination;
use crate::sparse::Csc;

/// The pseudo-inverse of a matrix, applied as a correction: `x += J^+ (rhs - J x)` moves `x` to the
/// nearest point that solves `J x = rhs` in the least-squares sense.  By a complete orthogonal
/// decomposition with column pivoting (Golub & Van Loan 2013, section 5.4).
#[derive(Clone, Debug)]
pub struct LeastNorm {
    matrix: Csc,
    /// `J^+`, column-major, `ncols x nrows`
    inverse: Vec<f64>,
    rank: usize,
}

impl LeastNorm {
    /// Decomposes a matrix; `None` if its entries are not finite or too small to be divided by.
    pub fn new(matrix: &Csc) -> Option<Self> {
        let (rows, columns) = (matrix.nrows, matrix.ncols);
        if matrix.values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut dense = vec![0.0; rows * columns];
        for (r, c, v) in matrix.iter() {
            dense[c * rows + r] = v;
        }
        // J P = Q [R; 0], and R' (trapezoidal, of full column rank) P2 = Z [T; 0], so that
        // J^+ = P Z [T'^-1 P2'; 0] [I 0] Q'
        let left = Triangularisation::new(dense, rows, columns, of_elimination(rows.max(columns)));
        let rank = left.rank;
        let mut transposed = vec![0.0; columns * rank];
        for r in 0..rank {
            for c in r..columns {
                transposed[r * columns + c] = left.r(r, c);
            }
        }
        let right = Triangularisation::new(transposed, columns, rank, 0.0);
        if right.rank < rank {
            return None; // only if a diagonal entry underflowed
        }
        let mut inverse = vec![0.0; rows * columns];
        let (mut unit, mut x) = (vec![0.0; rows], vec![0.0; columns]);
        for (r, column) in inverse.chunks_exact_mut(columns.max(1)).enumerate() {
            unit.fill(0.0);
            unit[r] = 1.0;
            left.rotate_back(&mut unit);
            x.fill(0.0);
            for (x, &p) in x.iter_mut().zip(&right.order) {
                *x = unit[p];
            }
            right.solve_transpose(&mut x);
            right.rotate(&mut x);
            for (x, &p) in x.iter().zip(&left.order) {
                column[p] = *x;
            }
        }
        Some(LeastNorm { matrix: matrix.clone(), inverse, rank })
    }

    /// Number of independent rows.
    pub fn rank(&self) -> usize {
        self.rank
    }

    fn add(&self, rhs: &[f64], x: &mut [f64]) {
        for (&r, column) in rhs.iter().zip(self.inverse.chunks_exact(self.matrix.ncols.max(1))) {
            if r != 0.0 {
                for (x, v) in x.iter_mut().zip(column) {
                    *x += v * r;
                }
            }
        }
    }

    /// Corrects `x` in two sweeps (the second removes the rounding errors of the first) and returns
    /// the consistency residual: the largest remaining `|rhs - J x|` as a part of the largest
    /// `|rhs| + |J| |x|`.  It is of the size of rounding errors exactly if `rhs` lies in the range of
    /// `J`.  Does not allocate; `work` holds at least a number for each row.
    pub fn correct(&self, rhs: &[f64], x: &mut [f64], work: &mut [f64]) -> f64 {
        let residual = &mut work[..self.matrix.nrows];
        for _ in 0..2 {
            residual.copy_from_slice(rhs);
            self.matrix.mul_add(-1.0, x, residual);
            self.add(residual, x);
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
