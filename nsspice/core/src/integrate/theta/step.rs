//! One step: by the affine map or the factor of the present mode, else by the driver.

use super::events::impacts::Cut;
use super::failure::{Best, Failure, Outcome};
use super::matrices::Ends;
use super::outputs::Quantities;
use super::step_length::Stage;
use super::stepper::{Large, Stepper};
use super::time_grid::{evaluate, Target};
use crate::mlcp::{Residual, Start};
use crate::rounding::OF_SOLUTION;
use crate::tolerances::ACCEPT;
use crate::waveform::Side;
use std::mem::take;

/// A mode earns its affine map at this many steps.
const USES_FOR_MAP: u32 = 3;
/// Lengths of ordinary steps whose matrices are kept, and of those that show what follows a jump (up to twenty,
/// the same at each event): as many as this memory holds [numbers], within these bounds.
const BUDGET: usize = 4_000_000;
const FEWEST: [usize; 2] = [12, 24];
const MOST: usize = 96;
/// Numbers that a length takes for each unknown and pair, roughly: matrices, rows and a factor.
const EACH: usize = 200;
/// Steps between two checks of the residual of quick steps, and how many are checked at first.
const CHECK: u64 = 64;
const NEW_MODE: u32 = 4;

/// Steps for which the sizes of rounding errors serve before they are computed again.
const NOISE_LASTS: u64 = 16;

/// How a mode went through a step.
enum Quick {
    /// all guards are positive
    Holds,
    /// some are negative, by so little that it may be rounding
    Nearly,
    /// the driver has to find the mode
    Fails,
}

/// What is known at the begin of a step.
struct Begun {
    /// a record of it is wanted
    wanted: bool,
    /// problems solved and changes of mode so far
    problems: u64,
    epoch: u64,
}

impl Stepper {
    /// Steps to a target, or to an impact before it: then returns where the step has ended.
    pub(in crate::integrate) fn step(
        &mut self,
        target: &Target,
    ) -> Result<Option<Target>, Box<Failure>> {
        let mut reached = None;
        self.state.time = target.time;
        self.recorder.two_sided = false;
        if self.facts.static_system || self.schedule.sweeping {
            if target.jump && self.shows_sides() {
                evaluate(&self.waveforms, target.time, Side::Left, &mut self.state.u0);
                self.state.u1.copy_from_slice(&self.state.u0);
                self.take(f64::INFINITY)?;
                self.write_left(target.label);
                self.recorder.two_sided = true;
            }
            evaluate(&self.waveforms, target.time, Side::Right, &mut self.state.u0);
            self.state.u1.copy_from_slice(&self.state.u0);
            if let Err(failure) = self.take(f64::INFINITY) {
                self.search(failure, |s| s.solve_static(Start::Cold))?;
            }
        } else {
            evaluate(&self.waveforms, target.time, Side::Left, &mut self.state.u1);
            let cut = self.take_to(target)?;
            self.instants.stale = false;
            if (target.jump || cut.is_some()) && self.shows_sides() {
                self.write_left(cut.as_ref().map_or(target.label, |c| c.target.label));
                self.recorder.two_sided = true;
            }
            if let Some(cut) = cut {
                self.state.u0.copy_from_slice(&self.state.u1);
                let before = self.state.z.clone();
                self.enter(None, before.clone(), cut.state_jump);
                if let Some(sums) = &mut self.recorder.sums {
                    sums.jump(&before, &self.state.z);
                }
                reached = Some(cut.target);
            } else if target.jump {
                evaluate(&self.waveforms, target.time, Side::Right, &mut self.state.u0);
                self.throw_by_sources();
                self.impulse_or_leave()?;
            } else {
                self.state.u0.copy_from_slice(&self.state.u1);
            }
        }
        if !self.switching.switches.is_empty() {
            self.look_for_rest();
            let changed = self.react();
            let dynamic = !self.facts.static_system && !self.schedule.sweeping;
            if dynamic {
                self.switching.still.fill(false); // what the switches do takes no time
            }
            if changed && dynamic && !self.recorder.two_sided && self.shows_sides() {
                self.write_left(reached.map_or(target.label, |r| r.label));
                self.recorder.two_sided = true;
            }
            self.settle_after(changed)?;
            if changed && !dynamic && self.recorder.samples.watches() {
                self.recorder.z_recorded.copy_from_slice(&self.state.z);
                self.record(f64::INFINITY);
            }
            self.note_controls();
        }
        Ok(reached)
    }

    /// True if rows on both sides of a jump are wanted.
    fn shows_sides(&self) -> bool {
        self.recorder.samples.keep_sides || self.recorder.all_points.is_finite()
    }

    /// The row before a possible jump, with the sources before it.
    pub(in crate::integrate) fn write_left(&mut self, label: f64) {
        self.recorder.left[0] = label;
        let f = self.smooth.as_ref().map_or([&[][..]; 2], |s| [&s.f, &s.rates]);
        let quantities = Quantities {
            z: &self.state.z,
            l: &self.state.l,
            rates: &self.recorder.rates,
            u: &self.state.u1,
            f,
        };
        self.recorder.outputs.write(&quantities, &mut self.recorder.left[1..]);
    }

    /// One ordinary step of the given length from (z, u0) with sources u1 at its end.
    fn take(&mut self, length: f64) -> Outcome {
        let begun = self.begin_step();
        self.solve_step(length)?;
        self.end_step(begun, length);
        Ok(())
    }

    /// One ordinary step to a target, or to an impact before it.
    fn take_to(&mut self, target: &Target) -> Result<Option<Cut>, Box<Failure>> {
        let begun = self.begin_step();
        self.instants.impacts.begin(&self.state.active);
        self.solve_step(target.length)?;
        let cut = if self.state.epoch == begun.epoch { None } else { self.cut_at_impact(target) };
        self.end_step(begun, cut.as_ref().map_or(target.length, |c| c.target.length));
        Ok(cut)
    }

    /// Keeps the state if it is asked for at the end of the step.
    fn begin_step(&mut self) -> Begun {
        self.stats.steps += 1;
        let wanted = self.recorder.samples.wants(self.state.epoch);
        if wanted || self.recorder.sums.as_ref().is_some_and(|s| s.asks_for_begin()) {
            self.scratch.z_before.copy_from_slice(&self.state.z);
        }
        Begun { wanted, problems: self.stats.problems, epoch: self.state.epoch }
    }

    fn end_step(&mut self, begun: Begun, length: f64) {
        // a mode that changed within the step was found by the driver, which keeps the old state
        if begun.wanted || self.recorder.samples.changed(self.state.epoch) {
            self.recorder.z_recorded.copy_from_slice(&self.scratch.z_before);
            self.record(length);
        }
        if length.is_finite() {
            let new = self.stats.problems > begun.problems || self.state.epoch != begun.epoch;
            self.sum_up(length, new);
        }
    }

    /// Adds an implicit step from `z_before`, u0 to z, u1 to the balance of energy.
    pub(in crate::integrate) fn sum_up(&mut self, length: f64, new: bool) {
        let Some(sums) = &mut self.recorder.sums else { return };
        let f = self.smooth.as_ref().map_or([&[][..]; 2], |s| [&s.f, &s.rates]);
        let (sides, sources) =
            ([&self.scratch.z_before[..], &self.state.z], [&self.state.u0[..], &self.state.u1]);
        sums.step(length, sides, &self.state.l, sources, f, new);
    }

    /// Finds the end of a step: by the affine map or factor of the mode, else by the driver.
    pub(in crate::integrate) fn solve_step(&mut self, length: f64) -> Outcome {
        let k = self.stage_index(length, false);
        if self.smooth.is_some() {
            return self.take_smooth(k, length);
        }
        let accepted = match self.quick(k) {
            Quick::Holds => self.approve(k),
            Quick::Nearly => self.approve_signs(k),
            Quick::Fails => false,
        };
        if accepted {
            self.stats.quick_steps += 1;
            self.keep_for_rates();
            let (z, guards) = self.scratch.x.split_at(self.state.z.len());
            self.state.z.copy_from_slice(z);
            multipliers(guards, &self.state.active, &mut self.state.l);
        } else {
            let matrices = &self.levels.stages[k].matrices;
            matrices.right_hand_side(
                &self.state.z,
                &self.state.u0,
                &self.state.u1,
                &mut self.scratch.rhs,
            );
            self.keep_for_rates();
            self.solve(k, length, Start::Warm)?;
            let (base, u0, u1) = (
                take(&mut self.scratch.z_before),
                take(&mut self.state.u0),
                take(&mut self.state.u1),
            );
            self.sharpen(k, &base, &u0, &u1);
            (self.scratch.z_before, self.state.u0, self.state.u1) = (base, u0, u1);
        }
        self.finish_rates(length);
        Ok(())
    }

    /// Hands the step to the samples: from `z_recorded` and u0 to z and u1.
    pub(in crate::integrate) fn record(&mut self, length: f64) {
        let roles = if self.switching.switches.is_empty() { &[] } else { &self.state.roles[..] };
        self.recorder.samples.records.push(
            self.state.time,
            length,
            &self.recorder.z_recorded,
            &self.state.z,
            &self.state.l,
            &self.state.u0,
            &self.state.u1,
            roles.iter().map(|&r| r as u8),
        );
    }

    /// Checks the residual of a quick step, always while its mode is new and now and then later.
    /// A mode that misses it once (stiff circuits lose digits in it) is left to the driver, which
    /// refines.
    fn approve(&mut self, k: usize) -> bool {
        if !self.scratch.recent && !self.stats.steps.is_multiple_of(CHECK) {
            return true;
        }
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(
            &self.state.z,
            &self.state.u0,
            &self.state.u1,
            &mut self.scratch.rhs,
        );
        let found = self.residual_of_trial(k);
        let stage = &mut self.levels.stages[k];
        if found.worst() <= ACCEPT {
            let ends = Ends { z0: &self.state.z, u0: &self.state.u0, u1: &self.state.u1 };
            if stage.slot(&self.state.active, self.state.epoch).map.is_some()
                && stage.matrices.loses_charge(
                    ends,
                    &self.state.active,
                    &self.scratch.x,
                    &mut self.scratch.work,
                )
            {
                stage.slot(&self.state.active, self.state.epoch).map = None;
                return false;
            }
            self.note(found);
            return true;
        }
        stage.slot(&self.state.active, self.state.epoch).trusted = false;
        false
    }

    /// Solves the mode that the driver has found once more, for the increment from `base`: its own
    /// solution has the rounding errors of `K z`.  It stands where these do not show, and where the
    /// other does not satisfy all laws.
    pub(in crate::integrate) fn sharpen(&mut self, k: usize, base: &[f64], u0: &[f64], u1: &[f64]) {
        if self.smooth.is_some() || self.levels.stages[k].length.is_infinite() {
            return;
        }
        let n = self.state.z.len();
        self.scratch.x[..n].copy_from_slice(&self.state.z);
        self.scratch.x[n..].copy_from_slice(&self.state.l);
        let stage = &mut self.levels.stages[k];
        let factor = stage.factor(&self.state.active, self.state.epoch);
        let matrices = &stage.matrices;
        let ends = Ends { z0: base, u0, u1 };
        if !matrices.sharpen(
            &factor,
            &self.state.active,
            ends,
            &mut self.scratch.x,
            &mut self.scratch.work,
        ) || self.sys.apart(&self.state.z, &self.scratch.x, base) <= OF_SOLUTION
        {
            return;
        }
        matrices.guards(&mut self.scratch.x, &self.state.active, true, &mut self.scratch.w);
        if self.signs_hold(k) {
            let (z, guards) = self.scratch.x.split_at(self.state.z.len());
            self.state.z.copy_from_slice(z);
            multipliers(guards, &self.state.active, &mut self.state.l);
        }
    }

    /// Applies the sign tests of the driver to guards that are negative by rounding at most: in a
    /// network at rest they are zero up to noise of either sign.
    fn approve_signs(&mut self, k: usize) -> bool {
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(
            &self.state.z,
            &self.state.u0,
            &self.state.u1,
            &mut self.scratch.rhs,
        );
        self.signs_hold(k)
    }

    /// The residual of `x`, unknowns and guards, in the present mode with the right-hand side `rhs`.
    fn residual_of_trial(&mut self, k: usize) -> Residual {
        let scratch = &mut self.scratch;
        let (z, guards) = scratch.x.split_at(self.state.z.len());
        multipliers(guards, &self.state.active, &mut scratch.w);
        let driver = &mut self.levels.stages[k].driver;
        driver.residual(&scratch.rhs, &self.sys.linear.q, &self.state.roles, z, &scratch.w)
    }

    /// Whether `x` satisfies the laws of the present mode with the right-hand side `rhs`.
    pub(in crate::integrate) fn signs_hold(&mut self, k: usize) -> bool {
        let found = self.residual_of_trial(k);
        let stage = &mut self.levels.stages[k];
        let guards = &self.scratch.x[self.state.z.len()..];
        stage.driver.sign_tolerances(&self.state.active, &mut self.scratch.noise);
        let sure = |&i: &usize| guards[i] >= -self.scratch.noise[i];
        if found.worst() > ACCEPT || !self.switching.diodes.iter().all(sure) {
            return false;
        }
        self.scratch.noise_known = (self.state.epoch, stage.length, self.stats.steps + NOISE_LASTS);
        self.note(found);
        true
    }

    /// Tries the present mode: leaves unknowns and guards in `x` and tells whether the guards hold.
    fn quick(&mut self, k: usize) -> Quick {
        let n = self.state.z.len();
        let stage = &mut self.levels.stages[k];
        let (inputs, slot) = stage.inputs_and_slot(&self.state.active, self.state.epoch);
        if !slot.trusted {
            return Quick::Fails;
        }
        slot.uses += 1;
        self.scratch.recent = slot.uses <= NEW_MODE;
        if let Some(map) = &slot.map {
            self.scratch.input.clear();
            self.scratch.input.extend(inputs.carried.iter().map(|&j| self.state.z[j]));
            self.scratch.input.extend(inputs.ends.iter().map(|&j| self.state.u1[j]));
            self.scratch.input.extend(inputs.starts.iter().map(|&j| self.state.u0[j]));
            map.apply(&self.scratch.input, &mut self.scratch.x);
        } else {
            let due = slot.uses == USES_FOR_MAP;
            let factor = stage.factor(&self.state.active, self.state.epoch);
            if !factor.regular() {
                self.stats.undetermined += 1;
                return Quick::Fails; // consistency has to be checked: the driver's work
            }
            let ends = Ends { z0: &self.state.z, u0: &self.state.u0, u1: &self.state.u1 };
            let (x, work) = (&mut self.scratch.x, &mut self.scratch.work);
            stage.solve_mode(&self.sys, &self.state.active, self.state.epoch, ends, false, x, work);
            let matrices = &stage.matrices;
            matrices.guards(&mut self.scratch.x, &self.state.active, true, &mut self.scratch.w);
            if due {
                stage.make_map(&self.state.active, self.state.epoch, &mut self.scratch.work);
            }
        }
        // NaN fails the comparison and goes to the driver, which names the trouble
        let guards = &self.scratch.x[n..];
        if self.switching.diodes.iter().all(|&i| guards[i] >= 0.0) {
            return Quick::Holds;
        }
        let (epoch, length, until) = self.scratch.noise_known;
        let known =
            epoch == self.state.epoch && length == stage.length && self.stats.steps <= until;
        if known && self.switching.diodes.iter().all(|&i| guards[i] >= -self.scratch.noise[i]) {
            return Quick::Holds;
        }
        // below what is accepted a look at the terms of each comes first, which costs less than the driver
        let largest = guards.iter().fold(0.0f64, |a, g| a.max(g.abs()));
        if self.switching.diodes.iter().all(|&i| guards[i] >= -ACCEPT * largest) {
            return Quick::Nearly;
        }
        Quick::Fails
    }

    /// Solves the complementarity problem with right-hand side `rhs` at stage `k`.
    pub(in crate::integrate) fn solve(&mut self, k: usize, length: f64, start: Start) -> Outcome {
        self.stats.problems += 1;
        self.scratch.z_before.copy_from_slice(&self.state.z);
        self.scratch.l_before.copy_from_slice(&self.state.l);
        if self.smooth.is_some() {
            return self.solve_smooth(length, start);
        }
        let stage = &mut self.levels.stages[k];
        stage.release();
        let solved = stage.driver.solve(
            &self.scratch.rhs,
            &self.sys.linear.q,
            &self.state.roles,
            &mut self.state.z,
            &mut self.state.l,
            start,
        );
        let (residual, suspect) = match solved {
            // the way to a very short step is by longer ones, where nothing hides; flaws that
            // remain need a proof that they are no conflict
            Ok(solved)
                if solved.flawed
                    && stage.impulsive
                    && matches!(self.refusal.large, Large::Refused) =>
            {
                (solved.residual.worst(), true)
            }
            Ok(solved) => {
                self.stats.worst_stage = self.stats.worst_stage.max(solved.stage);
                let found = stage.driver.active();
                let known = match self.refusal.large {
                    Large::Refused => false,
                    Large::Awaited => true,
                    Large::Mode(epoch) => epoch == self.state.epoch && found == self.state.active,
                };
                if !solved.needs_certificate || known {
                    if found != self.state.active {
                        self.state.active.copy_from_slice(found);
                        self.state.epoch += 1;
                        self.stats.mode_changes += 1;
                    }
                    if solved.needs_certificate {
                        self.refusal.large = Large::Mode(self.state.epoch);
                    }
                    self.note(solved.residual);
                    return Ok(());
                }
                (solved.residual.worst(), true)
            }
            Err(unsolved) => (unsolved.residual.worst(), false),
        };
        self.state.z.copy_from_slice(&self.scratch.z_before);
        self.state.l.copy_from_slice(&self.scratch.l_before);
        Err(self.failed(length, residual, suspect, None))
    }

    /// A failure with what a certificate needs.
    pub(in crate::integrate) fn failed(
        &self,
        length: f64,
        residual: f64,
        suspect: bool,
        best: Option<Box<Best>>,
    ) -> Box<Failure> {
        Box::new(Failure {
            time: self.state.time,
            length,
            rhs: self.scratch.rhs.clone(),
            roles: self.state.roles.iter().map(|&r| r as u8).collect(),
            residual,
            suspect,
            best,
            restless: None,
        })
    }

    /// A switch has found no state.
    pub(in crate::integrate) fn unsettled(&self) -> Box<Failure> {
        let pair = self.switching.last_thrown.map(|k| self.switching.switches[k].pair);
        Box::new(Failure::restless(self.state.time, pair))
    }

    pub(in crate::integrate) fn solve_static(&mut self, start: Start) -> Outcome {
        let k = self.stage_index(f64::INFINITY, false);
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(
            &self.state.z,
            &self.state.u0,
            &self.state.u1,
            &mut self.scratch.rhs,
        );
        self.solve(k, f64::INFINITY, start)?;
        Ok(())
    }

    pub(in crate::integrate) fn keep_for_rates(&mut self) {
        if self.recorder.outputs.needs_rates() {
            self.recorder.rates.copy_from_slice(&self.state.z);
        }
    }

    pub(in crate::integrate) fn finish_rates(&mut self, length: f64) {
        if self.recorder.outputs.needs_rates() {
            for (rate, z) in self.recorder.rates.iter_mut().zip(&self.state.z) {
                *rate = (z - *rate) / length;
            }
        }
    }

    pub(in crate::integrate) fn note(&mut self, residual: Residual) {
        self.stats.checks += 1;
        let s = &mut self.stats;
        s.residual_rows = s.residual_rows.max(residual.rows);
        s.residual_complementarity = s.residual_complementarity.max(residual.complementarity);
    }

    /// The stage for a step length; lengths equal up to rounding share one.
    pub(in crate::integrate) fn stage_index(&mut self, length: f64, impulsive: bool) -> usize {
        self.levels.stamp += 1;
        let stamp = self.levels.stamp;
        let same = |s: &Stage| {
            s.impulsive == impulsive
                && (s.length == length || (s.length - length).abs() <= 1e-9 * length)
        };
        // most steps are like the last one
        let last = self.levels.last_stage;
        if self
            .levels
            .stages
            .get(last)
            .is_some_and(|s| s.length == length && s.impulsive == impulsive)
        {
            self.levels.stages[last].stamp = stamp;
            return last;
        }
        if let Some(k) = self.levels.stages.iter().position(same) {
            self.levels.stages[k].stamp = stamp;
            self.levels.last_stage = k;
            return k;
        }
        let alike = |k: &usize| self.levels.stages[*k].impulsive == impulsive;
        let kept = (0..self.levels.stages.len()).filter(alike);
        let size = self.state.z.len() + self.state.l.len();
        let most = (BUDGET / (EACH * size + 1)).clamp(FEWEST[usize::from(impulsive)], MOST);
        if kept.clone().count() >= most {
            let oldest = kept.min_by_key(|&k| self.levels.stages[k].stamp).unwrap_or(0);
            self.levels.stages.swap_remove(oldest);
        }
        let mut stage = Stage::new(&self.sys, length, impulsive, &self.facts.constants);
        stage.stamp = stamp;
        self.levels.stages.push(stage);
        self.levels.stages.len() - 1
    }
}

/// Multipliers from guards: those of inactive pairs vanish.
pub(in crate::integrate) fn multipliers(guards: &[f64], active: &[bool], l: &mut [f64]) {
    for ((l, &guard), &active) in l.iter_mut().zip(guards).zip(active) {
        *l = if active { guard } else { 0.0 };
    }
}
