//! What is shown and kept of a run: rows, events, jumps and what the certificate needs.

use super::instants::jumps::Jump;
use super::outputs::{Outputs, Quantities};
use super::samples::Samples;
use super::state::State;
use super::statistics::Statistics;
use crate::audit::Sums;
use crate::row_sums::RowSums;

/// Events kept in full; later ones are only counted.
pub(in crate::integrate) const MAX_EVENTS: usize = 1 << 16;

/// What is shown and kept of a run.
pub struct Recorder {
    /// what rows are made of
    pub(in crate::integrate) outputs: Outputs,
    /// what switches are is kept with each step
    roles: bool,
    /// rates of the unknowns, where outputs need them
    pub(in crate::integrate) rates: Vec<f64>,
    /// what is left for the certificate
    pub samples: Samples,
    /// what goes with the run for the certificate: its balance of energy
    pub sums: Option<Box<Sums>>,
    /// the last step ended in a jump; `left` is the row before it
    pub(in crate::integrate) two_sided: bool,
    /// the row before a jump
    pub(in crate::integrate) left: Vec<f64>,
    /// what all rows must add up to
    pub(in crate::integrate) expected: RowSums,
    /// unknowns at the begin of the recorded step
    pub(in crate::integrate) z_recorded: Vec<f64>,
    /// from here on every step is a row, and a jump two [s]; infinite for rows of the grid only
    pub(in crate::integrate) all_points: f64,
    /// the row at the begin is still to come
    pub(in crate::integrate) first_row: bool,
    /// changes of pairs: time, pair, whether it conducts from then on
    pub events: Vec<(f64, usize, bool)>,
    /// recorded jumps
    pub jumps: Vec<Jump>,
    /// the state of the pairs that `events` leads to
    pub(in crate::integrate) logged: Vec<bool>,
    /// the epoch of `logged`
    pub(in crate::integrate) logged_epoch: u64,
}

impl Recorder {
    /// For `n` unknowns and `m` pairs, some of them `switches` or none.
    pub fn new(outputs: Outputs, [n, m]: [usize; 2], switches: bool) -> Recorder {
        Recorder {
            roles: switches,
            rates: vec![0.0; n],
            samples: Samples::default(),
            sums: None,
            two_sided: false,
            left: vec![0.0; 1 + outputs.len()],
            expected: RowSums::default(),
            z_recorded: vec![0.0; n],
            all_points: f64::INFINITY,
            first_row: false,
            events: Vec::new(),
            jumps: Vec::new(),
            logged: vec![false; m],
            logged_epoch: 0,
            outputs,
        }
    }

    /// Number of output columns, the time included.
    pub fn columns(&self) -> usize {
        self.outputs.len() + 1
    }

    /// True if rows on both sides of a jump are wanted.
    pub fn shows_sides(&self) -> bool {
        self.samples.keep_sides || self.all_points.is_finite()
    }

    /// Hands a step to the samples: from `z_recorded` and u0 to z and u1.
    pub fn record(&mut self, state: &State, length: f64) {
        let roles = if self.roles { &state.roles[..] } else { &[] };
        self.samples.records.push(
            state.time,
            length,
            &self.z_recorded,
            &state.z,
            &state.l,
            &state.u0,
            &state.u1,
            roles.iter().map(|&r| r as u8),
        );
    }

    /// Notes which pairs have changed since the last time.
    pub fn log_events(&mut self, state: &State, stats: &mut Statistics) {
        self.logged_epoch = state.epoch;
        for (i, (old, &new)) in self.logged.iter_mut().zip(&state.active).enumerate() {
            if *old != new {
                *old = new;
                stats.events += 1;
                if self.events.len() < MAX_EVENTS {
                    self.events.push((state.time, i, new));
                }
            }
        }
    }

    /// Writes a row: the values at a state, with these functions and their rates.
    pub fn write(&mut self, state: &State, f: [&[f64]; 2], label: f64, row: &mut [f64]) {
        row[0] = label;
        let (z, l, u) = (&state.z[..], &state.l[..], &state.u0[..]);
        self.outputs.write(&Quantities { z, l, rates: &self.rates, u, f }, &mut row[1..]);
    }

    /// The row written last belongs to the table.
    pub fn expect_last(&mut self) {
        if self.expected.wanted {
            let weight = self.expected.next();
            self.outputs.sum_last(weight);
        }
    }

    /// What the columns of all rows so far must add up to, weighted.
    pub fn expected_sums(&mut self) -> Vec<f64> {
        let mut row = vec![0.0; self.outputs.len()];
        self.outputs.write_sums(&mut row);
        self.expected.add(1.0, &row);
        self.expected.sums().to_vec()
    }

    /// The row before a possible jump, with the sources before it.
    pub fn write_left(&mut self, state: &State, f: [&[f64]; 2], label: f64) {
        self.left[0] = label;
        let (z, l, u) = (&state.z[..], &state.l[..], &state.u1[..]);
        self.outputs.write(&Quantities { z, l, rates: &self.rates, u, f }, &mut self.left[1..]);
    }

    /// Adds the values at a state to the side rows.
    pub fn note_side(&mut self, state: &State, f: [&[f64]; 2], label: f64) {
        let mut sides = std::mem::take(&mut self.samples.sides);
        let start = sides.len();
        sides.resize(start + self.columns(), 0.0);
        self.write(state, f, label, &mut sides[start..]);
        self.samples.sides = sides;
    }
}
