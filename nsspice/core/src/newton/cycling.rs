//! Where Newton's method goes to and fro.
//!
//! A law whose slope is infinite at its own zero (the outflow `sqrt(v)` of a tank) throws each step to
//! the other side of its solution, and the next one back: `x + h sgn(x) sqrt|x| = c` alternates between
//! two points for small c.  Where a step turns the defects over and leaves them as large as they were, the
//! solution, or a point near it, lies between its ends.  Halves of the step lead there, each for
//! one evaluation and no factorisation.

use super::convergence::Judgement;
use super::solve::{Newton, Pull};
use crate::mlcp::Residual;
use crate::tape::{Linearisation, Program};
use crate::tolerances::PROGRESS;

/// Iterations that are not looked at: most solutions need no more.
const SETTLED: usize = 3;
/// Halvings of one step: beyond rounding, where laws jump.
const HALVINGS: usize = 64;

/// The last point of an iteration.
#[derive(Default)]
pub(super) struct Turns {
    /// some law may be upright; others have ways of their own, which lead farther
    looks: bool,
    x: Vec<f64>,
    defect: Vec<f64>,
    terms: Vec<f64>,
    /// the terms, or those at the other end of a step if they are larger
    largest: Vec<f64>,
    /// the largest defect, as part of its terms
    size: f64,
    /// the above are those of a point
    known: bool,
    /// there is nothing between two points: a law jumps there
    in_vain: bool,
}

impl Turns {
    /// For laws of this program.
    pub fn new(program: &Program) -> Turns {
        Turns { looks: program.may_be_upright(), ..Turns::default() }
    }

    /// An iteration begins.
    pub fn forget(&mut self) {
        (self.known, self.in_vain) = (false, false);
    }

    /// How defects relate to those of the last point: their product (negative where they have turned over),
    /// and the largest, as part of the terms there.
    fn compare(&self, defect: &[f64]) -> (f64, f64) {
        let rows = self.defect.iter().zip(defect).zip(&self.terms).filter(|r| *r.1 > 0.0);
        rows.fold((0.0, 0.0f64), |(along, size), ((old, new), terms)| {
            (along + (old / terms) * (new / terms), size.max((new / terms).abs()))
        })
    }
}

impl Newton {
    /// Looks at the point `state.x` of the given round, judged `found`: where the step to it has turned back,
    /// the iteration goes on from a point between its ends, whose judgement is returned.
    pub(super) fn turn(
        &mut self,
        round: usize,
        pull: Option<&Pull>,
        mut found: Judgement,
    ) -> Judgement {
        if !self.turns.looks || round < SETTLED || self.turns.in_vain {
            return found;
        }
        if self.tape.limited() {
            self.turns.known = false;
            return found;
        }
        let n = self.eq.n;
        if self.turns.known {
            let (along, size) = self.turns.compare(&self.state.balance.defect[..n]);
            if along < 0.0 && size > PROGRESS * self.turns.size {
                found = self.between(pull).unwrap_or(found);
            }
        }
        let Newton { turns, state: s, .. } = self;
        turns.x.clone_from(&s.x);
        turns.defect.clear();
        turns.defect.extend_from_slice(&s.balance.defect[..n]);
        turns.terms.clear();
        turns.terms.extend_from_slice(&s.balance.terms[..n]);
        (turns.known, turns.size) = (true, 0.0);
        turns.size = turns.compare(&s.balance.defect[..n]).1;
        found
    }

    /// Goes to a point between the last one and `state.x` where the defects are smaller, or where they
    /// turn over within the rounding of the unknowns.
    fn between(&mut self, pull: Option<&Pull>) -> Option<Judgement> {
        let n = self.eq.n;
        let Turns { terms, largest, .. } = &mut self.turns;
        largest.clear();
        largest.extend(terms.iter().zip(&self.state.balance.terms).map(|(a, b)| a.max(*b)));
        let points = self.tape.points().to_vec();
        let (mut near, mut far) = (self.turns.x.clone(), self.state.x.clone());
        let end = far.clone();
        for _ in 0..HALVINGS {
            let ends = near.iter().zip(&far);
            self.state.x.iter_mut().zip(ends).for_each(|(x, (a, b))| *x = a + 0.5 * (b - a));
            self.evaluate_at_x(Linearisation::Exact, pull);
            let s = &self.state;
            let (along, size) = self.turns.compare(&s.balance.defect[..n]);
            if size <= PROGRESS * self.turns.size {
                self.tape.set_points(&points);
                self.evaluate_at_x(Linearisation::Careful, pull);
                return Some(self.judge());
            }
            if along < 0.0 { &mut far } else { &mut near }.copy_from_slice(&s.x);
        }
        // the defects turn over within the rounding of the unknowns
        for side in [near, far] {
            self.state.x.copy_from_slice(&side);
            self.evaluate_at_x(Linearisation::Exact, pull);
            if self.is_faded() {
                let found = self.judge();
                let residual = Residual { rows: 0.0, ..found.residual };
                return Some(Judgement { residual, ..found });
            }
        }
        self.state.x.copy_from_slice(&end);
        self.turns.in_vain = true;
        self.tape.set_points(&points);
        self.evaluate_at_x(Linearisation::Careful, pull);
        None
    }

    /// Whether hardly anything is left of the rows that do not hold at `state.x`, compared with what they were at the
    /// ends of the step: an emptying tank holds the square of what it held before after each step, and in
    /// the end no number is small enough.
    fn is_faded(&self) -> bool {
        let (balance, turns) = (&self.state.balance, &self.turns);
        let rows = balance.defect[..self.eq.n].iter().zip(&balance.terms);
        rows.zip(&turns.largest).all(|((defect, terms), largest)| {
            defect.abs() <= self.accuracy() * terms || *terms <= f64::EPSILON * largest
        })
    }
}
