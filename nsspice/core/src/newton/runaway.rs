//! Points whose residual falls although no solution is near.

use super::solve::Newton;
use crate::tape::Linearisation;

/// Iterations from which on a static point is looked at once more.
const SLOW: u32 = 8;
/// Part of the largest voltage or current that a solution does not move by.
const MOVES: f64 = 1e-3;

impl Newton {
    /// Whether a static point that took many iterations still moves by a part of its largest unknown
    /// with each: the residual falls, but there is no solution that the points tend to.
    ///
    /// Near a regular solution Newton's method squares its error, so that a small residual leaves
    /// nothing to move.
    pub(super) fn runs_away(&mut self) -> bool {
        if self.state.iterations < SLOW {
            return false;
        }
        let (x, active) = (self.state.x.clone(), self.state.active.clone());
        self.evaluate_at_x(Linearisation::Exact, None);
        let moved = self.advance(None);
        let largest = |of: &[u32], y: &dyn Fn(usize) -> f64| {
            of.iter().fold(0.0f64, |most, &i| most.max(y(i as usize).abs()))
        };
        let s = &mut self.state;
        let goes = moved
            && [&self.eq.potentials, &self.eq.branches]
                .iter()
                .any(|of| largest(of, &|i| s.x[i] - x[i]) > MOVES * largest(of, &|i| x[i]));
        s.x.copy_from_slice(&x);
        s.active.copy_from_slice(&active);
        self.evaluate_at_x(Linearisation::Exact, None);
        if goes {
            // the last point shows where the search has gone
            let found = self.judge();
            let s = &mut self.state;
            s.nearest.0 = found;
            s.nearest.1.copy_from_slice(&s.x);
        }
        goes
    }
}
