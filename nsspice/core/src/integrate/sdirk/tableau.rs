//! Singly diagonally implicit Runge-Kutta methods: every stage has the same matrix.

use std::cmp::Ordering;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// The largest number of stages.
pub const MOST: usize = 6;
/// The largest degree of a continuous solution.
pub const DEGREE: usize = 4;

/// A point near which the solution is known when a stage is to be solved.
#[derive(Clone, Copy, Debug)]
pub enum Node {
    /// the end of a stage of the step before, or, after them, its begin
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
/// `z + h sum a_ij k_j`; the last stage is the new state.  Where the first stage is the begin of the
/// step itself (`c_0 = 0`), its rate is that of the end of the step before.
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
    /// the estimate has to be smoothed: that of a stiff part grows with its stiffness
    pub smoothed: bool,
    /// the error estimate is proportional to this power of the step
    pub error_order: i32,
    /// weights of the rates in what the continuous solution has beyond Hermite's cubic, at its largest
    pub inside: &'static [f64],
    /// weights of the rates in the coefficients of theta, theta^2, ... of the continuous solution
    pub dense: [[f64; MOST]; DEGREE],
    /// the stage nearest to the middle of the step
    pub middle: usize,
    /// from which points each stage is predicted
    pub predictors: &'static [&'static [Node]],
    /// the method of the first step after a jump or breakpoint, where the rates at its begin are not known
    pub starter: Option<&'static Tableau>,
}

/// The coefficients of each stage, power by power.
const fn by_powers<const D: usize>(stages: &[[f64; D]]) -> [[f64; MOST]; DEGREE] {
    let mut powers = [[0.0; MOST]; DEGREE];
    let mut p = 0;
    while p < D {
        let mut j = 0;
        while j < stages.len() {
            powers[p][j] = stages[j][p];
            j += 1;
        }
        p += 1;
    }
    powers
}

const GAMMA2: f64 = 1.0 - FRAC_1_SQRT_2;
const RATIO2: f64 = GAMMA2 / FRAC_1_SQRT_2;
/// Scale of the first-order estimate `h (k2 - k1)`: such that an accepted step of an oscillation
/// with one radian per unit of time has about the error that the estimate says.
const WEIGHT2: f64 = 0.1;

/// Two stages, order two (Alexander 1977).
pub static SECOND: Tableau = Tableau { starter: Some(&START2), ..TWO };

/// The same, of which the first step after a jump or breakpoint has to show that it begins where the motion
/// does: the smoothed estimate forgives the decay of an inductor onto an open switch, which turns a diode on.
static START2: Tableau = TWO;

const TWO: Tableau = Tableau {
    order: 2,
    gamma: GAMMA2,
    c: &[GAMMA2, 1.0],
    a: &[&[], &[FRAC_1_SQRT_2]],
    error: &[-WEIGHT2, WEIGHT2],
    smoothed: true,
    error_order: 2,
    inside: &[],
    dense: by_powers(&[[1.0 + RATIO2, -FRAC_1_SQRT_2], [-RATIO2, FRAC_1_SQRT_2]]),
    middle: 0,
    predictors: &[&[Past(2), Past(0), Begin], &[Past(0), Begin, Stage(0)]],
    starter: None,
};

/// The weights of [`FOURTH`].
const B4: [f64; 6] = [
    (1181.0 - 987.0 * SQRT_2) / 13782.0,
    (1181.0 - 987.0 * SQRT_2) / 13782.0,
    47.0 * (1783.0 * SQRT_2 - 267.0) / 273343.0,
    -16.0 * (3525.0 * SQRT_2 - 22922.0) / 571953.0,
    -15625.0 * (97.0 + 376.0 * SQRT_2) / 90749876.0,
    0.25,
];
/// Those of its embedded formula of order three.
const EMBEDDED4: [f64; 6] = [
    -480923228411.0 / 4982971448372.0,
    -480923228411.0 / 4982971448372.0,
    6709447293961.0 / 12833189095359.0,
    3513175791894.0 / 6748737351361.0,
    -498863281070.0 / 6042575550617.0,
    2077005547802.0 / 8945017530137.0,
];
/// The quartic term of its continuous solution: `sum q_j c_j^p = 0` for `p < 3`, `1/4` for `p = 3`,
/// `sum q_i a_ij c_j^2 = 1/12`, which give order four; of those the one with the least errors of
/// order five.
const Q4: [f64; 6] = [
    -1.9972544699765011,
    2.3915815029401193,
    2.6507524170491683,
    -3.793088299505774,
    0.9671720593632138,
    -0.21916320987022808,
];
/// Scales of the estimates: such that errors of whole runs have about the size of the tolerance.
const WEIGHT4: f64 = 4.0;
pub const FIRST: f64 = 2.0;
const A31: f64 = (1.0 - SQRT_2) / 8.0;
const A41: f64 = (5.0 - 7.0 * SQRT_2) / 64.0;
const A51: f64 = -(13796.0 + 54539.0 * SQRT_2) / 125000.0;

/// An explicit and five implicit stages, order four, all stages of order two: ESDIRK4(3)6L[2]SA of
/// Kennedy & Carpenter (NASA/TM-2016-219173; Appl. Numer. Math. 146 (2019) 221,
/// doi:10.1016/j.apnum.2019.07.008).  Stiff parts, which the stages of [`START`] follow to first
/// order only, keep their order.  The continuous solution is Hermite's cubic and a quartic term that
/// vanishes with its slope at both ends, of order four.
pub static FOURTH: Tableau = Tableau {
    order: 4,
    gamma: 0.25,
    c: &[0.0, 0.5, (2.0 - SQRT_2) / 4.0, 0.625, 1.04, 1.0],
    a: &[
        &[],
        &[0.25],
        &[A31, A31],
        &[A41, A41, 7.0 * (1.0 + SQRT_2) / 32.0],
        &[
            A51,
            A51,
            (506605.0 + 132109.0 * SQRT_2) / 437500.0,
            166.0 * (376.0 * SQRT_2 - 97.0) / 109375.0,
        ],
        &[B4[0], B4[1], B4[2], B4[3], B4[4]],
    ],
    error: &[
        WEIGHT4 * (B4[0] - EMBEDDED4[0]),
        WEIGHT4 * (B4[1] - EMBEDDED4[1]),
        WEIGHT4 * (B4[2] - EMBEDDED4[2]),
        WEIGHT4 * (B4[3] - EMBEDDED4[3]),
        WEIGHT4 * (B4[4] - EMBEDDED4[4]),
        WEIGHT4 * (B4[5] - EMBEDDED4[5]),
    ],
    // smoothed with the slope at the end it would hide a diode that has begun to conduct
    smoothed: false,
    error_order: 4,
    // the quartic term is `theta^2 (1 - theta)^2` times this
    inside: &[Q4[0] / 16.0, Q4[1] / 16.0, Q4[2] / 16.0, Q4[3] / 16.0, Q4[4] / 16.0, Q4[5] / 16.0],
    dense: by_powers(&[
        [1.0, 3.0 * B4[0] - 2.0 + Q4[0], 1.0 - 2.0 * (B4[0] + Q4[0]), Q4[0]],
        [0.0, 3.0 * B4[1] + Q4[1], -2.0 * (B4[1] + Q4[1]), Q4[1]],
        [0.0, 3.0 * B4[2] + Q4[2], -2.0 * (B4[2] + Q4[2]), Q4[2]],
        [0.0, 3.0 * B4[3] + Q4[3], -2.0 * (B4[3] + Q4[3]), Q4[3]],
        [0.0, 3.0 * B4[4] + Q4[4], -2.0 * (B4[4] + Q4[4]), Q4[4]],
        [0.0, 3.0 * B4[5] - 1.0 + Q4[5], 1.0 - 2.0 * (B4[5] + Q4[5]), Q4[5]],
    ]),
    middle: 1,
    predictors: &[
        &[],
        &[Past(2), Past(1), Begin],
        &[Past(1), Begin, Stage(1)],
        &[Past(1), Begin, Stage(2), Stage(1)],
        &[Begin, Stage(2), Stage(1), Stage(3)],
        &[Stage(2), Stage(1), Stage(3), Stage(4)],
    ],
    starter: Some(&START),
};

/// Five stages, order four, continuous solution of order three (Hairer & Wanner, *Solving Ordinary
/// Differential Equations II*, section IV.6), after a first stage that counts for nothing, so that
/// it has as many as [`FOURTH`].
pub static START: Tableau = Tableau {
    order: 4,
    gamma: 0.25,
    c: &[0.0, 0.25, 0.75, 0.55, 0.5, 1.0],
    a: &[
        &[],
        &[0.0],
        &[0.0, 0.5],
        &[0.0, 17.0 / 50.0, -1.0 / 25.0],
        &[0.0, 371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0],
        &[0.0, 25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
    ],
    error: &[
        0.0,
        FIRST * (-3.0 / 16.0),
        FIRST * (-27.0 / 32.0),
        FIRST * (25.0 / 32.0),
        0.0,
        FIRST * 0.25,
    ],
    smoothed: true,
    error_order: 4,
    inside: &[],
    dense: by_powers(&[
        [0.0; DEGREE],
        [11.0 / 3.0, -463.0 / 72.0, 217.0 / 36.0, -20.0 / 9.0],
        [11.0 / 2.0, -385.0 / 16.0, 661.0 / 24.0, -10.0],
        [-125.0 / 18.0, 20125.0 / 432.0, -8875.0 / 216.0, 250.0 / 27.0],
        [0.0, -85.0 / 4.0, 85.0 / 6.0, 0.0],
        [-11.0 / 9.0, 557.0 / 108.0, -359.0 / 54.0, 80.0 / 27.0],
    ]),
    middle: 4,
    predictors: &[
        &[],
        &[Past(4), Past(2), Begin],
        &[Past(2), Begin, Stage(1)],
        &[Begin, Stage(1), Stage(2)],
        &[Stage(1), Stage(3), Stage(2)],
        &[Begin, Stage(1), Stage(4), Stage(2)],
    ],
    starter: None,
};

impl Tableau {
    /// The method of an order.
    pub fn of_order(order: u32) -> Option<&'static Tableau> {
        [&SECOND, &FOURTH].into_iter().find(|t| t.order == order)
    }

    /// Coefficient of a stage, those on the diagonal included.
    fn coefficient(&self, i: usize, j: usize) -> f64 {
        match i.cmp(&j) {
            _ if i < self.first() => 0.0,
            Ordering::Equal => self.gamma,
            Ordering::Greater => self.a[i].get(j).copied().unwrap_or(0.0),
            Ordering::Less => 0.0,
        }
    }

    /// An entry of the matrix of algebraic stability, `b_i a_ij + b_j a_ji - b_i b_j`: none of energy is taken by a
    /// step where it vanishes.
    pub fn algebraic(&self, i: usize, j: usize) -> f64 {
        let b = |j| self.coefficient(self.stages() - 1, j);
        b(i) * self.coefficient(i, j) + b(j) * self.coefficient(j, i) - b(i) * b(j)
    }

    /// Number of stages.
    pub fn stages(&self) -> usize {
        self.c.len()
    }

    /// The first stage that is to be solved: one that is the begin of the step is not.
    pub fn first(&self) -> usize {
        usize::from(self.c[0] == 0.0)
    }

    /// The rates at the begin of a step count.
    pub fn continues(&self) -> bool {
        self.first() > 0 && self.starter.is_some()
    }

    /// This is the first step: it has to be seen whether the continuous solution begins where it does.
    pub fn looks_back(&self) -> bool {
        self.starter.is_none()
    }

    /// The method of the next step, where the rates at its begin are `known` or not.
    pub fn next(&'static self, known: bool) -> &'static Tableau {
        self.starter.filter(|_| !known).unwrap_or(self)
    }

    /// Weights of the rates in the solution at `theta` and in its derivative.
    pub fn weights(&self, theta: f64) -> ([f64; MOST], [f64; MOST]) {
        let (mut value, mut slope) = ([0.0; MOST], [0.0; MOST]);
        for (p, row) in self.dense.iter().enumerate().rev() {
            let exponent = (p + 1) as f64;
            for (j, &b) in row.iter().enumerate() {
                value[j] = value[j] * theta + b;
                slope[j] = slope[j] * theta + b * exponent;
            }
        }
        (value.map(|v| v * theta), slope)
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
            row[i] = if i < t.first() { 0.0 } else { t.gamma };
            row
        };
        (0..s).map(row).collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    /// What a step takes of an energy `z^2/2` is what its stages leave of their work.
    #[test]
    fn the_energy_that_a_step_takes_is_a_form_of_its_rates() {
        for t in [2, 4].into_iter().filter_map(Tableau::of_order) {
            for t in [Some(t), t.starter].into_iter().flatten() {
                let (a, s) = (full(t), t.stages());
                let (h, z) = (0.3, 0.7);
                let rates: Vec<f64> = (0..s).map(|i| (1.0 + 2.0 * i as f64).sin()).collect();
                let stage = |i: usize| z + h * dot(&a[i], &rates);
                let work: f64 = (0..s).map(|i| h * a[s - 1][i] * stage(i) * rates[i]).sum();
                let form = |i: usize| -> f64 {
                    (0..s).map(|j| t.algebraic(i, j) * rates[i] * rates[j]).sum()
                };
                let taken = 0.5 * h * h * (0..s).map(form).sum::<f64>();
                let change = 0.5 * (stage(s - 1).powi(2) - z * z);
                assert!((work - change - taken).abs() < 1e-14, "{work} {change} {taken}");
            }
        }
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
        for t in [&SECOND, &FOURTH, &START] {
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
    fn all_stages_are_of_second_order() {
        let a = full(&FOURTH);
        for (row, c) in a.iter().zip(FOURTH.c) {
            assert!((dot(row, FOURTH.c) - 0.5 * c * c).abs() < 1e-15, "{c}");
        }
    }

    /// The term is as large as it says, in the middle of the step, and of the order of the estimate.
    #[test]
    fn the_term_beyond_a_cubic_is_largest_in_the_middle() {
        let t = &FOURTH;
        let last = full(t)[t.stages() - 1].clone();
        let middle = t.weights(0.5).0;
        for (j, inside) in t.inside.iter().enumerate() {
            // Hermite's cubic from the ends and the slopes there
            let slopes = [t.weights(0.0).1[j], t.weights(1.0).1[j]];
            let cubic = 0.5 * last[j] + (slopes[0] - slopes[1]) / 8.0;
            assert!((middle[j] - cubic - inside).abs() < 1e-14);
        }
        let parts: Vec<f64> = last.iter().zip(t.inside).map(|(b, e)| b - e).collect();
        for (p, defect) in conditions(t, &parts, 1.0) {
            assert!(p >= t.error_order || defect.abs() < 1e-14, "order {p}: {defect}");
        }
    }

    #[test]
    fn steps_from_known_and_unknown_rates_share_their_matrices() {
        assert_eq!(FOURTH.gamma, START.gamma);
        assert_eq!(FOURTH.stages(), START.stages());
        for t in [&SECOND, &FOURTH, &START] {
            assert!(t.stages() <= MOST && t.c[t.stages() - 1] == 1.0);
            assert!(std::ptr::eq(t.next(false).next(false), t.next(false)));
        }
    }

    #[test]
    fn continuous_solutions_have_their_order_everywhere() {
        for (t, order) in [(&SECOND, 2), (&FOURTH, 4), (&START, 3)] {
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
        for t in [&SECOND, &FOURTH, &START] {
            for mu in [-1e3, -1e6, -1e9f64] {
                let mut k = Vec::new();
                let mut last = 1.0;
                if t.first() > 0 {
                    k.push(mu);
                }
                for row in &t.a[t.first()..] {
                    let base = 1.0 + dot(row, &k);
                    last = base / (1.0 - t.gamma * mu);
                    k.push(mu * last);
                }
                assert!(last.abs() < 20.0 / mu.abs(), "{mu}: {last}");
            }
        }
    }
}
