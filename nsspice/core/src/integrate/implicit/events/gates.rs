//! The gates of switches: which turn where the unknowns are now.

use super::switching::Switching;
use crate::integrate::implicit::records::Facts;
use crate::integrate::implicit::solver::Solver;
use crate::integrate::implicit::state::State;
use crate::integrate::implicit::stepper::{Stepper, MAX_REACTIONS};
use crate::integrate::implicit::time_grid::{evaluate, first_breakpoint};
use crate::mlcp::{Role, Start};
use crate::rounding::{OF_EQUATION, OF_SOLUTION};
use crate::switch::{comparisons_first, Slack};
use crate::tolerances::ACCEPT;
use crate::waveform::{Side, Waveform, INSTANT};

/// How far ahead a control at its threshold is looked at, as a part of the time to the next breakpoint or of a step.
const AHEAD: f64 = 1e-3;
/// Rounds in which all switches turn together.
const TOGETHER: usize = MAX_REACTIONS / 2;

/// What decides about switches sees the solver and the state, neither jumps nor records.
pub(in crate::integrate) struct Gates<'a> {
    pub switching: &'a mut Switching,
    pub state: &'a mut State,
    pub solver: &'a mut Solver,
    pub facts: &'a Facts,
    pub sources: &'a [Waveform],
    /// nominal [s]
    pub step_length: f64,
    /// each point is a state at rest: nothing is stored, or a sweep leaves it out
    pub at_rest: bool,
    /// the state is that before sources or switches changed: no jump has been found
    pub stale: bool,
}

impl Stepper {
    /// What decides about switches, at the present state.
    pub(in crate::integrate) fn gates(&mut self) -> Gates<'_> {
        Gates {
            switching: &mut self.switching,
            state: &mut self.state,
            solver: &mut self.solver,
            facts: &self.facts,
            sources: &self.waveforms,
            step_length: self.schedule.step_length,
            stale: self.instants.stale,
            at_rest: self.facts.static_system || self.schedule.sweeping,
        }
    }
}

impl Gates<'_> {
    /// Takes notice of how far controls are from their thresholds.
    pub(in crate::integrate) fn see_controls(&mut self) {
        for (k, swing) in self.switching.swings.iter_mut().enumerate() {
            *swing = swing.max(
                self.switching.switches[k].distance(self.switching.gates[k], &self.state.z).abs(),
            );
        }
    }

    /// Updates all switches; true if one of them changed.
    pub(in crate::integrate) fn react(&mut self) -> bool {
        self.see_controls();
        let mut changed = false;
        for k in self.turning_first() {
            self.turn(k, false);
            // a thyristor that opens carries no current: nothing else changes
            changed |=
                !self.switching.switches[k].latching || self.switching.gates[k] || self.stale;
        }
        changed
    }

    /// Updates all switches in the first rounds, then one alone, one that opens if there is any: those that turn
    /// together may do so for ever (two that hold each other open), where one after the other comes to rest.
    pub(in crate::integrate) fn react_in(&mut self, round: usize) -> bool {
        if round < TOGETHER {
            return self.react();
        }
        self.see_controls();
        let turning = self.turning_first();
        let closed = |&&k: &&usize| self.state.active[self.switching.switches[k].pair];
        let chosen = turning.iter().find(closed).or(turning.first()).copied();
        if let Some(k) = chosen {
            self.turn(k, false);
        }
        chosen.is_some()
    }

    /// Updates the switches that the sources u0 decide about: they change with them, not after what
    /// the sources would do to their old states.
    pub(in crate::integrate) fn throw_by_sources(&mut self) {
        let turned = self.turned_by_sources();
        if self.switching.turns.open() && !turned.is_empty() {
            let z = self.with_controls();
            turned.iter().for_each(|&k| self.note_turn(k, &z));
        }
        turned.into_iter().for_each(|k| self.throw(k));
    }

    /// Whether the sources u0 turn a switch.
    pub(in crate::integrate) fn sources_turn(&self) -> bool {
        !self.turned_by_sources().is_empty()
    }

    fn turned_by_sources(&self) -> Vec<usize> {
        if !self.switching.controls.any() {
            return Vec::new();
        }
        let z = self.with_controls();
        let turned = |&k: &usize| self.switching.controls.decide(k) && self.turns(k, &z);
        (0..self.switching.count()).filter(turned).collect()
    }

    /// The unknowns with those controls that the sources u0 decide about.
    fn with_controls(&self) -> Vec<f64> {
        let mut z = self.state.z.clone();
        self.switching.controls.fill(&self.solver.sys.linear.s, &self.state.u0, &mut z);
        z
    }

    /// Notes where the control of a switch is that turns where the unknowns are `z`.
    fn note_turn(&mut self, k: usize, z: &[f64]) {
        let Switching { turns, switches, gates, .. } = &mut *self.switching;
        let of = (&switches[k], gates[k]);
        turns.note((self.state.time, false), k, of, [z, &self.state.l]);
    }

    /// Turns a switch whose control has reached its threshold where the unknowns are now, an instant that was
    /// `located` or not.
    pub(in crate::integrate) fn turn(&mut self, k: usize, located: bool) {
        let Switching { turns, switches, gates, .. } = &mut *self.switching;
        let of = (&switches[k], gates[k]);
        turns.note((self.state.time, located), k, of, [&self.state.z, &self.state.l]);
        self.throw(k);
    }

    /// The switches that turn where the unknowns are now.
    pub(in crate::integrate) fn turning(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.switching.count()).filter(|&k| self.turns(k, &self.state.z))
    }

    /// Those of them that turn before the others.
    fn turning_first(&self) -> Vec<usize> {
        let mut turning: Vec<usize> = self.turning().collect();
        comparisons_first(&self.switching.switches, &mut turning);
        turning
    }

    /// Whether a switch turns where the unknowns are `z`; not one that is sampled.
    fn turns(&self, k: usize, z: &[f64]) -> bool {
        let slack = self.slack(k);
        if self.switching.sampled[k] {
            return false;
        }
        let (switch, gate, conducts) =
            (&self.switching.switches[k], self.switching.gates[k], self.carries(k));
        let rests = || {
            self.switching.still[k]
                && switch.distance(gate, z).abs() <= switch.known(z, slack)
                && !switch.held(gate, conducts)
                && self.switching.resting.turns(k, switch, gate, self.fading_swing(k))
        };
        switch.turns(gate, z, slack, conducts) || rests()
    }

    /// Whether a switch turns where the unknowns are now.
    pub(in crate::integrate) fn would_turn(&self, k: usize) -> bool {
        self.turns(k, &self.state.z)
    }

    /// To what the control of a switch is known where the unknowns are now.
    pub(in crate::integrate) fn known(&self, k: usize) -> f64 {
        self.switching.switches[k].known(&self.state.z, self.slack(k))
    }

    /// To what a control is known.
    fn slack(&self, k: usize) -> Slack {
        // Newton's method ends where its equations hold well enough: right after an event the control is at
        // its threshold up to that, on either side
        let known = if self.solver.smooth.is_some() { ACCEPT } else { OF_EQUATION };
        // gates that cross their thresholds together do so in one step, regardless of the rounding of the time
        let blur = INSTANT * self.state.time / self.step_length;
        Slack { part: known.max(blur), swing: self.switching.swings[k] }
    }

    /// Whether the control of a switch is at the threshold that turns its gate.
    fn is_at_threshold(&self, k: usize) -> bool {
        let switch = &self.switching.switches[k];
        let distance = switch.distance(self.switching.gates[k], &self.state.z);
        distance.abs() <= switch.known(&self.state.z, self.slack(k)) && !self.switching.latched(k)
    }

    /// Looks which controls stay at their thresholds: in a step, those that were there at its begin; at a point of
    /// a network without storage, comparisons have the values that are written, and switches turn if the control
    /// is still there a little later.
    pub(in crate::integrate) fn look_for_rest(&mut self) {
        let passing = !(self.at_rest);
        let mut unsure = false;
        for k in 0..self.switching.count() {
            let (gate, switch) = (self.switching.gates[k], &self.switching.switches[k]);
            self.switching.still[k] = if passing {
                self.switching.resting.is_near(k)
            } else {
                let turns = || self.switching.resting.turns(k, switch, gate, self.fading_swing(k));
                unsure |= !(switch.compares() || self.switching.frozen)
                    && self.is_at_threshold(k)
                    && turns();
                switch.compares() || self.switching.frozen
            };
        }
        if unsure {
            self.look_ahead();
        }
        for k in 0..self.switching.count() {
            if self.switching.still[k] && self.is_at_threshold(k) {
                let swing = self.fading_swing(k);
                self.switching.resting.note(k, &self.switching.switches[k], swing, self.state.time);
            }
        }
    }

    /// Solves the static equations a little later, for controls that may only touch their thresholds now.
    fn look_ahead(&mut self) {
        let there: Vec<usize> =
            (0..self.switching.count()).filter(|&k| self.is_at_threshold(k)).collect();
        let (z, l, u, active) = (
            self.state.z.clone(),
            self.state.l.clone(),
            self.state.u0.clone(),
            self.state.active.clone(),
        );
        let time = self.state.time;
        let breakpoint = first_breakpoint(self.sources, time).0;
        let room = if breakpoint.is_finite() { breakpoint - time } else { self.swing_of_time() };
        self.state.time = time + AHEAD * room;
        evaluate(self.sources, self.state.time, Side::Right, &mut self.state.u0);
        self.state.u1.copy_from_slice(&self.state.u0);
        if self.solver.solve_static(self.state, Start::Warm).is_ok() {
            for k in there {
                self.switching.still[k] = self.switching.still[k] || self.is_at_threshold(k);
            }
        }
        self.state.time = time;
        self.state.z.copy_from_slice(&z);
        self.state.l.copy_from_slice(&l);
        self.state.u0.copy_from_slice(&u);
        self.state.u1.copy_from_slice(&u);
        self.state.turn_to(&active);
        self.solver.forget_functions();
    }

    /// The swing relative to which a control may have decayed: none where nothing is stored.
    pub(in crate::integrate) fn fading_swing(&self, k: usize) -> f64 {
        if self.at_rest {
            0.0
        } else {
            self.switching.swings[k]
        }
    }

    /// A time in which sources change visibly [s].
    fn swing_of_time(&self) -> f64 {
        let pace = self.sources.iter().map(|w| w.pace()).fold(f64::INFINITY, f64::min);
        let step = pace.min(self.step_length);
        if step.is_finite() {
            step
        } else {
            self.state.time.max(1.0)
        }
    }

    /// Notes where the controls are at the end of a step.
    pub(in crate::integrate) fn note_controls(&mut self) {
        for k in 0..self.switching.count() {
            let switch = &self.switching.switches[k];
            let known = switch.known(&self.state.z, self.slack(k));
            self.switching.resting.see(
                k,
                switch.distance(self.switching.gates[k], &self.state.z),
                known,
            );
        }
    }

    /// Whether a thyristor carries a current: one that has come to zero up to rounding is none.
    fn carries(&self, k: usize) -> bool {
        let pair = self.switching.switches[k].pair;
        if !(self.switching.latched(k) && self.state.active[pair]) {
            return false;
        }
        let [voltage, current] = self.solver.sys.largest(&[&self.state.z]);
        let largest = self.state.l.iter().fold(current, |a, l| a.max(l.abs()));
        self.state.l[pair]
            > OF_SOLUTION * largest + f64::EPSILON * self.facts.conductances[1] * voltage
    }

    /// Turns a switch.
    pub(in crate::integrate) fn throw(&mut self, k: usize) {
        self.switching.gates[k] = !self.switching.gates[k];
        self.switching.resting.turned(k);
        self.solver.stats.switchings += 1;
        self.switching.last_thrown = Some(k);
        let (pair, role) = (
            self.switching.switches[k].pair,
            self.switching.switches[k].role(self.switching.gates[k]),
        );
        self.state.roles[pair] = role;
        self.state.active[pair] = role == Role::Closed;
        self.state.epoch += 1;
        if self.switching.switches[k].latching {
            self.state.diodes.retain(|&i| i != pair);
            if role == Role::Diode {
                self.state.diodes.push(pair);
            }
        }
    }
}
