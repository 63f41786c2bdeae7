//! Stage 1: semismooth Newton on `min(l, w) = 0`, an active-set iteration from the last mode.
//!
//! Most steps of a simulation change few pairs or none, so that this stage ends after one or two
//! solves with cached factors.  It has no convergence theory; cycles are noticed and left to the
//! stages that have one.

use super::cache::fingerprint;
use super::residual::Residual;
use super::scratch::{Scale, Scratch};
use crate::rounding::OF_SOLUTION;

/// Iterations granted for few pairs; large networks get more (a front of switching diodes moves
/// one pair per iteration).
const ITERATIONS: usize = 12;

/// A front is not wider than so many pairs: where more change simultaneously, and their number has not come to a
/// new low for `ITERATIONS`, they go to and fro.
const FRONT: usize = 4;

/// Starts from `start` and the active set already in `s.active`; true if `s.x` solves the problem.
pub(crate) fn solve(s: &mut Scratch) -> Option<Residual> {
    let limit = ITERATIONS.max((s.model.m / 8).min(200));
    let mut scale = Scale::Own;
    let (mut fewest, mut idle) = (usize::MAX, 0);
    s.seen.clear();
    s.seen.push(fingerprint(&s.active));
    for _ in 0..limit {
        s.x.copy_from_slice(&s.start);
        let regular = s.solve_mode_in(1);
        let mut changes = s.identify(scale);
        if changes == 0 {
            let found = s.judge_strictly();
            if !regular || found.is_some_and(|f| f.worst() <= OF_SOLUTION) {
                return found;
            }
        }
        if regular {
            // signs must not be decided by errors that one more sweep removes
            s.solve_mode_in(1);
            changes = s.identify(scale);
            if changes == 0 {
                return s.judge_strictly();
            }
        }
        idle = if changes < fewest { 0 } else { idle + 1 };
        fewest = fewest.min(changes);
        if idle > ITERATIONS && changes > FRONT {
            return None;
        }
        let print = fingerprint(&s.next);
        if s.seen.contains(&print) {
            if scale == Scale::Network {
                return None;
            }
            scale = Scale::Network;
            s.seen.clear();
        }
        s.seen.push(print);
        s.adopt();
    }
    None
}
