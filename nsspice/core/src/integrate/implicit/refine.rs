//! Solutions of one mode to the last digit, where rounding of the step equations shows.
//!
//! Storage next to small conductances: in the column of a map, the part of a capacitor's voltage that
//! reaches a node connected by 1 MOhm is small, and multiplied by hundreds of volts in every step.  It is found by
//! refinement with residuals in twice the working precision (J. H. Wilkinson 1963; T. Ogita,
//! S. M. Rump, S. Oishi, *Accurate sum and dot product*, SIAM J. Sci. Comput. 26, 2005).

use super::matrices::StepMatrices;
use crate::mlcp::ModeFactor;

/// A first correction below this part of the largest entry: nothing to refine.
const FINE: f64 = 1e-14;
/// Corrections below this part change nothing that matters.
const DONE: f64 = 1e-18;
const SWEEPS: usize = 6;

/// A sum with twice the working precision.
#[derive(Clone, Copy, Default)]
struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    fn add(&mut self, x: f64) {
        let sum = self.high + x;
        let part = sum - self.high;
        self.low += (self.high - (sum - part)) + (x - part);
        self.high = sum;
    }

    fn subtract_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.low -= a.mul_add(b, -product);
        self.add(-product);
    }

    fn subtract(&mut self, a: f64, x: Twofold) {
        self.subtract_product(a, x.high);
        self.low -= a * x.low;
    }

    fn value(self) -> f64 {
        self.high + self.low
    }
}

/// Refines `x = [z; l]`, the solution of a regular mode with right-hand side `rhs`.
pub fn refine(
    matrices: &StepMatrices,
    factor: &ModeFactor,
    active: &[bool],
    rhs: &[f64],
    x: &mut [f64],
    work: &mut [f64],
) {
    let mut exact: Vec<_> = x.iter().map(|&high| Twofold { high, low: 0.0 }).collect();
    let mut step = vec![0.0; x.len()];
    let mut last = f64::INFINITY;
    for sweep in 0..SWEEPS {
        residual(matrices, active, rhs, &exact, &mut step);
        factor.solve(&mut step, work);
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let (change, size) = (largest(&step[..matrices.n]), largest(&x[..matrices.n]));
        if change.is_nan() || change >= 0.5 * last {
            break; // it does not converge: what is there is what can be had
        }
        last = change;
        for (e, &d) in exact.iter_mut().zip(&step) {
            e.add(d);
        }
        for (x, e) in x.iter_mut().zip(&exact) {
            *x = e.value();
        }
        if change <= if sweep == 0 { FINE } else { DONE } * size {
            break;
        }
    }
}

fn residual(matrices: &StepMatrices, active: &[bool], rhs: &[f64], x: &[Twofold], out: &mut [f64]) {
    let n = matrices.n;
    let (z, l) = x.split_at(n);
    for (i, r) in out.iter_mut().enumerate() {
        let mut sum = Twofold { high: rhs[i], low: 0.0 };
        let mut take = |matrix: &crate::sparse::Csc, row: usize, v: &[Twofold], sign: f64| {
            let (indices, values) = matrix.col(row);
            for (&j, &value) in indices.iter().zip(values) {
                sum.subtract(sign * value, v[j]);
            }
        };
        if i < n {
            take(&matrices.carry_rows, i, z, 1.0);
            take(&matrices.g_rows, i, z, 1.0);
            take(&matrices.a_rows, i, l, 1.0);
        } else if active[i - n] {
            take(&matrices.b_rows, i - n, z, -1.0);
            take(&matrices.d_rows, i - n, l, 1.0);
        } else {
            sum = Twofold::default();
        }
        *r = sum.value();
    }
}
