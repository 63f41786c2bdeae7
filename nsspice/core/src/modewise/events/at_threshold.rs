//! Controls of switches that stay at their thresholds throughout a segment.

use crate::at_threshold::{Resting, FADED};
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::run::Engine;
use crate::rounding::OF_SOLUTION;
use crate::sampling::Sampling;

/// Where a segment is looked at for controls that have decayed by its end.
const LATE: f64 = 0.9;

/// What the switches do.
pub struct Control {
    pub(in crate::modewise) gates: Vec<bool>,
    /// switches that chatter
    pub(in crate::modewise) sampling: Sampling,
    /// controls that rest at thresholds
    pub resting: Resting,
}

impl Control {
    /// All of some switches are off.
    pub(in crate::modewise) fn new(count: usize) -> Control {
        Control {
            gates: vec![false; count],
            sampling: Sampling::new(count, 1.0),
            resting: Resting::new(count),
        }
    }
}

impl Engine {
    /// Turns a gate.
    pub(in crate::modewise) fn throw(&mut self, switch: usize) {
        self.control.gates[switch] = !self.control.gates[switch];
        self.control.resting.turned(switch);
        self.stats.switchings += 1;
    }

    /// Turns the gates whose controls stay at their thresholds throughout the segment that the picker has found;
    /// whether there are any.
    pub(in crate::modewise) fn rest(&mut self) -> bool {
        let mut turned = false;
        for k in 0..self.picker.verifier.resting.len() {
            let (s, noise) = self.picker.verifier.resting[k];
            if self.control.sampling.on[s] {
                continue;
            }
            let (switch, swing) = (&self.prepared.switches[s], noise / OF_SOLUTION);
            self.control.resting.note(s, switch, swing, self.span.time);
            if self.control.resting.turns(s, switch, self.control.gates[s], swing) {
                self.throw(s);
                turned = true;
            }
        }
        turned
    }

    /// Notes how far controls are from their thresholds at the end of a segment.
    pub(in crate::modewise) fn see_controls(&mut self, mode: &Mode) {
        let length = self.span.end - self.span.time;
        let mut late = Point::default();
        for &s in &mode.guards.idle {
            self.control.resting.see(s, 0.0, 0.0);
        }
        for (j, watch) in mode.guards.watch.iter().enumerate() {
            let Watch::Switch(s) = *watch else { continue };
            let verifier = &self.picker.verifier;
            let (guards, noise) = (&verifier.guards, verifier.noise[j]);
            let before = self.control.resting.is_near(s);
            let distance = guards.value(j, &self.motion.point);
            self.control.resting.see(s, distance, noise);
            // at the end of a steep edge rounding of the instant is more than that of the control
            if distance.abs() <= FADED * noise / OF_SOLUTION {
                self.motion.path.at(LATE * length, &mut late);
                self.control.resting.pass(s, guards.value(j, &late), noise, before);
            }
        }
    }
}
