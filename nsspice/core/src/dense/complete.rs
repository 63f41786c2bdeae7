//! Elimination with complete pivoting, which finds the rank and all solutions of a square system.
//!
//! Rows and columns are scaled by powers of two so that their largest entries become about one; what is left after the
//! last pivot above the rounding of the elimination counts as zero (N. J. Higham, Accuracy and Stability of Numerical
//! Algorithms, 2nd ed., SIAM 2002, section 9.4).

use super::matrix::{add_scaled, Matrix};
use crate::rounding::of_elimination;

/// Rounds of scaling; each takes the square root of how far entries are from one.
const ROUNDS: usize = 6;

/// A square matrix in triangular form.
#[derive(Default)]
pub struct Complete {
    /// the matrix as it was
    given: Matrix,
    lu: Matrix,
    rows: Vec<usize>,
    cols: Vec<usize>,
    row_scale: Vec<f64>,
    col_scale: Vec<f64>,
    rank: usize,
    /// largest entries of rows, where their pivot is still to come
    largest: Vec<f64>,
    work: Vec<f64>,
}

/// The largest of some numbers by size.
fn size(row: &[f64]) -> f64 {
    row.iter().fold(0.0, |most, v| most.max(v.abs()))
}

/// The power of two below a positive number; 1 for anything else.
fn power(x: f64) -> f64 {
    if x.is_normal() {
        f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
    } else {
        1.0
    }
}

impl Complete {
    /// Factorises a matrix, if it is another one than the last.
    pub fn factor(&mut self, a: &Matrix) {
        let n = a.rows;
        if self.given.rows == n && self.given.data == a.data {
            return;
        }
        self.given.clone_from(a);
        self.lu.clone_from(a);
        self.scale(n);
        self.rows.clear();
        self.rows.extend(0..n);
        self.cols.clear();
        self.cols.extend(0..n);
        self.rank = 0;
        self.largest.clear();
        self.largest.extend(self.lu.data.chunks_exact(n.max(1)).map(size));
        let nothing = of_elimination(n);
        while self.rank < n {
            let k = self.rank;
            let (mut best, mut row) = (0.0, k);
            for (r, &most) in self.largest.iter().enumerate().skip(k) {
                if most > best {
                    (best, row) = (most, r);
                }
            }
            if best <= nothing {
                break;
            }
            let column = self.lu.row(row)[k..].iter().position(|v| v.abs() == best);
            self.swap(k, (row, k + column.unwrap_or(0)), n);
            let (above, below) = self.lu.data.split_at_mut((k + 1) * n);
            let pivot = &above[k * n..];
            for (row, most) in below.chunks_exact_mut(n).zip(&mut self.largest[k + 1..]) {
                if row[k] != 0.0 {
                    let f = row[k] / pivot[k];
                    add_scaled(&mut row[k + 1..], -f, &pivot[k + 1..]);
                    row[k] = f;
                    *most = size(&row[k + 1..]);
                }
            }
            self.rank += 1;
        }
    }

    /// Scales rows and columns in turn.
    fn scale(&mut self, n: usize) {
        self.row_scale.clear();
        self.row_scale.resize(n, 1.0);
        self.col_scale.clear();
        self.col_scale.resize(n, 1.0);
        for _ in 0..ROUNDS {
            for r in 0..n {
                let most = self.lu.row(r).iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let factor = 1.0 / power(most.sqrt());
                self.row_scale[r] *= factor;
                self.lu.row_mut(r).iter_mut().for_each(|v| *v *= factor);
            }
            self.work.clear();
            self.work.resize(n, 0.0);
            for r in 0..n {
                self.work.iter_mut().zip(self.lu.row(r)).for_each(|(m, v)| *m = m.max(v.abs()));
            }
            self.work.iter_mut().for_each(|m| *m = 1.0 / power(m.sqrt()));
            self.col_scale.iter_mut().zip(&self.work).for_each(|(c, f)| *c *= f);
            for row in self.lu.data.chunks_exact_mut(n) {
                row.iter_mut().zip(&self.work).for_each(|(v, f)| *v *= f);
            }
        }
    }

    fn swap(&mut self, k: usize, (r, c): (usize, usize), n: usize) {
        if r != k {
            (0..n).for_each(|j| self.lu.data.swap(k * n + j, r * n + j));
            self.rows.swap(k, r);
            self.largest.swap(k, r);
        }
        if c != k {
            (0..n).for_each(|i| self.lu.data.swap(i * n + k, i * n + c));
            self.cols.swap(k, c);
        }
    }

    /// Number of independent rows.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Columns that depend on others: their unknowns are free.
    pub fn free(&self) -> &[usize] {
        &self.cols[self.rank..]
    }

    /// Solves for the other unknowns with the free ones at zero; equations that depend on others are left out.
    pub fn solve(&mut self, x: &mut [f64]) {
        let (n, rank) = (x.len(), self.rank);
        let y = &mut self.work;
        y.clear();
        y.extend(self.rows.iter().map(|&r| x[r] * self.row_scale[r]));
        for k in 0..rank {
            let sum: f64 = self.lu.row(k)[..k].iter().zip(&y[..k]).map(|(l, y)| l * y).sum();
            y[k] -= sum;
        }
        back(&self.lu, rank, y);
        y[rank..n].fill(0.0);
        for (k, &c) in self.cols.iter().enumerate() {
            x[c] = self.work[k] * self.col_scale[c];
        }
    }

    /// What rounding may leave of each equation at a solution: a part of `|L| |U| |x|` (Higham, theorem 9.4).
    pub fn residuals(&self, x: &[f64]) -> Vec<f64> {
        let (n, rank) = (x.len(), self.rank);
        let y: Vec<f64> = self.cols.iter().map(|&c| (x[c] / self.col_scale[c]).abs()).collect();
        let terms =
            |row: &[f64], y: &[f64]| -> f64 { row.iter().zip(y).map(|(v, y)| v.abs() * y).sum() };
        let upper: Vec<f64> =
            (0..rank).map(|k| terms(&self.lu.row(k)[k..rank], &y[k..rank])).collect();
        let mut out = vec![0.0; n];
        for (k, &r) in self.rows.iter().enumerate() {
            let own = upper.get(k).copied().unwrap_or(0.0);
            let before = k.min(rank);
            let sum = own + terms(&self.lu.row(k)[..before], &upper[..before]);
            out[r] = of_elimination(n) * sum / self.row_scale[r];
        }
        out
    }

    /// A basis of the kernel, one column for each free unknown.
    pub fn kernel(&self) -> Matrix {
        let (n, rank) = (self.lu.rows, self.rank);
        let mut out = Matrix::zeros(n, n - rank);
        for (j, &free) in self.free().iter().enumerate() {
            let mut y: Vec<f64> = (0..rank).map(|k| -self.lu[(k, rank + j)]).collect();
            back(&self.lu, rank, &mut y);
            for (k, v) in y.iter().enumerate() {
                out[(self.cols[k], j)] = v * self.col_scale[self.cols[k]];
            }
            out[(free, j)] = self.col_scale[free];
        }
        out
    }
}

/// Solves with the upper triangle.
fn back(lu: &Matrix, rank: usize, y: &mut [f64]) {
    for k in (0..rank).rev() {
        let row = lu.row(k);
        let sum: f64 = row[k + 1..rank].iter().zip(&y[k + 1..rank]).map(|(u, y)| u * y).sum();
        y[k] = (y[k] - sum) / row[k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_of_wide_range_is_solved_for_each_unknown() {
        let a = Matrix { rows: 2, cols: 2, data: vec![1e-12, 1.0, 3e9, -1e20] };
        let mut found = Complete::default();
        found.factor(&a);
        let mut x = vec![1e-12 * 7.0 + 2.0, 3e9 * 7.0 - 2e20];
        found.solve(&mut x);
        assert_eq!(found.rank(), 2);
        assert!((x[1] - 2.0).abs() < 1e-15);
    }

    #[test]
    fn rounding_of_an_unknown_that_cancels_is_within_the_bound() {
        // two equations of nearly the same terms: the second unknown is nothing but rounding
        let tilt = 1.0 + 2f64.powi(-30);
        let data = vec![1.0, 1.0, 0.1, 1.0, tilt, 0.1, 0.3, 0.7, 1.0];
        let a = Matrix { rows: 3, cols: 3, data };
        let mut found = Complete::default();
        found.factor(&a);
        let right = [0.1, 0.1, 0.3 * 0.1];
        let mut x = right.to_vec();
        found.solve(&mut x);
        let mut product = [0.0; 3];
        a.apply(&x, &mut product);
        for ((p, r), bound) in product.iter().zip(right).zip(found.residuals(&x)) {
            assert!((p - r).abs() <= bound, "{} of {bound}", p - r);
            // and no more than some rounding of the largest terms
            assert!(bound <= 1e-12);
        }
    }

    #[test]
    fn dependent_rows_leave_unknowns_free() {
        // x + y = 3, twice; z = 5
        let data = vec![1.0, 1.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.0];
        let mut found = Complete::default();
        found.factor(&Matrix { rows: 3, cols: 3, data });
        assert_eq!(found.rank(), 2);
        let mut x = vec![3.0, 6.0, 5.0];
        found.solve(&mut x);
        assert_eq!((x[0] + x[1], x[2]), (3.0, 5.0));
        let kernel = found.kernel();
        assert_eq!((kernel[(0, 0)] + kernel[(1, 0)], kernel[(2, 0)]), (0.0, 0.0));
    }
}
