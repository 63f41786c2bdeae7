//! Events that follow one another too fast.
//!
//! Where switches chatter they are sampled ([`crate::sampling`]); what accumulates else (Zeno) is stepped across by
//! implicit steps ([`crate::modewise::events::implicit_steps`]), and so are parts of a run that would take for ever.

use crate::modewise::events::implicit_steps::snapped;
use crate::modewise::run::Engine;
use crate::sampling::Sampling;

/// So many events within so small a part of the run are an accumulation.
const RECENT: usize = 40;
/// See [`RECENT`]: with a decade less, spirals of infinitely many switchings end in rounding of instants before they are
/// noticed.
const CROWDED: f64 = 1e-12;
/// The same number where events have accumulated already.
const AGAIN: usize = 3;
/// So much work (a segment, or ten intervals) within so small a part of the run means that it would
/// take minutes or hours: the next such part is stepped, and twice as much each time that nothing has changed.
const STORM: (u64, f64) = (50_000, 2e-3);
/// Longest time between two looks of switches that chatter, and longest step where events follow too fast, as a part
/// of the run: at a few microseconds each, all take a second.  A decade more is too coarse for switches that slide.
const INTERVAL: f64 = 5e-6;

/// Parts of a run in which events follow too fast to be followed one by one.
pub(in crate::modewise) struct Accumulation {
    /// times of events that may accumulate
    pub recent: Vec<f64>,
    /// when the exact engine took over again, and the implicit step before
    pub resumed: (f64, f64),
    /// implicit steps before it is tried again, and how many of them were waited for last time
    pub pause: (u32, u32),
    /// work and time at the last look
    look: (u64, f64),
    /// how long the last one was taken to last, and its end [s]
    spell: f64,
    end: f64,
    /// how often the work has doubled since the first look was due
    doubled: u32,
}

impl Default for Accumulation {
    fn default() -> Accumulation {
        Accumulation {
            recent: Vec::new(),
            resumed: (f64::NEG_INFINITY, 0.0),
            pause: (0, 0),
            look: (0, 0.0),
            spell: 0.0,
            end: 0.0,
            doubled: 0,
        }
    }
}

impl Engine {
    /// Nobody is sampled; looks are no further apart than implicit steps.
    pub(in crate::modewise) fn new_sampling(&self) -> Sampling {
        Sampling::new(
            self.prepared.switches.len(),
            self.plan.fixed_step.min(INTERVAL * self.plan.stop),
        )
    }

    /// Lets the switches that are sampled look at their controls if it is time; returns when they look next [s].
    pub(in crate::modewise) fn look(&mut self) -> f64 {
        let looking = self.control.sampling.looks(self.span.time);
        let verifier = &mut self.picker.verifier;
        if looking {
            for (k, &seen) in verifier.seen.iter().enumerate() {
                self.control.sampling.stays(k, seen);
            }
            self.control.sampling.release();
        }
        verifier.sampled.clone_from(&self.control.sampling.on);
        verifier.looking = looking;
        self.control.sampling.next
    }

    /// Notes an event at the present time; whether such accumulate.
    pub(in crate::modewise) fn is_crowded(&mut self) -> bool {
        let crowded = CROWDED * self.plan.stop;
        if self.accumulation.recent.last().is_some_and(|&last| self.span.time - last > crowded) {
            self.control.sampling.forget();
        }
        self.accumulation.recent.push(self.span.time);
        let again =
            self.span.time - self.accumulation.resumed.0 <= 64.0 * self.accumulation.resumed.1;
        let limit = if again { AGAIN } else { RECENT };
        if self.accumulation.recent.len() <= limit {
            return false;
        }
        let first = self.accumulation.recent[self.accumulation.recent.len() - limit];
        if self.span.time - first < crowded {
            self.accumulation.recent.clear();
            return true;
        }
        if self.accumulation.recent.len() > 4 * RECENT {
            self.accumulation.recent.drain(..2 * RECENT);
        }
        false
    }

    /// Work of the exact engine so far.
    pub fn work(&self) -> u64 {
        self.stats.segments + self.event_search.intervals / 10
    }

    /// Looks now and then whether the run would take for ever; true if it is given up for a while.
    pub(in crate::modewise) fn too_fast(&mut self) -> bool {
        let work = self.work();
        let (before, since) = self.accumulation.look;
        if work - before < STORM.0 {
            return false;
        }
        self.accumulation.look = (work, self.span.time);
        if self.span.time - since >= STORM.1 * self.plan.stop {
            return false;
        }
        self.accumulation.spell = (2.0 * self.accumulation.spell).max(STORM.1 * self.plan.stop);
        self.accumulation.end = self.span.time + self.accumulation.spell;
        true
    }

    /// The exact engine takes over again.
    pub(in crate::modewise) fn begin_to_follow(&mut self) {
        self.accumulation.look = (self.work(), self.span.time);
    }

    /// Whether events follow too fast at present.
    pub(in crate::modewise) fn accumulates_for_long(&self) -> bool {
        self.span.time < self.accumulation.end
    }

    /// The longest implicit step [s].
    pub(in crate::modewise) fn longest_step(&self) -> f64 {
        if self.accumulates_for_long() {
            snapped(INTERVAL * self.plan.stop, self.plan.fixed_step)
        } else {
            self.plan.fixed_step
        }
    }

    /// Whether events have followed one another too fast somewhere.
    pub fn accumulation(&self) -> bool {
        self.accumulation.spell > 0.0
    }

    /// Whether the run has just become long, or twice as long: whoever watches it may think again.
    pub(in crate::modewise) fn doubles(&mut self) -> bool {
        let doubles = self.work() >> self.accumulation.doubled >= STORM.0;
        self.accumulation.doubled += u32::from(doubles);
        doubles
    }

    /// How often that was so.
    pub fn doublings(&self) -> u32 {
        self.accumulation.doubled
    }

    /// See [`Sampling::chattering`].
    pub fn chattering(&self) -> (Vec<(usize, u64, f64)>, f64) {
        self.control.sampling.chattering(&self.prepared.switches, |k| self.samples.controls[k])
    }
}
