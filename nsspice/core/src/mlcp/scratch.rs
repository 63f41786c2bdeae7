//! Work space shared by the stages, so that a solve allocates nothing once it is warm.

use super::cache::ModeCache;
use super::model::Model;
use super::modes::{work_len, ModeFactor, NEAREST};
use super::problem::Role;
use super::residual::{residual, Residual};
use crate::rounding::OF_SOLUTION;
use crate::tolerances::{ACCEPT, CLEARLY};
use std::sync::Arc;

/// Largest defect of an accepted solution, as a part of the data.  Far out along a direction that
/// never arrives, residuals relative to the point itself fade away although no solution exists.  No test
/// distinguishes a decade more or less.
pub(super) const ACCEPT_DATA: f64 = 1e-6;
/// What is off by such a part of the data is no solution of a problem that is not monotone; of others, relations
/// show whether there is one.  No test distinguishes a decade less; with one more, solutions of a billion times their
/// data might miss a tenth of it and need no certificate.
const NO_DATA: f64 = 0.01;

/// Against which size rounding errors are judged in sign tests.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// the terms of the equation itself: a nanovolt next to a megavolt keeps its sign
    Own,
    /// the largest current and voltage of the network: ends disputes about rounding errors
    Network,
}

/// One problem instance together with the arrays in which it is solved.
pub(crate) struct Scratch {
    pub model: Arc<Model>,
    pub cache: ModeCache,
    pub roles: Vec<Role>,
    /// `[b; -q]`
    pub f: Vec<f64>,
    /// prox centre and warm start `[z; l]`
    pub start: Vec<f64>,
    /// present iterate
    pub x: Vec<f64>,
    /// active pairs of the present iterate
    pub active: Vec<bool>,
    /// what the signs of the present iterate suggest
    pub next: Vec<bool>,
    /// `f - H x`; minus its second part is the slack
    pub defect: Vec<f64>,
    /// sizes of the terms summed in the defect
    pub terms: Vec<f64>,
    /// right-hand side of the mode being solved
    pub rhs: Vec<f64>,
    pub work: Vec<f64>,
    /// fingerprints of the active sets visited
    pub seen: Vec<u64>,
    /// mode equations solved so far
    pub iterations: u32,
    /// the last mode solved was nearly singular, and its solution is not the nearest one
    pub doubtful: bool,
    /// a point that the residual accepts although its pairs have flaws, and its active set
    pub flawed: Option<(Residual, Vec<f64>, Vec<bool>)>,
    /// residual of the best point so far
    pub best_residual: Residual,
}

impl Scratch {
    pub fn new(model: Arc<Model>) -> Scratch {
        let (size, m) = (model.size(), model.m);
        let zeros = vec![0.0; size];
        Scratch {
            cache: ModeCache::new(),
            roles: vec![Role::Diode; m],
            f: zeros.clone(),
            start: zeros.clone(),
            x: zeros.clone(),
            active: vec![false; m],
            next: vec![false; m],
            defect: zeros.clone(),
            terms: zeros.clone(),
            rhs: zeros.clone(),
            work: vec![0.0; work_len(size)],
            seen: Vec::with_capacity(64),
            iterations: 0,
            doubtful: false,
            flawed: None,
            best_residual: Residual::INFINITE,
            model,
        }
    }

    /// The factored equations of the present active set.
    pub fn factor(&mut self, level: usize) -> Arc<ModeFactor> {
        self.cache.get(&self.model, level, &self.active)
    }

    /// Activity that the signs of multiplier and slack suggest: `l > w` in the scaled system.
    pub fn guess(&self, i: usize, l: f64, w: f64) -> bool {
        match self.roles[i] {
            Role::Closed => true,
            Role::Open => false,
            Role::Diode => {
                let s = self.model.scale[self.model.n + i];
                l / s > w * s
            }
        }
    }

    /// Sets the active set from the signs at `x`.
    pub fn activate_from_signs(&mut self) {
        self.model.defect(&self.f, &self.x, &mut self.defect);
        for i in 0..self.model.m {
            let at = self.model.n + i;
            self.active[i] = self.guess(i, self.x[at], -self.defect[at]);
        }
    }

    /// Moves `x` to the nearest solution of the equations of the present active set.
    pub fn solve_mode(&mut self) {
        self.solve_mode_in(2);
    }

    /// As `solve_mode`, in a given number of sweeps if the mode is regular; returns whether it is.
    pub fn solve_mode_in(&mut self, sweeps: usize) -> bool {
        self.iterations += 1;
        let n = self.model.n;
        self.rhs.copy_from_slice(&self.f);
        for (r, _) in self.rhs[n..].iter_mut().zip(&self.active).filter(|(_, &a)| !a) {
            *r = 0.0;
        }
        let factor = self.factor(0);
        let nearest = factor.needs_nearest().then(|| self.factor(NEAREST));
        let Scratch { x, rhs, work, .. } = self;
        self.doubtful = !factor.correct_with(nearest.as_deref(), sweeps, x, rhs, work);
        // a refined solution may be off by a rounding error there
        for (l, _) in self.x[n..].iter_mut().zip(&self.active).filter(|(_, &a)| !a) {
            *l = 0.0;
        }
        factor.regular()
    }

    /// Computes the slacks at `x` and, in `next`, the active set its signs suggest; returns the
    /// number of pairs that differ from the present one.
    pub fn identify(&mut self, scale: Scale) -> usize {
        let Scratch { model, f, x, defect, .. } = self;
        model.defect(f, x, defect);
        self.identify_from_defect(scale)
    }

    /// As `identify`, with the slacks (minus the second part of `defect`) given.
    pub fn identify_from_defect(&mut self, scale: Scale) -> usize {
        let (n, m) = (self.model.n, self.model.m);
        self.next.copy_from_slice(&self.active);
        let mut doubtful = false;
        for i in (0..m).filter(|&i| self.roles[i] == Role::Diode) {
            let value = if self.active[i] { self.x[n + i] } else { -self.defect[n + i] };
            doubtful |= value < 0.0 || value.is_nan();
        }
        if !doubtful {
            return 0;
        }
        let Scratch { model, f, x, terms, .. } = self;
        model.terms(f, x, terms);
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        let (current, voltage) = (largest(&x[n..]), largest(&terms[n..]));
        // what rounding makes of the largest voltage grows with the number of unknowns
        let network = OF_SOLUTION.min(4.0 * f64::EPSILON * (n + m) as f64);
        let part = if scale == Scale::Own { OF_SOLUTION } else { network };
        let mut changes = 0;
        for i in (0..m).filter(|&i| self.roles[i] == Role::Diode) {
            let flip = if self.active[i] {
                let size = match scale {
                    Scale::Own => self.model.multiplier_terms(i, &self.terms),
                    Scale::Network => current.max(self.model.multiplier_terms(i, &self.terms)),
                };
                self.x[n + i] < -part * size
            } else {
                let size = match scale {
                    Scale::Own => self.terms[n + i],
                    Scale::Network => voltage,
                };
                -self.defect[n + i] < -part * size
            };
            if flip {
                self.next[i] = !self.active[i];
                changes += 1;
            }
        }
        changes
    }

    /// What the sign tests by `Scale::Own` ignore, from the terms computed last.
    pub fn sign_tolerances(&self, active: &[bool], out: &mut [f64]) {
        let n = self.model.n;
        for (i, (out, &active)) in out.iter_mut().zip(active).enumerate() {
            let size = if active {
                self.model.multiplier_terms(i, &self.terms)
            } else {
                self.terms[n + i]
            };
            *out = OF_SOLUTION * size;
        }
    }

    /// Makes the suggested active set the present one.
    pub fn adopt(&mut self) {
        self.active.copy_from_slice(&self.next);
    }

    /// Residual of `x` if it is small enough to accept; the best one is remembered.
    ///
    /// Where all voltages (or all currents) of a network vanish, rounding is all that is left to
    /// compare them with: then unknowns that are nothing but rounding are set to zero, and the laws
    /// need to hold up to rounding of the largest voltage and current.
    pub fn judge(&mut self) -> Option<Residual> {
        self.rate(false).or_else(|| self.without_rounding()).or_else(|| self.rate(true))
    }

    /// Residual of `x` without what is nothing but rounding, if that is accepted.
    fn without_rounding(&mut self) -> Option<Residual> {
        let Scratch { model, x, work, .. } = self;
        let largest = x.iter().zip(&model.scale).fold(0.0f64, |a, (v, s)| a.max((v / s).abs()));
        let before = &mut work[..x.len()];
        before.copy_from_slice(x);
        for (v, s) in x.iter_mut().zip(&model.scale) {
            // in the scaled system this may be rounding of the largest
            if (*v / s).abs() <= OF_SOLUTION * largest {
                *v = 0.0;
            }
        }
        if before == x {
            return None;
        }
        let found = self.rate(false);
        if found.is_none() {
            let Scratch { x, work, .. } = self;
            x.copy_from_slice(&work[..self.model.size()]);
        }
        found
    }

    /// Residual of `x` if it is small enough; with `coarse`, laws are measured by no less than what
    /// makes rounding of the largest voltage (current) acceptable.
    fn rate(&mut self, coarse: bool) -> Option<Residual> {
        let Scratch { model, roles, f, x, terms, defect, .. } = self;
        let unit = if coarse { f64::EPSILON / ACCEPT } else { 0.0 };
        let found = residual(model, roles, f, x, unit, terms, defect);
        if found.worst() < self.best_residual.worst() {
            self.best_residual = found;
        }
        let growth = self.growth();
        // no less is asked for: that may be rounding
        let limit = ACCEPT.min((ACCEPT_DATA / growth).max(CLEARLY * ACCEPT));
        let hidden = found.worst() * growth > NO_DATA && growth.is_finite();
        if hidden && found.worst() <= limit && !self.model.monotone() {
            return None;
        }
        (found.worst() <= limit).then_some(found)
    }

    /// As `judge`, but a point with flaws is only kept.
    ///
    /// The residual measures slacks by all voltages of the network.  In very short steps those of
    /// the inductors are so large that volts hide behind them, and next to kilovolts elsewhere a diode
    /// might bear microvolts forward; here slacks are measured by the voltages that meet in them, and
    /// multipliers by the currents that they balance, but for rounding.  A slack that is an equation of the
    /// mode has no other rounding than that of the potentials.
    pub fn judge_strictly(&mut self) -> Option<Residual> {
        let found = self.judge()?;
        if self.flawless() {
            return Some(found);
        }
        if self.flawed.as_ref().is_none_or(|(last, ..)| found.worst() < last.worst()) {
            self.flawed = Some((found, self.x.clone(), self.active.clone()));
        }
        None
    }

    /// Whether the pairs of the point judged last obey their laws (see `judge_strictly`).
    fn flawless(&self) -> bool {
        let Scratch { model, roles, x, terms, defect, active, .. } = self;
        let n = model.n;
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        let mut rows = [0.0f64; 2];
        for (i, &size) in terms[..n].iter().enumerate() {
            rows[model.kind(i)] = rows[model.kind(i)].max(size);
        }
        // unless they are rounding of the largest of the pairs, or of what meets in the rows
        let current = OF_SOLUTION * largest(&x[n..]).max(rows[0]);
        let nodes = (0..n).filter(|&i| model.kind(i) == 0).fold(0.0f64, |a, i| a.max(x[i].abs()));
        let solved = OF_SOLUTION * largest(&terms[n..]).max(nodes);
        let voltage = solved.max(OF_SOLUTION * rows[1]);
        roles.iter().enumerate().all(|(i, role)| {
            let (l, w) = (x[n + i], -defect[n + i]);
            // a flaw is clearly more than what an equation may be missed by, too, as a part of its own terms
            let current = current.max(ACCEPT / CLEARLY * model.multiplier_terms(i, terms));
            let own = ACCEPT / CLEARLY * terms[n + i];
            let (no_l, no_w) = (l.abs() <= current, w.abs() <= solved.max(own));
            match role {
                Role::Diode if active[i] => no_w && l >= -current,
                Role::Diode => no_l && w >= -voltage.max(own),
                Role::Closed => no_w,
                Role::Open => no_l,
            }
        })
    }

    /// Returns to the point that was kept.
    pub fn take_kept(&mut self) -> Option<Residual> {
        let (found, x, active) = self.flawed.take()?;
        (self.x, self.active) = (x, active);
        Some(found)
    }

    /// Size of `x` relative to the data (to the start, if there are none), in the scaled system.
    /// The start does not count otherwise: it may already have gone astray.
    pub fn growth(&self) -> f64 {
        let scale = &self.model.scale;
        let size = |v: &[f64]| v.iter().zip(scale).fold(0.0f64, |a, (v, s)| a.max((v / s).abs()));
        let data = self.f.iter().zip(scale).fold(0.0f64, |a, (v, s)| a.max((v * s).abs()));
        let reference = if data == 0.0 { size(&self.start) } else { data };
        match size(&self.x) {
            0.0 => 0.0,
            size => size / reference,
        }
    }
}
