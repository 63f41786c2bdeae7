//! The iteration.

use super::contradiction::GROSS;
use super::convergence::{Balance, Judgement};
use super::cycling::Turns;
use super::equations::Equations;
use super::homotopy;
use super::linear::Assembly;
use super::rates::rates_kept;
use super::state::{Limits, Problem, State};
use crate::descriptor::Smooth;
use crate::mlcp::{Residual, Role, Start};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;
use crate::structure::Coordinates;
use crate::tape::{Linearisation, Tape};
use crate::tolerances::{ACCEPT, CLEARLY, PROGRESS};
use std::sync::Arc;

/// Guesses that are not judged after one that was not good enough: in a circuit at rest they are.
const UNJUDGED: u8 = 7;
/// Iterations from a good start.
const ITERATIONS: usize = 40;
/// The same where others may be found more easily.
const BRIEF: usize = 10;
/// From a good start, so many times as long while the worst defect makes [`PROGRESS`].
const PATIENCE: usize = 3;
/// Rounds in a row in which rounding leaves nothing known of the worst law: there is no way back.
const LOST: usize = 4;

/// A point that solves the equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// linearised problems solved
    pub iterations: u32,
    /// how well the equations hold
    pub residual: Residual,
    /// 1 Newton's method alone, 2 with the complementarity driver, 3 along a homotopy
    pub stage: u8,
}

/// No solution was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsolved {
    /// linearised problems solved
    pub iterations: u32,
    /// residual of the best point
    pub residual: Residual,
    /// the row of z it violates most
    pub worst_row: usize,
    /// the unknowns z there
    pub point: Vec<f64>,
}

/// Newton's method for one system, at any rate and point.
pub struct Newton {
    pub(super) eq: Arc<Equations>,
    pub(super) tape: Tape,
    pub(super) assemblies: Vec<Assembly>,
    /// their rates once more, side by side
    pub(super) rates: Vec<f64>,
    /// how many are kept
    pub(super) most: usize,
    pub(super) present: usize,
    pub(super) stamp: u64,
    /// relative residual at which the iteration ends
    accuracy: f64,
    /// the next solve may give up early
    brief: bool,
    predicted: bool,
    prediction: Vec<f64>,
    /// see [`Newton::carry`]; empty: nothing
    pub(super) carried: Vec<f64>,
    pub(super) carried_functions: Vec<f64>,
    pub(super) state: State,
    pub(super) turns: Turns,
}

/// A proximal term `mu D (z - centre)`: as if a resistor led from each node to its voltage in
/// `centre`, and one lay in series with each branch.
pub(super) struct Pull<'a> {
    pub mu: f64,
    pub centre: &'a [f64],
}

/// Relative residual at which the iteration ends: clearly less than rounding leaves of a solution.
fn finest() -> f64 {
    CLEARLY * OF_SOLUTION
}

const NOWHERE: Judgement = Judgement { residual: Residual::INFINITE, worst_row: 0, unknown: false };

impl Newton {
    /// Prepares a system, whose unknown voltages may be those along a tree.
    #[allow(clippy::too_many_arguments)] // one per matrix
    pub fn new(
        e: &Csc,
        g: &Csc,
        a: &Csc,
        b: &Csc,
        d: &Csc,
        row_kind: &[u8],
        smooth: Smooth,
        tree: Option<&Coordinates>,
    ) -> Newton {
        let eq = Arc::new(Equations::new(e, g, a, b, d, row_kind, &smooth, tree));
        let (size, m) = (eq.size(), eq.m);
        let zeros = vec![0.0; size];
        let sources = smooth.tape.program().sources();
        Newton {
            turns: Turns::new(smooth.tape.program()),
            assemblies: vec![Assembly::new(&eq, 0.0)],
            rates: vec![0.0],
            most: rates_kept(&eq),
            present: 0,
            stamp: 0,
            accuracy: finest(),
            brief: false,
            predicted: false,
            prediction: vec![0.0; eq.n],
            carried: Vec::new(),
            carried_functions: Vec::new(),
            state: State {
                x: zeros.clone(),
                problem: Problem {
                    right: vec![0.0; eq.padded()],
                    q: vec![0.0; m],
                    u: vec![0.0; sources],
                    t: 0.0,
                    roles: vec![Role::Diode; m],
                },
                active: vec![false; m],
                balance: Balance::new(&eq, &smooth.tape),
                step: zeros.clone(),
                work: vec![0.0; 4 * size],
                direct: false,
                seen: Vec::new(),
                iterations: 0,
                stage: 1,
                limits: Limits::new(size),
                contradicted: Vec::new(),
                best: (NOWHERE, zeros.clone()),
                nearest: (NOWHERE, zeros.clone()),
                trial: zeros,
                kept: Vec::new(),
                kept_active: vec![false; m],
            },
            tape: smooth.tape,
            eq,
        }
    }

    /// Lets the iteration end at a relative residual; it stays between what rounding allows and a
    /// tenth of what is accepted.  With 0 the iteration goes on while it helps.
    pub fn set_accuracy(&mut self, accuracy: f64) {
        self.accuracy =
            if accuracy > 0.0 { accuracy.clamp(finest(), CLEARLY * ACCEPT) } else { 0.0 };
        self.tape.set_accuracy(self.accuracy);
    }

    /// The relative residual at which the iteration ends.
    pub fn accuracy(&self) -> f64 {
        self.accuracy
    }

    /// Lets the next warm start give up early: a caller who can ask for less has no use for a
    /// solution that is hard to find.
    pub fn be_brief(&mut self, brief: bool) {
        self.brief = brief;
    }

    /// Solves the equations at the present rate for the sources `u` at the time `t`.
    ///
    /// On entry `z`, `l` are a guess (for a cold start they do not count), on exit the solution;
    /// they are left alone if none is found.  A static problem that has none near its guess is
    /// solved from nothing.
    #[allow(clippy::too_many_arguments)] // the data of the problem
    pub fn solve(
        &mut self,
        rhs: &[f64],
        u: &[f64],
        t: f64,
        q: &[f64],
        roles: &[Role],
        z: &mut [f64],
        l: &mut [f64],
        start: Start,
    ) -> Result<Solved, Box<Unsolved>> {
        let n = self.eq.n;
        self.load(rhs, u, t, q, roles);
        let s = &mut self.state;
        s.iterations = 0;
        s.stage = 1;
        s.nearest.0 = NOWHERE;
        let found = match start {
            Start::Warm => {
                s.x[..n].copy_from_slice(z);
                s.x[n..].copy_from_slice(l);
                self.warm().or_else(|| self.afresh())
            }
            Start::Cold => homotopy::first(self),
        };
        self.predicted = false;
        let found = found.filter(|found| {
            let assembly = &self.assemblies[self.present];
            let timed = assembly.rate > 0.0;
            timed
                || !self.state.contradicts_itself(&self.eq, assembly)
                    && !self.runs_away(found.residual)
        });
        let Some(found) = found.or_else(|| self.at_rest()) else {
            return Err(Box::new(self.unsolved()));
        };
        let s = &mut self.state;
        s.balance.take_largest(&mut self.assemblies[self.present].largest);
        z.copy_from_slice(&s.x[..n]);
        l.copy_from_slice(&s.x[n..]);
        Ok(Solved { iterations: s.iterations, residual: found.residual, stage: s.stage })
    }

    /// The best point of a step, if all that a law misses is rounding of its largest terms in steps of this length: what
    /// is stored has come to rest, and no digit of the terms that are left is right.
    fn at_rest(&mut self) -> Option<Judgement> {
        if self.assemblies[self.present].rate == 0.0 {
            return None;
        }
        self.state.x.copy_from_slice(&self.state.nearest.1);
        self.evaluate_at_x(Linearisation::Exact, None);
        let mut found = self.judge();
        let largest = &self.assemblies[self.present].largest;
        let rests =
            self.state.balance.is_nothing(largest) && found.residual.complementarity <= ACCEPT;
        found.residual.rows = if rests { 0.0 } else { found.residual.rows };
        rests.then_some(found)
    }

    /// The best point that was found.
    fn unsolved(&mut self) -> Unsolved {
        // junctions may have been limited in every iteration: then the last point, or rest
        for rest in [false, true] {
            if self.state.nearest.0.residual.worst().is_finite() {
                break;
            }
            if rest {
                homotopy::begin_at_zero(self);
            }
            self.evaluate_at_x(Linearisation::Exact, None);
            let found = self.judge();
            let s = &mut self.state;
            s.nearest.0 = found;
            s.nearest.1.copy_from_slice(&s.x);
        }
        if self.assemblies[self.present].rate == 0.0 {
            self.state.x.copy_from_slice(&self.state.nearest.1);
            self.evaluate_at_x(Linearisation::Exact, None);
            // the search may have gone to voltages next to which everything else is nothing
            let (rows, worst_row) = self.state.balance.missed(&self.eq);
            let found = &mut self.state.nearest.0;
            if rows > found.residual.rows {
                (found.residual.rows, found.worst_row) = (rows, worst_row);
            }
        }
        let State { iterations, nearest: (found, x), .. } = &self.state;
        let (residual, worst_row) = (found.residual, found.worst_row);
        Unsolved { iterations: *iterations, residual, worst_row, point: x[..self.eq.n].to_vec() }
    }

    /// Takes the data of a problem.
    pub(super) fn load(&mut self, rhs: &[f64], u: &[f64], t: f64, q: &[f64], roles: &[Role]) {
        let (n, s) = (self.eq.n, &mut self.state);
        s.problem.right[..n].copy_from_slice(rhs);
        self.eq.combined.combine(&mut s.problem.right[..n], &mut s.work);
        for (r, q) in s.problem.right[n..].iter_mut().zip(q) {
            *r = -q;
        }
        s.problem.q.copy_from_slice(q);
        s.problem.u.copy_from_slice(u);
        s.problem.t = t;
        s.problem.roles.copy_from_slice(roles);
        let rate = self.assemblies[self.present].rate;
        if !self.carried.is_empty() {
            self.eq.add_carried(rate, &self.carried, &mut s.problem.right);
            self.carried.clear();
        }
        if !self.carried_functions.is_empty() {
            let stored = |k: usize| self.carried_functions[k];
            self.eq.add_carried_functions(rate, stored, &mut s.problem.right);
            self.carried_functions.clear();
        }
    }

    /// A static solution that no way from the last one leads to: the branch may have ended.
    fn afresh(&mut self) -> Option<Judgement> {
        if self.assemblies[self.present].rate != 0.0 {
            return None; // a step begins where the last one has ended
        }
        homotopy::first(self)
    }

    /// From `state.x`, the last solution, by way of the prediction if there is one.
    fn warm(&mut self) -> Option<Judgement> {
        let brief = std::mem::take(&mut self.brief);
        self.activate_from_signs();
        let s = &mut self.state;
        s.kept.clear();
        s.kept.extend_from_slice(&s.x);
        s.kept.extend_from_slice(self.tape.points());
        s.kept_active.copy_from_slice(&s.active);
        let limit = if brief { BRIEF } else { ITERATIONS };
        if self.predicted {
            s.x[..self.eq.n].copy_from_slice(&self.prediction);
            if let Some(found) = self.iterate(limit, None, Linearisation::Careful) {
                return Some(found);
            }
            self.restore();
        }
        if brief {
            let found = self.iterate(limit, None, Linearisation::Careful);
            if found.is_none() {
                self.restore();
            }
            return found;
        }
        if let Some(found) = self.iterate(ITERATIONS, None, Linearisation::Careful) {
            return Some(found);
        }
        self.restore();
        let begin = self.state.x.clone();
        homotopy::follow(self, &begin)
    }

    /// Goes back to where a warm start began.
    fn restore(&mut self) {
        let s = &mut self.state;
        let (x, points) = s.kept.split_at(s.x.len());
        s.x.copy_from_slice(x);
        self.tape.set_points(points);
        s.active.copy_from_slice(&s.kept_active);
    }

    /// Where the next solve begins: near the unknowns `z`, in the mode of its guess.
    ///
    /// Where the equations leave something open nothing holds back what extrapolation makes of noise:
    /// then the next solve begins at its guess.
    pub fn predict(&mut self, z: &[f64]) {
        self.prediction.copy_from_slice(z);
        self.predicted = !self.assemblies[self.present].open();
    }

    /// Values of the functions at the solution found last, as they are in its equations.
    pub fn values(&self, out: &mut [f64]) {
        for (k, v) in out.iter_mut().enumerate() {
            *v = self.tape.value(k);
        }
    }

    /// Evaluates the functions at a point.
    pub fn evaluate(&mut self, z: &[f64], u: &[f64], t: f64, out: &mut [f64]) {
        self.tape.evaluate(z, u, t, Linearisation::Exact);
        self.values(out);
    }

    /// Active pairs of the solution found last.
    pub fn active(&self) -> &[bool] {
        &self.state.active
    }

    /// Newton's iteration from `state.x`; the point is left in `state.x`.
    pub(super) fn run(&mut self, limit: usize, pull: Option<&Pull>) -> Option<Judgement> {
        self.activate_from_signs();
        self.iterate(limit, pull, Linearisation::Careful)
    }

    /// As `run`, in the present mode, with the first linearisation as given.
    pub(super) fn iterate(
        &mut self,
        limit: usize,
        pull: Option<&Pull>,
        mut how: Linearisation,
    ) -> Option<Judgement> {
        let mut halvings = 0;
        let mut before = f64::INFINITY;
        let accuracy = self.accuracy;
        let s = &mut self.state;
        s.best.0 = NOWHERE;
        s.limits.begin(&s.x);
        self.turns.forget();
        let most = if limit > BRIEF { PATIENCE * limit } else { limit };
        let mut last = (0, 0.0); // the worst row and its defect
        let mut lost = 0;
        for round in 0..=most {
            self.evaluate_at_x(how, pull);
            how = Linearisation::Careful;
            if round == 0 && pull.is_none() && self.needs_a_step() {
                before = 0.0; // not known: the next step has a Jacobian of its own
                self.advance_again();
                continue;
            }
            // a guess has been improved by nothing yet
            let done = if round == 0 { CLEARLY * accuracy } else { accuracy };
            let mut found = self.judge_to(done);
            if before == 0.0 && self.goes_back(&found) {
                self.evaluate_at_x(how, pull);
                found = self.judge_to(done);
            }
            if !found.residual.rows.is_finite() {
                // outside the domain of some function: part of the way back
                if round == 0 || halvings > 30 {
                    break;
                }
                halvings += 1;
                let s = &mut self.state;
                for (x, d) in s.x.iter_mut().zip(&mut s.step) {
                    *d *= 0.5;
                    *x -= *d;
                }
                continue;
            }
            halvings = 0;
            let found = self.turn(round, pull, found);
            if round == 0 {
                let (size, s) = (self.eq.size(), &mut self.state);
                s.limits.given.copy_from_slice(&s.balance.terms[..size]);
            }
            if found.residual.worst() <= done {
                if !self.tape.limited() {
                    let assembly = &mut self.assemblies[self.present];
                    if round == 0 {
                        assembly.unjudged = 0;
                    } else {
                        assembly.steady = round == 1 && pull.is_none();
                    }
                    return Some(found);
                }
                // what was limited may not matter: see what the functions themselves say
                let points = self.tape.points().to_vec();
                self.evaluate_at_x(Linearisation::Exact, pull);
                let exact = self.judge();
                if exact.residual.worst() <= done {
                    return Some(exact);
                }
                self.tape.set_points(&points);
                self.evaluate_at_x(Linearisation::Held, pull);
            }
            if !self.tape.limited() {
                let s = &mut self.state;
                let (worst, best) = (found.residual.worst(), s.best.0.residual.worst());
                if worst < best {
                    s.best.0 = found;
                    if worst <= ACCEPT {
                        s.best.1.copy_from_slice(&s.x);
                    }
                } else if best <= ACCEPT {
                    break; // rounding: no better than before
                }
            }
            lost = if found.unknown { lost + 1 } else { 0 };
            if lost > LOST {
                break;
            }
            // a junction that was driven far gives way by one thermal voltage at a time
            if round + 1 >= limit {
                let row = found.worst_row;
                let defect = self.state.balance.defect[row].abs();
                let falls = row == last.0 && defect <= PROGRESS * last.1;
                last = (row, defect);
                if round == most || round >= limit && !falls {
                    break;
                }
            }
            // Newton's method squares the residual; with the Jacobian of the last step it falls by
            // the last quotient once more, or twice that: where that is enough it is kept
            let worst = found.residual.worst();
            let near = if round == 0 {
                self.assemblies[self.present].steady
            } else {
                // an expected residual is relied upon if it is clearly below what ends the iteration
                2.0 * worst / before * worst <= CLEARLY * accuracy
            };
            before = worst;
            if round == 0 {
                self.assemblies[self.present].unjudged = UNJUDGED;
            }
            let moved = if near && pull.is_none() && self.keeps_mode() && !self.tape.limited() {
                self.advance_again()
            } else {
                self.advance(pull)
            };
            if !moved {
                break;
            }
        }
        self.assemblies[self.present].steady = false;
        let s = &mut self.state;
        // the problem itself, with all its laws
        if pull.is_none()
            && !self.tape.is_blunt()
            && s.best.0.residual.worst() <= s.nearest.0.residual.worst()
        {
            // the last point shows where the search has gone
            s.nearest.0 = s.best.0;
            s.nearest.1.copy_from_slice(&s.x);
        }
        if s.best.0.residual.worst() > ACCEPT {
            return None;
        }
        let State { x, best, .. } = s;
        x.copy_from_slice(&best.1);
        self.evaluate_at_x(Linearisation::Exact, pull);
        Some(self.judge())
    }

    /// Whether the guess at `state.x`, just evaluated, needs no judgement: the last ones were not good
    /// enough, and one step with the same Jacobian made them so.
    fn needs_a_step(&mut self) -> bool {
        let assembly = &self.assemblies[self.present];
        if !assembly.steady || assembly.unjudged == 0 || self.tape.limited() || !self.keeps_mode() {
            return false;
        }
        self.assemblies[self.present].unjudged -= 1;
        let (size, s) = (self.eq.size(), &mut self.state);
        s.limits.given.copy_from_slice(&s.balance.terms[..size]);
        true
    }

    /// Goes back to the guess if the first step, with a Jacobian of old, has led away; true if so.  What hangs
    /// on the leakage of junctions alone has slopes that differ by powers of ten a moment later.
    fn goes_back(&mut self, found: &Judgement) -> bool {
        let s = &mut self.state;
        let Some(points) = s.kept.get(s.x.len()..) else { return false };
        let away = self.tape.limited() || found.residual.worst() > GROSS;
        if away {
            s.x.copy_from_slice(&s.limits.begin);
            self.tape.set_points(points);
        }
        away
    }

    /// Evaluates the functions at `state.x` and the balance there.
    pub(super) fn evaluate_at_x(&mut self, how: Linearisation, pull: Option<&Pull>) {
        self.tape.evaluate(
            &self.state.x[..self.eq.n],
            &self.state.problem.u,
            self.state.problem.t,
            how,
        );
        self.balance();
        let Newton { eq, state: s, .. } = self;
        if let Some(pull) = pull {
            for i in 0..eq.n {
                let force = pull.mu * eq.reference[i] * (s.x[i] - pull.centre[i]);
                s.balance.defect[i] -= force;
                s.balance.terms[i] += force.abs();
            }
        }
    }

    /// The balance at `state.x` with the functions as they have been left.
    pub(super) fn balance(&mut self) {
        let Newton { eq, tape, assemblies, present, state: s, .. } = self;
        s.balance.compute(&assemblies[*present], tape, &s.problem.right, &s.x);
        eq.combined.add_sizes(&mut s.balance.terms);
    }

    pub(super) fn judge(&mut self) -> Judgement {
        self.judge_to(0.0)
    }

    /// As `judge`; what is good enough need not be known exactly.
    fn judge_to(&mut self, enough: f64) -> Judgement {
        let (assembly, s) = (&self.assemblies[self.present], &mut self.state);
        s.balance.judge(&self.eq, assembly, &self.tape, &s.problem.roles, &s.x, enough)
    }
}
