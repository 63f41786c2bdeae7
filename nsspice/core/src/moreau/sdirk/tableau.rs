//! Singly diagonally implicit Runge-Kutta methods: every stage has the same matrix.

use std::f64::consts::FRAC_1_SQRT_2;

/// A point near which the solution is known when a stage is to be solved.
#[derive(Clone, Copy, Debug)]
pub enum Node {
    /// the end of a stage of the step before, or, behind them, its begin
    Past(usize),
    /// the begin of the step
    Begin,
    /// the end of a stage
    Stage(usize),
}
use Node::{Begin, Past, Stage};

/// A stiffly accurate, L-stable method with a continuous solution.
///
/// Stage i solves an implicit step of length `gamma h` that ends at `t + c_i h` and starts from
/// `z + h sum a_ij k_j`; the last stage is the new state.
pub struct Tableau {
    /// order of the solution
    pub order: u32,
    /// diagonal coefficient
    pub gamma: f64,
    /// where the stages end
    pub c: &'static [f64],
    /// coefficients below the diagonal
    pub a: &'static [&'static [f64]],
    /// weights of the rates in the error estimate
    pub error: &'static [f64],
    /// the error estimate is proportional to this power of the step
    pub error_order: i32,
    /// per stage the coefficients of theta, theta^2, ... in the continuous solution
    pub dense: &'static [&'static [f64]],
    /// the stage nearest to the middle of the step
    pub middle: usize,
    /// from which points each stage is predicted
    pub predictors: &'static [&'static [Node]],
}

const GAMMA2: f64 = 1.0 - FRAC_1_SQRT_2;
const RATIO2: f64 = GAMMA2 / FRAC_1_SQRT_2;
/// Scale of the first-order estimate `h (k2 - k1)`: such that an accepted step of an oscillation
/// with one radian per unit of time has about the error that the estimate says.
const WEIGHT2: f64 = 0.1;

/// Two stages, order two (Alexander 1977).
pub static SECOND: Tableau = Tableau {
    order: 2,
    gamma: GAMMA2,
    c: &[GAMMA2, 1.0],
    a: &[&[], &[FRAC_1_SQRT_2]],
    error: &[-WEIGHT2, WEIGHT2],
    error_order: 2,
    dense: &[&[1.0 + RATIO2, -FRAC_1_SQRT_2], &[-RATIO2, FRAC_1_SQRT_2]],
    middle: 0,
    predictors: &[&[Past(2), Past(0), Begin], &[Past(0), Begin, Stage(0)]],
};

/// Five stages, order four, continuous solution of order three (Hairer & Wanner, *Solving Ordinary
/// Differential Equations II*, section IV.6).
pub static FOURTH: Tableau = Tableau {
    order: 4,
    gamma: 0.25,
    c: &[0.25, 0.75, 0.55, 0.5, 1.0],
    a: &[
        &[],
        &[0.5],
        &[17.0 / 50.0, -1.0 / 25.0],
        &[371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0],
        &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
    ],
    error: &[-3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25],
    error_order: 4,
    dense: &[
        &[11.0 / 3.0, -463.0 / 72.0, 217.0 / 36.0, -20.0 / 9.0],
        &[11.0 / 2.0, -385.0 / 16.0, 661.0 / 24.0, -10.0],
        &[-125.0 / 18.0, 20125.0 / 432.0, -8875.0 / 216.0, 250.0 / 27.0],
        &[0.0, -85.0 / 4.0, 85.0 / 6.0, 0.0],
        &[-11.0 / 9.0, 557.0 / 108.0, -359.0 / 54.0, 80.0 / 27.0],
    ],
    middle: 3,
    predictors: &[
        &[Past(3), Past(1), Begin],
        &[Past(1), Begin, Stage(0)],
        &[Begin, Stage(0), Stage(1)],
        &[Stage(0), Stage(2), Stage(1)],
        &[Begin, Stage(0), Stage(3), Stage(1)],
    ],
};

impl Tableau {
    /// The method of an order.
    pub fn of_order(order: u32) -> Option<&'static Tableau> {
        [&SECOND, &FOURTH].into_iter().find(|t| t.order == order)
    }

    /// Number of stages.
    pub fn stages(&self) -> usize {
        self.c.len()
    }

    /// Weights of the rates in the solution at `theta` and in its derivative.
    pub fn weights(&self, theta: f64) -> ([f64; 5], [f64; 5]) {
        let (mut value, mut slope) = ([0.0; 5], [0.0; 5]);
        for (j, coefficients) in self.dense.iter().enumerate() {
            for (p, &b) in coefficients.iter().enumerate().rev() {
                value[j] = value[j] * theta + b;
                slope[j] = slope[j] * theta + b * (p + 1) as f64;
            }
            value[j] *= theta;
        }
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full(t: &Tableau) -> Vec<Vec<f64>> {
        let s = t.stages();
        let row = |i: usize| {
            let mut row = vec![0.0; s];
            row[..i].copy_from_slice(t.a[i]);
            row[i] = t.gamma;
            row
        };
        (0..s).map(row).collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    /// Left and right sides of the order conditions with their orders, for weights at `theta`.
    fn conditions(t: &Tableau, b: &[f64], theta: f64) -> Vec<(i32, f64)> {
        let a = full(t);
        let times = |v: &[f64]| a.iter().map(|r| dot(r, v)).collect::<Vec<_>>();
        let power = |p: i32| t.c.iter().map(|c| c.powi(p)).collect::<Vec<_>>();
        let c = power(1);
        let (ac, c2) = (times(&c), power(2));
        let cac: Vec<f64> = c.iter().zip(&ac).map(|(x, y)| x * y).collect();
        let list: [(i32, Vec<f64>, f64); 8] = [
            (1, vec![1.0; t.stages()], 1.0),
            (2, c, 2.0),
            (3, c2.clone(), 3.0),
            (3, ac.clone(), 6.0),
            (4, power(3), 4.0),
            (4, cac, 8.0),
            (4, times(&c2), 12.0),
            (4, times(&ac), 24.0),
        ];
        list.into_iter().map(|(p, v, d)| (p, dot(b, &v) - theta.powi(p) / d)).collect()
    }

    #[test]
    fn order_conditions_hold() {
        for t in [&SECOND, &FOURTH] {
            let a = full(t);
            for (row, &c) in a.iter().zip(t.c) {
                assert!((row.iter().sum::<f64>() - c).abs() < 1e-15);
            }
            let last = &a[t.stages() - 1];
            for (p, defect) in conditions(t, last, 1.0) {
                assert!(p > t.order as i32 || defect.abs() < 1e-14, "order {p}: {defect}");
            }
            let embedded: Vec<f64> = last.iter().zip(t.error).map(|(b, e)| b - e).collect();
            for (p, defect) in conditions(t, &embedded, 1.0) {
                assert!(p >= t.error_order || defect.abs() < 1e-14, "embedded {p}: {defect}");
            }
        }
    }

    #[test]
    fn continuous_solutions_have_their_order_everywhere() {
        for (t, order) in [(&SECOND, 2), (&FOURTH, 3)] {
            for theta in [0.1, 0.37, 0.5, 0.9, 1.0] {
                let (value, slope) = t.weights(theta);
                for (p, defect) in conditions(t, &value[..t.stages()], theta) {
                    assert!(p > order || defect.abs() < 1e-13, "{theta}, order {p}: {defect}");
                }
                let d = 1e-6;
                let (up, down) = (t.weights(theta + d).0, t.weights(theta - d).0);
                for j in 0..t.stages() {
                    assert!((slope[j] - (up[j] - down[j]) / (2.0 * d)).abs() < 1e-6);
                }
            }
            let end = t.weights(1.0).0;
            for (b, last) in end.iter().zip(&full(t)[t.stages() - 1]) {
                assert!((b - last).abs() < 1e-13, "the end of the step is its last stage");
            }
        }
    }

    #[test]
    fn stiff_parts_vanish_in_one_step() {
        for t in [&SECOND, &FOURTH] {
            for mu in [-1e3, -1e6, -1e9f64] {
                let mut k = Vec::new();
                let mut last = 1.0;
                for row in t.a {
                    let base = 1.0 + dot(row, &k);
                    last = base / (1.0 - t.gamma * mu);
                    k.push(mu * last);
                }
                assert!(last.abs() < 20.0 / mu.abs(), "{mu}: {last}");
            }
        }
    }
}
