//! What rows must add up to: engines sum the quantities that rows are made of, and bring the sums into outputs once for
//! many rows.  Outputs are affine in these quantities, so that the sums of the rows that are written must be the same.

use crate::dense::add_scaled;

/// Rows have one of so many weights, so that rows in another order have another sum.
const WEIGHTS: u64 = 8;

/// The weight of the row with a number.
pub fn weight(number: u64) -> f64 {
    1.0 + (number % WEIGHTS) as f64 / WEIGHTS as f64
}

/// Weighted sums over rows.
#[derive(Default)]
pub struct RowSums {
    /// somebody compares them
    pub wanted: bool,
    count: u64,
    sums: Vec<f64>,
}

impl RowSums {
    /// The weight of the next row.
    pub fn next(&mut self) -> f64 {
        self.count += 1;
        weight(self.count - 1)
    }

    /// Adds so many times these outputs.
    pub fn add(&mut self, factor: f64, outputs: &[f64]) {
        if self.sums.len() < outputs.len() {
            self.sums.resize(outputs.len(), 0.0);
        }
        add_scaled(&mut self.sums, factor, outputs);
    }

    /// Takes a row, the time included, that is known in no other way.
    pub fn take(&mut self, row: &[f64]) {
        if self.wanted {
            let weight = self.next();
            self.add(weight, &row[1..]);
        }
    }

    /// The sums so far.
    pub fn sums(&self) -> &[f64] {
        &self.sums
    }
}
