//! The rows of a table, as they are written, against the laws of the elements of the deck.
//!
//! Nothing of an engine takes part, neither its unknowns nor its modes: a law is a sum of columns that vanishes, a
//! polygon on which the voltage and the current of a set-valued element lie, the state of a switch next to its control,
//! or a source next to its waveform.  What columns are known to is measured by the largest values of the whole run,
//! since a row may be small by chance.

mod block;
mod source;
mod sum;
mod switch;
mod valve;

pub use source::Source;
pub use sum::Sum;
pub use switch::Gate;
pub use valve::{Line, Valve};

use super::worse;
use block::{largest, Block};

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

/// Arrays of one number a row.
type Work = [Vec<f64>; 3];

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
    /// conductance through which the largest voltage would drive a current [S]
    siemens: f64,
}

impl Size {
    /// The rounding of a quantity that is this large itself: currents have that of what the largest voltage drives.
    fn rounding(&self, unit: Unit) -> f64 {
        self.known * self.of(unit)
    }

    /// The largest voltage or current there may be.
    fn of(&self, unit: Unit) -> f64 {
        match unit {
            Unit::Volts => self.largest[0],
            Unit::Amperes => self.largest[1].max(self.siemens * self.largest[0]),
        }
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
    block: Block,
    work: Work,
    /// rows seen
    pub count: u64,
}

impl Rows {
    /// Of columns with these units behind that of the time, known to a part of the largest and of what the largest
    /// voltage drives through a conductance [S].
    pub fn new(units: Vec<Unit>, known: f64, siemens: f64) -> Rows {
        Rows {
            columns: 1 + units.len(),
            units,
            size: Size { largest: [0.0; 2], known, siemens },
            sums: Vec::new(),
            valves: Vec::new(),
            gates: Vec::new(),
            sources: Vec::new(),
            block: Block::default(),
            work: Work::default(),
            count: 0,
        }
    }

    /// Number of columns, that of the time included.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Measures errors by the largest voltage and current of other rows, too: a few rows of a run can all be small.
    pub fn see(&mut self, largest: [f64; 2]) {
        self.size.largest = [0, 1].map(|k| largest[k].max(self.size.largest[k]));
    }

    /// Measures the errors of laws as in other rows; `same` are pairs of numbers of sums, valves, gates and sources, here
    /// and there.
    pub fn measure_as(&mut self, other: &Rows, same: &[Vec<(usize, usize)>; 4]) {
        self.see(other.size.largest);
        same[0].iter().for_each(|&(own, its)| self.sums[own].see(&other.sums[its]));
        same[1].iter().for_each(|&(own, its)| self.valves[own].see(&other.valves[its]));
        same[2].iter().for_each(|&(own, its)| self.gates[own].see(&other.gates[its]));
        same[3].iter().for_each(|&(own, its)| self.sources[own].see(&other.sources[its]));
    }

    /// Takes some rows, one after the other.
    pub fn take(&mut self, table: &[f64]) {
        for rows in table.chunks(self.columns * block::ROWS) {
            self.block.fill(rows, self.columns);
            let Rows { block, work, size, .. } = self;
            for (k, unit) in self.units.iter().enumerate() {
                let most = &mut size.largest[*unit as usize];
                *most = most.max(largest(block.column(1 + k)));
            }
            self.sums.iter_mut().for_each(|sum| sum.take(block, work));
            self.sources.iter_mut().for_each(|source| source.take(block, self.count, work));
            self.valves.iter_mut().for_each(|valve| valve.take(block, size, work));
            for gate in &mut self.gates {
                gate.take(block, &self.valves[gate.valve], size, work);
            }
            self.count += block.count() as u64;
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
