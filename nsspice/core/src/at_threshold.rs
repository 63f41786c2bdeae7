//! Controls that rest at the thresholds of their switches.
//!
//! A control that crosses a threshold turns its gate, wherever it goes on to. One that comes to a threshold and
//! stays there has crossed nothing, and what its gate is then is a matter of definition
//! ([`AtThreshold`](crate::switch::AtThreshold)): a comparison has the value that is written, a switch turns when
//! the control has come. What only tends to a threshold, as the voltage of a capacitor does, never comes.

use crate::switch::Switch;

/// A control that was nearer than this part of its swing when last seen away from its threshold has not come
/// there but decayed: an exponential that falls below rounding (1e-13) between two looks, a tenth of a segment
/// apart, is below `1e-13^0.9` at the first; a step of an implicit formula reduces it by far less than 1e-7.
/// No test distinguishes a decade more or less.
pub const FADED: f64 = 1e-6;

/// What is known of the controls of all switches.
#[derive(Clone, Debug)]
pub struct Resting {
    /// how far each was when last seen away from the threshold that turns its gate
    away: Vec<f64>,
    /// whether it is there
    near: Vec<bool>,
    /// whether the gate has turned since the control came to where it is, or began there
    settled: Vec<bool>,
    /// when each came to rest for the first time [s]
    since: Vec<Option<f64>>,
}

impl Resting {
    /// All begin where they are.
    pub fn new(switches: usize) -> Resting {
        Resting {
            away: vec![f64::INFINITY; switches],
            near: vec![false; switches],
            settled: vec![true; switches],
            since: vec![None; switches],
        }
    }

    /// Notes how far the control of a switch is from the threshold that turns its gate, which is `known` up to
    /// so much; whether it is there.
    pub fn see(&mut self, switch: usize, distance: f64, known: f64) -> bool {
        self.near[switch] = distance.abs() <= known;
        if !self.near[switch] {
            self.away[switch] = distance.abs();
            self.settled[switch] = false;
        }
        self.near[switch]
    }

    /// Notes how far it was late in a motion to the threshold, in the same way; `before` says that it was there
    /// when the motion began. One that is there already has decayed.
    pub fn pass(&mut self, switch: usize, distance: f64, known: f64, before: bool) {
        if distance.abs() > known {
            self.away[switch] = distance.abs();
            self.settled[switch] = false;
        } else if !before {
            self.away[switch] = 0.0;
        }
    }

    /// Whether the control of a switch was at its threshold when last seen.
    pub fn is_near(&self, switch: usize) -> bool {
        self.near[switch]
    }

    /// Notes that a gate has turned.
    pub fn turned(&mut self, switch: usize) {
        self.settled[switch] = true;
    }

    /// Whether a control of this swing that is at its threshold has come there, or began there.
    fn has_come(&self, k: usize, swing: f64) -> bool {
        self.away[k] > FADED * swing
    }

    /// Whether a gate turns because its control, of this swing, stays at the threshold.
    pub fn turns(&self, k: usize, switch: &Switch, gate: bool, swing: f64) -> bool {
        self.has_come(k, swing) && switch.turns_at_rest(gate, self.settled[k])
    }

    /// Notes that the control of a switch stays at the threshold from a time [s] on.  A comparison that begins
    /// there has its value, and is not worth a word.
    pub fn note(&mut self, k: usize, switch: &Switch, swing: f64, time: f64) {
        if self.has_come(k, swing) && !(switch.compares() && self.away[k].is_infinite()) {
            self.since[k].get_or_insert(time);
        }
    }

    /// Pairs of the switches whose controls have come to rest, and when they did so first [s].
    pub fn told(&self, switches: &[Switch]) -> Vec<(usize, f64)> {
        let rested = switches.iter().zip(&self.since);
        rested.filter_map(|(switch, since)| since.map(|time| (switch.pair, time))).collect()
    }
}
