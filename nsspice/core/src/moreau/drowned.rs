//! Steps so short that what conducts drowns beside what is stored.
//!
//! Between nodes that capacitors tie, `E/h` times the gigavolts of an impulse has a rounding of kiloamperes:
//! there nothing tells the driver that a coil ends at an open switch.  In the sums of `sums.rs` its
//! current stands alone.  From the mode that the driver has found, pairs whose signs these show to be
//! wrong are turned one by one until all laws hold (R. W. Cottle, J.-S. Pang, R. E. Stone: *The Linear
//! Complementarity Problem*, Academic Press 1992, chapter 4: the simplest of the pivoting methods).

use super::matrices::Ends;
use super::step::multipliers;
use super::stepper::Stepper;

/// Pairs turned on the way, in units of their number: more is going round in circles.
const TURNS: usize = 2;
/// Sums that are missed by less than this part of the largest current are met: the mode is right.
const SEEN: f64 = 1e-12;

impl Stepper {
    /// Solves a short step, of which `rhs` is the right-hand side, with sums of laws, starting from the
    /// present mode; false, and nothing changed, if that does not lead to a point that satisfies all laws.
    pub(super) fn solve_with_sums(&mut self, k: usize, ends: Ends) -> bool {
        let current = self.sys.largest(&[&self.z, ends.z0])[1];
        let point = [&self.z[..], &self.l, ends.u1];
        if !self.stages[k].misses_sums(&self.sys, point, SEEN * current) {
            return false;
        }
        let begun = self.active.clone();
        for _ in 0..=TURNS * begun.len() {
            let stage = &mut self.stages[k];
            if !stage.solve_with_sums(&self.active, self.epoch, ends, &mut self.x) {
                break;
            }
            stage.matrices.guards(&mut self.x, &self.active, true, &mut self.w);
            if self.signs_hold(k) {
                let (z, guards) = self.x.split_at(self.z.len());
                self.z.copy_from_slice(z);
                multipliers(guards, &self.active, &mut self.l);
                return true;
            }
            let Some(pair) = self.most_wrong() else { break };
            self.active[pair] = !self.active[pair];
            self.epoch += 1;
        }
        self.turn_to(&begun);
        false
    }

    /// The diode whose guard in `x` is the most negative beside its rounding, if there is one.
    fn most_wrong(&self) -> Option<usize> {
        let guards = &self.x[self.z.len()..];
        let wrong = self.diodes.iter().copied().filter(|&i| guards[i] < -self.noise[i]);
        let by = |i: &usize| guards[*i] / self.noise[*i];
        wrong.min_by(|a, b| by(a).total_cmp(&by(b)))
    }
}
