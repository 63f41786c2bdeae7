//! The end of one step: by the affine map or the factor of the present mode, else by the driver.

use super::failure::Outcome;
use super::matrices::Ends;
use super::solver::Solver;
use super::state::State;
use crate::mlcp::{Residual, Start};
use crate::rounding::OF_SOLUTION;
use crate::tolerances::ACCEPT;
use std::mem::take;

/// A mode earns its affine map at this many steps.
const USES_FOR_MAP: u32 = 3;
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

impl Solver {
    /// Finds the end of a step: by the affine map or factor of the mode, else by the driver.
    pub(in crate::integrate) fn step(&mut self, state: &mut State, length: f64) -> Outcome {
        let k = self.stage_index(state, length, false);
        if self.smooth.is_some() {
            return self.take_smooth(state, k, length);
        }
        let accepted = match self.quick(state, k) {
            Quick::Holds => self.approve(state, k),
            Quick::Nearly => self.approve_signs(state, k),
            Quick::Fails => false,
        };
        if accepted {
            self.stats.quick_steps += 1;
            let (z, guards) = self.scratch.x.split_at(state.z.len());
            state.z.copy_from_slice(z);
            multipliers(guards, &state.active, &mut state.l);
            return Ok(());
        }
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(&state.z, &state.u0, &state.u1, &mut self.scratch.rhs);
        self.solve(state, k, length, Start::Warm)?;
        let (base, u0, u1) =
            (take(&mut self.scratch.z_before), take(&mut state.u0), take(&mut state.u1));
        self.sharpen(state, k, &base, &u0, &u1);
        (self.scratch.z_before, state.u0, state.u1) = (base, u0, u1);
        Ok(())
    }

    /// Tries the present mode: leaves unknowns and guards in `x` and returns whether the guards hold.
    fn quick(&mut self, state: &State, k: usize) -> Quick {
        let n = state.z.len();
        let stage = &mut self.levels.stages[k];
        let (inputs, slot) = stage.inputs_and_slot(&state.active, state.epoch);
        if !slot.trusted {
            return Quick::Fails;
        }
        slot.uses += 1;
        self.scratch.recent = slot.uses <= NEW_MODE;
        if let Some(map) = &slot.map {
            self.scratch.input.clear();
            self.scratch.input.extend(inputs.carried.iter().map(|&j| state.z[j]));
            self.scratch.input.extend(inputs.ends.iter().map(|&j| state.u1[j]));
            self.scratch.input.extend(inputs.starts.iter().map(|&j| state.u0[j]));
            map.apply(&self.scratch.input, &mut self.scratch.x);
        } else {
            let due = slot.uses == USES_FOR_MAP;
            let factor = stage.factor(&state.active, state.epoch);
            if !factor.regular() {
                self.stats.undetermined += 1;
                return Quick::Fails; // consistency has to be checked: the driver's work
            }
            let ends = Ends { z0: &state.z, u0: &state.u0, u1: &state.u1 };
            let (x, work) = (&mut self.scratch.x, &mut self.scratch.work);
            stage.solve_mode(&self.sys, &state.active, state.epoch, ends, false, x, work);
            let matrices = &stage.matrices;
            matrices.guards(&mut self.scratch.x, &state.active, true, &mut self.scratch.w);
            if due {
                stage.make_map(&state.active, state.epoch, &mut self.scratch.work);
            }
        }
        // NaN fails the comparison and goes to the driver, which names the trouble
        let guards = &self.scratch.x[n..];
        if state.diodes.iter().all(|&i| guards[i] >= 0.0) {
            return Quick::Holds;
        }
        fault!("mode_kept_a_step" => if self.stats.steps.is_multiple_of(2) {
            return Quick::Holds;
        });
        fault!("quick_signs_1e-3" => {
            let most = guards.iter().fold(0.0f64, |a, g| a.max(g.abs()));
            if state.diodes.iter().all(|&i| guards[i] >= -1e-3 * most) {
                return Quick::Holds;
            }
        });
        let (epoch, length, until) = self.scratch.noise_known;
        let known = epoch == state.epoch && length == stage.length && self.stats.steps <= until;
        if known && state.diodes.iter().all(|&i| guards[i] >= -self.scratch.noise[i]) {
            return Quick::Holds;
        }
        // below what is accepted a look at the terms of each comes first, which costs less than the driver
        let largest = guards.iter().fold(0.0f64, |a, g| a.max(g.abs()));
        if state.diodes.iter().all(|&i| guards[i] >= -ACCEPT * largest) {
            return Quick::Nearly;
        }
        Quick::Fails
    }

    /// Checks the residual of a quick step, always while its mode is new and now and then later.
    /// A mode that misses it once (stiff circuits lose digits in it) is left to the driver, which
    /// refines.
    fn approve(&mut self, state: &State, k: usize) -> bool {
        if !self.scratch.recent && !self.stats.steps.is_multiple_of(CHECK) {
            return true;
        }
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(&state.z, &state.u0, &state.u1, &mut self.scratch.rhs);
        let found = self.residual_of_trial(state, k);
        let stage = &mut self.levels.stages[k];
        if found.worst() <= ACCEPT {
            let ends = Ends { z0: &state.z, u0: &state.u0, u1: &state.u1 };
            if stage.slot(&state.active, state.epoch).map.is_some()
                && stage.matrices.loses_charge(
                    ends,
                    &state.active,
                    &self.scratch.x,
                    &mut self.scratch.work,
                )
            {
                stage.slot(&state.active, state.epoch).map = None;
                return false;
            }
            self.note(found);
            return true;
        }
        stage.slot(&state.active, state.epoch).trusted = false;
        false
    }

    /// Applies the sign tests of the driver to guards that are negative by rounding at most: in a
    /// network at rest they are zero up to noise of either sign.
    fn approve_signs(&mut self, state: &State, k: usize) -> bool {
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(&state.z, &state.u0, &state.u1, &mut self.scratch.rhs);
        self.signs_hold(state, k)
    }

    /// The residual of `x`, unknowns and guards, in the present mode with the right-hand side `rhs`.
    fn residual_of_trial(&mut self, state: &State, k: usize) -> Residual {
        let scratch = &mut self.scratch;
        let (z, guards) = scratch.x.split_at(state.z.len());
        multipliers(guards, &state.active, &mut scratch.w);
        let driver = &mut self.levels.stages[k].driver;
        driver.residual(&scratch.rhs, &self.sys.linear.q, &state.roles, z, &scratch.w)
    }

    /// Whether `x` satisfies the laws of the present mode with the right-hand side `rhs`.
    pub(in crate::integrate) fn signs_hold(&mut self, state: &State, k: usize) -> bool {
        let found = self.residual_of_trial(state, k);
        let stage = &mut self.levels.stages[k];
        let guards = &self.scratch.x[state.z.len()..];
        stage.driver.sign_tolerances(&state.active, &mut self.scratch.noise);
        let sure = |&i: &usize| guards[i] >= -self.scratch.noise[i];
        if found.worst() > ACCEPT || !state.diodes.iter().all(sure) {
            return false;
        }
        self.scratch.noise_known = (state.epoch, stage.length, self.stats.steps + NOISE_LASTS);
        self.note(found);
        true
    }

    /// Solves the mode that the driver has found once more, for the increment from `base`: its own
    /// solution has the rounding errors of `K z`.  It is used where these do not show, and where the
    /// other does not satisfy all laws.
    pub(in crate::integrate) fn sharpen(
        &mut self,
        state: &mut State,
        k: usize,
        base: &[f64],
        u0: &[f64],
        u1: &[f64],
    ) {
        if self.smooth.is_some() || self.levels.stages[k].length.is_infinite() {
            return;
        }
        let n = state.z.len();
        self.scratch.x[..n].copy_from_slice(&state.z);
        self.scratch.x[n..].copy_from_slice(&state.l);
        let stage = &mut self.levels.stages[k];
        let factor = stage.factor(&state.active, state.epoch);
        let matrices = &stage.matrices;
        let ends = Ends { z0: base, u0, u1 };
        if !matrices.sharpen(
            &factor,
            &state.active,
            ends,
            &mut self.scratch.x,
            &mut self.scratch.work,
        ) || self.sys.apart(&state.z, &self.scratch.x, base) <= OF_SOLUTION
        {
            return;
        }
        matrices.guards(&mut self.scratch.x, &state.active, true, &mut self.scratch.w);
        if self.signs_hold(state, k) {
            let (z, guards) = self.scratch.x.split_at(state.z.len());
            state.z.copy_from_slice(z);
            multipliers(guards, &state.active, &mut state.l);
        }
    }
}

/// Multipliers from guards: those of inactive pairs vanish.
pub(in crate::integrate) fn multipliers(guards: &[f64], active: &[bool], l: &mut [f64]) {
    for ((l, &guard), &active) in l.iter_mut().zip(guards).zip(active) {
        *l = if active { guard } else { 0.0 };
    }
}
