//! Jumps of charges and fluxes: the reinitialising step, and what switches do at one instant.

use super::jump_test::values_after;
use super::short_steps::Short;
use super::values::{Rest, Settled, CLOSE, HELD};
use crate::integrate::implicit::failure::{Failure, Outcome};
use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::integrate::implicit::step_length::System;
use crate::integrate::implicit::stepper::{Stepper, MAX_REACTIONS};
use crate::mlcp::Start;
use crate::rounding::OF_SOLUTION;

/// Length of a reinitialising step relative to the nominal step and to the fastest time constant: short
/// enough that nothing but the jump happens in it, long enough that `E/h` does not drown `G`.
pub(in crate::integrate) const JUMP: f64 = 1e-8;
/// The same where a gap may close at speed: its rounding counts by the inverse of this, what is not
/// the impact by the square.
pub(in crate::integrate) const IMPACT: f64 = 1e-5;
/// A stored unknown that differs by more than this from what the jump left is not determined by what
/// is stored: the potential of a floating capacitor.
pub(in crate::integrate) const LOOSE: f64 = 1e-6;
/// Ratio of lengths on the way down to a short step that is too hard in one go.
pub(in crate::integrate) const DESCENT: f64 = 1e-2;
/// How often reinitialising steps are made shorter by that ratio; those in which charges of junctions go most
/// straight are taken.
const STRAIGHTER: usize = 4;
const SHORTER: f64 = 0.1;
/// Jumps kept in full; later ones are only counted.
pub(in crate::integrate) const MAX_JUMPS: usize = 4096;

/// A jump of the stored charges or fluxes.
#[derive(Clone, Debug)]
pub struct Jump {
    /// when [s]
    pub time: f64,
    /// unknowns before
    pub before: Vec<f64>,
    /// unknowns after
    pub after: Vec<f64>,
    /// impulses of the multipliers [A s or V s]
    pub multipliers: Vec<f64>,
    /// impulses of the unknowns that carry one (branch currents, node voltages)
    pub unknowns: Vec<f64>,
    /// impulses of the smooth functions: a junction without series resistance lets a charge pass in no time
    pub functions: Vec<f64>,
    /// sources after the jump
    pub sources: Vec<f64>,
    /// of the short steps whose limit it is; 0 for a closed form [s]
    pub length: f64,
    /// the impulses contain what ordinary values carry in this time: 0 if they are a limit [s]
    pub span: f64,
}

/// What charges and fluxes are measured by where jumps are reported: `1 / sqrt(E_ii)`; with functions
/// that store something, all alike.
pub(in crate::integrate) fn jump_weights(sys: &System) -> Vec<f64> {
    let mut weights = vec![1.0; sys.linear.g.nrows];
    if sys.smooth.is_none() {
        for (r, _, v) in sys.linear.e.iter().filter(|e| e.0 == e.1 && e.2 > 0.0) {
            weights[r] = 1.0 / v.sqrt();
        }
    }
    weights
}

/// What a reinitialising step has done.
pub(in crate::integrate) struct StateJump {
    /// unknowns at the end of the shortest step, and at length 0
    pub first: Vec<f64>,
    /// length of the first steps, relative to the shortest time
    pub part: f64,
    pub after: Vec<f64>,
    /// of unknowns, multipliers and smooth functions [A s or V s]
    pub impulses: [Vec<f64>; 3],
    /// see [`Jump`]
    pub length: f64,
    pub span: f64,
    /// multipliers before
    pub multipliers: Vec<f64>,
    /// a step and the limit of steps from `after` that need no impulse
    pub settled: Option<Settled>,
    /// what those steps look like
    pub rest: Rest,
}

impl StateJump {
    /// This step and the one from where it led.
    fn and(self, next: StateJump) -> StateJump {
        let sum =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        StateJump {
            first: next.after.clone(),
            impulses: [0, 1, 2].map(|k| sum(&self.impulses[k], &next.impulses[k])),
            length: self.length + next.length,
            span: self.span + next.span,
            ..next
        }
    }
}

/// Value at length 0 from those at length 1 and 2.
fn limit(once: &[f64], twice: Option<&Vec<f64>>) -> Vec<f64> {
    match twice {
        Some(twice) => once.iter().zip(twice).map(|(a, b)| 2.0 * a - b).collect(),
        None => once.to_vec(),
    }
}

impl Stepper {
    /// A jump at the present time; where the impulsive problem has no solution the next ordinary
    /// step has to resolve it.
    pub(in crate::integrate) fn impulse_or_leave(&mut self) -> Outcome {
        let (z, l) = (self.state.z.clone(), self.state.l.clone());
        let jumps = self.solver.stats.jumps;
        self.instants.stale = self.impulse(None, Start::Warm).is_err();
        if self.instants.stale {
            self.state.z = z;
            self.state.l = l;
            self.solver.forget_functions();
        } else {
            self.account_for_jump(&z, jumps);
        }
        Ok(())
    }

    /// Reports a jump to the balance from `before`, which is reported if there are more than so many `jumps` now.
    pub(in crate::integrate) fn account_for_jump(&mut self, before: &[f64], jumps: u64) {
        let reported = match self.solver.stats.jumps > jumps {
            // of later ones nothing is kept
            true => {
                Some(self.recorder.jumps.last().filter(|_| self.recorder.jumps.len() < MAX_JUMPS))
            }
            false => None,
        };
        if let Some(sums) = &mut self.recorder.sums {
            let after = reported.map(|jump| jump.map_or(&self.state.z[..], |jump| &jump.after));
            sums.jump(before, &self.state.z, after);
        }
    }

    /// The implicit reinitialising step: charges and fluxes jump so that all equations hold again.
    ///
    /// Very short steps from the same charges, extrapolated to length 0, move the stored
    /// quantities; longer ones from there, extrapolated too, give the finite values of currents and
    /// voltages right after the jump.
    pub(in crate::integrate) fn impulse(
        &mut self,
        charges: Option<&[f64]>,
        start: Start,
    ) -> Outcome {
        #[cfg(feature = "faults")]
        let origin = self.state.z.clone();
        self.instants.begun = None;
        if self.facts.static_system {
            self.state.u1.copy_from_slice(&self.state.u0);
            return self.solver.solve_static(&mut self.state, start);
        }
        if charges.is_none() && self.goes_on() {
            return Ok(());
        }
        if let Some(charges) = charges {
            self.jumps().compare_with(charges);
        }
        let known = self.reinitialise(charges) || self.by_derivative_array(charges, start);
        if !known {
            let before = self.state.z.clone();
            let impacts = charges.is_none() && self.instants.impacts.active;
            let part = if impacts { IMPACT } else { JUMP };
            self.solver.stats.short_steps += 1;
            let state_jump = self.jumps().find_state_jump(charges, part, start)?;
            self.enter(charges, before, state_jump);
        }
        #[cfg(feature = "faults")]
        if charges.is_none() {
            let stored = self.facts.storage.unknowns();
            crate::faults::damage::jump(&origin, &mut self.state.z, stored);
        }
        Ok(())
    }

    /// Goes where a reinitialising step has led, and notes what jumped.
    pub(in crate::integrate) fn enter(
        &mut self,
        charges: Option<&[f64]>,
        before: Vec<f64>,
        state_jump: StateJump,
    ) {
        let StateJump { first, after, impulses, length, span, settled, .. } = state_jump;
        let values = settled.as_ref().map_or(&[][..], |s| &s.z);
        let begun = values_after(&after, span, settled.as_ref());
        if self.jumps().noticed(charges, [&before, &first, &begun], values) {
            self.solver.stats.jumps += 1;
            if self.recorder.jumps.len() < MAX_JUMPS {
                let [unknowns, multipliers, functions] = impulses;
                self.recorder.jumps.push(Jump {
                    time: self.state.time,
                    before,
                    after: after.clone(),
                    multipliers,
                    unknowns,
                    functions,
                    sources: self.state.u0.clone(),
                    length,
                    span,
                });
            }
        }
        let Some(settled) = settled else {
            self.state.z.copy_from_slice(&after);
            self.solver.forget_functions();
            return;
        };
        if self.recorder.outputs.needs_rates() {
            self.recorder
                .rates
                .iter_mut()
                .zip(settled.rates())
                .for_each(|(rate, found)| *rate = found);
        }
        self.state.z.copy_from_slice(&settled.z);
        self.state.l.copy_from_slice(&settled.l);
        if settled.missed <= HELD || settled.calm && !self.facts.storage.tight() {
            // what is stored stays to its last digit; currents that a shared flux does not determine belong to the
            // end of the step, and where that misses more than rounding so do the others: their sums hold there. So
            // does a picofarad across a closed switch, of which larger charges show nothing: more than the
            // certificate grants
            let [volts, _] = self.jumps().scale_of(&after);
            let most = if volts > 0.0 { CLOSE * volts } else { f64::INFINITY };
            let kinds = &self.solver.sys.linear.row_kind;
            let slack = |j: usize| if kinds[j] == 0 { most } else { f64::INFINITY };
            self.facts.storage.restore(&after, &mut self.state.z, slack);
        }
        let (u, time) = (&self.state.u0, self.state.time);
        if let Some(smooth) = &mut self.solver.smooth {
            smooth.after_jump(&self.state.z, &settled.functions, u, time, settled.length);
        }
        self.jumps().tie_groups();
        if self.recorder.samples.jumped() {
            self.state.u1.copy_from_slice(&self.state.u0);
            // a state, not a step; the short one shows what its rounding is measured by
            let ahead = settled.rates().zip(&settled.z).map(|(rate, z)| z + settled.length * rate);
            self.recorder.z_recorded.iter_mut().zip(ahead).for_each(|(recorded, z)| *recorded = z);
            self.recorder.record(&self.state, -settled.length);
        }
    }

    /// Applies the switch laws until they agree with the state; a first look at the switches has shown
    /// whether one has changed.
    pub(in crate::integrate) fn settle_after(&mut self, mut changed: bool) -> Outcome {
        for round in 0..MAX_REACTIONS {
            if !changed {
                return Ok(());
            }
            if self.schedule.sweeping {
                self.state.u1.copy_from_slice(&self.state.u0);
                self.solver.solve_static(&mut self.state, Start::Warm)?;
            } else {
                self.impulse_or_leave()?;
            }
            changed = self.gates().react_in(round);
        }
        if changed {
            self.solver.stats.chatter += 1;
            return Err(self.unsettled());
        }
        Ok(())
    }
}

impl StateJumps<'_> {
    /// Takes charges and fluxes into the largest so far.
    fn compare_with(&mut self, stored: &[f64]) {
        let now = self.solver.sys.largest(&[stored]);
        self.instants.largest = [0, 1].map(|kind| self.instants.largest[kind].max(now[kind]));
    }

    /// The reinitialising step from the present state, which is left undefined; the first steps have
    /// this part of the shortest time.
    pub(in crate::integrate) fn find_state_jump(
        &mut self,
        charges: Option<&[f64]>,
        part: f64,
        start: Start,
    ) -> Result<StateJump, Box<Failure>> {
        let shortest = self.shortest_time();
        let begun = (self.state.z.clone(), self.state.l.clone());
        let stored =
            charges.map_or_else(|| self.solver.stored_at(self.state, &begun.0), <[f64]>::to_vec);
        self.compare_with(&stored);
        // charges that a step ends with need no impulse; where gaps close at speed, they may jump all the same
        if charges.is_none() && !self.instants.impacts.active {
            if let Some(still) = self.unmoved(&begun, shortest) {
                return Ok(still);
            }
            (self.state.z, self.state.l) = begun.clone();
        }
        let state_jump = self.state_jump(charges, part, shortest, start)?;
        let mut state_jump = self.without_motion(charges, &begun, state_jump, shortest, start);
        // a gap closes at the end of the step, not at its begin: what it had left is speed that the next one does not see
        let strikes = charges.is_none() && self.instants.impacts.active;
        let struck = strikes && self.has_jumped(charges, &begun.0, &state_jump);
        if struck {
            (self.state.z, self.state.l) =
                (state_jump.after.clone(), state_jump.multipliers.clone());
            if let Ok(next) = self.state_jump(None, part, shortest, Start::Warm) {
                state_jump = state_jump.and(next);
            }
        }
        // motion of so long a step has to come once more
        let moved = strikes && !struck && state_jump.rest >= Rest::Bent;
        let still = if moved { self.unmoved(&begun, shortest) } else { None };
        Ok(still.unwrap_or(state_jump))
    }

    /// Moves charges and fluxes by a very short step (this part of `shortest`), then shows what
    /// currents and voltages they lead to.
    pub(in crate::integrate) fn state_jump(
        &mut self,
        charges: Option<&[f64]>,
        part: f64,
        shortest: f64,
        start: Start,
    ) -> Result<StateJump, Box<Failure>> {
        let (before, multipliers) = (self.state.z.clone(), self.state.l.clone());
        let mut part = part;
        let (mut once, mut twice) = self.solver.two_steps(
            self.state,
            charges,
            &before,
            [part * shortest, self.step_length],
            start,
        )?;
        let mut after = limit(&once.z, twice.as_ref().map(|t| &t.z));
        let linear = !self.solver.functions_store();
        let scale = if linear { self.instants.largest } else { self.scale_of_charges(&once) };
        let mut bend =
            self.solver.curvature_of_charges(self.state, &once, twice.as_ref(), &after, scale);
        let mut shorter = part;
        for _ in 0..STRAIGHTER {
            if bend <= OF_SOLUTION {
                break;
            }
            shorter *= SHORTER;
            let steps = self.solver.two_steps(
                self.state,
                charges,
                &before,
                [shorter * shortest, self.step_length],
                Start::Warm,
            );
            let Ok(steps) = steps else { break };
            let end = limit(&steps.0.z, steps.1.as_ref().map(|t| &t.z));
            let found = self.solver.curvature_of_charges(
                self.state,
                &steps.0,
                steps.1.as_ref(),
                &end,
                scale,
            );
            if found <= bend {
                ((once, twice), after, part, bend) = (steps, end, shorter, found);
            }
        }
        self.facts.storage.project(&mut after);
        if linear {
            // with junctions charges depend on potentials
            self.facts.storage.lower(&before, &mut after);
        }
        let carried = |s: &mut Self, step: &Short| {
            let functions = s.solver.functions_at(s.state, &step.z);
            [&step.z, &step.l, &functions]
                .map(|list| list.iter().map(|v| v * step.length).collect::<Vec<_>>())
        };
        let (short, long) = (carried(self, &once), twice.as_ref().map(|step| carried(self, step)));
        let impulses = [0, 1, 2].map(|k| limit(&short[k], long.as_ref().map(|long| &long[k])));
        let length = once.length;
        let span = if twice.is_some() { 0.0 } else { length };
        // what the laws leave open keeps the value it had: densities of impulses are no values
        self.state.l.copy_from_slice(&multipliers);
        self.state.z.copy_from_slice(&before);
        self.take_stored(&after);
        let (settled, rest) = self.settle(&after, shortest)?;
        Ok(StateJump {
            first: once.z,
            part,
            after,
            impulses,
            length,
            span,
            multipliers,
            settled,
            rest,
        })
    }

    /// The largest charge and flux so far and at the end of a short step.
    fn scale_of_charges(&mut self, step: &Short) -> [f64; 2] {
        let charges = self.solver.stored_by_functions(self.state, &step.z);
        let [charge, flux] = self.solver.sys.largest(&[&charges]);
        [self.instants.largest[0].max(charge), self.instants.largest[1].max(flux)]
    }
}
