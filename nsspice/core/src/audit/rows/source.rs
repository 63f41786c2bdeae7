//! Independent sources next to their waveforms.

use super::block::Block;
use super::{Size, Terms, Unit, Work, Worst};
use crate::audit::sources::known;
use crate::audit::{ratio, worse, Described};

/// One row of so many is compared with waveforms that change: prime to how many rows a period may have.
const EVERY: u64 = 13;

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
    /// instants at which some waveform jumps
    jumps: Vec<f64>,
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
            jumps: Vec::new(),
        }
    }

    pub(super) fn take(&mut self, block: &Block, before: u64, work: &mut Work) {
        let [sums, sizes, ..] = work;
        self.potential = self.potential.max(block.combine(&self.terms, sums, sizes));
        let times = block.column(0);
        if let Some(constant) = self.constant {
            self.largest = self.largest.max(constant.abs());
            for (found, time) in sums.iter().zip(times) {
                let off = (found - constant).abs();
                if worse(off, self.off) {
                    (self.off, self.time) = (off, *time);
                }
            }
            return;
        }
        // of two rows at an instant the first may show what was before
        let last = |k: usize| times.get(k + 1).is_some_and(|next| *next != times[k]);
        let first = (EVERY - before % EVERY) % EVERY;
        for k in (first as usize..times.len()).step_by(EVERY as usize) {
            self.look(times[k], sums[k], last(k));
        }
        // and those at jumps
        let mut jumps = std::mem::take(&mut self.jumps);
        jumps.clear();
        if let (Some(begin), Some(end)) = (times.first(), times.last()) {
            for waveform in &self.waveforms {
                waveform.jumps_within(
                    [begin - known(*begin), end + known(*end)],
                    times.len(),
                    &mut jumps,
                );
            }
        }
        for jump in &jumps {
            let near = known(*jump);
            let first = times.partition_point(|t| *t < jump - near);
            for k in (first..times.len()).take_while(|k| times[*k] <= jump + near) {
                self.look(times[k], sums[k], last(k));
            }
        }
        self.jumps = jumps;
    }

    /// Compares one value with the waveforms; `last` of those at an instant it shows what the run goes on with.
    fn look(&mut self, t: f64, found: f64, last: bool) {
        let given: f64 = self.waveforms.iter().map(|w| w.value(t)).sum();
        self.largest = self.largest.max(given.abs());
        let mut off = (found - given).abs();
        if worse(off, self.off) {
            // the instant may explain it
            off = match &self.waveforms[..] {
                [one] if last => one.outside_after(t, found).max(0.0),
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

    /// Measures errors by the values of the same source in other rows, too.
    pub(super) fn see(&mut self, other: &Source) {
        self.largest = self.largest.max(other.largest);
        self.potential = self.potential.max(other.potential);
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let rounding = size.known
            * self.potential.max(self.largest).max(match self.unit {
                Unit::Volts => 0.0,
                Unit::Amperes => size.of(Unit::Amperes),
            });
        let beyond = if self.off.is_nan() { f64::NAN } else { (self.off - rounding).max(0.0) };
        let scale =
            if self.largest > 0.0 { self.largest } else { size.largest[self.unit as usize] };
        Worst { error: ratio(beyond, scale), time: self.time }
    }
}
