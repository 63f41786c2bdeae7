//! Reduced row echelon form of matrices whose entries are small integers, or nearly so.
//!
//! The ranks of a passive network are properties of its graph: they are found on matrices with
//! entries 0 and 1 and -1, so that no element value ever enters such a decision.

use super::matrix::{add_scaled, Matrix};

/// Entries below this are zero: far from the integers and turn ratios that these matrices hold.
const ZERO: f64 = 1e-9;

/// The reduced row echelon form, columns taken in a given order.
pub struct Echelon {
    /// the reduced rows, one for each pivot
    pub reduced: Matrix,
    /// pivot columns, in order of their rows
    pub pivots: Vec<usize>,
    /// the other columns
    pub free: Vec<usize>,
}

impl Echelon {
    /// Reduces a matrix; columns that come early in `order` are preferred as pivots.
    pub fn new(mut a: Matrix, order: impl IntoIterator<Item = usize>) -> Echelon {
        let mut pivots = Vec::new();
        let mut free = Vec::new();
        let cols = a.cols;
        for c in order {
            let next = pivots.len();
            let best = (next..a.rows).max_by(|&i, &j| a[(i, c)].abs().total_cmp(&a[(j, c)].abs()));
            let Some(p) = best.filter(|&p| a[(p, c)].abs() > ZERO) else {
                free.push(c);
                continue;
            };
            if p != next {
                for k in 0..cols {
                    a.data.swap(p * cols + k, next * cols + k);
                }
            }
            let inverse = 1.0 / a[(next, c)];
            a.row_mut(next).iter_mut().for_each(|v| *v *= inverse);
            let (above, rest) = a.data.split_at_mut(next * cols);
            let (pivot_row, below) = rest.split_at_mut(cols);
            for row in above.chunks_exact_mut(cols).chain(below.chunks_exact_mut(cols)) {
                let f = row[c];
                if f != 0.0 {
                    add_scaled(row, -f, pivot_row);
                    row[c] = 0.0;
                }
            }
            pivots.push(c);
        }
        a.data.truncate(pivots.len() * cols);
        a.rows = pivots.len();
        for v in a.data.iter_mut().filter(|v| **v != 0.0) {
            let whole = v.round();
            if (*v - whole).abs() < ZERO * 1e-3 {
                *v = whole; // no rounding errors on integers
            }
        }
        Echelon { reduced: a, pivots, free }
    }

    /// A basis of the kernel, one column for each free column of the matrix.
    pub fn kernel(&self) -> Matrix {
        let mut out = Matrix::zeros(self.reduced.cols, self.free.len());
        for (k, &f) in self.free.iter().enumerate() {
            out[(f, k)] = 1.0;
            for (r, &p) in self.pivots.iter().enumerate() {
                out[(p, k)] = -self.reduced[(r, f)];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernel_of_an_incidence_matrix_is_made_of_indicators() {
        // nodes 0-1-2 joined, node 3 alone
        let a = Matrix::from_fn(2, 4, |r, c| match (r, c) {
            (0, 0) | (1, 1) => 1.0,
            (0, 1) | (1, 2) => -1.0,
            _ => 0.0,
        });
        let found = Echelon::new(a, 0..4);
        assert_eq!(found.pivots, [0, 1]);
        let kernel = found.kernel();
        assert_eq!(kernel.col(0), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(kernel.col(1), [0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn preferred_columns_become_pivots() {
        let a = Matrix::from_fn(1, 3, |_, _| 1.0);
        assert_eq!(Echelon::new(a, [2, 0, 1]).pivots, [2]);
    }
}
