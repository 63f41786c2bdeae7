//! Products of a sparse matrix, and of its absolute values.

use super::{ITERATED, TOLERANCE};
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

    /// What the unknowns of nodes conduct to ground in each law of currents: sums of the entries of nodes.
    pub fn to_ground(&self, kinds: &[u8]) -> Vec<f64> {
        let (mut sums, mut sizes) = (vec![0.0f64; kinds.len()], vec![0.0f64; kinds.len()]);
        let between = |e: &&(u32, u32, f64)| kinds[e.0 as usize] + kinds[e.1 as usize] == 0;
        for &(row, _, value) in self.list.iter().filter(between) {
            sums[row as usize] += value;
            sizes[row as usize] += value.abs();
        }
        let rounding = |size: f64| 4.0 * f64::EPSILON * size;
        sums.iter()
            .zip(sizes)
            .map(|(&s, size)| if s.abs() <= rounding(size) { 0.0 } else { s })
            .collect()
    }

    /// Adds the product with `x`, and the sizes of its terms: in laws of currents those of what flows between
    /// nodes and to ground, and the part of what their potentials alone would make to which steps are solved.
    pub fn add_flows(
        &self,
        kinds: &[u8],
        to_ground: &[f64],
        x: &[f64],
        out: &mut [f64],
        sizes: &mut [f64],
    ) {
        const SOLVED: f64 = ITERATED / TOLERANCE;
        for &(row, column, value) in &self.list {
            let (r, c) = (row as usize, column as usize);
            out[r] += value * x[c];
            let from = if kinds[r] + kinds[c] > 0 {
                0.0
            } else if r == c {
                continue; // what others and ground take up
            } else {
                x[r]
            };
            sizes[r] += value.abs() * (x[c] - from).abs().max(SOLVED * from.abs());
        }
        for (size, (conductance, x)) in sizes.iter_mut().zip(to_ground.iter().zip(x)) {
            *size += (conductance * x).abs();
        }
    }

    /// Adds the sizes of the terms of the product.
    pub fn add_sizes(&self, factor: f64, x: &[f64], sizes: &mut [f64]) {
        for &(row, column, value) in &self.list {
            sizes[row as usize] += (factor * value * x[column as usize]).abs();
        }
    }

    /// `y' M x` and the sum of the sizes of its terms.
    pub fn form(&self, y: &[f64], x: &[f64]) -> (f64, f64) {
        let (mut sum, mut size) = (0.0, 0.0);
        for &(row, column, value) in &self.list {
            let term = y[row as usize] * value * x[column as usize];
            sum += term;
            size += term.abs();
        }
        (sum, size)
    }

    /// The entries.
    pub fn list(&self) -> &[(u32, u32, f64)] {
        &self.list
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
