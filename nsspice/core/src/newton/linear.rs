//! The linearised problem: Jacobian of a mode, factored anew when values or mode change.

use super::equations::Equations;
use crate::linear::Factor;
use crate::mlcp::equilibrate;
use crate::sparse::Csc;

/// A mode is singular if less than this part of a pivot survives.
const SINGULAR: f64 = 1e-13;

/// All that depends on the rate: linear part, scaling, factors.
pub(super) struct Assembly {
    pub rate: f64,
    /// last use, for eviction
    pub stamp: u64,
    /// `[[rate E + G, A], [-B, D]]`
    pub linear: Csc,
    /// coefficient of each entry of `Equations::entries`, and of each of `Equations::terms`
    pub entries: Vec<f64>,
    pub terms: Vec<f64>,
    /// the Jacobian with all pairs active, unscaled
    pub values: Vec<f64>,
    /// physical unknown = scale * scaled unknown; also multiplies the rows
    pub scale: Vec<f64>,
    scaled: bool,
    /// product of the two scales of each entry
    weight: Vec<f64>,
    jacobian: Csc,
    factor: Option<Factor>,
}

impl Assembly {
    pub fn new(eq: &Equations, rate: f64) -> Assembly {
        let mut linear = eq.pattern.clone();
        if rate != 0.0 {
            for (v, e) in linear.values.iter_mut().zip(&eq.storage) {
                *v += rate * e;
            }
        }
        // no division by an infinite step: charges that do not count may be infinite themselves
        let coefficient = |f: f64, q: f64| if rate == 0.0 || q == 0.0 { f } else { f + rate * q };
        Assembly {
            rate,
            stamp: 0,
            entries: eq.entries.iter().map(|e| coefficient(e.f, e.q)).collect(),
            terms: eq.terms.iter().map(|t| coefficient(t.f, t.q)).collect(),
            values: linear.values.clone(),
            scale: vec![1.0; eq.size()],
            scaled: false,
            weight: vec![1.0; linear.values.len()],
            jacobian: linear.clone(),
            linear,
            factor: None,
        }
    }

    /// Adds the derivatives of the functions to the linear part.
    pub fn linearise(&mut self, eq: &Equations, slopes: &[f64]) {
        self.values.copy_from_slice(&self.linear.values);
        for (entry, &c) in eq.entries.iter().zip(&self.entries) {
            if c != 0.0 {
                self.values[entry.at as usize] += c * slopes[entry.slot as usize];
            }
        }
    }

    /// Scales the present Jacobian so that its entries come near one.
    pub fn rescale(&mut self, eq: &Equations) {
        self.jacobian.values.copy_from_slice(&self.values);
        self.scale = equilibrate(&self.jacobian);
        self.scaled = true;
        self.factor = None;
        let _ = eq;
        for c in 0..self.jacobian.ncols {
            for at in self.jacobian.colptr[c]..self.jacobian.colptr[c + 1] {
                self.weight[at] = self.scale[self.jacobian.rowidx[at]] * self.scale[c];
            }
        }
    }

    /// Factors the present Jacobian in a mode, `mu` added to the scaled equations; false if it is
    /// singular.
    pub fn factorise(&mut self, eq: &Equations, active: &[bool], mu: f64) -> bool {
        if !self.scaled {
            self.rescale(eq);
        }
        if self.try_factorise(eq, active, mu) {
            return true;
        }
        // values far from those that the scaling was made for look singular
        self.rescale(eq);
        self.try_factorise(eq, active, mu)
    }

    fn try_factorise(&mut self, eq: &Equations, active: &[bool], mu: f64) -> bool {
        let (n, jacobian) = (eq.n, &mut self.jacobian.values);
        for ((j, v), w) in jacobian.iter_mut().zip(&self.values).zip(&self.weight) {
            *j = v * w;
        }
        if mu != 0.0 {
            for &at in &eq.diagonal[..n] {
                jacobian[at as usize] += mu;
            }
        }
        for (i, _) in active.iter().enumerate().filter(|(_, &a)| !a) {
            for &(_, at) in eq.ordering.row(n + i) {
                jacobian[at as usize] = 0.0;
            }
            jacobian[eq.diagonal[n + i] as usize] = 1.0;
        }
        match &mut self.factor {
            Some(factor) => {
                factor.refactor(&self.jacobian);
                if factor.pivot_ratio() <= SINGULAR {
                    factor.factor(&self.jacobian); // the old order of pivots may be to blame
                }
            }
            None => self.factor = Some(Factor::new(&self.jacobian, &eq.ordering)),
        }
        self.factor.as_ref().is_some_and(|f| f.pivot_ratio() > SINGULAR)
    }

    /// `x := J^-1 x` in physical units, in the mode factored last.
    pub fn solve(&self, n: usize, active: &[bool], x: &mut [f64], work: &mut [f64]) {
        let scale = &self.scale;
        for (v, s) in x[..n].iter_mut().zip(scale) {
            *v *= s;
        }
        for ((v, s), &on) in x[n..].iter_mut().zip(&scale[n..]).zip(active) {
            *v = if on { *v * s } else { *v / s };
        }
        let solved = self.factor.as_ref().map(|f| f.solve(x, work));
        if !matches!(solved, Some(Ok(()))) {
            x.fill(f64::NAN);
        }
        for (v, s) in x.iter_mut().zip(scale) {
            *v *= s;
        }
    }
}
