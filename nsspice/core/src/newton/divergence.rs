//! Points whose residual falls although no solution is near.

use super::contradiction::GROSS;
use super::solve::Newton;
use crate::mlcp::Residual;
use crate::rounding::OF_SOLUTION;
use crate::tape::Linearisation;

/// Iterations from which on a static point is looked at again.
const SLOW: u32 = 8;

impl Newton {
    /// Whether a static point with the residual `found`, which took many iterations, still moves by a part of
    /// its largest unknown: the residual falls, but there is no solution that the points tend to.
    ///
    /// Near a regular solution Newton's method squares its error, so that a small residual leaves
    /// nothing to move.
    pub(super) fn runs_away(&mut self, found: Residual) -> bool {
        if self.state.iterations < SLOW || found.worst() <= OF_SOLUTION {
            return false;
        }
        let (x, active) = (self.state.x.clone(), self.state.active.clone());
        self.evaluate_at_x(Linearisation::Exact, None);
        let size = self.largest();
        let moved = self.advance(None);
        let n = self.eq.n;
        let change: Vec<f64> = self.state.x[..n].iter().zip(&x).map(|(a, b)| a - b).collect();
        let mut moves = [0.0; 2];
        self.widen(&change, &mut moves);
        let goes = moved && moves.iter().zip(size).any(|(m, size)| *m > GROSS * size);
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
