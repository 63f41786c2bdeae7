//! Jumps of charges and fluxes: the impulsive step, and what switches do at one instant.

use super::stage::System;
use super::stepper::{Outcome, Stepper, MAX_REACTIONS};
use crate::mlcp::Start;

/// Length of an impulsive step relative to the nominal step and to the fastest time constant: short
/// enough that nothing but the jump happens in it, long enough that `E/h` does not drown `G`.
const JUMP: f64 = 1e-7;
/// Length of the step that shows the values right after a jump.
const AFTER_JUMP: f64 = 1e-4;
/// Changes below this part of the largest charge (or flux) so far are no jump.
const NO_JUMP: f64 = 1e-9;
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

/// An estimate of the fastest time constant [s]: largest rate at which stored quantities act on each
/// other, directly or through one algebraic unknown, in coordinates with unit storage.
pub(super) fn fastest_time(sys: &System) -> f64 {
    let n = sys.g.nrows;
    let mut storage = vec![0.0; n];
    let mut diagonal = vec![0.0; n];
    for (matrix, out) in [(&sys.e, &mut storage), (&sys.g, &mut diagonal)] {
        for (_, c, v) in matrix.iter().filter(|e| e.0 == e.1) {
            out[c] = v.abs().sqrt();
        }
    }
    // strongest coupling of each algebraic unknown to stored quantities, as row and as column
    let (mut into, mut from) = (vec![0.0f64; n], vec![0.0f64; n]);
    let mut rate = 0.0f64;
    for (r, c, v) in sys.g.iter() {
        match (storage[r] > 0.0, storage[c] > 0.0) {
            (true, true) => rate = rate.max(v.abs() / (storage[r] * storage[c])),
            (false, true) if diagonal[r] > 0.0 => {
                into[r] = into[r].max(v.abs() / (diagonal[r] * storage[c]));
            }
            (true, false) if diagonal[c] > 0.0 => {
                from[c] = from[c].max(v.abs() / (storage[r] * diagonal[c]));
            }
            _ => {}
        }
    }
    rate = into.iter().zip(&from).map(|(a, b)| a * b).fold(rate, f64::max);
    1.0 / rate // infinite if nothing couples
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
    /// Two very short steps of length d and 2d from the same charges, extrapolated to d = 0, move
    /// the stored quantities; a third, longer one from there gives the finite values of currents
    /// and voltages right after the jump.
    pub(super) fn impulse(&mut self, charges: Option<&[f64]>, start: Start) -> Outcome {
        let shortest = self.step_length.min(self.fastest);
        let before = self.z.clone();
        self.short_step(charges, &before, JUMP * shortest, start)?;
        let (first, mut lasting) = (self.z.clone(), self.l.clone());
        let mut after = first.clone();
        let mut unknowns: Vec<f64> = after.iter().map(|v| v * JUMP * shortest).collect();
        lasting.iter_mut().for_each(|v| *v *= JUMP * shortest);
        let twice = 2.0 * JUMP * shortest;
        if self.short_step(charges, &before, twice, Start::Warm).is_ok() {
            for (once, &two) in after.iter_mut().zip(&self.z) {
                *once = 2.0 * *once - two;
            }
            for (once, &two) in unknowns.iter_mut().zip(&self.z) {
                *once = 2.0 * *once - two * twice;
            }
            for (once, &two) in lasting.iter_mut().zip(&self.l) {
                *once = 2.0 * *once - two * twice;
            }
        }
        if self.jumped(charges, &before, &first, &after) {
            self.stats.jumps += 1;
            if self.jumps.len() < MAX_JUMPS {
                let (after, multipliers) = (after.clone(), lasting);
                self.jumps.push(Jump { time: self.time, before, after, multipliers, unknowns });
            }
        }
        let settle = AFTER_JUMP * shortest;
        if self.short_step(None, &after, settle, Start::Warm).is_err() {
            self.z.copy_from_slice(&after);
            return Ok(());
        }
        if self.outputs.needs_rates() {
            for (rate, (new, old)) in self.rates.iter_mut().zip(self.z.iter().zip(&after)) {
                *rate = (new - old) / settle;
            }
        }
        let k = self.stage_index(settle, true);
        for &j in &self.stages[k].inputs.carried {
            self.z[j] = after[j];
        }
        Ok(())
    }

    /// One theta = 1 step of length `delta` from the given charges, or from those of `before`.
    fn short_step(
        &mut self,
        charges: Option<&[f64]>,
        before: &[f64],
        delta: f64,
        start: Start,
    ) -> Outcome {
        let k = self.stage_index(delta, true);
        let matrices = &self.stages[k].matrices;
        match charges {
            Some(charges) => {
                for (r, c) in self.rhs.iter_mut().zip(charges) {
                    *r = c / delta;
                }
                matrices.source_end.mul_add(1.0, &self.u0, &mut self.rhs);
            }
            None => matrices.right_hand_side(before, &self.u0, &self.u0, &mut self.rhs),
        }
        self.solve(k, delta, start)
    }

    /// Did stored charges or fluxes jump?  A change that extrapolation to length 0 takes away was
    /// not a jump but the ordinary motion during the short step.
    fn jumped(
        &mut self,
        charges: Option<&[f64]>,
        before: &[f64],
        first: &[f64],
        after: &[f64],
    ) -> bool {
        let n = before.len();
        let stored = |z: &[f64]| {
            let mut out = vec![0.0; n];
            self.sys.e.mul_add(1.0, z, &mut out);
            out
        };
        let old = charges.map_or_else(|| stored(before), <[f64]>::to_vec);
        let (once, new) = (stored(first), stored(after));
        let mut found = false;
        for kind in 0..2u8 {
            let rows = || (0..n).filter(|&i| self.sys.row_kind[i] == kind);
            let size = rows().map(|i| old[i].abs().max(new[i].abs())).fold(0.0, f64::max);
            // against the largest so far: a flux that has just decayed to rounding does not jump
            let largest = &mut self.largest[usize::from(kind)];
            *largest = largest.max(size);
            found |= rows().any(|i| {
                let change = (new[i] - old[i]).abs();
                change > NO_JUMP * *largest && change > 0.1 * (once[i] - old[i]).abs()
            });
        }
        found
    }

    /// Applies the switch laws until they agree with the state.
    pub(super) fn settle_switches(&mut self) -> Outcome {
        for _ in 0..MAX_REACTIONS {
            if !self.react() {
                return Ok(());
            }
            if self.static_system || self.sweeping {
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
