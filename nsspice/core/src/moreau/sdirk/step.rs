//! One step in a fixed mode, its error, and its continuous solution.

use super::super::record::Quantities;
use super::super::stepper::Stepper;
use super::combine::{add_rates, scaled_difference};
use super::ladder::{Fit, Ladder, StageProblem};
use super::predict::{Beside, Past};
use super::tableau::{Tableau, FIRST, MOST};
use crate::waveform::{Side, Waveform, INSTANT};

/// After so many steps without a solution from one point other ways to one are tried: behind a fold of the
/// laws shorter ones have none either.  Not from this level on: there a single implicit step is at hand,
/// and where a winding tears the last charge out of a junction every way ends in megavolts.
const TRIED: u32 = 4;
const DEEP: usize = 24;

/// A smoothed error below this part of the plain one belongs to a constrained unknown.
const CONSTRAINED: f64 = 1e-6;

/// How the equations of a stage are solved: [`Ladder::solve`] or [`Ladder::cross`].
type Way = fn(&mut Ladder, &mut Stepper, StageProblem, &mut [f64]) -> Fit;

/// A step from `start`: stages, rates, and what is needed to evaluate it anywhere.
pub struct Trial {
    n: usize,
    m: usize,
    /// begin [s]
    pub start: f64,
    /// length [s]
    pub length: f64,
    /// which matrices
    pub level: usize,
    /// first corner of a source after the begin [s]
    pub corner: f64,
    /// steps from here that had no solution
    pub unsolved: u32,
    /// unknowns, guards and functions at the begin
    pub first: Vec<f64>,
    /// the same at the end of each stage
    pub stages: Vec<Vec<f64>>,
    /// stages, and last the point, that were solved in a mode that leaves something open, or in any
    pub open: Vec<bool>,
    /// each stage is solved in the mode that its laws ask for
    pub crossing: bool,
    /// then: the mode at the end of the step, and whether any stage is in another than its begin
    pub mode: Vec<bool>,
    pub crossed: bool,
    /// where each stage begins: unknowns, then functions
    pub bases: Vec<Vec<f64>>,
    /// the sources at the end of each stage
    pub inputs: Vec<Vec<f64>>,
    /// rate of each stage: of the unknowns that carry storage, then of the functions
    pub rates: Vec<Vec<f64>>,
    /// unknowns whose error is that of their rates
    pub constrained: Vec<bool>,
    /// what each unknown is known from: the sizes of the terms of its law at the end of the step, by what
    /// its own part there is
    pub terms: Vec<f64>,
    /// the same of what is not stored
    flows: Vec<f64>,
    /// diagonals of the storage matrix and of the other
    pub(super) storage: Vec<f64>,
    conducted: Vec<f64>,
    /// unknowns that smooth stored functions see by themselves, not in differences alone
    own: Vec<bool>,
    /// there are such
    mixed: bool,
    /// the error of the potential of each node at which functions store a charge, where unknowns are voltages along
    /// a tree
    pub charged: Vec<f64>,
    charged_before: Vec<f64>,
    beside_charged: Vec<f64>,
    /// unknowns on whose common value nothing that is stored depends
    afloat: Vec<Vec<usize>>,
    /// where Newton's method begins
    past: Past,
    guess: Vec<f64>,
    plain: Vec<f64>,
    beside: Beside,
    /// scratch
    from: Vec<f64>,
    raw: Vec<f64>,
    pub(super) stored: Vec<f64>,
    smoothed: Vec<f64>,
    pub u: Vec<f64>,
    /// a point of the continuous solution: unknowns, guards and functions
    pub point: Vec<f64>,
    /// rates of the unknowns and functions there
    pub slope: Vec<f64>,
    /// two points at which guards have been looked at: rows and the end of the step ask for them again
    pub samples: [Sample; 2],
}

/// A point of the continuous solution of a step that is cut.
#[derive(Clone, Default)]
pub struct Sample {
    /// where it is, as a part of the step; nothing if it is not of this one
    theta: Option<f64>,
    /// unknowns, guards and functions
    pub point: Vec<f64>,
    slope: Vec<f64>,
    u: Vec<f64>,
    open: bool,
}

/// The stages could not be computed up to the end.
pub struct Broken {
    /// end of the stage that has no solution in this mode, as a part of the step
    pub at: f64,
}

/// Sources at a time after `start`: behind their next breakpoint, `corner`, as they would go on without it.
pub(in super::super) fn sources(
    waveforms: &[Waveform],
    t: f64,
    start: f64,
    corner: f64,
    u: &mut [f64],
) {
    // within rounding of an edge at the begin the step is behind it
    let known = INSTANT * t.abs();
    let side = if t - start <= known && corner - t > known { Side::Right } else { Side::Left };
    for (u, w) in u.iter_mut().zip(waveforms) {
        *u = if t <= corner { w.value(t, side) } else { w.continued(t, start, corner) };
    }
}

impl Trial {
    pub fn new(s: &Stepper, tableau: &Tableau) -> Trial {
        let (n, m) = (s.z.len(), s.l.len());
        let p = s.smooth.as_ref().map_or(0, |smooth| smooth.f.len());
        let many = |len: usize| vec![vec![0.0; len]; tableau.stages()];
        let mut storage = vec![0.0; n];
        for (_, c, v) in s.sys.linear.e.iter().filter(|e| e.0 == e.1) {
            storage[c] = v;
        }
        let mut conducted = vec![0.0; n];
        for (_, c, v) in s.sys.linear.g.iter().filter(|g| g.0 == g.1) {
            conducted[c] = v.abs();
        }
        let mut own = vec![false; n];
        for j in s.smooth.iter().flat_map(|smooth| smooth.newton.stored_unknowns()) {
            own[j] = true;
        }
        let sums = s.smooth.iter().flat_map(|_| &s.facts.at_once);
        Trial {
            mixed: own.contains(&true),
            afloat: sums.filter(|sum| sum.len() > 1).cloned().collect(),
            charged: vec![0.0; n],
            charged_before: vec![0.0; n],
            beside_charged: vec![0.0; n],
            own,
            storage,
            conducted,
            flows: vec![0.0; n],
            constrained: vec![false; n],
            terms: vec![0.0; n],
            raw: vec![0.0; n + p],
            stored: vec![0.0; n],
            smoothed: vec![0.0; n],
            start: 0.0,
            length: 0.0,
            level: 0,
            corner: f64::INFINITY,
            unsolved: 0,
            first: vec![0.0; n + m + p],
            stages: many(n + m + p),
            open: vec![false; tableau.stages() + 1],
            crossing: false,
            mode: vec![false; m],
            crossed: false,
            bases: many(n + p),
            inputs: many(s.u0.len()),
            rates: many(n + p),
            past: Past::new(tableau.stages(), n + m + p),
            guess: vec![0.0; n],
            plain: vec![0.0; n],
            beside: Beside::new(n),
            from: vec![0.0; n + p],
            u: vec![0.0; s.u0.len()],
            point: vec![0.0; n + m + p],
            slope: vec![0.0; n + p],
            samples: Default::default(),
            n,
            m,
        }
    }

    /// How a point is solved.
    fn way(&self) -> Way {
        if self.crossing {
            Ladder::cross
        } else {
            Ladder::solve
        }
    }

    /// Computes the stages of a step at `level` from the state of `s`; `first` has been set.
    pub fn compute(
        &mut self,
        s: &mut Stepper,
        ladder: &mut Ladder,
        tableau: &Tableau,
        level: usize,
    ) -> Result<(), Broken> {
        let (n, m) = (self.n, self.m);
        self.level = level;
        self.beside.forget();
        self.length = ladder.length(level);
        self.samples.iter_mut().for_each(|sample| sample.theta = None);
        self.crossed = false;
        let solve = self.way();
        let h = self.length;
        let rate = 1.0 / (tableau.gamma * h);
        if tableau.first() > 0 {
            self.stages[0].copy_from_slice(&self.first);
            self.inputs[0].copy_from_slice(&s.u0);
        }
        for i in tableau.first()..tableau.stages() {
            let t = self.start + tableau.c[i] * h;
            let u = &mut self.inputs[i];
            sources(&s.waveforms, t, self.start, self.corner, u);
            let (done, rest) = self.stages.split_at_mut(i);
            let (base, x) = (&mut self.bases[i], &mut rest[0]);
            base[..n].copy_from_slice(&self.first[..n]);
            base[n..].copy_from_slice(&self.first[n + m..]);
            add_rates(h, tableau.a[i], &self.rates, base);
            // the last stage but one is a good beginning for Newton's method
            let near = done.last().unwrap_or(&self.first);
            if let Some(smooth) = &mut s.smooth {
                if self.past.predict(tableau, i, h, &self.first, done, &mut self.guess) {
                    smooth.newton.predict(&self.guess);
                }
                smooth.newton.be_brief(level >= DEEP || self.unsolved < TRIED);
            }
            let fit =
                solve(ladder, s, StageProblem { level, t, from: base, u, near, keeps: true }, x);
            if fit == Fit::Contradiction {
                return Err(Broken { at: tableau.c[i] });
            }
            if self.crossing {
                self.mode.clone_from(&ladder.met);
                self.crossed |= self.mode != s.active;
            }
            self.open[i] = fit == Fit::Open;
            let (rates, function_rates) = self.rates[i].split_at_mut(n);
            scaled_difference(rate, &x[..n], &base[..n], rates);
            scaled_difference(rate, &x[n + m..], &base[n..], function_rates);
        }
        Ok(())
    }

    /// The estimated error of each unknown, into `slope`: the rates weighted, and, where the method
    /// asks for it, smoothed by one solve with the matrix of the stages so that it stays bounded for
    /// stiff parts and leaves constrained unknowns alone.
    pub fn estimate(&mut self, s: &mut Stepper, ladder: &mut Ladder, tableau: &Tableau) {
        let last = tableau.stages() - 1;
        self.from.copy_from_slice(&self.bases[last]);
        add_rates(self.length, tableau.error, &self.rates, &mut self.from);
        let (n, base) = (self.n, &self.bases[last]);
        for ((f, base), raw) in self.from.iter().zip(base).zip(&mut self.raw) {
            *raw = f - base;
        }
        self.level_out();
        if s.smooth.is_some() {
            ladder.respond(s, self.level, &self.raw, &mut self.slope);
        } else {
            // of a step from mode to mode, in the last
            let mut turn = |s: &mut Stepper| {
                if self.crossing {
                    std::mem::swap(&mut self.mode, &mut s.active);
                    s.epoch += 1;
                }
            };
            turn(s);
            let (x, t) = (&mut self.point, self.start + self.length);
            let (level, near, u) = (self.level, &self.stages[last][..], &self.inputs[last][..]);
            ladder.solve(s, StageProblem { level, t, from: &self.from, u, near, keeps: true }, x);
            turn(s);
            for ((d, x), end) in self.slope.iter_mut().zip(&x[..n]).zip(&self.stages[last]) {
                *d = x - end;
            }
        }
        let charged = self.at_charged_nodes(s, |trial| &trial.slope);
        if charged && !tableau.smoothed {
            let both = self.charged.iter_mut().zip(&self.beside_charged);
            both.for_each(|(d, plain)| *d = (plain * *d).abs().sqrt());
        }
        // as changes of charges and fluxes: directions without storage mean nothing
        self.stored.fill(0.0);
        s.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        self.terms.fill(0.0);
        s.sys.linear.e.abs_mul_add(&self.stages[last][..n], &mut self.terms);
        self.flows.fill(0.0);
        s.sys.linear.g.abs_mul_add(&self.stages[last][..n], &mut self.flows);
        let h = self.length;
        let parts = self.storage.iter().zip(self.flows.iter().zip(&self.conducted));
        for (terms, (&storage, (flow, conducted))) in self.terms.iter_mut().zip(parts) {
            let whole = (*terms + h * flow) / (storage + h * conducted);
            *terms = if storage > 0.0 { whole } else { 0.0 };
        }
        self.smoothed.fill(0.0);
        s.sys.linear.e.mul_add(1.0, &self.slope[..n], &mut self.smoothed);
        let charges = self.smoothed.iter().zip(&self.stored).zip(&self.storage);
        let out = self.slope.iter_mut().zip(&mut self.constrained).zip(&self.raw);
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
    fn at_charged_nodes(&mut self, s: &Stepper, of: impl Fn(&Trial) -> &Vec<f64>) -> bool {
        let Some(tree) = s.facts.coordinates.as_ref().filter(|_| self.mixed) else { return false };
        let n = self.n;
        std::mem::swap(&mut self.charged, &mut self.charged_before);
        let mut errors = std::mem::take(&mut self.charged);
        errors.copy_from_slice(&of(self)[..n]);
        tree.add_up(&mut errors);
        self.charged = errors;
        self.beside_charged.copy_from_slice(&self.raw[..n]);
        tree.add_up(&mut self.beside_charged);
        true
    }

    /// Takes the mean of each group out of `raw` on whose common value nothing that is stored depends: behind
    /// a jump, where only windings hold such a group, it is known to the rounding of their fluxes alone.
    fn level_out(&mut self) {
        for group in &self.afloat {
            let mean = group.iter().map(|&j| self.raw[j]).sum::<f64>() / group.len() as f64;
            group.iter().for_each(|&j| self.raw[j] -= mean);
        }
    }

    /// Adds to the estimate what the continuous solution has beyond Hermite's cubic: inside a step in which
    /// a diode begins to conduct it errs more than at the end.
    pub fn look_inside(&mut self, s: &mut Stepper, ladder: &mut Ladder, tableau: &Tableau) {
        let n = self.n;
        if tableau.inside.is_empty() {
            return;
        }
        self.raw.fill(0.0);
        add_rates(self.length, tableau.inside, &self.rates, &mut self.raw);
        self.level_out();
        self.stored.fill(0.0);
        s.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        self.smoothed.fill(0.0);
        if self.mixed {
            ladder.respond(s, self.level, &self.raw, &mut self.smoothed);
        }
        if self.at_charged_nodes(s, |trial| &trial.smoothed) {
            let both = self.charged.iter_mut().zip(&self.beside_charged);
            for ((d, plain), before) in both.zip(&self.charged_before) {
                *d = (*d * plain).abs().sqrt().max(before.abs());
            }
        }
        for (j, d) in self.slope[..n].iter_mut().enumerate() {
            let swing = match (self.own[j], self.storage[j]) {
                (true, _) => (self.raw[j] * self.smoothed[j]).abs().sqrt(),
                (false, 0.0) => self.smoothed[j].abs(),
                (false, storage) => (self.stored[j] / storage).abs(),
            };
            *d = d.abs().max(swing);
        }
    }

    /// Adds to the estimate how far the continuous solution is from the state with which it begins, where
    /// the rates there do not count: it shows what changes faster than the stages follow.
    pub fn look_back(&mut self, s: &mut Stepper, ladder: &mut Ladder, tableau: &Tableau) {
        let n = self.n;
        self.smoothed.copy_from_slice(&self.slope[..n]);
        let fit = self.evaluate(s, ladder, tableau, 0.0);
        for (raw, (x, z)) in self.raw.iter_mut().zip(self.point[..n].iter().zip(&self.first)) {
            *raw = if fit == Fit::Contradiction { 0.0 } else { x - z };
        }
        self.level_out();
        if self.at_charged_nodes(s, |trial| &trial.raw) {
            for (d, before) in self.charged.iter_mut().zip(&self.charged_before) {
                *d = (FIRST * d.abs()).max(before.abs());
            }
        }
        self.stored.fill(0.0);
        s.sys.linear.e.mul_add(1.0, &self.raw[..n], &mut self.stored);
        for j in 0..n {
            let storage = self.storage[j];
            let missed = if storage > 0.0 { self.stored[j] / storage } else { self.raw[j] };
            self.slope[j] = self.smoothed[j].abs().max(FIRST * missed.abs());
        }
    }

    /// The sources at `theta`, into `u`.
    pub fn look_up_sources(&mut self, s: &Stepper, theta: f64) {
        let t = self.start + theta * self.length;
        sources(&s.waveforms, t, self.start, self.corner, &mut self.u);
    }

    /// Keeps the point at `theta`, evaluated last, as one of the samples.
    pub fn remember(&mut self, k: usize, theta: f64, stages: usize) {
        let sample = &mut self.samples[k];
        (sample.theta, sample.open) = (Some(theta), self.open[stages]);
        sample.point.clone_from(&self.point);
        sample.slope.clone_from(&self.slope);
        sample.u.clone_from(&self.u);
    }

    /// Goes back to the sample at `theta` if there is one.
    fn recall(&mut self, theta: f64, stages: usize) -> Option<Fit> {
        let sample = self.samples.iter().find(|sample| sample.theta == Some(theta))?;
        self.open[stages] = sample.open;
        self.point.copy_from_slice(&sample.point);
        self.slope.copy_from_slice(&sample.slope);
        self.u.copy_from_slice(&sample.u);
        Some(if sample.open { Fit::Open } else { Fit::Solved })
    }

    /// Evaluates the continuous solution at `theta` (of the step): stored quantities from the
    /// polynomial, all others from the laws at that instant.
    pub fn evaluate(
        &mut self,
        s: &mut Stepper,
        ladder: &mut Ladder,
        tableau: &Tableau,
        theta: f64,
    ) -> Fit {
        // across ends of modes the solution tells the mode, too
        if let (false, Some(fit)) = (self.crossing, self.recall(theta, tableau.stages())) {
            return fit;
        }
        let (n, m) = (self.n, self.m);
        let h = self.length;
        let stage = tableau.gamma * h;
        let (value, slope) = tableau.weights(theta);
        self.from[..n].copy_from_slice(&self.first[..n]);
        self.from[n..].copy_from_slice(&self.first[n + m..]);
        let weights: [f64; MOST] = std::array::from_fn(|j| h * value[j] - stage * slope[j]);
        add_rates(1.0, &weights, &self.rates, &mut self.from);
        if let Some(smooth) = &mut s.smooth {
            // all unknowns lie near the polynomial through the stages
            self.guess.copy_from_slice(&self.first[..n]);
            add_rates(h, &value, &self.rates, &mut self.guess);
            self.plain.copy_from_slice(&self.guess);
            self.beside.correct(theta, &mut self.guess);
            smooth.newton.predict(&self.guess);
        }
        let t = if theta == 1.0 { self.start + h } else { self.start + theta * h };
        sources(&s.waveforms, t, self.start, self.corner, &mut self.u);
        let near = &self.stages[tableau.stages() - 1];
        let solve = self.way();
        let (level, from, u) = (self.level, &self.from[..], &self.u[..]);
        let fit = solve(
            ladder,
            s,
            StageProblem { level, t, from, u, near, keeps: false },
            &mut self.point,
        );
        if s.smooth.is_some() && fit != Fit::Contradiction {
            self.beside.keep(theta, &self.plain, &self.point);
        }
        self.open[tableau.stages()] = fit == Fit::Open;
        let stored = self.point[..n].iter().chain(&self.point[n + m..]);
        for ((d, x), b) in self.slope.iter_mut().zip(stored).zip(&self.from) {
            *d = (x - b) / stage;
        }
        fit
    }

    /// The outputs at `point`.
    pub fn write(&mut self, s: &mut Stepper, ladder: &Ladder, row: &mut [f64]) {
        let (z, rest) = self.point.split_at_mut(self.n);
        let (guards, f) = rest.split_at_mut(self.m);
        let pairs = s.active.iter().zip(&s.roles);
        for (i, (g, (&active, &role))) in guards.iter_mut().zip(pairs).enumerate() {
            *g = ladder.multiplier(i, *g, active, role, self.crossing);
        }
        let (rates, slope) = self.slope.split_at(self.n);
        s.recorder
            .outputs
            .write(&Quantities { z, l: guards, rates, u: &self.u, f: [f, slope] }, row);
    }

    /// The step has been accepted up to `theta`; what follows is its `smooth` continuation, or not.
    pub fn leave(&mut self, tableau: &Tableau, theta: f64, smooth: bool) {
        if smooth {
            self.past.keep(tableau, self.length, theta, &self.first, &mut self.stages);
        } else {
            self.past.forget();
        }
    }

    /// The rates of the next step at its begin are those of `slope`.
    pub fn continue_rates(&mut self) {
        self.rates[0].copy_from_slice(&self.slope);
    }

    /// The next step begins with these rates.
    pub fn begin_rates(&mut self, rates: &[f64]) {
        self.rates[0][..self.n].copy_from_slice(rates);
    }

    /// The end of the step as a point.
    pub fn take_end(&mut self, tableau: &Tableau) {
        let last = tableau.stages() - 1;
        self.u.copy_from_slice(&self.inputs[last]);
        self.open[last + 1] = self.open[last];
        self.point.copy_from_slice(&self.stages[last]);
        self.slope.copy_from_slice(&self.rates[last]);
    }
}
