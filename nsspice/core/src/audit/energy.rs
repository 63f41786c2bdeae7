//! The balance of energy of the recorded steps and of the jumps.

use super::{ratio, worse, TOLERANCE};

/// Share of all that a run has moved that its sums may lose by rounding.
const ROUNDING: f64 = 1e-6;

/// The energy balance of a run [J].
#[derive(Clone, Copy, Debug, Default)]
pub struct Energy {
    /// change of the stored energy over the recorded steps and all jumps
    pub stored: f64,
    /// by independent sources
    pub delivered: f64,
    /// in resistors, controlled sources and set-valued elements
    pub dissipated: f64,
    /// in jumps
    pub lost: f64,
    /// taken by the scheme
    pub scheme: f64,
    /// worst relative error of the balance of a step
    pub imbalance: f64,
    /// recorded steps
    pub steps: u64,
}

/// Terms of one step's balance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Entry {
    pub change: f64,
    pub scheme: f64,
    pub dissipated: f64,
    pub delivered: f64,
    /// sum of all terms without their signs: how far rounding can go
    pub size: f64,
    /// stored at both ends
    pub before: f64,
    pub after: f64,
}

/// Adds up energies.
#[derive(Clone, Debug)]
pub struct Ledger {
    /// so far
    pub energy: Energy,
    entries: Vec<Entry>,
    first: Option<f64>,
    last: f64,
    /// by steps, and by jumps between the first and the last of them
    moved: f64,
    jumped: f64,
    /// change of the stored energy in all jumps, and what sources gave in them
    in_jumps: [f64; 2],
    scale: f64,
    rounding: f64,
    begin: f64,
    end: f64,
}

impl Default for Ledger {
    fn default() -> Ledger {
        Ledger {
            energy: Energy::default(),
            entries: Vec::new(),
            first: None,
            last: 0.0,
            moved: 0.0,
            jumped: 0.0,
            in_jumps: [0.0; 2],
            scale: 0.0,
            rounding: 0.0,
            begin: f64::INFINITY,
            end: f64::NEG_INFINITY,
        }
    }
}

impl Ledger {
    /// Takes a step from `begin` to `end`, of which as many steps of the engine are finished.
    pub(super) fn take(&mut self, entry: Entry, begin: f64, end: f64, steps: u64) {
        // records of one kind come before those of another
        if self.first.is_none() || begin < self.begin {
            self.first = Some(entry.before);
            self.begin = begin;
        }
        if end >= self.end {
            self.last = entry.after;
            self.end = end;
        }
        self.energy.steps += steps;
        self.entries.push(entry);
    }

    /// Judges the steps taken since the last call.
    pub(super) fn judge(&mut self) {
        let energy = &mut self.energy;
        for e in self.entries.drain(..) {
            let error = (e.change + e.scheme + e.dissipated - e.delivered).abs();
            // products of small numbers underflow
            let found = ratio(error, e.size.max(f64::MIN_POSITIVE / TOLERANCE));
            if worse(found, energy.imbalance) {
                energy.imbalance = found;
            }
            self.moved += e.change;
            energy.stored += e.change;
            energy.scheme += e.scheme;
            energy.dissipated += e.dissipated;
            energy.delivered += e.delivered;
            self.scale += e.delivered.abs() + e.dissipated.abs();
            self.rounding += e.size;
        }
    }

    /// Takes a jump.
    pub fn jump(&mut self, time: f64, before: f64, after: f64, delivered: f64) {
        self.energy.lost += before + delivered - after;
        self.energy.stored += after - before;
        self.in_jumps[0] += after - before;
        self.in_jumps[1] += delivered;
        self.energy.delivered += delivered;
        self.scale += delivered.abs() + (after - before).abs();
        if self.first.is_some() && self.begin < time && time < self.end {
            self.jumped += after - before;
        }
    }

    /// Change of the stored energy in all jumps, and what sources gave in them [J].
    pub fn in_jumps(&self) -> [f64; 2] {
        self.in_jumps
    }

    /// Relative error of the sums over the run, if all steps were recorded.
    pub fn drift(&self) -> f64 {
        let Some(first) = self.first else { return 0.0 };
        let error = (self.last - first - self.moved - self.jumped).abs();
        let scale = self.scale + first.abs() + self.last.abs() + ROUNDING * self.rounding;
        ratio(error, scale)
    }
}
