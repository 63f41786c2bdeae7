//! The rows of a table, as they are written, against the laws of the elements of the deck.
//!
//! Nothing of an engine takes part, neither its unknowns nor its modes: a law is a sum of columns that vanishes, a
//! polygon on which the voltage and the current of a set-valued element lie, the state of a switch next to its control,
//! or a source next to its waveform.  What columns are known to is measured by the largest values of the whole run,
//! since a row may be small by chance.

mod source;
mod sum;
mod switch;
mod valve;

pub use source::Source;
pub use sum::Sum;
pub use switch::Gate;
pub use valve::{Line, Valve};

use super::worse;

/// Terms: places of columns, the time being 0, and factors.
pub type Terms = Vec<(usize, f64)>;

/// A voltage [V] or a current [A].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// of a voltage
    Volts = 0,
    /// of a current
    Amperes = 1,
}

/// The value of a sum in a row.
#[inline]
fn value(terms: &Terms, row: &[f64]) -> f64 {
    terms.iter().map(|&(column, factor)| factor * row[column]).sum()
}

/// An error, and when.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst {
    /// relative
    pub error: f64,
    /// [s]
    pub time: f64,
}

impl Worst {
    fn note(&mut self, error: f64, time: f64) {
        if worse(error, self.error) {
            *self = Worst { error, time };
        }
    }
}

/// The largest voltage and current of all columns, and the part of them to which columns are known.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// [V] and [A]
    pub largest: [f64; 2],
    /// part
    pub known: f64,
}

impl Size {
    /// The rounding of a quantity that is this large itself.
    fn rounding(&self, unit: Unit) -> f64 {
        self.known * self.largest[unit as usize]
    }
}

/// The laws of a deck and what its rows have shown so far.
pub struct Rows {
    columns: usize,
    units: Vec<Unit>,
    size: Size,
    /// sums that vanish
    pub sums: Vec<Sum>,
    /// set-valued elements
    pub valves: Vec<Valve>,
    /// switches, each with the number of its valve
    pub gates: Vec<Gate>,
    /// sources
    pub sources: Vec<Source>,
    /// the last row
    before: Vec<f64>,
    /// rows seen
    pub count: u64,
}

impl Rows {
    /// Of columns with these units behind that of the time, known to a part of the largest.
    pub fn new(units: Vec<Unit>, known: f64) -> Rows {
        Rows {
            columns: 1 + units.len(),
            units,
            size: Size { largest: [0.0; 2], known },
            sums: Vec::new(),
            valves: Vec::new(),
            gates: Vec::new(),
            sources: Vec::new(),
            before: Vec::new(),
            count: 0,
        }
    }

    /// Number of columns, that of the time included.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The largest voltage and current so far.
    pub fn largest(&self) -> [f64; 2] {
        self.size.largest
    }

    /// Measures errors by the largest voltage and current of other rows, too: a few rows of a run can all be small.
    pub fn see(&mut self, largest: [f64; 2]) {
        self.size.largest = [0, 1].map(|k| largest[k].max(self.size.largest[k]));
    }

    /// Takes some rows, one after the other.
    pub fn take(&mut self, table: &[f64]) {
        for row in table.chunks_exact(self.columns) {
            for (value, unit) in row[1..].iter().zip(&self.units) {
                let largest = &mut self.size.largest[*unit as usize];
                *largest = largest.max(value.abs());
            }
        }
        for row in table.chunks_exact(self.columns) {
            self.count += 1;
            self.sums.iter_mut().for_each(|sum| sum.take(row));
            self.sources.iter_mut().for_each(|source| source.take(row));
            for valve in &mut self.valves {
                valve.take(row, &self.size);
            }
            for gate in &mut self.gates {
                gate.take(&self.before, row, &self.valves[gate.valve], &self.size);
            }
            self.before.clear();
            self.before.extend_from_slice(row);
        }
    }

    /// The worst errors of sums, valves, gates and sources.
    pub fn worst(&self) -> [Vec<Worst>; 4] {
        let size = &self.size;
        [
            self.sums.iter().map(|sum| sum.worst(size)).collect(),
            self.valves.iter().map(|valve| valve.worst(size)).collect(),
            self.gates.iter().map(Gate::worst).collect(),
            self.sources.iter().map(|source| source.worst(size)).collect(),
        ]
    }
}

#[cfg(test)]
mod tests;
