//! The estimated error of a step, and what it is known from.

use super::stage_equations::StageEquations;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::combine::add_rates;
use crate::integrate::sdirk::tableau::{Tableau, FIRST};

/// A smoothed error below this part of the plain one belongs to a constrained unknown.
const CONSTRAINED: f64 = 1e-6;

/// Errors of the potentials of the nodes at which functions store a charge, where unknowns are voltages along a tree.
pub struct AtNodes {
    /// of the estimate so far
    pub errors: Vec<f64>,
    before: Vec<f64>,
    plain: Vec<f64>,
}

/// Diagonals of the storage matrix and of the other.
pub struct Diagonals {
    pub storage: Vec<f64>,
    conducted: Vec<f64>,
}

/// The estimated error of each unknown.
pub struct Estimate {
    pub errors: Vec<f64>,
    /// unknowns whose error is that of their rates
    pub constrained: Vec<bool>,
    /// what each unknown is known from: the sizes of the terms of its law at the end of the step, by what
    /// its own part there is
    pub terms: Vec<f64>,
    /// the same of what is not stored
    flows: Vec<f64>,
    pub diagonals: Diagonals,
    /// unknowns that smooth stored functions see by themselves, not in differences alone
    own: Vec<bool>,
    /// there are such
    mixed: bool,
    pub charged: AtNodes,
    /// scratch: plain errors of unknowns and functions, the same as charges and fluxes, smoothed ones
    raw: Vec<f64>,
    pub stored: Vec<f64>,
    smoothed: Vec<f64>,
}

impl Estimate {
    pub fn new(s: &Stepper) -> Estimate {
        let n = s.state.z.len();
        let p = s.solver.smooth.as_ref().map_or(0, |smooth| smooth.f.len());
        let mut storage = vec![0.0; n];
        for (_, c, v) in s.solver.sys.linear.e.iter().filter(|e| e.0 == e.1) {
            storage[c] = v;
        }
        let mut conducted = vec![0.0; n];
        for (_, c, v) in s.solver.sys.linear.g.iter().filter(|g| g.0 == g.1) {
            conducted[c] = v.abs();
        }
        let mut own = vec![false; n];
        for j in s.solver.smooth.iter().flat_map(|smooth| smooth.newton.stored_unknowns()) {
            own[j] = true;
        }
        Estimate {
            errors: vec![0.0; n],
            constrained: vec![false; n],
            terms: vec![0.0; n],
            flows: vec![0.0; n],
            diagonals: Diagonals { storage, conducted },
            mixed: own.contains(&true),
            own,
            charged: AtNodes { errors: vec![0.0; n], before: vec![0.0; n], plain: vec![0.0; n] },
            raw: vec![0.0; n + p],
            stored: vec![0.0; n],
            smoothed: vec![0.0; n],
        }
    }

    /// Begins with the plain errors: how far a step `from` weighted rates is from its `base`.
    pub fn begin(&mut self, from: &[f64], base: &[f64]) {
        for ((f, base), raw) in from.iter().zip(base).zip(&mut self.raw) {
            *raw = f - base;
        }
    }

    /// Smooths them by the equations of the smooth stage solved last.
    pub fn smooth(&mut self, s: &mut Stepper, stage_equations: &mut StageEquations, level: usize) {
        stage_equations.respond(s, level, &self.raw, &mut self.errors);
    }

    /// Takes as smoothed errors how far the stage solved from them is from the `end` of the step.
    pub fn compare(&mut self, stage: &[f64], end: &[f64]) {
        for ((d, x), end) in self.errors.iter_mut().zip(stage).zip(end) {
            *d = x - end;
        }
    }

    /// Chooses between plain and smoothed errors of a step of this length with these unknowns at its `end`.
    pub fn finish(&mut self, s: &Stepper, tableau: &Tableau, h: f64, end: &[f64]) {
        let n = end.len();
        let charged = self.at_charged_nodes(s, |estimate| &estimate.errors);
        if charged && !tableau.smoothed {
            let both = self.charged.errors.iter_mut().zip(&self.charged.plain);
            both.for_each(|(d, plain)| *d = (plain * *d).abs().sqrt());
        }
        // as changes of charges and fluxes: directions without storage mean nothing
        self.stored.fill(0.0);
        s.solver.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        self.terms.fill(0.0);
        s.solver.sys.linear.e.abs_mul_add(end, &mut self.terms);
        self.flows.fill(0.0);
        s.solver.sys.linear.g.abs_mul_add(end, &mut self.flows);
        let parts =
            self.diagonals.storage.iter().zip(self.flows.iter().zip(&self.diagonals.conducted));
        for (terms, (&storage, (flow, conducted))) in self.terms.iter_mut().zip(parts) {
            let whole = (*terms + h * flow) / (storage + h * conducted);
            *terms = if storage > 0.0 { whole } else { 0.0 };
        }
        self.smoothed.fill(0.0);
        s.solver.sys.linear.e.mul_add(1.0, &self.errors, &mut self.smoothed);
        let charges = self.smoothed.iter().zip(&self.stored).zip(&self.diagonals.storage);
        let out = self.errors.iter_mut().zip(&mut self.constrained).zip(&self.raw);
        for (j, (((d, constrained), &plain), ((smoothed, raw), &storage))) in
            out.zip(charges).enumerate()
        {
            if storage > 0.0 {
                // what a constraint determines shows no error; its rates have one
                *constrained = smoothed.abs() < CONSTRAINED * raw.abs();
            }
            *d = match (*constrained || !tableau.smoothed, self.own[j]) {
                (false, true) => *d,
                // charges of junctions are stiff, and their diodes begin to conduct: between both
                (true, true) if !*constrained => (plain * *d).abs().sqrt(),
                _ if storage == 0.0 => *d,
                (true, _) => raw / storage,
                (false, false) => smoothed / storage,
            };
        }
    }

    /// Adds up some errors, into `charged`, and the plain ones along the tree to the nodes at which functions store
    /// charges; false if there are none.
    fn at_charged_nodes(&mut self, s: &Stepper, of: impl Fn(&Estimate) -> &Vec<f64>) -> bool {
        let Some(tree) = s.facts.coordinates.as_ref().filter(|_| self.mixed) else { return false };
        let n = self.errors.len();
        std::mem::swap(&mut self.charged.errors, &mut self.charged.before);
        let mut errors = std::mem::take(&mut self.charged.errors);
        errors.copy_from_slice(&of(self)[..n]);
        tree.add_up(&mut errors);
        self.charged.errors = errors;
        self.charged.plain.copy_from_slice(&self.raw[..n]);
        tree.add_up(&mut self.charged.plain);
        true
    }

    /// Adds to the estimate what the continuous solution has beyond Hermite's cubic: inside a step in which
    /// a diode begins to conduct it errs more than at the end.  It counts by what it is above `shown` times the estimate:
    /// `s^2 / (s + shown d)`.
    pub fn look_inside(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        level: usize,
        h: f64,
        (weights, shown): (&[f64], f64),
        rates: &[Vec<f64>],
    ) {
        let n = self.errors.len();
        self.raw.fill(0.0);
        add_rates(h, weights, rates, &mut self.raw);
        self.stored.fill(0.0);
        s.solver.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        self.smoothed.fill(0.0);
        if self.mixed {
            stage_equations.respond(s, level, &self.raw, &mut self.smoothed);
        }
        if self.at_charged_nodes(s, |estimate| &estimate.smoothed) {
            let both = self.charged.errors.iter_mut().zip(&self.charged.plain);
            for ((d, plain), before) in both.zip(&self.charged.before) {
                *d = (*d * plain).abs().sqrt().max(before.abs());
            }
        }
        for (j, d) in self.errors.iter_mut().enumerate() {
            let swing = match (self.own[j], self.diagonals.storage[j]) {
                (true, _) => (self.raw[j] * self.smoothed[j]).abs().sqrt(),
                (false, 0.0) => self.smoothed[j].abs(),
                (false, storage) => (self.stored[j] / storage).abs(),
            };
            let part = swing / (swing + shown * d.abs());
            *d = if swing > 0.0 { d.abs().max(swing * part) } else { d.abs() };
        }
    }

    /// Adds how far the continuous solution `found` at the begin is from the state `first` there; nothing where there
    /// is none.
    pub fn look_back(&mut self, s: &Stepper, found: Option<&[f64]>, first: &[f64]) {
        let n = first.len();
        let raw = &mut self.raw[..n];
        match found {
            Some(x) => raw.iter_mut().zip(x).zip(first).for_each(|((raw, x), z)| *raw = x - z),
            None => raw.fill(0.0),
        }
        if self.at_charged_nodes(s, |estimate| &estimate.raw) {
            for (d, before) in self.charged.errors.iter_mut().zip(&self.charged.before) {
                *d = (FIRST * d.abs()).max(before.abs());
            }
        }
        self.stored.fill(0.0);
        s.solver.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        for (j, error) in self.errors.iter_mut().enumerate() {
            let storage = self.diagonals.storage[j];
            let missed = if storage > 0.0 { self.stored[j] / storage } else { self.raw[j] };
            *error = error.abs().max(FIRST * missed.abs());
        }
    }
}
