//! Sums of columns that vanish: Kirchhoff's laws, resistors, controlled sources.

use super::{value, Size, Terms, Unit, Worst};
use crate::audit::{ratio, worse};

/// One of them.
pub struct Sum {
    terms: Terms,
    /// sums whose rounding is in it besides: voltages of nodes times what conducts there
    rounded: Terms,
    unit: Unit,
    off: f64,
    time: f64,
    /// largest sum of the sizes of its terms
    terms_size: f64,
    rounded_size: f64,
}

impl Sum {
    /// Nothing is known of it yet.
    pub fn new(terms: Terms, rounded: Terms, unit: Unit) -> Sum {
        Sum { terms, rounded, unit, off: 0.0, time: 0.0, terms_size: 0.0, rounded_size: 0.0 }
    }

    #[inline]
    pub(super) fn take(&mut self, row: &[f64]) {
        let (mut sum, mut size) = (0.0, 0.0);
        for &(column, factor) in &self.terms {
            let term = factor * row[column];
            sum += term;
            size += term.abs();
        }
        let off: f64 = sum;
        if worse(off.abs(), self.off) {
            (self.off, self.time) = (off.abs(), row[0]);
        }
        self.terms_size = self.terms_size.max(size);
        if !self.rounded.is_empty() {
            let rounded = self.rounded.iter().map(|&(column, f)| (f * row[column]).abs()).sum();
            self.rounded_size = self.rounded_size.max(rounded);
        }
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let rounding = size.rounding(self.unit) + size.known * self.rounded_size;
        let beyond = if self.off.is_nan() { f64::NAN } else { (self.off - rounding).max(0.0) };
        Worst { error: ratio(beyond, self.terms_size), time: self.time }
    }

    /// Its value in a row.
    pub fn value(&self, row: &[f64]) -> f64 {
        value(&self.terms, row)
    }
}
