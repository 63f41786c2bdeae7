//! What a run reports besides its rows: counters, jumps, changes of pairs.

use crate::integrate::{Failure, Jump};
use crate::switch::Turns;

/// Events kept in full; later ones are only counted.
const MAX_EVENTS: usize = 1 << 16;

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// segments
    pub segments: u64,
    /// changes of pairs
    pub events: u64,
    /// breakpoints of the sources
    pub breakpoints: u64,
    /// changes of the mode
    pub mode_changes: u64,
    /// segments that leave some voltage or current undetermined
    pub undetermined: u64,
    /// switch operations
    pub switchings: u64,
    /// jumps of charges or fluxes
    pub jumps: u64,
    /// instants at which a switch did not come to rest
    pub chatter: u64,
    /// implicit steps where no mode could be proved
    pub fixed_steps: u64,
    /// energy that those have taken which are no jumps [J]
    pub taken: f64,
    /// worst residual of rows over all checks
    pub residual_rows: f64,
    /// worst complementarity residual over all checks
    pub residual_complementarity: f64,
    /// residual checks made
    pub checks: u64,
}

/// Jumps and changes of pairs in the order in which they came, and the last failure.
#[derive(Default)]
pub struct Log {
    /// whether each pair conducts, as noted last
    pub(super) pairs: Vec<bool>,
    pub(super) open: bool,
    /// recorded jumps
    pub jumps: Vec<Jump>,
    /// changes of pairs: time, pair, whether it conducts from then on
    pub events: Vec<(f64, usize, bool)>,
    /// where controls were when gates turned
    pub turns: Turns,
    /// the last failure
    pub failure: Option<Failure>,
}

impl Log {
    /// Begins with the pairs that conduct.
    pub(super) fn begin(&mut self, on: &[bool]) {
        self.pairs.copy_from_slice(on);
        self.open = true;
    }

    /// Notes which pairs have changed since the last time; returns how many.
    pub(super) fn note(&mut self, on: &[bool], time: f64) -> u64 {
        let mut changes = 0;
        if !self.open {
            return changes;
        }
        for (i, (old, &new)) in self.pairs.iter_mut().zip(on).enumerate() {
            if *old != new {
                *old = new;
                changes += 1;
                if self.events.len() < MAX_EVENTS {
                    self.events.push((time, i, new));
                }
            }
        }
        changes
    }
}
