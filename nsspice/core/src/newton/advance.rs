//! One step of the iteration: the linearised problem.

use super::driver;
use super::solve::{Newton, Pull};
use super::state::{fingerprint, flip, slack, Problem, State};
use crate::mlcp::Role;

/// Rounds of the active-set iteration before the driver takes over.
const ROUNDS: usize = 12;

impl Newton {
    /// The solution of the equations linearised at the solution found last (or just before it) for changes of
    /// what the unknowns `z` and the functions `f` store; all unknowns where they are if there is none.
    pub fn respond(&mut self, z: &[f64], f: &[f64], out: &mut [f64]) {
        let n = self.eq.n;
        let Newton { eq, tape, assemblies, present, state: s, .. } = self;
        let assembly = &mut assemblies[*present];
        let size = eq.size();
        let defect = &mut s.balance.defect;
        defect.fill(0.0);
        eq.add_carried(assembly.rate, z, defect);
        eq.add_carried_functions(assembly.rate, |k| f[k], defect);
        if assembly.factored(&s.active) {
            s.step.copy_from_slice(&s.balance.defect[..size]);
            assembly.solve(n, &s.active, &mut s.step, &mut s.work);
        } else {
            assembly.linearise(tape.slopes());
            s.direct = false;
            s.x.fill(0.0);
            if !s.solve_mode(eq, assembly, tape.slopes()) {
                s.step.fill(0.0);
            }
        }
        out.copy_from_slice(&s.step[..n]);
    }

    /// Whether the mode is given, and that of the Jacobian factored last.
    pub(super) fn keeps_mode(&self) -> bool {
        let (assembly, s) = (&self.assemblies[self.present], &self.state);
        s.problem.roles.iter().all(|&role| role != Role::Diode) && assembly.factored(&s.active)
    }

    /// As `advance` in a mode that is given, with the Jacobian factored last.
    pub(super) fn advance_again(&mut self) -> bool {
        let Newton { eq, assemblies, present, state: s, .. } = self;
        s.iterations += 1;
        s.take_defects(eq, &assemblies[*present]);
        assemblies[*present].solve(eq.n, &s.active, &mut s.step, &mut s.work);
        s.x.iter_mut().zip(&s.step).for_each(|(x, d)| *x += d);
        true
    }

    /// Solves the linearised problem; false if that is not possible.
    pub(super) fn advance(&mut self, pull: Option<&Pull>) -> bool {
        let Newton { eq, tape, assemblies, present, state: s, .. } = self;
        let assembly = &mut assemblies[*present];
        let n = eq.n;
        // the first Jacobian of a small system is written when it is factorised
        s.direct = pull.is_none() && assembly.is_direct();
        if !s.direct {
            assembly.linearise(tape.slopes());
        }
        if let Some(pull) = pull {
            for (&at, d) in eq.diagonal.iter().zip(&eq.reference) {
                assembly.values[at as usize] += pull.mu * d;
            }
        }
        s.iterations += 1;
        s.seen.clear();
        let limit = if eq.m == 0 { 1 } else { ROUNDS.max((eq.m / 8).min(200)) };
        for _ in 0..limit {
            if !s.solve_mode(eq, assembly, tape.slopes()) {
                break;
            }
            s.move_within_reach(eq, assembly);
            for (i, _) in s.active.iter().enumerate().filter(|(_, &a)| !a) {
                s.trial[n + i] = 0.0;
            }
            if !flip(eq, assembly, s) {
                s.x.copy_from_slice(&s.trial);
                return true;
            }
            let print = fingerprint(&s.active);
            if s.seen.contains(&print) {
                break;
            }
            s.seen.push(print);
        }
        if s.direct {
            assembly.linearise(tape.slopes());
        }
        s.trial.copy_from_slice(&s.x);
        let State { balance, problem: Problem { roles, q, .. }, trial, active, .. } = s;
        let solved = driver::step(eq, assembly, &balance.defect, roles, q, trial, active);
        let Some(_) = solved else { return false };
        s.stage = s.stage.max(2);
        for ((d, t), x) in s.step.iter_mut().zip(&s.trial).zip(&mut s.x) {
            *d = t - *x;
            *x = *t;
        }
        true
    }

    /// Sets the active set from the signs at `state.x`.
    pub(super) fn activate_from_signs(&mut self) {
        let Newton { eq, assemblies, present, state: s, .. } = self;
        let assembly = &assemblies[*present];
        for i in 0..eq.m {
            s.active[i] = match s.problem.roles[i] {
                Role::Closed => true,
                Role::Open => false,
                Role::Diode => {
                    let scale = assembly.scaling.columns[eq.n + i];
                    let (w, _) = slack(eq, assembly, &s.problem.q, &s.x, i);
                    s.x[eq.n + i] / scale > w * scale
                }
            };
        }
    }
}
