//! Implicit steps where no mode can be proved: events that accumulate (Zeno), switches that chatter,
//! modes of an index above 2.  Short at first, doubled while needed; the exact engine goes on as
//! soon as the mode of a step holds.

use crate::integrate::Failure;
use crate::mlcp::{Role, Unsolved};
use crate::modewise::events::successor::{fix, roles};
use crate::modewise::modes::implicit_step::{later, Taken};
use crate::modewise::modes::prepared::Prepared;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;
use crate::rounding::OF_EQUATION;
use crate::switch::Slack;

/// What an implicit step has left in the row it was given.
pub(in crate::modewise) enum Stepped {
    /// nothing
    Silent,
    /// the values at its end, a row of their own
    Point,
    /// the row that was to come
    Row,
}

/// Most implicit steps before the exact engine is tried again, where it has not got far the last times:
/// what slides goes on sliding, and every trial costs several steps.
const PATIENCE: u32 = 8;
/// How long switches are looked at that have to agree with the state they lead to, as parts of the step
/// before.
const AGREEMENT: [f64; 8] = [1e-3, 1e-5, 1e-7, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9];
/// How often they come back to the same state of all gates before they have none.
const RETURNS: usize = 2;
/// First step, relative to the run; with a decade less a ball of a billion times the usual mass does not come to rest.
/// What such a step takes of the energy may be that of a jump.
const FIRST: f64 = 1e-9;
/// Steps are multiples of a power of 2 of the longest one, so that their matrices can be kept.
pub(in crate::modewise) fn snapped(h: f64, longest: f64) -> f64 {
    if h >= longest {
        longest
    } else {
        longest * (h / longest).log2().floor().exp2()
    }
}

impl Engine {
    /// Goes on by implicit steps.
    pub(in crate::modewise) fn carry_on(&mut self) -> Result<(), Failure> {
        // soon after the last time: what accumulates goes on, and longer steps are in place
        let again =
            self.span.time - self.accumulation.resumed.0 <= 64.0 * self.accumulation.resumed.1;
        let wait = if again { (2 * self.accumulation.pause.1).clamp(1, PATIENCE) } else { 0 };
        self.accumulation.pause = (wait, wait);
        let first = if again { 2.0 * self.accumulation.resumed.1 } else { FIRST * self.plan.stop };
        let longest = self.longest_step();
        let h = if self.accumulates_for_long() { longest } else { snapped(first, longest) };
        self.span.phase = Phase::Stepping(h);
        if self.log.open {
            return Ok(());
        }
        // a first state has to exist: the step is taken immediately, without a row
        let mut none = Vec::new();
        self.implicit_step(h, f64::INFINITY, &mut none).map(|_| ())
    }

    /// An implicit step of this length from the present charges and fluxes, with the sources at its end; the state of
    /// the engine stays.
    pub(in crate::modewise) fn try_step(
        &mut self,
        v: &[f64],
        roles: &[Role],
        length: f64,
    ) -> Result<Taken, Unsolved> {
        let Prepared { sys, net, .. } = &self.prepared;
        self.implicit.step(sys, net, &self.state.a, v, roles, length)
    }

    /// One implicit step of at most the length `h`; `row` is written if it ends at `target`, or if
    /// every point is a row.
    pub(in crate::modewise) fn implicit_step(
        &mut self,
        h: f64,
        target: f64,
        row: &mut [f64],
    ) -> Result<Stepped, Failure> {
        let near = 1e-9 * h;
        let first_row = target <= self.span.time + near;
        if self.span.breakpoint <= self.span.time + near {
            self.span.time = self.span.time.max(self.span.breakpoint); // a ramp that ends here does not go on in the step
        }
        self.prepared.inputs.begin(self.span.time, &mut self.motion.segment);
        if self.span.breakpoint <= self.span.time {
            self.span.breakpoint = self.prepared.inputs.next_breakpoint(self.span.time);
        }
        let goal = target.min(self.span.breakpoint).min(if self.span.time < self.plan.stop {
            self.plan.stop
        } else {
            f64::INFINITY
        });
        let mut length = h;
        let mut reached = self.span.time + h;
        if goal > self.span.time + near && goal <= reached + near {
            length = goal - self.span.time;
            reached = goal;
        }
        let roles = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
        let mut v = Vec::new();
        later(&self.motion.segment, length, &mut v);
        let begin = self.span.time;
        let mut step = length;
        let result = loop {
            let taken = self.try_step(&v, &roles, step);
            match taken {
                Ok(taken) if !taken.suspect => break Ok(taken.residual),
                // impulses of a very short step can hide a solution: a longer one shows it
                _ if step < self.plan.fixed_step => {
                    step = snapped(4.0 * step, self.plan.fixed_step)
                }
                Ok(taken) => break Err((taken.residual.worst(), true)),
                Err(unsolved) => break Err((unsolved.residual.worst(), false)),
            }
        };
        if let Err((residual, suspect)) = result {
            return Err(Failure {
                time: self.span.time,
                length: step,
                rhs: self.implicit.rhs.clone(),
                roles: roles.iter().map(|&r| r as u8).collect(),
                residual,
                suspect,
                best: None,
                restless: None,
            });
        }
        if step != length {
            reached = self.span.time + step;
            if goal > self.span.time + near && reached > goal {
                reached = goal; // the solution of a longer step stands for the shorter one
            }
        }
        if let Ok(found) = result {
            self.stats.checks += 1;
            self.stats.residual_rows = self.stats.residual_rows.max(found.rows);
            self.stats.residual_complementarity =
                self.stats.residual_complementarity.max(found.complementarity);
        }
        self.stats.fixed_steps += 1;
        self.sample_implicit(reached, step, &v, &roles);
        self.state.z.copy_from_slice(&self.implicit.z);
        self.state.l.copy_from_slice(&self.implicit.l);
        let a = self.coordinates(&self.state.z);
        // what a first step takes may be that of a jump, of others it is an error
        if step > FIRST * self.plan.stop {
            // coordinates in which the energy is half a square
            let squares = a.iter().zip(&self.state.a).map(|(new, old)| (new - old) * (new - old));
            self.stats.taken += 0.5 * squares.sum::<f64>();
        }
        let before = std::mem::replace(&mut self.state.a, a);
        self.scale.see_state(&self.state.a);
        self.sample_end();
        self.span.time = reached;
        let mut on: Vec<bool> = self.implicit.active().to_vec();
        let at_target = first_row || (target - self.span.time).abs() <= near;
        let written = (at_target || self.table.ends.all_from <= self.span.time) && !row.is_empty();
        let label = if at_target { target } else { self.span.time };
        let wanted = self.table.pieces.wanted(begin, self.span.time).is_some();
        let waits = self.prepared.inputs.known() <= self.span.time;
        if written || wanted || waits || self.hands_on() {
            // of what is stored: the unknowns before a first step are not known otherwise
            let moved = self.state.a.iter().zip(&before).map(|(new, old)| (new - old) / step);
            let mut rates = vec![0.0; self.prepared.net.n];
            self.prepared.net.big_r.apply(&moved.collect::<Vec<_>>(), &mut rates);
            let u = self.sources(label);
            let mut outputs = vec![0.0; self.table.outputs.len()];
            self.table.outputs.write(&self.state.z, &self.state.l, &rates, &u, &mut outputs);
            if wanted {
                self.table.pieces.line([begin, self.span.time], None, &outputs);
            }
            if self.hands_on() {
                self.hand_step([begin, self.span.time], &outputs);
            }
            if written {
                row[0] = label;
                row[1..].copy_from_slice(&outputs);
            }
            if waits {
                self.table.stepped.clear();
                self.table.stepped.push(label);
                self.table.stepped.append(&mut outputs);
            }
        }
        if self.react(&on) {
            self.find_rest(step)?;
        }
        fix(&self.prepared.switches, &self.control.gates, &mut on);
        let id = self.registry.id(&on, &self.control.gates.clone());
        self.stats.events += self.log.note(self.registry.on(id), self.span.time);
        self.resume(id, h);
        Ok(match (at_target, written) {
            (true, _) => Stepped::Row,
            (false, true) => Stepped::Point,
            _ => Stepped::Silent,
        })
    }

    /// Turns the switches that the present unknowns and the pairs that conduct turn.
    fn react(&mut self, on: &[bool]) -> bool {
        let mut turned = false;
        let slack = Slack::of_terms(OF_EQUATION);
        for k in 0..self.prepared.switches.len() {
            let switch = &self.prepared.switches[k];
            if switch.turns(self.control.gates[k], &self.state.z, slack, on[switch.pair]) {
                self.throw(k);
                turned = true;
            }
        }
        turned
    }

    /// Refuses switches that have no state at this instant, after a step of the given length.
    ///
    /// What slides along a threshold by what is stored agrees with the state that it leads to immediately,
    /// or else where it is looked at for a shorter time; a switch that takes its own control across its
    /// threshold at any time comes back to where it was again and again.
    fn find_rest(&mut self, step: f64) -> Result<(), Failure> {
        let (z, a, gates) =
            (self.state.z.clone(), self.state.a.clone(), self.control.gates.clone());
        let switchings = self.stats.switchings;
        let restless = self.returning(step);
        (self.state.z, self.state.a, self.control.gates, self.stats.switchings) =
            (z, a, gates, switchings);
        match restless {
            None => Ok(()),
            pair => {
                self.stats.chatter += 1;
                Err(Failure::restless(self.span.time, pair))
            }
        }
    }

    /// The pair of a switch that comes back to the same state; the state of the engine is left anywhere.
    fn returning(&mut self, step: f64) -> Option<usize> {
        let mut met = Vec::new();
        let mut v = Vec::new();
        self.prepared.inputs.begin(self.span.time, &mut self.motion.segment);
        for length in AGREEMENT.map(|part| part * step) {
            met.push(self.control.gates.clone());
            later(&self.motion.segment, length, &mut v);
            let roles = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
            let taken = self.try_step(&v, &roles, length);
            if !taken.is_ok_and(|taken| !taken.suspect) {
                return None; // the next step decides
            }
            self.state.z.copy_from_slice(&self.implicit.z);
            let on = self.implicit.active().to_vec();
            if !self.react(&on) {
                return None;
            }
            if met.iter().filter(|gates| **gates == self.control.gates).count() == RETURNS {
                let last = met.last()?;
                let turned = self.control.gates.iter().zip(last).rposition(|(a, b)| a != b);
                return turned.map(|k| self.prepared.switches[k].pair);
            }
            // an impulse that the switch has caused is not undone by it
            self.state.a = self.coordinates(&self.state.z);
        }
        None
    }

    /// Back to the exact engine if the mode of the step just taken holds from here on.
    fn resume(&mut self, id: usize, h: f64) {
        if self.accumulation.pause.0 > 0 {
            self.accumulation.pause.0 -= 1;
            self.go_on(h);
            return;
        }
        let horizon = self.begin_inputs();
        if self.registry.gates(id) == self.control.gates.as_slice() {
            if let Ok(mode) = self.registry.mode(id, &self.prepared.net, &self.prepared.switches) {
                let found = self.picker.verifier.verify(
                    &mode,
                    &self.state.a,
                    &self.motion.segment,
                    horizon,
                    &mut self.scale,
                    &mut self.motion.path,
                );
                let good = found == crate::modewise::events::verify::Finding::Good
                    && self.picker.verifier.thrown.is_empty();
                if good && !self.accumulates_for_long() && !self.rest() {
                    self.begin_to_follow();
                    self.accumulation.resumed = (self.span.time, h);
                    self.motion.present = Some((id, mode));
                    self.walk_from_here(horizon);
                    return;
                }
            }
        }
        self.go_on(h);
    }

    /// Another implicit step, a longer one.
    fn go_on(&mut self, h: f64) {
        self.motion.present = None;
        self.span.phase = Phase::Stepping(snapped(2.0 * h, self.longest_step()));
    }
}
