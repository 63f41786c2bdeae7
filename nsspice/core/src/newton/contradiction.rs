//! Laws that contradict each other by rounding, where the linearised equations leave something open.
//!
//! The diodes of a bridge at rest block: their leakage has no slope left, so that the potential of the bridge
//! is open, and some combination of the laws holds whatever the unknowns are, or not.  The current of a
//! resistor of 1 Ohm at 10 V is rounded by 1e-15 A, beside which a leakage of 1e-13 A is known to a percent.
//! One law has to leave that rest.  If it is the one of the leakage, it is violated, and the next step finds
//! the same rest again; that of the resistor bears it as rounding.

use super::linear::Assembly;
use super::state::State;

/// What a law bears as rounding of its terms.
const BORNE: f64 = f64::EPSILON;

impl State {
    /// Takes what contradicts by rounding out of the right-hand side in `step`, in the law with the largest
    /// terms, where the Jacobian factored last holds something.
    #[cold]
    pub(super) fn settle_contradictions(&mut self, n: usize, assembly: &Assembly) {
        let mut combinations: Vec<Vec<f64>> = Vec::new();
        for c in assembly.held() {
            let mut y = vec![0.0; self.x.len()];
            assembly.contradiction(n, &self.active, c, &mut y, &mut self.work);
            combinations.push(y);
        }
        while let Some(y) = combinations.pop() {
            let terms = y[..n].iter().zip(&self.balance.terms).map(|(y, t)| (y * t).abs());
            let Some((place, most)) = terms.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
                return;
            };
            let rest: f64 = y.iter().zip(&self.step).map(|(y, d)| y * d).sum();
            if most == 0.0 || rest.is_nan() || rest.abs() > BORNE * most {
                continue; // what is held has to move
            }
            self.step[place] -= rest / y[place];
            for other in &mut combinations {
                let part = other[place] / y[place];
                other.iter_mut().zip(&y).for_each(|(o, y)| *o -= part * y);
            }
        }
    }
}
