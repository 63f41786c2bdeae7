//! Independent sources next to their waveforms.

use super::{value, Size, Terms, Unit, Worst};
use crate::audit::{ratio, worse, Described};

/// One of them: what it gives is the sum of some waveforms.
pub struct Source {
    terms: Terms,
    waveforms: Vec<Described>,
    unit: Unit,
    /// a constant, if all of them are
    constant: Option<f64>,
    off: f64,
    time: f64,
    largest: f64,
    potential: f64,
}

impl Source {
    /// Nothing is known of it yet.
    pub fn new(terms: Terms, waveforms: Vec<Described>, unit: Unit) -> Source {
        let constants: Option<Vec<f64>> = waveforms.iter().map(Described::constant).collect();
        let constant = constants.map(|list| list.iter().sum());
        Source {
            terms,
            waveforms,
            unit,
            constant,
            off: 0.0,
            time: 0.0,
            largest: 0.0,
            potential: 0.0,
        }
    }

    pub(super) fn take(&mut self, row: &[f64]) {
        let (t, found) = (row[0], value(&self.terms, row));
        let given =
            self.constant.unwrap_or_else(|| self.waveforms.iter().map(|w| w.value(t)).sum());
        self.largest = self.largest.max(given.abs());
        let potential = self.terms.iter().map(|&(c, f)| (f * row[c]).abs()).sum();
        self.potential = self.potential.max(potential);
        let mut off = (found - given).abs();
        if self.constant.is_none() && worse(off, self.off) {
            // the instant may explain it
            off = match &self.waveforms[..] {
                [one] => one.outside(t, found).max(0.0),
                many => {
                    many.iter().map(|w| w.swing(t)).fold(off, |off, swing| (off - swing).max(0.0))
                }
            };
        }
        if worse(off, self.off) {
            (self.off, self.time) = (off, t);
        }
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let rounding = size.known
            * self.potential.max(self.largest).max(match self.unit {
                Unit::Volts => 0.0,
                Unit::Amperes => size.largest[1],
            });
        let beyond = if self.off.is_nan() { f64::NAN } else { (self.off - rounding).max(0.0) };
        let scale =
            if self.largest > 0.0 { self.largest } else { size.largest[self.unit as usize] };
        Worst { error: ratio(beyond, scale), time: self.time }
    }
}
