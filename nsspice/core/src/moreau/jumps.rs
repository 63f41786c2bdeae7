//! Jumps of charges and fluxes: the impulsive step, and what switches do at one instant.

use super::stepper::{Outcome, Plan, Stepper, MAX_REACTIONS};
use crate::mlcp::Start;

/// Length of an impulsive step relative to the nominal step: short enough that nothing but the jump
/// happens in it, long enough that `E/h` does not drown `G`.
const JUMP: f64 = 1e-9;
/// Length of the step that shows the values right after a jump.
const AFTER_JUMP: f64 = 1e-4;
/// Jumps kept in full; later ones are only counted.
const MAX_JUMPS: usize = 4096;

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
}

impl Stepper {
    /// A jump at the present time; where the impulsive problem has no solution the next ordinary
    /// step has to resolve it.
    pub(super) fn impulse_or_leave(&mut self) -> Outcome {
        let (z, l) = (self.z.clone(), self.l.clone());
        if self.impulse(None, Start::Warm).is_err() {
            self.z = z;
            self.l = l;
        }
        Ok(())
    }

    /// The implicit impulsive step: charges and fluxes jump so that all laws hold again.
    ///
    /// The first, very short step moves the stored quantities; a second, longer one from the same
    /// stored quantities gives the finite values of currents and voltages right after the jump.
    pub(super) fn impulse(&mut self, charges: Option<&[f64]>, start: Start) -> Outcome {
        let before = self.z.clone();
        let delta = JUMP * self.step_length;
        let k = self.stage_index(delta, true);
        self.load_charges(k, charges, delta);
        self.solve(k, delta, start)?;
        let after = self.z.clone();
        let multipliers: Vec<f64> = self.l.iter().map(|v| v * delta).collect();
        if self.jumped(charges, &before, &after) {
            self.stats.jumps += 1;
            if self.jumps.len() < MAX_JUMPS {
                let unknowns = after.iter().map(|v| v * delta).collect();
                let after = after.clone();
                self.jumps.push(Jump { time: self.time, before, after, multipliers, unknowns });
            }
        }
        let short = AFTER_JUMP * self.step_length;
        let k = self.stage_index(short, true);
        self.load_charges(k, None, short);
        if self.solve(k, short, Start::Warm).is_ok() {
            if self.outputs.needs_rates() {
                for (rate, (new, old)) in self.rates.iter_mut().zip(self.z.iter().zip(&after)) {
                    *rate = (new - old) / short;
                }
            }
            for &j in &self.stages[k].inputs.carried {
                self.z[j] = after[j];
            }
        } else {
            self.z.copy_from_slice(&after);
        }
        Ok(())
    }

    /// Right-hand side of an impulsive step of length `delta`.
    fn load_charges(&mut self, k: usize, charges: Option<&[f64]>, delta: f64) {
        let matrices = &self.stages[k].matrices;
        match charges {
            Some(charges) => {
                self.rhs.fill(0.0);
                for (r, c) in self.rhs.iter_mut().zip(charges) {
                    *r = c / delta;
                }
                matrices.source_end.mul_add(1.0, &self.u0, &mut self.rhs);
            }
            None => matrices.right_hand_side(&self.z, &self.u0, &self.u0, &mut self.rhs),
        }
    }

    /// Did stored charges or fluxes change by more than a step of length `JUMP h` explains?
    fn jumped(&mut self, charges: Option<&[f64]>, before: &[f64], after: &[f64]) -> bool {
        let n = before.len();
        let mut old = vec![0.0; n];
        match charges {
            Some(charges) => old.copy_from_slice(charges),
            None => self.sys.e.mul_add(1.0, before, &mut old),
        }
        self.ends.fill(0.0);
        self.sys.e.mul_add(1.0, after, &mut self.ends);
        for kind in 0..2u8 {
            let rows = || (0..n).filter(|&i| self.sys.row_kind[i] == kind);
            let size = rows().map(|i| old[i].abs().max(self.ends[i].abs())).fold(0.0, f64::max);
            if rows().any(|i| (self.ends[i] - old[i]).abs() > 1e-6 * size) {
                return true;
            }
        }
        false
    }

    /// Applies the switch laws until they agree with the state.
    pub(super) fn settle_switches(&mut self) -> Outcome {
        for _ in 0..MAX_REACTIONS {
            if !self.react() {
                return Ok(());
            }
            if self.static_system || matches!(self.plan, Plan::Points { .. }) {
                self.u1.copy_from_slice(&self.u0);
                self.solve_static(Start::Warm)?;
            } else {
                self.impulse_or_leave()?;
            }
        }
        self.stats.chatter += 1;
        Ok(())
    }
}
