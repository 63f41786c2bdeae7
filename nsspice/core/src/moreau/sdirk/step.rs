//! One step in a fixed mode, its error, and its continuous solution.

use super::super::stepper::Stepper;
use super::ladder::{Fit, Ladder};
use super::tableau::Tableau;
use crate::waveform::{Side, Waveform};

/// A step from `start`: stages, rates, and what is needed to evaluate it anywhere.
pub struct Trial {
    /// begin [s]
    pub start: f64,
    /// length [s]
    pub length: f64,
    /// which matrices
    pub level: usize,
    /// first corner of a source after the begin [s]
    pub corner: f64,
    /// unknowns and guards at the begin
    pub first: Vec<f64>,
    /// unknowns and guards at the end of each stage
    pub stages: Vec<Vec<f64>>,
    /// where each stage begins
    pub bases: Vec<Vec<f64>>,
    /// rate of each stage, of the unknowns that carry storage
    rates: Vec<Vec<f64>>,
    /// scratch
    from: Vec<f64>,
    pub u: Vec<f64>,
    /// a point of the continuous solution: unknowns and guards
    pub point: Vec<f64>,
    /// rates of the unknowns there
    pub slope: Vec<f64>,
}

/// The stages could not be computed up to the end.
pub struct Broken {
    /// end of the stage that has no solution in this mode, as a part of the step
    pub at: f64,
}

fn sources(waveforms: &[Waveform], t: f64, start: f64, corner: f64, u: &mut [f64]) {
    for (u, w) in u.iter_mut().zip(waveforms) {
        *u = if t <= corner { w.value(t, Side::Left) } else { w.continued(t, start, corner) };
    }
}

impl Trial {
    pub fn new(s: &Stepper, tableau: &Tableau) -> Trial {
        let (n, m) = (s.z.len(), s.l.len());
        let many = |len: usize| vec![vec![0.0; len]; tableau.stages()];
        Trial {
            start: 0.0,
            length: 0.0,
            level: 0,
            corner: f64::INFINITY,
            first: vec![0.0; n + m],
            stages: many(n + m),
            bases: many(n),
            rates: many(n),
            from: vec![0.0; n],
            u: vec![0.0; s.u0.len()],
            point: vec![0.0; n + m],
            slope: vec![0.0; n],
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
        let n = s.z.len();
        self.level = level;
        self.length = ladder.length(level);
        let h = self.length;
        let rate = 1.0 / (tableau.gamma * h);
        for i in 0..tableau.stages() {
            let t = self.start + tableau.c[i] * h;
            sources(&s.waveforms, t, self.start, self.corner, &mut self.u);
            let (base, x) = (&mut self.bases[i], &mut self.stages[i]);
            base.copy_from_slice(&self.first[..n]);
            for (&a, k) in tableau.a[i].iter().zip(&self.rates) {
                add(a * h, k, base);
            }
            let fit = ladder.solve(s, level, base, &self.u, &self.first, x);
            if fit == Fit::Contradiction {
                return Err(Broken { at: tableau.c[i] });
            }
            for ((k, x), b) in self.rates[i].iter_mut().zip(x.iter()).zip(base.iter()) {
                *k = (x - b) * rate;
            }
        }
        Ok(())
    }

    /// The estimated error of each unknown, into `slope`: the rates weighted, and smoothed by one
    /// solve with the matrix of the stages so that it stays bounded for stiff parts and leaves
    /// constrained unknowns alone.
    pub fn estimate(&mut self, s: &mut Stepper, ladder: &mut Ladder, tableau: &Tableau) {
        let last = tableau.stages() - 1;
        self.from.copy_from_slice(&self.bases[last]);
        for (&e, k) in tableau.error.iter().zip(&self.rates) {
            if e != 0.0 {
                add(e * self.length, k, &mut self.from);
            }
        }
        let x = &mut self.point;
        ladder.solve(s, self.level, &self.from, &self.u, &self.stages[last], x);
        for ((d, x), end) in self.slope.iter_mut().zip(&*x).zip(&self.stages[last]) {
            *d = x - end;
        }
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
        let n = s.z.len();
        let h = self.length;
        let stage = tableau.gamma * h;
        let (value, slope) = tableau.weights(theta);
        self.from.copy_from_slice(&self.first[..n]);
        for (j, k) in self.rates.iter().enumerate() {
            add(h * value[j] - stage * slope[j], k, &mut self.from);
        }
        let t = if theta == 1.0 { self.start + h } else { self.start + theta * h };
        sources(&s.waveforms, t, self.start, self.corner, &mut self.u);
        let near = &self.stages[tableau.stages() - 1];
        let fit = ladder.solve(s, self.level, &self.from, &self.u, near, &mut self.point);
        for ((d, x), b) in self.slope.iter_mut().zip(&self.point).zip(&self.from) {
            *d = (x - b) / stage;
        }
        fit
    }

    /// The end of the step as a point.
    pub fn take_end(&mut self, s: &Stepper, tableau: &Tableau) {
        let last = tableau.stages() - 1;
        sources(&s.waveforms, self.start + self.length, self.start, self.corner, &mut self.u);
        self.point.copy_from_slice(&self.stages[last]);
        self.slope.copy_from_slice(&self.rates[last]);
    }
}

fn add(factor: f64, v: &[f64], out: &mut [f64]) {
    for (o, v) in out.iter_mut().zip(v) {
        *o += factor * v;
    }
}
