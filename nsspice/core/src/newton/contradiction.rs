//! Laws that contradict each other by rounding, where the linearised equations leave something open.
//!
//! The diodes of a bridge at rest block: their leakage has no slope left, so that the potential of the bridge
//! is open, and some combination of the laws holds for any unknowns, or not.  The current of a
//! resistor of 1 Ohm at 10 V is rounded by 1e-15 A, next to which a leakage of 1e-13 A is known to a percent.
//! One law has to leave that rest.  If it is the one of the leakage, it is violated, and the next step finds
//! the same rest again; that of the resistor bears it as rounding.

use super::equations::Equations;
use super::linear::Assembly;
use super::state::State;
use crate::tolerances::{ACCEPT, CLEARLY};

/// Neither rounding nor an iteration near its end leaves so large a part: laws that leave that much of each other have
/// no solution here, however large other voltages are; a first step that ends with it has led away; and a point that
/// would move its largest unknown by it tends to no solution.  No test distinguishes a decade more or less.
pub(super) const GROSS: f64 = 1e-3;

impl State {
    /// Takes what contradicts by rounding out of the right-hand side in `step`, in the law with the largest
    /// terms, where the Jacobian factored last holds something; notes the columns at which laws do contradict
    /// each other.
    #[cold]
    pub(super) fn settle_contradictions(&mut self, n: usize, assembly: &Assembly) {
        self.contradicted.clear();
        let mut combinations = self.combinations(n, assembly);
        while let Some((c, y)) = combinations.pop() {
            let Some((place, most, rest)) = self.weigh(n, &y) else { return };
            // a part of the terms that would not be accepted is no rounding of them
            if most == 0.0 || rest.is_nan() || rest.abs() > f64::EPSILON * most {
                if rest.abs() > ACCEPT * most {
                    self.contradicted.push(c);
                }
                continue; // what is held has to move
            }
            self.step[place] -= rest / y[place];
            for (_, other) in &mut combinations {
                let part = other[place] / y[place];
                other.iter_mut().zip(&y).for_each(|(o, y)| *o -= part * y);
            }
        }
    }

    /// Each column that the Jacobian factored last holds, with the combination of laws that vanishes but for that.
    fn combinations(&mut self, n: usize, assembly: &Assembly) -> Vec<(usize, Vec<f64>)> {
        let held = assembly.held().into_iter();
        held.map(|c| {
            let mut y = vec![0.0; self.x.len()];
            assembly.contradiction(n, &self.active, c, &mut y, &mut self.work);
            (c, y)
        })
        .collect()
    }

    /// The law with the largest terms in a combination, these terms, and what `step` leaves of the combination.
    fn weigh(&self, n: usize, y: &[f64]) -> Option<(usize, f64, f64)> {
        let terms = y[..n].iter().zip(&self.balance.terms).map(|(y, t)| (y * t).abs());
        let (place, most) = terms.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((place, most, y.iter().zip(&self.step).map(|(y, d)| y * d).sum()))
    }

    /// Where laws do contradict each other (a diode and a switch short a source), what is held moves far; turns
    /// it to where it would go with a resistance in each branch and pair, and a conductance at each node.  A held
    /// pivot may have either sign, and would send the current of the source through the diode that has to open.
    #[cold]
    pub(super) fn resist(&mut self, eq: &Equations, assembly: &Assembly) {
        if self.contradicted.is_empty() {
            return;
        }
        let n = eq.n;
        let mut combinations = self.combinations(n, assembly);
        combinations.retain(|(c, _)| self.contradicted.contains(c));
        for (c, y) in combinations.into_iter().rev() {
            let moved = self.goes_with(eq, assembly, c, -1.0);
            let on = |i: usize| i < n || self.active[i - n];
            let power = |i: usize| y[i] * moved[i] / (eq.unit[i] * eq.unit[i]);
            let powers = (0..eq.size()).filter(|&i| on(i)).map(power);
            let (sum, size) = powers.fold((0.0, 0.0), |(s, a), p| (s + p, a + p.abs()));
            // a power that is less relative to its terms may be rounding; a held column moves by all of itself if the
            // Jacobian without it is singular, or not at all
            if sum.abs() > ACCEPT * size && moved[c] > CLEARLY {
                let amount = self.step[c] / moved[c];
                let turned = if sum < 0.0 { -amount } else { amount };
                add(turned - amount, &moved, &mut self.step);
            }
        }
    }

    /// Whether laws contradict each other at `x` by more than any rounding, where the Jacobian factored last
    /// holds something: of a product the search may go on to 1e16 V, next to which a whole ampere is none.
    pub(super) fn contradicts_itself(&mut self, eq: &Equations, assembly: &Assembly) -> bool {
        let combinations = self.combinations(eq.n, assembly);
        if combinations.is_empty() {
            return false;
        }
        self.ask(eq);
        let mut weighed = combinations.iter().filter_map(|(_, y)| self.weigh(eq.n, y));
        weighed.any(|(_, most, rest)| rest.abs() > GROSS * most)
    }
}

/// Adds a multiple of a step to another.
fn add(part: f64, moved: &[f64], step: &mut [f64]) {
    step.iter_mut().zip(moved).for_each(|(step, v)| *step += part * v);
}
