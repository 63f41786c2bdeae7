//! Events that follow one another too fast.
//!
//! Where switches chatter they are sampled ([`crate::sampling`]); what piles up else (Zeno) is passed over by
//! implicit steps ([`super::fixed`]), and so are parts of a run that would take for ever.

use super::fixed::snapped;
use super::run::Engine;
use crate::sampling::Sampling;

/// So many events within so small a part of the run are an accumulation.
const CROWD: usize = 40;
const CROWDED: f64 = 1e-12;
/// The same number where events have piled up already.
const AGAIN: usize = 3;
/// So much work (a segment, or ten intervals) within so small a part of the run means that it would
/// take minutes or hours: the next such part is stepped, and twice as much each time that nothing has changed.
const STORM: (u64, f64) = (50_000, 2e-3);
/// Longest time between two looks of switches that chatter, and longest step where events follow too fast, as a part
/// of the run: at a few microseconds each, all take a second.
const INTERVAL: f64 = 5e-6;

/// Parts of a run in which events follow too fast to be followed one by one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Storm {
    /// work and time at the last look
    look: (u64, f64),
    /// how long the last one was taken to last, and its end [s]
    spell: f64,
    end: f64,
    /// how often the work has doubled since the first look was due
    doubled: u32,
}

impl Engine {
    /// Nobody is sampled; looks are no further apart than implicit steps.
    pub(super) fn new_sampling(&self) -> Sampling {
        Sampling::new(self.switches.len(), self.fixed_step.min(INTERVAL * self.stop))
    }

    /// Lets the switches that are sampled look at their controls if it is time; returns when they look next [s].
    pub(super) fn look(&mut self) -> f64 {
        let looking = self.sampling.looks(self.time);
        let verifier = &mut self.picker.verifier;
        if looking {
            for (k, &seen) in verifier.seen.iter().enumerate() {
                self.sampling.stays(k, seen);
            }
            self.sampling.release();
        }
        verifier.sampled.clone_from(&self.sampling.on);
        verifier.looking = looking;
        self.sampling.next
    }

    /// Notes an event at the present time; whether such pile up.
    pub(super) fn is_crowded(&mut self) -> bool {
        let crowded = CROWDED * self.stop;
        if self.crowd.last().is_some_and(|&last| self.time - last > crowded) {
            self.sampling.forget();
        }
        self.crowd.push(self.time);
        let again = self.time - self.resumed.0 <= 64.0 * self.resumed.1;
        let limit = if again { AGAIN } else { CROWD };
        if self.crowd.len() <= limit {
            return false;
        }
        let first = self.crowd[self.crowd.len() - limit];
        if self.time - first < crowded {
            self.crowd.clear();
            return true;
        }
        if self.crowd.len() > 4 * CROWD {
            self.crowd.drain(..2 * CROWD);
        }
        false
    }

    /// Work of the exact engine so far.
    pub fn work(&self) -> u64 {
        self.stats.segments + self.march.intervals / 10
    }

    /// Looks now and then whether the run would take for ever; true if it is given up for a while.
    pub(super) fn too_fast(&mut self) -> bool {
        let work = self.work();
        let (before, since) = self.storm.look;
        if work - before < STORM.0 {
            return false;
        }
        self.storm.look = (work, self.time);
        if self.time - since >= STORM.1 * self.stop {
            return false;
        }
        self.storm.spell = (2.0 * self.storm.spell).max(STORM.1 * self.stop);
        self.storm.end = self.time + self.storm.spell;
        true
    }

    /// The exact engine takes over again.
    pub(super) fn begin_to_follow(&mut self) {
        self.storm.look = (self.work(), self.time);
    }

    /// Whether events follow too fast at present.
    pub(super) fn is_stormy(&self) -> bool {
        self.time < self.storm.end
    }

    /// The longest implicit step [s].
    pub(super) fn longest_step(&self) -> f64 {
        if self.is_stormy() {
            snapped(INTERVAL * self.stop, self.fixed_step)
        } else {
            self.fixed_step
        }
    }

    /// Whether events have followed one another too fast somewhere.
    pub fn storm(&self) -> bool {
        self.storm.spell > 0.0
    }

    /// Whether the run has just become long, or twice as long: whoever watches it may think again.
    pub(super) fn doubles(&mut self) -> bool {
        let doubles = self.work() >> self.storm.doubled >= STORM.0;
        self.storm.doubled += u32::from(doubles);
        doubles
    }

    /// How often that was so.
    pub fn doublings(&self) -> u32 {
        self.storm.doubled
    }

    /// See [`Sampling::chattering`].
    pub fn chattering(&self) -> (Vec<(usize, u64, f64)>, f64) {
        self.sampling.chattering(&self.switches, |k| self.witness.controls[k])
    }
}
