//! A generalized equation at many points: solved at each, or followed from one to the next.

use super::euler_newton::{Data, Tracking};
use super::solve::Newton;
use crate::descriptor::Smooth;
use crate::mlcp::{Role, Start};
use crate::sparse::Csc;
use crate::tolerances::CLEARLY;

/// `G z + F f(z, t) + A l = right(t)`, `w = q - B z + D l`, one row per point.
pub struct Problem {
    /// linear part
    pub g: Csc,
    /// multiplier columns
    pub a: Csc,
    /// slack rows
    pub b: Csc,
    /// multipliers in the slacks
    pub d: Csc,
    /// constant slacks
    pub q: Vec<f64>,
    /// kinds of the rows
    pub row_kind: Vec<u8>,
    /// functions
    pub smooth: Smooth,
}

/// The points and what is given there, row by row.
pub struct Points<'a> {
    /// parameter values
    pub times: &'a [f64],
    /// right-hand sides
    pub right: &'a [f64],
    /// their rates, for the predictor that uses them
    pub rates: Option<&'a [f64]>,
    /// errors let into the predictor of each step
    pub errors: Option<&'a [f64]>,
}

/// Solutions, row by row, up to the first failure.
pub struct Path {
    /// unknowns
    pub z: Vec<f64>,
    /// multipliers
    pub l: Vec<f64>,
    /// relative residual of the laws at each point
    pub residuals: Vec<f64>,
    /// problems linearised
    pub linearised: u64,
    /// largest number of linearised problems of one point
    pub worst: u32,
    /// relative residual at the first point that was not reached, if there is one
    pub failed: f64,
}

impl Path {
    fn push(&mut self, z: &[f64], l: &[f64], residual: f64) {
        self.z.extend_from_slice(z);
        self.l.extend_from_slice(l);
        self.residuals.push(residual);
    }

    /// Forgets the points from one on.
    fn cut(&mut self, count: usize, n: usize, m: usize) {
        self.z.truncate(count * n);
        self.l.truncate(count * m);
        self.residuals.truncate(count);
    }

    /// Number of points reached.
    pub fn reached(&self) -> usize {
        self.residuals.len()
    }
}

impl Problem {
    /// Solves the first point (from `start`, or cold), then solves or follows the others; a path
    /// starts at `start` itself if there is one.
    pub fn run(
        self,
        points: &Points,
        tracking: Option<(bool, Option<usize>)>,
        start: Option<(&[f64], &[f64])>,
    ) -> Path {
        let (n, m) = (self.g.nrows, self.q.len());
        let zero = Csc::zeros(n, n);
        let Problem { g, a, b, d, q, row_kind, smooth } = self;
        let mut newton = Newton::new(&zero, &g, &a, &b, &d, &row_kind, smooth, None);
        newton.set_rate(0.0);
        let roles = vec![Role::Diode; m];
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        let mut path = Path {
            z: Vec::with_capacity(n * points.times.len()),
            l: Vec::with_capacity(m * points.times.len()),
            residuals: Vec::with_capacity(points.times.len()),
            linearised: 0,
            worst: 0,
            failed: f64::INFINITY,
        };
        if let Some((z0, l0)) = start {
            z.copy_from_slice(z0);
            l.copy_from_slice(l0);
        }
        let tracking = tracking.map(|(by_rate, correctors)| Tracking {
            by_rate,
            correctors: correctors.unwrap_or_else(|| newton.usual_correctors()),
        });
        let row = |list: &'_ [f64], k: usize| list[k * n..(k + 1) * n].to_vec();
        let mut rhs = vec![0.0; n];
        // largest voltage and current of the points that are certain, and how far the others are off
        let mut largest = [0.0; 2];
        let mut doubtful = Vec::new();
        'points: for (k, &t) in points.times.iter().enumerate() {
            rhs.copy_from_slice(&points.right[k * n..(k + 1) * n]);
            let here = Data { rhs: &rhs, u: &[], t, q: &q, roles: &roles };
            match tracking {
                Some(_) if k == 0 && start.is_some() => {}
                Some(tracking) if k > 0 => {
                    let before = points.times[k - 1];
                    let mut ahead = rhs.clone();
                    let mut clock = t;
                    if let (true, Some(rates)) = (tracking.by_rate, points.rates) {
                        ahead = row(points.right, k - 1);
                        clock = before;
                        let h = t - before;
                        for (a, r) in ahead.iter_mut().zip(row(rates, k - 1)) {
                            *a += h * r;
                        }
                        let mut values = vec![0.0; newton.functions()];
                        newton.evaluate(&z, &[], before, &mut values);
                        newton.add_drift(-h, &[], 1.0, &mut ahead);
                    }
                    if let Some(errors) = points.errors {
                        for (a, e) in ahead.iter_mut().zip(row(errors, k - 1)) {
                            *a += e;
                        }
                    }
                    let first = Data { rhs: &ahead, t: clock, ..here };
                    for step in 0..=tracking.correctors {
                        let data = if step == 0 { &first } else { &here };
                        path.linearised += 1;
                        if newton.linearised_step(data, &mut z, &mut l).is_none() {
                            break 'points;
                        }
                    }
                }
                _ => {
                    let begin = if k == 0 && start.is_none() { Start::Cold } else { Start::Warm };
                    let solved = newton.solve(&rhs, &[], t, &q, &roles, &mut z, &mut l, begin);
                    let solved = match solved {
                        Ok(solved) => solved,
                        Err(unsolved) => {
                            path.failed = unsolved.residual.worst();
                            break 'points;
                        }
                    };
                    path.linearised += u64::from(solved.iterations);
                    path.worst = path.worst.max(solved.iterations);
                }
            }
            let found = newton.residual_at(&here, &z, &l).worst();
            // a point that is not clearly better may be of another path, or of none
            if found <= CLEARLY {
                newton.widen(&z, &mut largest);
            } else if tracking.is_some() {
                doubtful.push((k, newton.left_to_move(&here, &z, &l)));
            }
            path.push(&z, &l, found);
        }
        // nan is lost as well
        let lost = |moves: &[f64; 2]| {
            moves.iter().zip(largest).any(|(m, most)| m.is_nan() || *m > CLEARLY * most)
        };
        if let Some((k, _)) = doubtful.iter().find(|(_, moves)| lost(moves)) {
            path.failed = path.residuals[*k];
            path.cut(*k, n, m);
        }
        path
    }
}
