//! Products of a sparse matrix, and of its absolute values.

use crate::sparse::Csc;

/// The entries of a matrix.
#[derive(Clone, Debug)]
pub struct Entries {
    list: Vec<(u32, u32, f64)>,
}

impl Entries {
    pub fn new(matrix: &Csc) -> Entries {
        let mut list = Vec::with_capacity(matrix.values.len());
        for column in 0..matrix.ncols {
            for k in matrix.colptr[column]..matrix.colptr[column + 1] {
                list.push((matrix.rowidx[k] as u32, column as u32, matrix.values[k]));
            }
        }
        list.sort_by_key(|e| (e.0, e.1));
        Entries { list }
    }

    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Adds the product with `x` times a factor.
    pub fn add(&self, factor: f64, x: &[f64], out: &mut [f64]) {
        for &(row, column, value) in &self.list {
            out[row as usize] += factor * value * x[column as usize];
        }
    }

    /// Adds the product with `x` times a factor, and the sizes of its terms.
    pub fn add_both(&self, factor: f64, x: &[f64], out: &mut [f64], sizes: &mut [f64]) {
        for &(row, column, value) in &self.list {
            let term = factor * value * x[column as usize];
            out[row as usize] += term;
            sizes[row as usize] += term.abs();
        }
    }

    /// Adds the sizes of the terms of the product.
    pub fn add_sizes(&self, factor: f64, x: &[f64], sizes: &mut [f64]) {
        for &(row, column, value) in &self.list {
            sizes[row as usize] += (factor * value * x[column as usize]).abs();
        }
    }

    /// `y' M x`
    #[inline]
    pub fn between(&self, y: &[f64], x: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for &(row, column, value) in &self.list {
            sum += value * y[row as usize] * x(column as usize);
        }
        sum
    }

    /// Rows, columns and values of the entries.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.list.iter().map(|e| (e.0 as usize, e.1 as usize, e.2))
    }

    /// Rows and columns of the entries.
    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.list.iter().map(|e| (e.0 as usize, e.1 as usize))
    }
}
