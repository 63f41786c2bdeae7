//! One step in a fixed mode, its error, and its continuous solution.

use super::combine::{add_rates, scaled_difference};
use super::controller::estimate::Estimate;
use super::controller::stage_equations::{Fit, StageEquations, StageProblem};
use super::predict::Beginning;
use super::tableau::{Tableau, MOST};
use crate::integrate::implicit::outputs::Quantities;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::implicit::time_grid::evaluate_after;

/// After so many steps without a solution from one point other ways to one are tried: behind a fold of the
/// laws shorter ones have none either.  Not from this level on: there a single implicit step is at hand,
/// and where a winding tears the last charge out of a junction every way ends in megavolts.
const TRIED: u32 = 4;
const DEEP: usize = 24;

/// How the equations of a stage are solved: [`StageEquations::solve`] or [`StageEquations::cross`].
type Way = fn(&mut StageEquations, &mut Stepper, StageProblem, &mut [f64]) -> Fit;

/// The stages of a step.
pub struct Stages {
    /// unknowns, guards and functions at the end of each
    pub ends: Vec<Vec<f64>>,
    /// where each begins: unknowns, then functions
    pub bases: Vec<Vec<f64>>,
    /// the sources at the end of each
    pub inputs: Vec<Vec<f64>>,
    /// rate of each: of the unknowns that carry storage, then of the functions
    pub rates: Vec<Vec<f64>>,
    /// stages, and last the point, that were solved in a mode that leaves something open, or in any
    pub open: Vec<bool>,
}

/// A point of the continuous solution of a step.
#[derive(Clone, Default)]
pub struct CurvePoint {
    /// unknowns, guards and functions
    pub x: Vec<f64>,
    /// rates of the unknowns and functions
    pub slope: Vec<f64>,
    /// sources
    pub u: Vec<f64>,
}

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
    /// first breakpoint of a source after the begin [s]
    pub breakpoint: f64,
    /// steps from here that had no solution
    pub unsolved: u32,
    /// unknowns, guards and functions at the begin
    pub first: Vec<f64>,
    pub stages: Stages,
    /// each stage is solved in the mode that its laws ask for
    pub crossing: bool,
    /// then: the mode at the end of the step, and whether any stage is in another than its begin
    pub mode: Vec<bool>,
    pub crossed: bool,
    /// what it errs by
    pub estimate: Estimate,
    /// where Newton's method begins
    beginning: Beginning,
    /// scratch: unknowns and functions with which an implicit step begins
    from: Vec<f64>,
    /// the point evaluated last
    pub at: CurvePoint,
    /// two points at which guards have been looked at: rows and the end of the step ask for them again
    pub samples: [Sample; 2],
}

/// A point of the continuous solution of a step that is cut.
#[derive(Clone, Default)]
pub struct Sample {
    /// where it is, as a part of the step; nothing if it is not of this one
    theta: Option<f64>,
    pub at: CurvePoint,
    open: bool,
}

/// The stages could not be computed up to the end.
pub struct Broken {
    /// end of the stage that has no solution in this mode, as a part of the step
    pub at: f64,
}

impl Trial {
    pub fn new(s: &Stepper, tableau: &Tableau) -> Trial {
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let p = s.solver.smooth.as_ref().map_or(0, |smooth| smooth.f.len());
        let many = |len: usize| vec![vec![0.0; len]; tableau.stages()];
        Trial {
            start: 0.0,
            length: 0.0,
            level: 0,
            breakpoint: f64::INFINITY,
            unsolved: 0,
            first: vec![0.0; n + m + p],
            stages: Stages {
                ends: many(n + m + p),
                bases: many(n + p),
                inputs: many(s.state.u0.len()),
                rates: many(n + p),
                open: vec![false; tableau.stages() + 1],
            },
            crossing: false,
            mode: vec![false; m],
            crossed: false,
            estimate: Estimate::new(s),
            beginning: Beginning::new(tableau.stages(), n, m + p),
            from: vec![0.0; n + p],
            at: CurvePoint {
                x: vec![0.0; n + m + p],
                slope: vec![0.0; n + p],
                u: vec![0.0; s.state.u0.len()],
            },
            samples: Default::default(),
            n,
            m,
        }
    }

    /// How a point is solved.
    fn way(&self) -> Way {
        if self.crossing {
            StageEquations::cross
        } else {
            StageEquations::solve
        }
    }

    /// Computes the stages of a step at `level` from the state of `s`; `first` has been set.
    pub fn compute(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        tableau: &Tableau,
        level: usize,
    ) -> Result<(), Broken> {
        let (n, m) = (self.n, self.m);
        self.level = level;
        self.length = stage_equations.length(level);
        self.samples.iter_mut().for_each(|sample| sample.theta = None);
        self.crossed = false;
        let solve = self.way();
        let h = self.length;
        let rate = 1.0 / (tableau.gamma * h);
        if tableau.first() > 0 {
            self.stages.ends[0].copy_from_slice(&self.first);
            self.stages.inputs[0].copy_from_slice(&s.state.u0);
        }
        for i in tableau.first()..tableau.stages() {
            let t = self.start + tableau.c[i] * h;
            let u = &mut self.stages.inputs[i];
            evaluate_after(&s.waveforms, t, self.start, self.breakpoint, u);
            let (done, rest) = self.stages.ends.split_at_mut(i);
            let (base, x) = (&mut self.stages.bases[i], &mut rest[0]);
            base[..n].copy_from_slice(&self.first[..n]);
            base[n..].copy_from_slice(&self.first[n + m..]);
            add_rates(h, tableau.a[i], &self.stages.rates, base);
            fault!("stage_coefficient" => {
                let first = tableau.a[i].iter().position(|a| *a != 0.0).unwrap_or(i);
                let weights: Vec<f64> = (0..i).map(|j| if j == first { 0.01 * tableau.a[i][j] } else { 0.0 }).collect();
                add_rates(h, &weights, &self.stages.rates, base);
            });
            // the last stage but one is a good beginning for Newton's method
            let near = done.last().unwrap_or(&self.first);
            if let Some(smooth) = &mut s.solver.smooth {
                if let Some(guess) = self.beginning.of_stage(tableau, i, h, &self.first, done) {
                    smooth.newton.predict(guess);
                }
                smooth.newton.be_brief(level >= DEEP || self.unsolved < TRIED);
            }
            let fit = solve(
                stage_equations,
                s,
                StageProblem { level, t, from: base, u, near, keeps: true },
                x,
            );
            if fit == Fit::Contradiction {
                return Err(Broken { at: tableau.c[i] });
            }
            if self.crossing {
                self.mode.clone_from(&stage_equations.met);
                self.crossed |= self.mode != s.state.active;
            }
            self.stages.open[i] = fit == Fit::Open;
            #[cfg(feature = "faults")]
            let rate = fault!("stage_rate", rate, rate * (1.0 + 1e-3));
            #[cfg(feature = "faults")]
            if i + 1 == tableau.stages() {
                fault!("steps_value_off_1e-5" => x[0] *= 1.0 + 1e-5);
                fault!("steps_value_off_1e-3" => x[0] *= 1.0 + 1e-3);
            }
            let (rates, function_rates) = self.stages.rates[i].split_at_mut(n);
            scaled_difference(rate, &x[..n], &base[..n], rates);
            scaled_difference(rate, &x[n + m..], &base[n..], function_rates);
        }
        Ok(())
    }

    /// The estimated error of each unknown: the rates weighted, and, where the method
    /// asks for it, smoothed by one solve with the matrix of the stages so that it stays bounded for
    /// stiff parts and leaves constrained unknowns alone.
    pub fn estimate(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        tableau: &Tableau,
    ) {
        let last = tableau.stages() - 1;
        let (base, end) = (&self.stages.bases[last], &self.stages.ends[last]);
        self.from.copy_from_slice(base);
        add_rates(self.length, tableau.error, &self.stages.rates, &mut self.from);
        self.estimate.begin(&self.from, base);
        if s.solver.smooth.is_some() {
            self.estimate.smooth(s, stage_equations, self.level);
        } else {
            // of a step from mode to mode, in the last
            let mut turn = |s: &mut Stepper| {
                if self.crossing {
                    std::mem::swap(&mut self.mode, &mut s.state.active);
                    s.state.epoch += 1;
                }
            };
            turn(s);
            let (x, t) = (&mut self.at.x, self.start + self.length);
            let (level, near, u) = (self.level, &end[..], &self.stages.inputs[last][..]);
            stage_equations.solve(
                s,
                StageProblem { level, t, from: &self.from, u, near, keeps: true },
                x,
            );
            turn(s);
            self.estimate.compare(x, end);
        }
        self.estimate.finish(s, tableau, self.length, &end[..self.n]);
    }

    /// Adds to the estimate what the continuous solution has beyond Hermite's cubic, less where that is no more than
    /// `shown` times the estimate.
    pub fn look_inside(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        tableau: &Tableau,
        shown: f64,
    ) {
        if !tableau.inside.is_empty() {
            let (level, weights) = (self.level, tableau.inside);
            self.estimate.look_inside(
                s,
                stage_equations,
                level,
                self.length,
                (weights, shown),
                &self.stages.rates,
            );
        }
    }

    /// Adds to the estimate how far the continuous solution is from the state with which it begins, where
    /// the rates there do not count: it shows what changes faster than the stages follow.
    pub fn look_back(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        tableau: &Tableau,
    ) {
        let found = self.evaluate(s, stage_equations, tableau, 0.0) != Fit::Contradiction;
        let (x, first) = (&self.at.x[..self.n], &self.first[..self.n]);
        self.estimate.look_back(s, found.then_some(x), first);
    }

    /// The sources at `theta`, into `at`.
    pub fn look_up_sources(&mut self, s: &Stepper, theta: f64) {
        let t = self.start + theta * self.length;
        evaluate_after(&s.waveforms, t, self.start, self.breakpoint, &mut self.at.u);
    }

    /// Keeps the point at `theta`, evaluated last, as one of the samples.
    pub fn remember(&mut self, k: usize, theta: f64, stages: usize) {
        let sample = &mut self.samples[k];
        (sample.theta, sample.open) = (Some(theta), self.stages.open[stages]);
        sample.at.x.clone_from(&self.at.x);
        sample.at.slope.clone_from(&self.at.slope);
        sample.at.u.clone_from(&self.at.u);
    }

    /// Goes back to the sample at `theta` if there is one.
    fn recall(&mut self, theta: f64, stages: usize) -> Option<Fit> {
        let sample = self.samples.iter().find(|sample| sample.theta == Some(theta))?;
        self.stages.open[stages] = sample.open;
        self.at.x.copy_from_slice(&sample.at.x);
        self.at.slope.copy_from_slice(&sample.at.slope);
        self.at.u.copy_from_slice(&sample.at.u);
        Some(if sample.open { Fit::Open } else { Fit::Solved })
    }

    /// Evaluates the continuous solution at `theta` (of the step): stored quantities from the
    /// polynomial, all others from the laws at that instant.
    pub fn evaluate(
        &mut self,
        s: &mut Stepper,
        stage_equations: &mut StageEquations,
        tableau: &Tableau,
        theta: f64,
    ) -> Fit {
        // across ends of modes the solution also gives the mode
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
        #[cfg(feature = "faults")]
        let weights = fault!("dense_output", weights, {
            let off = 1.0 + 1e-3 * theta * (1.0 - theta);
            weights.map(|w| w * off)
        });
        add_rates(1.0, &weights, &self.stages.rates, &mut self.from);
        if let Some(smooth) = &mut s.solver.smooth {
            // all unknowns lie near the polynomial through the stages
            let (first, rates) = (&self.first[..n], &self.stages.rates);
            smooth.newton.predict(self.beginning.of_point(h, &value, first, rates));
        }
        let t = if theta == 1.0 { self.start + h } else { self.start + theta * h };
        evaluate_after(&s.waveforms, t, self.start, self.breakpoint, &mut self.at.u);
        let near = &self.stages.ends[tableau.stages() - 1];
        let solve = self.way();
        let (level, from, u) = (self.level, &self.from[..], &self.at.u[..]);
        let fit = solve(
            stage_equations,
            s,
            StageProblem { level, t, from, u, near, keeps: false },
            &mut self.at.x,
        );
        self.stages.open[tableau.stages()] = fit == Fit::Open;
        let stored = self.at.x[..n].iter().chain(&self.at.x[n + m..]);
        for ((d, x), b) in self.at.slope.iter_mut().zip(stored).zip(&self.from) {
            *d = (x - b) / stage;
        }
        fit
    }

    /// Whether guards of the point evaluated last are those of a complementarity problem, which may have found another
    /// mode.
    pub fn open(&self) -> bool {
        self.crossing || self.stages.open.last().copied().unwrap_or(false)
    }

    /// The outputs at the point evaluated last.
    pub fn write(&mut self, s: &mut Stepper, stage_equations: &StageEquations, row: &mut [f64]) {
        let open = self.open();
        let (z, rest) = self.at.x.split_at_mut(self.n);
        let (guards, f) = rest.split_at_mut(self.m);
        let pairs = s.state.active.iter().zip(&s.state.roles);
        for (i, (g, (&active, &role))) in guards.iter_mut().zip(pairs).enumerate() {
            *g = stage_equations.resistances.multiplier(i, *g, active, role, open);
        }
        let (rates, slope) = self.at.slope.split_at(self.n);
        s.recorder
            .outputs
            .write(&Quantities { z, l: guards, rates, u: &self.at.u, f: [f, slope] }, row);
    }

    /// The step has been accepted up to `theta`; what follows is its `smooth` continuation, or not.
    pub fn leave(&mut self, tableau: &Tableau, theta: f64, smooth: bool) {
        if smooth {
            self.beginning.past.keep(
                tableau,
                self.length,
                theta,
                &self.first,
                &mut self.stages.ends,
            );
        } else {
            self.beginning.past.forget();
        }
    }

    /// The rates of the next step at its begin are those of the point evaluated last.
    pub fn continue_rates(&mut self) {
        self.stages.rates[0].copy_from_slice(&self.at.slope);
        fault!("first_rate" => self.stages.rates[0].iter_mut().for_each(|rate| *rate *= 1.05));
    }

    /// The next step begins with these rates.
    pub fn begin_rates(&mut self, rates: &[f64]) {
        self.stages.rates[0][..self.n].copy_from_slice(rates);
    }

    /// The end of the step as a point.
    pub fn take_end(&mut self, tableau: &Tableau) {
        let last = tableau.stages() - 1;
        self.at.u.copy_from_slice(&self.stages.inputs[last]);
        self.stages.open[last + 1] = self.stages.open[last];
        self.at.x.copy_from_slice(&self.stages.ends[last]);
        self.at.slope.copy_from_slice(&self.stages.rates[last]);
    }
}
