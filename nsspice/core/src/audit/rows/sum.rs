//! Sums of columns that vanish: Kirchhoff's laws, resistors, controlled sources.

use super::block::{finite, largest, Block};
use super::{Size, Terms, Unit, Work, Worst};
use crate::audit::{ratio, worse};

/// One of them.
pub struct Sum {
    terms: Terms,
    /// what conducts there: the rounding of voltages is in it besides [S]
    siemens: f64,
    unit: Unit,
    off: f64,
    time: f64,
    /// largest sum of the sizes of its terms
    terms_size: f64,
}

impl Sum {
    /// Nothing is known of it yet.
    pub fn new(terms: Terms, siemens: f64, unit: Unit) -> Sum {
        Sum { terms, siemens, unit, off: 0.0, time: 0.0, terms_size: 0.0 }
    }

    pub(super) fn take(&mut self, block: &Block, work: &mut Work) {
        let [sums, sizes, ..] = work;
        self.terms_size = self.terms_size.max(block.combine(&self.terms, sums, sizes));
        if largest(sums) <= self.off && finite(sums) {
            return;
        }
        for (sum, time) in sums.iter().zip(block.column(0)) {
            if worse(sum.abs(), self.off) {
                (self.off, self.time) = (sum.abs(), *time);
            }
        }
    }

    /// Measures errors by the terms of the same law in other rows, too.
    pub(super) fn see(&mut self, other: &Sum) {
        self.terms_size = self.terms_size.max(other.terms_size);
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let rounding = size.rounding(self.unit) + self.siemens * size.rounding(Unit::Volts);
        let beyond = if self.off.is_nan() { f64::NAN } else { (self.off - rounding).max(0.0) };
        Worst { error: ratio(beyond, self.terms_size), time: self.time }
    }
}
