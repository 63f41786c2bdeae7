//! Steps so short that nothing but a jump happens in them, and what is stored at their ends.

use super::jumps::{DESCENT, LOOSE};
use crate::integrate::implicit::failure::{Failure, Outcome};
use crate::integrate::implicit::solver::Solver;
use crate::integrate::implicit::state::State;
use crate::mlcp::Start;

/// Solution of a short step.
#[derive(Clone)]
pub(in crate::integrate) struct Short {
    pub z: Vec<f64>,
    pub l: Vec<f64>,
    pub length: f64,
}

impl Short {
    fn ending_at(state: &State, length: f64) -> Short {
        Short { z: state.z.clone(), l: state.l.clone(), length }
    }
}

impl Solver {
    /// Charges and fluxes of a state.
    pub(in crate::integrate) fn stored_at(&mut self, state: &State, z: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        self.store_at(state, z, &mut out);
        out
    }

    /// Charges and fluxes of a state, into `out`.
    pub(in crate::integrate) fn store_at(&mut self, state: &State, z: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.resize(z.len(), 0.0);
        self.sys.linear.e.mul_add(1.0, z, out);
        if let Some(smooth) = &mut self.smooth {
            smooth.add_stored_at(z, &state.u0, state.time, 1.0, out);
        }
    }

    /// One theta = 1 step of length `delta` from the given charges, or from those of `before`.
    pub(in crate::integrate) fn short_step(
        &mut self,
        state: &mut State,
        charges: Option<&[f64]>,
        before: &[f64],
        delta: f64,
        start: Start,
    ) -> Outcome {
        let Some(charges) = charges else {
            let functions =
                if self.functions_store() { self.functions_at(state, before) } else { Vec::new() };
            return self.step_from(state, before, &functions, delta, start);
        };
        let k = self.stage_index(state, delta, true);
        self.scratch.rhs.iter_mut().zip(charges).for_each(|(r, c)| *r = c / delta);
        self.levels.stages[k].matrices.source_end.mul_add(1.0, &state.u0, &mut self.scratch.rhs);
        if self.smooth.is_some() {
            state.u1.copy_from_slice(&state.u0);
        }
        self.solve(state, k, delta, start)
    }

    /// One theta = 1 step of length `delta` from the charges of `before`, and of these values of smooth functions.
    pub(in crate::integrate) fn step_from(
        &mut self,
        state: &mut State,
        before: &[f64],
        functions: &[f64],
        delta: f64,
        start: Start,
    ) -> Outcome {
        let k = self.stage_index(state, delta, true);
        let matrices = &self.levels.stages[k].matrices;
        if let Some(smooth) = &mut self.smooth {
            smooth.set_out(matrices, before, [&state.u0, &state.u0], &mut self.scratch.rhs);
            if smooth.newton.stores() {
                smooth.newton.carry_functions(functions);
            }
            state.u1.copy_from_slice(&state.u0);
        } else {
            matrices.right_hand_side(before, &state.u0, &state.u0, &mut self.scratch.rhs);
        }
        self.solve(state, k, delta, start)
            .map_err(|failure| self.with_charges(k, before, failure))?;
        let u = std::mem::take(&mut state.u0);
        self.sharpen(state, k, before, &u, &u);
        state.u0 = u;
        Ok(())
    }

    /// Steps of length `2 length` and `length` from the same charges; the longer one is left out
    /// if the two end in modes of different values.  Where so short a step is too hard, the shortest one
    /// that could be solved stands for both; an ordinary step has the length `ordinary`.
    pub(in crate::integrate) fn two_steps(
        &mut self,
        state: &mut State,
        charges: Option<&[f64]>,
        before: &[f64],
        [length, ordinary]: [f64; 2],
        start: Start,
    ) -> Result<(Short, Option<Short>), Box<Failure>> {
        let reached = self.approach(state, charges, before, [2.0 * length, ordinary], start)?;
        let twice = Short::ending_at(state, reached);
        let (epoch, active) = (state.epoch, state.active.clone());
        if reached > 2.0 * length
            || self.short_step(state, charges, before, length, Start::Warm).is_err()
        {
            return Ok((twice, None));
        }
        let once = Short::ending_at(state, length);
        let alike = state.epoch == epoch || {
            let ends = [(&twice, &active[..]), (&once, &state.active)];
            ends.iter().all(|(end, on)| self.without_voltage(state, end, on, &active))
        };
        Ok((once, alike.then_some(twice)))
    }

    /// Solves a short step, if necessary from an ordinary one down by steps of ever smaller length,
    /// each starting from the last; returns the length that was reached.
    fn approach(
        &mut self,
        state: &mut State,
        charges: Option<&[f64]>,
        before: &[f64],
        [target, ordinary]: [f64; 2],
        start: Start,
    ) -> Result<f64, Box<Failure>> {
        if self.short_step(state, charges, before, target, start).is_ok() {
            return Ok(target);
        }
        // where an ordinary step fails there is no way down; its failure can be certified, that of
        // a very short step cannot: multipliers of size 1/length drown the data
        let mut length = ordinary.max(target);
        self.short_step(state, charges, before, length, start)?;
        while length > target {
            let next = (length * DESCENT).max(target);
            if self.short_step(state, charges, before, next, Start::Warm).is_err() {
                break;
            }
            length = next;
        }
        Ok(length)
    }

    /// Whether no voltage lies across the pairs that block in the mode `on` of a short step and conduct
    /// in the other one of `active` and the present: closed switches and diodes in parallel share
    /// their current in many ways.
    fn without_voltage(&self, state: &State, end: &Short, on: &[bool], active: &[bool]) -> bool {
        let w = self.sys.linear.slacks_of(&end.z, &end.l);
        let largest = w.iter().fold(self.sys.largest(&[&end.z])[0], |a, w| a.max(w.abs()));
        let turned = active.iter().zip(&state.active).zip(on).zip(&w);
        turned.filter(|(((a, b), on), _)| a != b && !**on).all(|(_, w)| w.abs() <= LOOSE * largest)
    }

    /// How far the charges of junctions are from going as straight through two short steps to length 0 as the
    /// unknowns do, relative to a scale: they are exponentials of voltages.
    pub(in crate::integrate) fn curvature_of_charges(
        &mut self,
        state: &State,
        once: &Short,
        twice: Option<&Short>,
        after: &[f64],
        scale: [f64; 2],
    ) -> f64 {
        let smooth = self.smooth.as_mut().filter(|smooth| smooth.newton.stores());
        let (Some(smooth), Some(twice)) = (smooth, twice) else { return 0.0 };
        let (u, time) = (&state.u0, state.time);
        let mut bends = vec![0.0; after.len()];
        for (z, weight) in [(&once.z[..], 2.0), (&twice.z, -1.0), (after, -1.0)] {
            smooth.add_stored_at(z, u, time, weight, &mut bends);
        }
        if !bends.iter().all(|bend| bend.is_finite()) {
            return f64::INFINITY;
        }
        let bends = self.sys.largest(&[&bends]);
        let share = |kind: usize| if bends[kind] > 0.0 { bends[kind] / scale[kind] } else { 0.0 };
        share(0).max(share(1))
    }

    /// The sizes of the terms of charges and fluxes of a state.
    pub(in crate::integrate) fn stored_sizes(&self, z: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; z.len()];
        self.sys.linear.e.abs_mul_add(z, &mut out);
        out
    }
}
