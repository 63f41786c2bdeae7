//! Some rows column by column, so that a law is evaluated for all of them together.

use super::Terms;

/// Rows in a block: its columns stay in the fast cache.
pub(super) const ROWS: usize = 256;
/// Numbers that are handled together.
const LANES: usize = 4;

/// Up to [`ROWS`] rows.
#[derive(Default)]
pub(super) struct Block {
    count: usize,
    columns: Vec<f64>,
}

impl Block {
    /// Takes rows of so many columns.
    pub fn fill(&mut self, rows: &[f64], columns: usize) {
        self.count = rows.len() / columns;
        self.columns.resize(columns * ROWS, 0.0);
        for (k, row) in rows.chunks_exact(columns).enumerate() {
            for (value, column) in row.iter().zip(self.columns.chunks_exact_mut(ROWS)) {
                column[k] = *value;
            }
        }
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A column, the times being the first.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.columns[column * ROWS..][..self.count]
    }

    /// The values of a sum of terms in all rows; returns the largest sum of their sizes.
    pub fn combine(&self, terms: &Terms, out: &mut Vec<f64>, sizes: &mut Vec<f64>) -> f64 {
        out.clear();
        out.resize(self.count, 0.0);
        if let [(column, factor)] = terms[..] {
            out.iter_mut().zip(self.column(column)).for_each(|(sum, value)| *sum = factor * value);
            return largest(out);
        }
        sizes.clear();
        sizes.resize(self.count, 0.0);
        for &(column, factor) in terms {
            let sums = out.iter_mut().zip(sizes.iter_mut());
            for ((sum, size), value) in sums.zip(self.column(column)) {
                let term = factor * value;
                *sum += term;
                *size += term.abs();
            }
        }
        largest(sizes)
    }
}

/// The largest size of some numbers, those that are none apart.
pub(super) fn largest(values: &[f64]) -> f64 {
    let mut most = [0.0_f64; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder();
    for chunk in chunks {
        for (most, value) in most.iter_mut().zip(chunk) {
            let size = value.abs();
            *most = if size > *most { size } else { *most };
        }
    }
    rest.iter().chain(&most.clone()).fold(0.0, |most, value| most.max(value.abs()))
}

/// Whether all numbers are finite.
pub(super) fn finite(values: &[f64]) -> bool {
    let mut none = [0.0; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder().iter().map(|value| 0.0 * value).sum::<f64>();
    for chunk in chunks {
        none.iter_mut().zip(chunk).for_each(|(none, value)| *none += 0.0 * value);
    }
    none.iter().sum::<f64>() + rest == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_a_block_are_those_of_its_rows() {
        let rows: Vec<f64> = (0..30).map(f64::from).collect();
        let mut block = Block::default();
        block.fill(&rows, 3);
        let (mut out, mut sizes) = (Vec::new(), Vec::new());
        let most = block.combine(&vec![(1, 2.0), (2, -1.0)], &mut out, &mut sizes);
        assert_eq!(block.count(), 10);
        assert_eq!(out, (0..10).map(|k| f64::from(3 * k)).collect::<Vec<_>>());
        assert_eq!(most, 2.0 * 28.0 + 29.0);
    }

    #[test]
    fn what_is_no_number_is_not_finite_and_no_size() {
        for bad in [f64::NAN, f64::INFINITY] {
            for place in 0..7 {
                let mut values = vec![1.0; 7];
                assert!(finite(&values));
                values[place] = bad;
                assert!(!finite(&values));
            }
        }
        assert_eq!(largest(&[1.0, f64::NAN, -3.0, 2.0, 0.5]), 3.0);
    }
}
