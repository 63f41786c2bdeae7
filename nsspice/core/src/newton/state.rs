//! The arrays of one solve: modes, their equations at a point, and how far a step may go.

use super::convergence::{Balance, Judgement};
use super::equations::Equations;
use super::linear::Assembly;
use crate::mlcp::Role;
use crate::rounding::{OF_EQUATION, OF_SOLUTION};
use crate::tolerances::FLOOR;

/// Pivots that keep unknowns near where they are if the linearised equations leave them open: the
/// rounding of the equations moves them no further than by its quotient with the first.
const HOLD: [f64; 4] = [0.0, 1e-9, 1e-6, 1e-3];
/// Largest unknown in the scaled system, in units of the data and of the start.  Chains of amplifiers
/// multiply their gains: a linearised answer of 1e30 V would drown the volts of the stages before,
/// and leave no trace of which way each of them is driven.  With 20 or 0.2 rectifiers in their feedback find no
/// solution, and with 20 problems that have none seem solved.
const REACH: f64 = 2.0;
/// An unknown that is stopped there so many times in a row may go farther: twice as far, then 8, 128 and
/// 32,768 times, as far as an amplifier of open loop gets from rest.
const INSIST: u8 = 3;
/// The data of one problem.
pub(super) struct Problem {
    /// `[rhs; -q]`
    pub right: Vec<f64>,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub t: f64,
    pub roles: Vec<Role>,
}

/// How far unknowns may go.
pub(super) struct Limits {
    /// where the iteration began
    pub begin: Vec<f64>,
    /// how far each unknown may go beyond the reach of all, and how often it was stopped there
    pub leave: Vec<(f64, u8)>,
    /// size of the terms of every row where the iteration began: what sources and functions give
    pub given: Vec<f64>,
    /// some unknown has been stopped
    pub stopped: bool,
    /// the reach of all, voltages and others, and for which scaling it was computed
    pub reach: (u32, (f64, f64)),
    /// whether unknowns are stopped at all
    pub bounded: bool,
}

impl Limits {
    /// For so many unknowns and multipliers.
    pub fn new(size: usize) -> Limits {
        Limits {
            begin: vec![0.0; size],
            leave: vec![(1.0, 0); size],
            given: vec![0.0; size],
            stopped: false,
            reach: (0, (0.0, 0.0)),
            bounded: true,
        }
    }

    /// An iteration begins at `x`.
    pub fn begin(&mut self, x: &[f64]) {
        self.begin.copy_from_slice(x);
        if self.stopped {
            self.leave.fill((1.0, 0));
            self.stopped = false;
        }
        self.bounded = true;
        self.reach.0 = 0; // no scaling has this number
    }

    /// How large unknowns may become in this step: node voltages by the voltages that sources,
    /// functions and the start give, the others (and these, where nothing gives a voltage) in the
    /// scaled system.
    fn reach(&self, eq: &Equations, assembly: &Assembly) -> (f64, f64) {
        let (mut voltage, mut seen, mut scaled) = (0.0f64, 0.0f64, 0.0f64);
        let points = self.begin.iter().zip(&assembly.scaling.columns).zip(&self.given);
        for (i, ((x, s), given)) in points.enumerate() {
            let (x, given) = (x.abs(), given.abs());
            scaled = scaled.max(x / s).max(given * s);
            let law = i >= eq.n || eq.kind(i) == 1;
            voltage = voltage.max(if law { given } else { x });
            seen = seen.max(if law { given * s } else { x / s });
        }
        let bound = |size: f64| if size > 0.0 { REACH * size } else { f64::INFINITY };
        // next to large currents a trace of a voltage is the rounding of what came before
        (bound(if seen > OF_SOLUTION * scaled { voltage } else { 0.0 }), bound(scaled))
    }
}

/// The arrays of one solve.
pub(super) struct State {
    /// `[z; l]`
    pub x: Vec<f64>,
    pub problem: Problem,
    pub active: Vec<bool>,
    pub balance: Balance,
    pub step: Vec<f64>,
    pub work: Vec<f64>,
    /// the Jacobian is that of the tape and has not been written down
    pub direct: bool,
    pub seen: Vec<u64>,
    pub iterations: u32,
    pub stage: u8,
    pub limits: Limits,
    /// held columns at which the laws of the mode contradict each other
    pub contradicted: Vec<usize>,
    /// best point of this iteration, where nothing was limited
    pub best: (Judgement, Vec<f64>),
    /// the best point of all iterations for the problem itself
    pub nearest: (Judgement, Vec<f64>),
    pub trial: Vec<f64>,
    /// point, linearisation points and mode of a warm start
    pub kept: Vec<f64>,
    pub kept_active: Vec<bool>,
}

impl State {
    /// Sets `trial` to `x + step`, no unknown beyond its reach.
    pub fn move_within_reach(&mut self, eq: &Equations, assembly: &Assembly) {
        // what does not reach further than where it began, doubled, need not be looked at: the reach
        // is that of the largest
        let mut far = self.limits.stopped;
        let ends = self.trial.iter_mut().zip(&self.x).zip(&self.step).zip(&self.limits.begin);
        for (((trial, x), step), begin) in ends {
            *trial = x + step;
            far |= trial.abs() > REACH * begin.abs();
        }
        if far && self.limits.bounded {
            self.stop_at_reach(eq, assembly);
        }
    }

    /// Stops unknowns of `trial` at their reach.
    fn stop_at_reach(&mut self, eq: &Equations, assembly: &Assembly) {
        if self.limits.reach.0 != assembly.scaling.count {
            self.limits.reach = (assembly.scaling.count, self.limits.reach(eq, assembly));
        }
        let (voltage, scaled) = self.limits.reach.1;
        for i in 0..self.x.len() {
            let leave = &mut self.limits.leave[i];
            let node = i < eq.n && eq.kind(i) == 0 && voltage.is_finite();
            let far = leave.0 * if node { voltage } else { scaled * assembly.scaling.columns[i] };
            let t = self.trial[i];
            if t.abs() <= far {
                leave.1 = 0;
                continue;
            }
            self.limits.stopped = true;
            self.trial[i] = far.copysign(t);
            self.step[i] = self.trial[i] - self.x[i];
            leave.1 += 1;
            if leave.1 > INSIST {
                *leave = (2.0 * leave.0 * leave.0, 0);
            }
        }
    }

    /// What the present mode asks for at `x`, into `step`.
    pub fn ask(&mut self, eq: &Equations) {
        self.step.copy_from_slice(&self.balance.defect[..eq.size()]);
        for (i, _) in self.active.iter().enumerate().filter(|(_, &a)| !a) {
            self.step[eq.n + i] = -self.x[eq.n + i];
        }
    }

    /// The same but for contradictions by rounding.
    pub fn take_defects(&mut self, eq: &Equations, assembly: &Assembly) {
        self.ask(eq);
        // rounding of what blocking junctions let through would move the potential, for which nothing else has a
        // slope, by volts
        for &row in &eq.places.leaks {
            if self.step[row].abs() <= OF_EQUATION * self.balance.terms[row] {
                self.step[row] = 0.0;
            }
        }
        if assembly.open() {
            self.settle_contradictions(eq.n, assembly);
        }
    }

    /// Computes `step`, the solution of the equations of the present mode linearised at `x`; false
    /// if there is none.
    pub fn solve_mode(&mut self, eq: &Equations, assembly: &mut Assembly, slopes: &[f64]) -> bool {
        let n = eq.n;
        for hold in HOLD {
            // what the linearised equations leave open stays where it is
            if hold > 0.0 {
                self.stage = self.stage.max(2);
            }
            let mut factored = self.direct && assembly.factorise_directly(eq, slopes, &self.active);
            if self.direct && !factored {
                assembly.linearise(slopes);
                self.direct = false;
            }
            factored = factored || assembly.factorise(eq, &self.active, hold);
            if !factored {
                continue;
            }
            self.take_defects(eq, assembly);
            assembly.solve(n, &self.active, &mut self.step, &mut self.work);
            if self.step.iter().all(|v| v.is_finite()) {
                if assembly.open() {
                    self.resist(eq, assembly);
                }
                self.stop_what_goes_round(eq, assembly);
                return true;
            }
        }
        false
    }

    /// The others that go with an amount of column `c`, less that itself: what solves the laws in its place.
    pub fn goes_with(
        &mut self,
        eq: &Equations,
        assembly: &Assembly,
        c: usize,
        amount: f64,
    ) -> Vec<f64> {
        let mut others = vec![0.0; eq.size()];
        assembly.add_column(c, amount, &mut others);
        for (v, _) in others[eq.n..].iter_mut().zip(&self.active).filter(|(_, &a)| !a) {
            *v = 0.0;
        }
        assembly.solve(eq.n, &self.active, &mut others, &mut self.work);
        others[c] -= amount;
        others
    }

    /// Takes out of the step the currents that go round in loops of ideal elements: no law determines
    /// them and nothing remembers them, so those of the step before are no reason for others now (they
    /// would hold thyristors on).  Of each loop that the factors leave open one current becomes zero.
    fn stop_what_goes_round(&mut self, eq: &Equations, assembly: &Assembly) {
        let n = eq.n;
        let on = |active: &[bool], c: usize| c < n || active[c - n];
        for c in assembly.held() {
            let current = self.x[c] + self.step[c];
            let driven = self.contradicted.contains(&c);
            if driven || !eq.places.bare[c] || !on(&self.active, c) || current == 0.0 {
                continue;
            }
            let round = self.goes_with(eq, assembly, c, current);
            // leakage that a voltage drives, below the rounding of all, is open, too, but it has a cause
            if flows_round(eq, assembly, &round) {
                let part = -current / round[c];
                let ends = self.step.iter_mut().zip(&round).zip(&eq.places.bare);
                ends.filter(|e| *e.1).for_each(|((step, v), _)| *step += part * v);
            }
        }
    }
}

/// Whether unknowns differ by currents that go round in a loop of ideal elements, and nothing else differs.
fn flows_round(eq: &Equations, assembly: &Assembly, round: &[f64]) -> bool {
    let (mut flows, mut rest) = (0.0f64, 0.0f64);
    for ((v, scale), &bare) in round.iter().zip(&assembly.scaling.columns).zip(&eq.places.bare) {
        let largest = if bare { &mut flows } else { &mut rest };
        *largest = largest.max((v / scale).abs());
    }
    // what rounding makes of the held pivots is nothing next to the current
    rest <= FLOOR * flows
}

/// Slack of pair `i` at `x` and the size of its terms.
pub(super) fn slack(
    eq: &Equations,
    assembly: &Assembly,
    q: &[f64],
    x: &[f64],
    i: usize,
) -> (f64, f64) {
    let (mut w, mut size) = (q[i], q[i].abs());
    for &(c, at) in eq.ordering.row(eq.n + i) {
        let term = assembly.linear.values[at as usize] * x[c as usize];
        w += term;
        size += term.abs();
    }
    (w, size)
}

/// Turns over the pairs whose sign is wrong at `trial`; true if there are any.
pub(super) fn flip(eq: &Equations, assembly: &Assembly, s: &mut State) -> bool {
    let n = eq.n;
    let mut changed = false;
    for i in (0..eq.m).filter(|&i| s.problem.roles[i] == Role::Diode) {
        let wrong = if s.active[i] {
            let l = s.trial[n + i];
            l < 0.0 && l < -OF_SOLUTION * multiplier_terms(eq, assembly, &s.balance.terms, i)
        } else {
            let (w, size) = slack(eq, assembly, &s.problem.q, &s.trial, i);
            w < -OF_SOLUTION * size
        };
        if wrong {
            s.active[i] = !s.active[i];
            changed = true;
        }
    }
    changed
}

/// Size of the terms that multiplier `i` balances.
fn multiplier_terms(eq: &Equations, assembly: &Assembly, terms: &[f64], i: usize) -> f64 {
    let (rows, values) = assembly.linear.col(eq.n + i);
    let ratios = rows.iter().zip(values).filter(|(&r, &v)| r < eq.n && v != 0.0);
    ratios.fold(0.0f64, |size, (&r, &v)| size.max(terms[r] / v.abs()))
}

/// A number for an active set, to notice that it returns.
pub(super) fn fingerprint(active: &[bool]) -> u64 {
    active.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &a| {
        (hash ^ u64::from(a)).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(7)
    })
}
