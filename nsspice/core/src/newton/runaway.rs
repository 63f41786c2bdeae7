//! Points whose residual falls although no solution is near.

use super::solve::Newton;
use crate::mlcp::Residual;
use crate::tape::Linearisation;

/// Iterations from which on a static point is looked at once more.
const SLOW: u32 = 8;
/// Relative residual that is rounding: what a step makes of it says nothing, where slopes vanish.
const ROUNDED: f64 = 1e-13;
/// Steps in which the largest voltage or current of a point that runs away grows by this factor each;
/// where the residual falls like a square, Newton's method doubles it.
const STEPS: usize = 3;
const GROWS: f64 = 1.2;

impl Newton {
    /// Whether a static point with the residual `found`, which took many iterations, goes on to grow:
    /// the residual falls, but there is no solution that the points tend to.
    ///
    /// Near a regular solution Newton's method squares its error, so that a small residual leaves
    /// nothing to move.
    pub(super) fn runs_away(&mut self, found: Residual) -> bool {
        if self.state.iterations < SLOW || found.worst() <= ROUNDED {
            return false;
        }
        let (x, active) = (self.state.x.clone(), self.state.active.clone());
        self.evaluate_at_x(Linearisation::Exact, None);
        let mut sizes = self.largest();
        let mut grows = [true; 2];
        for _ in 0..STEPS {
            if !self.advance(None) {
                grows = [false; 2];
                break;
            }
            self.evaluate_at_x(Linearisation::Exact, None);
            let next = self.largest();
            for kind in 0..2 {
                grows[kind] &= next[kind] > GROWS * sizes[kind];
            }
            sizes = next;
        }
        let goes = grows[0] || grows[1];
        let s = &mut self.state;
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

    /// Largest node voltage and branch current of the present point.
    fn largest(&self) -> [f64; 2] {
        let mut largest = [0.0; 2];
        self.widen(&self.state.x[..self.eq.n], &mut largest);
        largest
    }
}
