//! States of switches where the present ones leave no solution.
//!
//! Where the control of a switch follows from the solution, a contradiction says nothing of the network as long as
//! the switch may be in the other state: with it there may be a solution that agrees with it.

use super::gates::Gates;
use crate::integrate::implicit::failure::{Failure, Outcome};
use crate::integrate::implicit::stepper::Stepper;

/// Most switches whose states are all tried: 255 problems.
const MOST: usize = 8;
/// The role of a switch whose state is not known, in a failure.
const EITHER: u8 = 3;

impl Stepper {
    /// Looks for a state of the switches whose solution agrees with it, after a `failure` in the present one; those
    /// that the sources decide about stay as they are. Without any the failure is returned: it holds for every state
    /// of those that were tried, and is to be proved for every state of the others.
    pub(in crate::integrate) fn search(
        &mut self,
        mut failure: Box<Failure>,
        solve: impl Fn(&mut Stepper) -> Outcome,
    ) -> Result<(), Box<Failure>> {
        let open: Vec<usize> = (0..self.switching.count())
            .filter(|&k| !self.switching.controls.decide(k) && !self.switching.sampled[k])
            .collect();
        let before = (
            self.switching.gates.clone(),
            self.state.z.clone(),
            self.state.l.clone(),
            self.solver.stats.switchings,
        );
        let tried = open.len().min(MOST);
        let mut states: Vec<u32> = (1..1u32 << tried).collect();
        states.sort_by_key(|state| state.count_ones());
        for state in states {
            for (bit, &k) in open.iter().take(tried).enumerate() {
                if self.switching.gates[k] != (before.0[k] != (state >> bit & 1 == 1)) {
                    self.gates().throw(k);
                }
            }
            self.state.z.fill(0.0);
            self.state.l.fill(0.0);
            if solve(self).is_ok() && self.gates().agrees(&before.0) {
                return Ok(());
            }
        }
        for &k in &open {
            if self.switching.gates[k] != before.0[k] {
                self.gates().throw(k);
            }
        }
        (_, self.state.z, self.state.l, self.solver.stats.switchings) = before;
        // what Newton's method does not find may be there all the same
        if open.len() > MOST || self.solver.smooth.is_some() {
            for &k in &open {
                failure.roles[self.switching.switches[k].pair] = EITHER;
            }
        }
        Err(failure)
    }
}

impl Gates<'_> {
    /// Whether the switches are as the solution has them: those that have left their states `before` are beyond
    /// the threshold that ends it.
    fn agrees(&mut self, before: &[bool]) -> bool {
        self.see_controls();
        (0..self.switching.count()).all(|k| {
            let left =
                || self.switching.switches[k].distance(before[k], &self.state.z) <= self.known(k);
            !self.would_turn(k) && (self.switching.gates[k] == before[k] || left())
        })
    }
}
