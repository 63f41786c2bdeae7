//! Small complex matrices and their solution by elimination with partial pivoting.

use crate::dense::{complex, Complex, Matrix};

/// A dense complex matrix, row by row.
#[derive(Clone, Debug, Default)]
pub struct CMatrix {
    /// number of rows
    pub rows: usize,
    /// number of columns
    pub cols: usize,
    /// entries
    pub data: Vec<Complex>,
}

impl CMatrix {
    /// Zeros.
    pub fn zeros(rows: usize, cols: usize) -> CMatrix {
        CMatrix { rows, cols, data: vec![Complex::default(); rows * cols] }
    }

    /// The unit matrix.
    pub fn identity(n: usize) -> CMatrix {
        let mut out = CMatrix::zeros(n, n);
        (0..n).for_each(|i| out.data[i * n + i] = complex(1.0, 0.0));
        out
    }

    /// A row.
    pub fn row(&self, r: usize) -> &[Complex] {
        &self.data[r * self.cols..(r + 1) * self.cols]
    }

    /// See [`CMatrix::row`].
    pub fn row_mut(&mut self, r: usize) -> &mut [Complex] {
        &mut self.data[r * self.cols..(r + 1) * self.cols]
    }

    /// A multiple.
    pub fn scale(&self, f: f64) -> CMatrix {
        CMatrix { data: self.data.iter().map(|v| v.scale(f)).collect(), ..*self }
    }

    /// A product.
    pub fn times(&self, other: &CMatrix) -> CMatrix {
        let mut out = CMatrix::zeros(self.rows, other.cols);
        for r in 0..self.rows {
            for (k, &f) in self.row(r).iter().enumerate() {
                if f != Complex::default() {
                    add_scaled(out.row_mut(r), f, other.row(k));
                }
            }
        }
        out
    }
}

/// `a += f b`
pub fn add_scaled(a: &mut [Complex], f: Complex, b: &[Complex]) {
    a.iter_mut().zip(b).for_each(|(x, y)| *x = *x + f * *y);
}

/// A real matrix applied to the columns of a complex one.
pub fn real_times(m: &Matrix, x: &CMatrix) -> CMatrix {
    let mut out = CMatrix::zeros(m.rows, x.cols);
    for r in 0..m.rows {
        for (k, &f) in m.row(r).iter().enumerate() {
            if f != 0.0 {
                let (to, from) = (out.row_mut(r), x.row(k));
                to.iter_mut().zip(from).for_each(|(a, b)| *a = *a + b.scale(f));
            }
        }
    }
    out
}

/// Solves `A X = B` in place of `B`; false if a pivot vanishes.
pub fn solve(mut a: CMatrix, b: &mut CMatrix) -> bool {
    let n = a.rows;
    for k in 0..n {
        let size = |r: usize| a.row(r)[k].abs();
        let Some(p) = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j))) else { return true };
        let pivot = a.row(p)[k];
        if pivot == Complex::default() {
            return false;
        }
        for c in 0..n {
            a.data.swap(k * n + c, p * n + c);
        }
        for c in 0..b.cols {
            b.data.swap(k * b.cols + c, p * b.cols + c);
        }
        let (head, upper) = (a.row(k).to_vec(), b.row(k).to_vec());
        for r in k + 1..n {
            let f = -(a.row(r)[k] / pivot);
            if f != Complex::default() {
                add_scaled(&mut a.row_mut(r)[k..], f, &head[k..]);
                add_scaled(b.row_mut(r), f, &upper);
            }
        }
    }
    for k in (0..n).rev() {
        for c in k + 1..n {
            let (f, known) = (-a.row(k)[c], b.row(c).to_vec());
            add_scaled(b.row_mut(k), f, &known);
        }
        let pivot = a.row(k)[k];
        b.row_mut(k).iter_mut().for_each(|v| *v = *v / pivot);
    }
    true
}
