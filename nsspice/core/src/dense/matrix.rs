//! A dense matrix by rows, with the few operations that reductions of small systems need.

use std::ops::{Index, IndexMut};

/// A dense matrix, row after row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix {
    /// number of rows
    pub rows: usize,
    /// number of columns
    pub cols: usize,
    /// entries, row after row
    pub data: Vec<f64>,
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;
    #[inline]
    fn index(&self, (r, c): (usize, usize)) -> &f64 {
        &self.data[r * self.cols + c]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    #[inline]
    fn index_mut(&mut self, (r, c): (usize, usize)) -> &mut f64 {
        &mut self.data[r * self.cols + c]
    }
}

impl Matrix {
    /// The zero matrix.
    pub fn zeros(rows: usize, cols: usize) -> Matrix {
        // without `calloc`, which takes several times as long for so little
        let mut data = Vec::with_capacity(rows * cols);
        data.extend((0..rows * cols).map(|_| 0.0));
        Matrix { rows, cols, data }
    }

    /// The unit matrix.
    pub fn identity(n: usize) -> Matrix {
        let mut out = Matrix::zeros(n, n);
        for i in 0..n {
            out[(i, i)] = 1.0;
        }
        out
    }

    /// Another shape, with any entries.
    pub fn reshape(&mut self, rows: usize, cols: usize) {
        (self.rows, self.cols) = (rows, cols);
        self.data.resize(rows * cols, 0.0);
    }

    /// A matrix from a rule for its entries.
    pub fn from_fn(rows: usize, cols: usize, f: impl Fn(usize, usize) -> f64) -> Matrix {
        let mut data = Vec::with_capacity(rows * cols);
        for r in 0..rows {
            data.extend((0..cols).map(|c| f(r, c)));
        }
        Matrix { rows, cols, data }
    }

    /// One row.
    #[inline]
    pub fn row(&self, r: usize) -> &[f64] {
        &self.data[r * self.cols..(r + 1) * self.cols]
    }

    /// One row, to be changed.
    #[inline]
    pub fn row_mut(&mut self, r: usize) -> &mut [f64] {
        &mut self.data[r * self.cols..(r + 1) * self.cols]
    }

    /// One column, copied.
    pub fn col(&self, c: usize) -> Vec<f64> {
        (0..self.rows).map(|r| self[(r, c)]).collect()
    }

    /// The transpose.
    pub fn transpose(&self) -> Matrix {
        let mut data = Vec::with_capacity(self.data.len());
        for c in 0..self.cols {
            data.extend(self.data[c.min(self.data.len())..].iter().step_by(self.cols));
        }
        Matrix { rows: self.cols, cols: self.rows, data }
    }

    /// The product `self * other`.
    pub fn times(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.cols, other.rows, "matrices do not fit");
        let mut out = Matrix::zeros(self.rows, other.cols);
        if other.cols == 0 {
            return out;
        }
        for (r, target) in out.data.chunks_exact_mut(other.cols).enumerate() {
            for (k, &f) in self.row(r).iter().enumerate() {
                if f != 0.0 {
                    add_scaled(target, f, other.row(k));
                }
            }
        }
        out
    }

    /// The product `self * other` of full matrices, in tiles that stay in registers.
    pub fn product(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.cols, other.rows, "matrices do not fit");
        let mut out = Matrix::zeros(self.rows, other.cols);
        super::wide::product(self, other, &mut out);
        out
    }

    /// The product `self' * other`.
    pub fn transpose_times(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.rows, other.rows, "matrices do not fit");
        let mut out = Matrix::zeros(self.cols, other.cols);
        for k in 0..self.rows {
            for (r, &f) in self.row(k).iter().enumerate() {
                if f != 0.0 {
                    add_scaled(out.row_mut(r), f, other.row(k));
                }
            }
        }
        out
    }

    /// `out = self * x`
    #[inline]
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        if self.cols == 0 {
            out[..self.rows].fill(0.0);
            return;
        }
        if self.cols >= super::wide::LONG {
            return super::wide::apply(&self.data, x, out);
        }
        for (o, row) in out.iter_mut().zip(self.data.chunks_exact(self.cols)) {
            *o = dot(row, x);
        }
    }

    /// `out += self * x`
    #[inline]
    pub fn apply_add(&self, x: &[f64], out: &mut [f64]) {
        if self.cols == 0 {
            return;
        }
        for (o, row) in out.iter_mut().zip(self.data.chunks_exact(self.cols)) {
            *o += dot(row, x);
        }
    }

    /// `out = self' * x`
    #[inline]
    pub fn apply_transposed(&self, x: &[f64], out: &mut [f64]) {
        out[..self.cols].fill(0.0);
        for (r, &f) in x.iter().enumerate().take(self.rows) {
            add_scaled(out, f, self.row(r));
        }
    }

    /// Adds `factor * other`.
    pub fn add_scaled(&mut self, factor: f64, other: &Matrix) {
        assert_eq!((self.rows, self.cols), (other.rows, other.cols), "matrices do not fit");
        add_scaled(&mut self.data, factor, &other.data);
    }

    /// The rows with the given numbers, in this order.
    pub fn select_rows(&self, rows: &[usize]) -> Matrix {
        let mut data = Vec::with_capacity(rows.len() * self.cols);
        rows.iter().for_each(|&r| data.extend_from_slice(self.row(r)));
        Matrix { rows: rows.len(), cols: self.cols, data }
    }

    /// The columns with the given numbers, in this order.
    pub fn select_cols(&self, cols: &[usize]) -> Matrix {
        let mut data = Vec::with_capacity(self.rows * cols.len());
        for r in 0..self.rows {
            let row = self.row(r);
            data.extend(cols.iter().map(|&c| row[c]));
        }
        Matrix { rows: self.rows, cols: cols.len(), data }
    }

    /// The columns from `first` on, `count` of them.
    pub fn columns(&self, first: usize, count: usize) -> Matrix {
        let mut data = Vec::with_capacity(self.rows * count);
        (0..self.rows).for_each(|r| data.extend_from_slice(&self.row(r)[first..first + count]));
        Matrix { rows: self.rows, cols: count, data }
    }

    /// The matrix of absolute values.
    pub fn abs(&self) -> Matrix {
        Matrix {
            rows: self.rows,
            cols: self.cols,
            data: self.data.iter().map(|v| v.abs()).collect(),
        }
    }

    /// Side by side.
    pub fn beside(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.rows, other.rows, "matrices do not fit");
        let mut data = Vec::with_capacity(self.rows * (self.cols + other.cols));
        for r in 0..self.rows {
            data.extend_from_slice(self.row(r));
            data.extend_from_slice(other.row(r));
        }
        Matrix { rows: self.rows, cols: self.cols + other.cols, data }
    }

    /// One above the other.
    pub fn above(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.cols, other.cols, "matrices do not fit");
        let data = [&self.data[..], &other.data[..]].concat();
        Matrix { rows: self.rows + other.rows, cols: self.cols, data }
    }

    /// The largest absolute value.
    pub fn max_abs(&self) -> f64 {
        self.data.iter().fold(0.0, |m, v| m.max(v.abs()))
    }

    /// True if all entries are finite.
    pub fn finite(&self) -> bool {
        self.data.iter().all(|v| v.is_finite())
    }
}

/// `a += f * b`
#[inline]
pub fn add_scaled(a: &mut [f64], f: f64, b: &[f64]) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += f * y;
    }
}

/// Scalar product.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < 8 {
        return a.iter().zip(b).map(|(x, y)| x * y).sum();
    }
    // four partial sums: a single one would make every addition wait for the last
    let mut sums = [0.0f64; 4];
    let b = &b[..a.len()];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Euclidean norm; scaled where squares would overflow or vanish.
#[inline]
pub fn norm(v: &[f64]) -> f64 {
    let squares = dot(v, v);
    if (1e-200..1e200).contains(&squares) || v.iter().all(|x| *x == 0.0) {
        return squares.sqrt();
    }
    v.iter().fold(0.0f64, |m, x| m.hypot(*x))
}

/// The larger of two numbers by a comparison, which skips NaN as `max` does and costs less.
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b {
        a
    } else {
        b
    }
}

/// LU factors of a square matrix with row scaling, for many right-hand sides together.
#[derive(Clone, Debug)]
pub struct Lu {
    lu: Matrix,
    perm: Vec<usize>,
    /// scaling of rows and columns (powers of 2)
    row: Vec<f64>,
    col: Vec<f64>,
    /// smallest by largest pivot of the scaled matrix
    pub ratio: f64,
}

impl Lu {
    /// Factorises after scaling rows and columns to a similar size.
    pub fn new(a: &Matrix) -> Lu {
        let n = a.rows;
        let (row, col) = equilibrate(a);
        let mut lu = a.clone();
        for (r, scale) in row.iter().enumerate() {
            lu.row_mut(r).iter_mut().zip(&col).for_each(|(v, other)| *v = *v * scale * other);
        }
        let mut perm: Vec<usize> = (0..n).collect();
        let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
        for k in 0..n {
            let p =
                (k..n).max_by(|&i, &j| lu[(i, k)].abs().total_cmp(&lu[(j, k)].abs())).unwrap_or(k);
            let pivot = lu[(p, k)];
            least = least.min(pivot.abs());
            greatest = greatest.max(pivot.abs());
            if pivot == 0.0 || !pivot.is_finite() {
                return Lu { lu, perm, row, col, ratio: 0.0 };
            }
            if p != k {
                perm.swap(p, k);
                for c in 0..n {
                    lu.data.swap(p * n + c, k * n + c);
                }
            }
            let (head, tail) = lu.data.split_at_mut((k + 1) * n);
            let pivot_row = &head[k * n..];
            for target in tail.chunks_exact_mut(n) {
                let f = target[k] / pivot;
                target[k] = f;
                if f != 0.0 {
                    add_scaled(&mut target[k + 1..], -f, &pivot_row[k + 1..]);
                }
            }
        }
        Lu { lu, perm, row, col, ratio: if n == 0 { 1.0 } else { least / greatest } }
    }

    /// `A^-1 B`
    pub fn solve(&self, b: &Matrix) -> Matrix {
        let n = self.lu.rows;
        let cols = b.cols;
        let mut data = Vec::with_capacity(n * cols);
        for &p in &self.perm {
            data.extend(b.row(p).iter().map(|v| v * self.row[p]));
        }
        let mut x = Matrix { rows: n, cols, data };
        if cols == 0 {
            return x;
        }
        for k in 0..n {
            let (head, tail) = x.data.split_at_mut((k + 1) * cols);
            let source = &head[k * cols..];
            for (i, target) in tail.chunks_exact_mut(cols).enumerate() {
                let f = self.lu[(k + 1 + i, k)];
                if f != 0.0 {
                    add_scaled(target, -f, source);
                }
            }
        }
        for k in (0..n).rev() {
            let (head, tail) = x.data.split_at_mut(k * cols);
            let inverse = 1.0 / self.lu[(k, k)];
            let source = &mut tail[..cols];
            source.iter_mut().for_each(|v| *v *= inverse);
            for (i, target) in head.chunks_exact_mut(cols).enumerate() {
                let f = self.lu[(i, k)];
                if f != 0.0 {
                    add_scaled(target, -f, source);
                }
            }
        }
        for r in 0..n {
            let f = self.col[r];
            x.row_mut(r).iter_mut().for_each(|v| *v *= f);
        }
        x
    }

    /// `A^-1 b` in place of `b`; `work` is as long at least.
    pub fn solve_one(&self, b: &mut [f64], work: &mut [f64]) {
        let n = self.lu.rows;
        let x = &mut work[..n];
        x.iter_mut().zip(&self.perm).for_each(|(x, &p)| *x = b[p] * self.row[p]);
        for k in 1..n {
            x[k] -= dot(&self.lu.row(k)[..k], &x[..k]);
        }
        for k in (0..n).rev() {
            let row = self.lu.row(k);
            x[k] = (x[k] - dot(&row[k + 1..], &x[k + 1..])) * (1.0 / row[k]);
        }
        b.iter_mut().zip(&*x).zip(&self.col).for_each(|((b, x), f)| *b = x * f);
    }

    /// `A^-1 B`, refined against the matrix itself: with residuals of twice the precision the
    /// solution has its digits as long as the matrix is regular at all (J. H. Wilkinson, *Rounding
    /// Errors in Algebraic Processes*, 1963, ch. 3), however far conductances lie apart.
    pub fn solve_refined(&self, a: &Matrix, b: &Matrix) -> Matrix {
        self.refine(a, b).0
    }

    /// The same, and the last correction: an entry that is no larger vanishes but for rounding.
    pub fn refine(&self, a: &Matrix, b: &Matrix) -> (Matrix, Matrix) {
        let mut x = self.solve(b);
        let mut correction = Matrix::default();
        for _ in 0..REFINEMENTS {
            let rest = super::wide::residual(a, &x, b);
            let nothing = rest.data.iter().all(|v| *v == 0.0);
            correction = if nothing { rest } else { self.solve(&rest) };
            let mut still = true;
            for (x, c) in x.data.iter_mut().zip(&correction.data) {
                let next = *x + c;
                still &= next == *x;
                *x = next;
            }
            // the next steps would find the same
            if still {
                break;
            }
        }
        (x, correction)
    }
}

/// Steps of refinement at most: each takes as many digits as the factorisation has.
const REFINEMENTS: usize = 3;

/// `B - A X` as if computed with twice the precision and rounded once (T. Ogita, S. M. Rump,
/// S. Oishi, SIAM J. Sci. Comput. 26, 2005).
#[inline(always)]
pub(super) fn residual(a: &Matrix, x: &Matrix, b: &Matrix) -> Matrix {
    // zeros of a matrix do not come from `calloc`
    let (mut out, mut low) = (b.clone(), Matrix::zeros(1, b.cols).data);
    for r in 0..a.rows {
        let high = out.row_mut(r);
        low.fill(0.0);
        for (k, &f) in a.row(r).iter().enumerate().filter(|f| *f.1 != 0.0) {
            let sums = high.iter_mut().zip(&mut low);
            for ((sum, rest), &x) in sums.zip(x.row(k)) {
                let product = -f * x;
                let lost = f64::mul_add(-f, x, -product);
                let new = *sum + product;
                let part = new - *sum;
                *rest += ((*sum - (new - part)) + (product - part)) + lost;
                *sum = new;
            }
        }
        add_scaled(high, 1.0, &low);
    }
    out
}

/// Powers of 2 for rows and columns that bring the largest entry of each near 1.
pub fn equilibrate(a: &Matrix) -> (Vec<f64>, Vec<f64>) {
    let (mut row, mut col) = (vec![1.0f64; a.rows], vec![1.0f64; a.cols]);
    // all are written before they are read; zeros would come from `calloc`
    let (mut largest_row, mut largest_col) = (row.clone(), col.clone());
    for _ in 0..4 {
        largest_col.fill(0.0);
        for ((r, scale), most) in row.iter().enumerate().zip(&mut largest_row) {
            *most = 0.0;
            for ((v, other), largest) in a.row(r).iter().zip(&col).zip(&mut largest_col) {
                let size = v.abs() * scale * other;
                *most = most.max(size);
                *largest = largest.max(size);
            }
        }
        let mut balanced = true;
        for (s, &m) in row.iter_mut().zip(&largest_row).chain(col.iter_mut().zip(&largest_col)) {
            if m > 0.0 && m.is_finite() && m != 1.0 {
                *s /= m.sqrt();
                balanced = false;
            }
        }
        if balanced {
            break;
        }
    }
    row.iter_mut().chain(&mut col).for_each(|v| *v = power_near(*v));
    (row, col)
}

/// The power of 2 that is nearest by its logarithm.
fn power_near(v: f64) -> f64 {
    if !v.is_normal() || v < 0.0 {
        return v.log2().round().exp2();
    }
    let below = f64::from_bits(v.to_bits() & f64::INFINITY.to_bits());
    if v >= below * std::f64::consts::SQRT_2 {
        2.0 * below
    } else {
        below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_solutions_agree() {
        let a = Matrix::from_fn(3, 3, |r, c| {
            [[2.0, -1.0, 0.5], [1e6, 3e6, 0.0], [0.0, 1.0, 1e-3]][r][c]
        });
        let x = Matrix::from_fn(3, 2, |r, c| (r * 2 + c) as f64 - 1.5);
        let b = a.times(&x);
        let found = Lu::new(&a).solve_refined(&a, &b);
        for (u, v) in found.data.iter().zip(&x.data) {
            assert!((u - v).abs() < 1e-12);
        }
        assert_eq!(a.transpose().transpose_times(&x), b);
    }

    #[test]
    fn a_singular_matrix_is_reported() {
        let a = Matrix::from_fn(2, 2, |_, _| 1.0);
        assert!(Lu::new(&a).ratio < 1e-15);
    }
}
