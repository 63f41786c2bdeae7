//! One mode (which pairs are active) as a linear system, factored.

use super::model::Model;
use crate::dense::LeastNorm;
use crate::linear::Factor;
use crate::sparse::Csc;
use std::sync::{Arc, OnceLock};

/// A mode is singular if its smallest pivot is below this part of the largest.
const SINGULAR: f64 = 1e-13;
/// Up to this many unknowns a singular mode is solved by its pseudo-inverse.
const DENSE: usize = 160;
/// Proximal weight (in the scaled system) that stands in for it beyond.
const PROXIMAL: f64 = 1e-7;
const SWEEPS: usize = 4;

/// Weights added to the diagonal of the scaled equations; 0 is the problem itself.
pub(crate) const LEVELS: [f64; 4] = [0.0, 1e-6, 1e-3, 1e-4];

/// The factored equations of one mode, in physical units.
///
/// Rows: `K z + A l = r`; for an active pair `-B z + D l = r` (with `r = -q`: zero slack), for an
/// inactive one `l = r`.
pub struct ModeFactor {
    model: Arc<Model>,
    active: Box<[bool]>,
    mu: f64,
    factor: Factor,
    regular: bool,
    nearest: OnceLock<Nearest>,
}

/// What finds the nearest solution of a singular mode.
enum Nearest {
    Dense(LeastNorm),
    /// factor of the Jacobian plus a multiple of the identity: for monotone problems the
    /// Jacobian and its transpose have the same kernel, so that the iteration
    /// `x += (J + mu I)^-1 (r - J x)` leaves the kernel's part of x alone
    Proximal(Factor),
}

impl ModeFactor {
    pub(crate) fn new(model: &Arc<Model>, level: usize, active: &[bool]) -> ModeFactor {
        let mu = LEVELS[level];
        let factor = factor(model, active, mu);
        let ratio = factor.pivot_ratio();
        ModeFactor {
            model: model.clone(),
            active: active.into(),
            mu,
            factor,
            regular: ratio > SINGULAR,
            nearest: OnceLock::new(),
        }
    }

    /// Whether the mode has exactly one solution for every right-hand side.
    pub fn regular(&self) -> bool {
        self.regular
    }

    /// Length of the work space that `solve` and `correct` need.
    pub fn work_len(&self) -> usize {
        4 * self.model.size()
    }

    /// Memory held [bytes], roughly.
    pub(crate) fn bytes(&self) -> usize {
        let extra = match self.nearest.get() {
            Some(Nearest::Dense(_)) => 8 * self.model.size().pow(2),
            Some(Nearest::Proximal(_)) => self.model.factor_bytes,
            None => 0,
        };
        self.model.factor_bytes + self.active.len() + extra + 200
    }

    /// Solves the equations of a regular mode: right-hand side in, solution `[z; l]` out.
    pub fn solve(&self, x: &mut [f64], work: &mut [f64]) {
        self.solve_with(&self.factor, x, work);
    }

    fn solve_with(&self, factor: &Factor, x: &mut [f64], work: &mut [f64]) {
        self.scale_rows(x);
        if factor.solve(x, work).is_err() {
            x.fill(f64::NAN);
        }
        for (v, &s) in x.iter_mut().zip(&self.model.scale) {
            *v *= s;
        }
    }

    /// The solution nearest to `x` (in the scaled norm) for the given right-hand side: `x += J^+
    /// (rhs - J x)`, twice.  Works for singular modes; the nearest least-squares solution if the
    /// equations contradict each other.
    pub fn correct(&self, x: &mut [f64], rhs: &[f64], work: &mut [f64]) {
        let size = self.model.size();
        let (defect, work) = work.split_at_mut(size);
        // exactly, so that what follows cannot trade it for other unknowns
        for (i, _) in self.active.iter().enumerate().filter(|(_, &a)| !a) {
            x[self.model.n + i] = rhs[self.model.n + i];
        }
        let sweeps = if self.regular || size <= DENSE { 2 } else { SWEEPS };
        for _ in 0..sweeps {
            self.defect(x, rhs, defect);
            if self.regular {
                self.solve_with(&self.factor, defect, work);
            } else {
                match self.nearest.get_or_init(|| self.make_nearest()) {
                    Nearest::Dense(pseudo) => {
                        let (step, work) = work.split_at_mut(size);
                        self.scale_rows(defect);
                        step.fill(0.0);
                        pseudo.correct(defect, step, work);
                        for ((v, d), s) in defect.iter_mut().zip(step).zip(&self.model.scale) {
                            *v = *d * s;
                        }
                    }
                    Nearest::Proximal(factor) => self.solve_with(factor, defect, work),
                }
            }
            for (v, d) in x.iter_mut().zip(defect.iter()) {
                *v += d;
            }
        }
    }

    /// `out = rhs - J x`
    fn defect(&self, x: &[f64], rhs: &[f64], out: &mut [f64]) {
        let n = self.model.n;
        self.model.defect(rhs, x, out);
        if self.mu != 0.0 {
            for ((o, v), s) in out.iter_mut().zip(x).zip(&self.model.scale) {
                *o -= self.mu / (s * s) * v;
            }
        }
        for (i, _) in self.active.iter().enumerate().filter(|(_, &a)| !a) {
            out[n + i] = rhs[n + i] - x[n + i];
        }
    }

    /// Physical right-hand side to scaled one.
    fn scale_rows(&self, r: &mut [f64]) {
        let n = self.model.n;
        let scale = &self.model.scale;
        for (v, s) in r[..n].iter_mut().zip(scale) {
            *v *= s;
        }
        for ((v, s), &on) in r[n..].iter_mut().zip(&scale[n..]).zip(self.active.iter()) {
            *v = if on { *v * s } else { *v / s };
        }
    }

    fn make_nearest(&self) -> Nearest {
        if self.model.size() <= DENSE {
            let jacobian = jacobian(&self.model, &self.active, self.mu);
            if let Some(pseudo) = LeastNorm::new(&jacobian) {
                return Nearest::Dense(pseudo);
            }
        }
        Nearest::Proximal(factor(&self.model, &self.active, self.mu + PROXIMAL))
    }
}

fn jacobian(model: &Model, active: &[bool], mu: f64) -> Csc {
    let mut jacobian = model.scaled.clone();
    model.jacobian(|i| f64::from(u8::from(active[i])), mu, &mut jacobian.values);
    jacobian
}

fn factor(model: &Model, active: &[bool], mu: f64) -> Factor {
    Factor::new(&jacobian(model, active, mu), &model.ordering)
}
