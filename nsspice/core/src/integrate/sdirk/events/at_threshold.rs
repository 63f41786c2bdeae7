//! Controls of switches that come to their thresholds and stay there.

use super::across_kinks::CLOSE;
use super::guards::VIOLATED;
use super::locate::Locator;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::run::Sdirk;
use crate::rounding::OF_EQUATION;

/// Halvings of the bracket around the instant at which a control comes to its threshold.
const HALVINGS: usize = 50;
/// How far beyond the edge of its threshold it is taken to have come, in widths of that.
const BEYOND: f64 = 4.0;
/// A control that would move by more than this part of its scale in the longest step does not rest: in a short
/// step nothing moves visibly.
const MOVES: f64 = 1e-6;
/// Level of the trial step at the begin of a motion: rounding of solutions is still no motion.
const TRIAL: usize = 10;
/// Rounds of gates that turn at one instant because their controls rest.
const ROUNDS: usize = 8;

impl Locator<'_> {
    /// How far the control of a switch is from its threshold at `theta`, relative to its scale.
    fn control(&mut self, k: usize, theta: f64) -> f64 {
        self.margin(theta);
        self.scales.control_margin(self.s, k, &self.trial.at.x[..self.s.state.z.len()])
    }

    /// Whether it is there.
    fn is_there(&mut self, k: usize, theta: f64) -> bool {
        self.control(k, theta).abs() <= VIOLATED
    }

    /// Of some switches, those whose controls are there at `theta`.
    fn that_are_there(&mut self, switches: &mut Vec<usize>, theta: f64) {
        if !switches.is_empty() {
            self.margin(theta);
            let z = &self.trial.at.x[..self.s.state.z.len()];
            switches.retain(|&k| self.scales.control_margin(self.s, k, z).abs() <= VIOLATED);
        }
    }

    /// When, within `(0, end)`, the control of a switch first comes to the threshold that turns its gate, to stay
    /// there up to `end`.
    pub fn arrival(&mut self, end: f64) -> Option<f64> {
        let (s, n) = (&*self.s, self.s.state.z.len());
        let margin = |x: &[f64], k: usize| self.scales.control_margin(s, k, &x[..n]);
        let last = &self.trial.stages.ends[self.tableau.stages() - 1];
        let may_come = |&k: &usize| {
            let begin = margin(&self.trial.first, k);
            let turns =
                s.switching.resting.turns(k, &s.switching.switches[k], s.switching.gates[k], 1.0);
            let away =
                begin.abs() > VIOLATED && begin.is_finite() && turns && !s.switching.sampled[k];
            away && (end < 1.0 || margin(last, k).abs() <= VIOLATED)
        };
        let mut coming: Vec<usize> = (0..s.switching.count()).filter(may_come).collect();
        self.that_are_there(&mut coming, end);
        // most only cross it there: instants are reported to this part of a step
        self.that_are_there(&mut coming, end * (1.0 - CLOSE));
        let mut first: Option<f64> = None;
        for k in coming {
            let begin = self.scales.control_margin(self.s, k, &self.trial.first[..n]);
            let (mut away, mut there) = (0.0, end * (1.0 - CLOSE));
            for _ in 0..HALVINGS {
                let middle = 0.5 * (away + there);
                if self.is_there(k, middle) {
                    there = middle;
                } else {
                    away = middle;
                }
            }
            // the bracket has closed on the edge of what counts as there
            there = (there + BEYOND * VIOLATED * there / begin.abs()).min(end);
            let middle = 0.5 * (there + end);
            let change = self.control(k, end) - self.control(k, middle);
            let moves = MOVES * (end - middle) * self.trial.length / self.stage_equations.longest;
            if change.abs() <= moves && first.is_none_or(|first| there < first) {
                first = Some(there);
            }
        }
        first
    }
}

impl Sdirk {
    /// Whether the control of a switch stays at its threshold throughout the trial step.
    pub(in crate::integrate::sdirk) fn stays(&self, s: &Stepper, k: usize) -> bool {
        let n = s.state.z.len();
        let stages = &self.trial.stages.ends[self.tableau.first()..self.tableau.stages()];
        let moves = MOVES * self.trial.length / self.stage_equations.longest;
        let margin = |x: &[f64]| self.scales.control_margin(s, k, &x[..n]);
        let begin = margin(&self.trial.first);
        let near = |x: &Vec<f64>| {
            let now = margin(x);
            now.abs() <= VIOLATED && (now - begin).abs() <= moves
        };
        begin.abs() <= VIOLATED && stages.iter().all(near)
    }

    /// Whether the control of a switch has come to its threshold by the end of the trial step.
    pub(in crate::integrate::sdirk) fn comes_to_rest(&self, s: &Stepper) -> bool {
        let n = s.state.z.len();
        let last = &self.trial.stages.ends[self.tableau.stages() - 1];
        let comes = |k: usize| {
            let margin = |x: &[f64]| self.scales.control_margin(s, k, &x[..n]).abs();
            let turns =
                s.switching.resting.turns(k, &s.switching.switches[k], s.switching.gates[k], 1.0);
            !s.switching.sampled[k]
                && turns
                && margin(last) <= VIOLATED
                && margin(&self.trial.first) > VIOLATED
        };
        (0..s.switching.count()).any(comes)
    }

    /// Whether the control of a switch was at its threshold when the step began, and leaves it on the side on which
    /// the gate does not turn.
    pub(in crate::integrate::sdirk) fn leaves(&self, s: &Stepper, k: usize) -> bool {
        let n = s.state.z.len();
        let last = &self.trial.stages.ends[self.tableau.stages() - 1];
        let [begin, end, later] = [&self.trial.first, &self.trial.at.x, last]
            .map(|x| self.scales.control_margin(s, k, &x[..n]));
        // an event right after the begin of the step shows no motion
        let change = if (end - begin).abs() > OF_EQUATION { end - begin } else { later - begin };
        begin.abs() <= VIOLATED && change > 0.0
    }

    /// The switches that turn because their controls stay at their thresholds throughout the trial step.
    fn resting(&self, s: &mut Stepper) -> Vec<usize> {
        let mut found = Vec::new();
        for k in 0..s.switching.count() {
            if s.switching.sampled[k] || !self.stays(s, k) {
                continue;
            }
            let (switches, gate) = (s.switching.switches.clone(), s.switching.gates[k]);
            s.switching.resting.note(k, &switches[k], 1.0, s.state.time);
            if s.switching.resting.turns(k, &switches[k], gate, 1.0) {
                found.push(k);
            }
        }
        found
    }

    /// When a control comes to its threshold in the trial step, to stay there up to its part `end`.
    pub(in crate::integrate::sdirk) fn arrives(
        &mut self,
        s: &mut Stepper,
        end: f64,
    ) -> Option<f64> {
        if s.switching.switches.is_empty() {
            return None;
        }
        let (stage_equations, scales) = (&mut self.stage_equations, &self.scales);
        let (tableau, trial) = (self.tableau, &mut self.trial);
        Locator { s, stage_equations, scales, tableau, trial }.arrival(end)
    }

    /// Turns the gates whose controls stay at their thresholds throughout the trial step, and begins again where
    /// they lead; whether there are any.
    pub(in crate::integrate::sdirk) fn turn_at_rest(&mut self, s: &mut Stepper) -> bool {
        let rounds = if self.trouble.rests.0 == s.state.time { self.trouble.rests.1 } else { 0 };
        if s.switching.switches.is_empty() || rounds >= ROUNDS {
            return false; // turned, they take their controls back where they were
        }
        let turned = self.resting(s);
        if turned.is_empty() {
            return false;
        }
        self.trouble.rests = (s.state.time, rounds + 1);
        turned.iter().for_each(|&k| s.gates().throw(k));
        self.restart(s);
        let known = self.knows_rates(s);
        self.tableau = self.settings.method.next(known);
        self.begin_step(s, false);
        true
    }

    /// Does the same at the begin of a motion, by a short trial step.
    pub(in crate::integrate::sdirk) fn begin_at_rest(&mut self, s: &mut Stepper) {
        for _ in 0..ROUNDS {
            let n = s.state.z.len();
            let waits = |k: usize| {
                let margin = self.scales.control_margin(s, k, &self.trial.first[..n]);
                let turns = s.switching.resting.turns(
                    k,
                    &s.switching.switches[k],
                    s.switching.gates[k],
                    1.0,
                );
                margin.abs() <= VIOLATED && turns && !s.switching.sampled[k]
            };
            if !(0..s.switching.count()).any(waits) || self.trouble.restless.is_some() {
                return;
            }
            let (stage_equations, tableau) = (&mut self.stage_equations, self.tableau);
            if self.trial.compute(s, stage_equations, tableau, TRIAL).is_err()
                || !self.turn_at_rest(s)
            {
                return;
            }
        }
    }

    /// Notes where the controls are at the begin of a step.
    pub(in crate::integrate::sdirk) fn note_controls(&self, s: &mut Stepper) {
        for k in 0..s.switching.count() {
            let margin = self.scales.control_margin(s, k, &s.state.z);
            if margin.is_finite() {
                s.switching.resting.see(k, margin, VIOLATED);
            }
        }
    }
}
