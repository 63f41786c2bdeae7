//! The driver: one mixed complementarity problem after the other, cheapest method first.

use super::cache::keeps_modes;
use super::model::Model;
use super::modes::ModeFactor;
use super::problem::{Problem, Role, Start};
use super::residual::{residual, Residual};
use super::scratch::{Scratch, ACCEPT_DATA};
use super::{active_set, exhaustive, interior, proximal};
use crate::tolerances::ACCEPT;
use std::sync::Arc;

/// Solves a sequence of problems with equal matrices.
pub struct Driver {
    scratch: Scratch,
}

/// A solved problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// 1 active set, 2 proximal point, 3 interior point, 5 search for non-monotone problems
    pub stage: u8,
    /// mode equations solved
    pub iterations: u32,
    /// how well it is solved
    pub residual: Residual,
    /// the solution is so large against its data that the problem may be infeasible up to
    /// rounding: ask for a certificate before accepting it
    pub needs_certificate: bool,
    /// no point without flaws was found: some pair violates its law by more than rounding, which
    /// the residual does not see next to larger currents or voltages of the network
    pub flawed: bool,
}

/// No stage found a solution: the problem is infeasible (a certificate decides) or too hard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unsolved {
    /// residual of the best point
    pub residual: Residual,
}

impl Driver {
    /// Prepares the matrices.
    pub fn new(problem: Problem) -> Driver {
        Driver::of(Arc::new(Model::new(problem)))
    }

    /// The same of matrices that have been prepared before.
    pub(crate) fn of(model: Arc<Model>) -> Driver {
        Driver { scratch: Scratch::new(model) }
    }

    /// Solves `K z + A l = rhs`, `w = q - B z + D l`, every pair in its role.
    ///
    /// On entry `z`, `l` hold the previous solution, on exit the new one; among several solutions
    /// the one nearest to the previous (cold start: of least norm) is approached.  They are left
    /// alone if the problem is not solved.
    pub fn solve(
        &mut self,
        rhs: &[f64],
        q: &[f64],
        roles: &[Role],
        z: &mut [f64],
        l: &mut [f64],
        start: Start,
    ) -> Result<Solved, Unsolved> {
        let s = &mut self.scratch;
        let n = s.model.n;
        load(s, rhs, q, roles);
        match start {
            Start::Warm => {
                start_at(s, z, l);
                s.activate_from_signs();
            }
            Start::Cold => {
                s.start.fill(0.0);
                for (a, r) in s.active.iter_mut().zip(&s.roles) {
                    *a = *r == Role::Closed;
                }
            }
        }
        s.iterations = 0;
        s.flawed = None;
        s.best_residual = Residual::INFINITE;
        let finite = s.f.iter().chain(&s.start).all(|v| v.is_finite());
        let outcome = if finite { stages(s) } else { None };
        let Some((stage, residual, flawed)) = outcome else {
            return Err(Unsolved { residual: s.best_residual });
        };
        z.copy_from_slice(&s.x[..n]);
        l.copy_from_slice(&s.x[n..]);
        Ok(Solved {
            stage,
            iterations: s.iterations,
            residual,
            needs_certificate: s.growth() > largest_growth(stage == 1 && !s.doubtful),
            flawed,
        })
    }

    /// `solve` by the first two stages alone, from a mode that agrees with the roles: who asks has another way to
    /// everything they do not solve.  Without a solution `z` and `l` are left alone.
    pub fn solve_from(
        &mut self,
        begin: &[bool],
        rhs: &[f64],
        q: &[f64],
        roles: &[Role],
        z: &mut [f64],
        l: &mut [f64],
    ) -> bool {
        let s = &mut self.scratch;
        let n = s.model.n;
        load(s, rhs, q, roles);
        start_at(s, z, l);
        s.active.copy_from_slice(begin);
        (s.iterations, s.flawed, s.best_residual) = (0, None, Residual::INFINITE);
        let finite = s.f.iter().chain(&s.start).all(|v| v.is_finite());
        let near = finite && active_set::solve(s).is_some();
        let solved = near || finite && proximal::solve(s).is_some();
        let sound = solved && !s.doubtful && s.growth() <= largest_growth(near);
        if sound {
            z.copy_from_slice(&s.x[..n]);
            l.copy_from_slice(&s.x[n..]);
        }
        sound
    }

    /// The factored equations of a mode, from the cache if it has been met before.
    pub fn mode_factor(&mut self, active: &[bool]) -> Arc<ModeFactor> {
        let s = &mut self.scratch;
        s.cache.get(&s.model, 0, active)
    }

    /// Whether factored modes are kept.  Otherwise (large systems) the last one is turned into the
    /// next: then hold no `ModeFactor` while another mode is asked for, or it has to be copied.
    pub fn keeps_modes(&self) -> bool {
        keeps_modes(&self.scratch.model)
    }

    /// Residual of a point.
    pub fn residual(
        &mut self,
        rhs: &[f64],
        q: &[f64],
        roles: &[Role],
        z: &[f64],
        l: &[f64],
    ) -> Residual {
        let s = &mut self.scratch;
        let n = s.model.n;
        load(s, rhs, q, roles);
        s.x[..n].copy_from_slice(z);
        s.x[n..].copy_from_slice(l);
        let Scratch { model, roles, f, x, terms, defect, .. } = s;
        residual(model, roles, f, x, 0.0, terms, defect)
    }

    /// Below which sizes the sign tests of `solve` ignore negative multipliers (of active pairs) and
    /// slacks (of the others) of the point whose residual was computed last.
    pub fn sign_tolerances(&self, active: &[bool], out: &mut [f64]) {
        self.scratch.sign_tolerances(active, out);
    }

    /// Active pairs of the last solution.
    pub fn active(&self) -> &[bool] {
        &self.scratch.active
    }
}

/// How large a solution may be against its data.  What is accepted of a larger one may be all of the data; of one
/// that was found by following a path, which may lead nowhere, so much of it as is accepted at most.
fn largest_growth(near: bool) -> f64 {
    1.0 / if near { ACCEPT } else { ACCEPT_DATA }
}

/// Begins at a point, and stays near it where the laws leave something open.
fn start_at(s: &mut Scratch, z: &[f64], l: &[f64]) {
    let (start, rest) = s.start.split_at_mut(s.model.n);
    start.copy_from_slice(z);
    rest.copy_from_slice(l);
    s.x.copy_from_slice(&s.start);
}

fn load(s: &mut Scratch, rhs: &[f64], q: &[f64], roles: &[Role]) {
    let n = s.model.n;
    s.f[..n].copy_from_slice(rhs);
    for (f, q) in s.f[n..].iter_mut().zip(q) {
        *f = -q;
    }
    s.roles.copy_from_slice(roles);
}

/// The stage that found a solution, its residual, and whether it has flaws.
fn stages(s: &mut Scratch) -> Option<(u8, Residual, bool)> {
    if let Some(found) = active_set::solve(s) {
        return Some((1, found, false));
    }
    if let Some(found) = proximal::solve(s) {
        return Some((2, found, false));
    }
    if let Some(found) = interior::solve(s) {
        return Some((3, found, false));
    }
    if let Some(found) = s.take_kept() {
        return Some((3, found, true));
    }
    if !s.model.monotone() {
        if let Some(found) = exhaustive::solve(s) {
            return Some((5, found, false));
        }
    }
    None
}
