//! The values at t+ in one mode, by Newton's method.

use super::{DerivativeArray, Moment};
use crate::descriptor::Linear;
use crate::newton::Newton;
use crate::rounding::OF_SOLUTION;
use crate::tape::Linearisation;
use crate::tolerances::{NO_JUMP, PROGRESS};

/// Rounds.  Nothing that is stored moves, so that junctions with a charge stay where they are.
const ROUNDS: usize = 40;

impl DerivativeArray {
    /// The values by Newton's method, in one mode.
    pub(super) fn find_values(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
    ) -> bool {
        let (mut last, mut settled) = (f64::INFINITY, false);
        for _ in 0..ROUNDS {
            self.linearise(linear, newton, from, at, Linearisation::Careful);
            self.assemble(linear);
            self.system.factor(&self.matrix);
            self.right_of_values();
            self.system.solve(&mut self.x);
            if !self.x.iter().all(|x| x.is_finite()) {
                return false;
            }
            let moved = self.advance(linear, 0.0);
            // what rounding moves does not become less; next to hundreds of volts digits of small ones take one round more
            if settled || moved <= NO_JUMP && moved >= PROGRESS * last {
                return true;
            }
            settled = moved <= OF_SOLUTION;
            last = moved;
        }
        false
    }

    /// Adds the solution to the unknowns; its largest part of them, or of the current `felt` before.
    pub(super) fn advance(&mut self, linear: &Linear, felt: f64) -> f64 {
        let n = self.n;
        let step = match &self.basis {
            Some(basis) => {
                self.scratch.fill(0.0);
                basis.apply(&self.x[..n], &mut self.scratch);
                &self.scratch
            }
            None => &self.x[..n],
        };
        let (mut moved, mut largest) =
            ([0.0f64; 2], [f64::MIN_POSITIVE, felt.max(f64::MIN_POSITIVE)]);
        for ((z, d), &kind) in self.z.iter_mut().zip(step).zip(&linear.row_kind) {
            let kind = usize::from(kind);
            *z += d;
            moved[kind] = moved[kind].max(d.abs());
            largest[kind] = largest[kind].max(z.abs());
        }
        for (&k, d) in self.conductors.iter().zip(&self.x[n..]) {
            self.l[k] += d;
        }
        (moved[0] / largest[0]).max(moved[1] / largest[1])
    }
}
