//! Matrices that carry bounds of the terms their entries were summed from, so that entries which
//! vanish but for rounding can be distinguished from small ones.

use crate::dense::{add_scaled, Matrix};

/// Below this part of its bound an entry of equations of this size is rounding.
pub fn negligible(size: usize) -> f64 {
    3e-15 * (size as f64).sqrt()
}

/// A matrix and, entry by entry, the sum of absolute values of the terms behind it.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// values
    pub value: Matrix,
    /// bounds
    pub bound: Matrix,
}

impl Tracked {
    /// An exact matrix.
    pub fn exact(value: Matrix) -> Tracked {
        Tracked { bound: value.abs(), value }
    }

    /// The zero matrix.
    pub fn zeros(rows: usize, cols: usize) -> Tracked {
        Tracked::exact(Matrix::zeros(rows, cols))
    }

    /// The product `factor * self`.
    pub fn under(&self, factor: &Matrix) -> Tracked {
        assert_eq!(factor.cols, self.value.rows, "matrices do not fit");
        let [mut value, mut bound] = [0; 2].map(|_| Matrix::zeros(factor.rows, self.value.cols));
        for r in 0..factor.rows {
            let (sums, sizes) = (value.row_mut(r), bound.row_mut(r));
            for (k, &f) in factor.row(r).iter().enumerate().filter(|f| *f.1 != 0.0) {
                add_scaled(sums, f, self.value.row(k));
                add_scaled(sizes, f.abs(), self.bound.row(k));
            }
        }
        Tracked { value, bound }
    }

    /// Adds `sign * other`.
    pub fn add(&mut self, sign: f64, other: &Tracked) {
        self.value.add_scaled(sign, &other.value);
        self.bound.add_scaled(sign.abs(), &other.bound);
    }

    /// Its rows as some of `size`, zero for the other ones.
    pub fn placed(&self, rows: &[usize], size: usize) -> Tracked {
        let mut out = Tracked::zeros(size, self.value.cols);
        for (i, &row) in rows.iter().enumerate() {
            out.value.row_mut(row).copy_from_slice(self.value.row(i));
            out.bound.row_mut(row).copy_from_slice(self.bound.row(i));
        }
        out
    }

    /// Some rows.
    pub fn rows(&self, rows: &[usize]) -> Tracked {
        Tracked { value: self.value.select_rows(rows), bound: self.bound.select_rows(rows) }
    }

    /// Sets to zero what is rounding.
    pub fn clean(&mut self, size: usize) {
        let tiny = negligible(size);
        for (v, b) in self.value.data.iter_mut().zip(&self.bound.data) {
            if v.abs() <= tiny * b {
                *v = 0.0;
            }
        }
    }
}
