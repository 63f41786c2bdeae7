//! Stage 2: the proximal point method.
//!
//! `z, l` become the solution of the problem with `mu (z - z_k)`, `mu (l - l_k)` added to its
//! equations, which always exists and is unique if the problem is monotone, for any K.  The
//! centres converge to a solution near the first one: this picks one of several solutions
//! continuously.  Every now and then the active set is read off and solved exactly.

use super::modes::LEVELS;
use super::residual::Residual;
use super::scratch::Scratch;
use super::{lemke, pivoting, polish};
use crate::rounding::OF_SOLUTION;

/// (level, centred at the previous solution, outer iterations).  Small weights move far in one
/// iteration where the solution is far from its data; large ones are safe against rounding.
const SETTINGS: [(usize, bool, u32); 6] =
    [(1, true, 12), (2, true, 6), (3, true, 4), (7, true, 18), (4, true, 30), (5, false, 30)];
const POLISH_AT: [u32; 9] = [1, 2, 3, 5, 8, 12, 18, 27, 30];
/// Pivoting rounds before Lemke's method, which costs O(m^3), takes over.
const ROUNDS: usize = 40;
/// Lemke's tableau is not made for more pairs; pivoting goes on instead.
const LEMKE_LIMIT: usize = 600;

/// True if `s.x` solves the problem.
pub(crate) fn solve(s: &mut Scratch) -> Option<Residual> {
    let (n, size) = (s.model.n, s.model.size());
    let mut rhs = vec![0.0; size];
    let mut centre = vec![0.0; size];
    for (level, centred, outer) in SETTINGS {
        let mu = LEVELS[level];
        if centred {
            centre.copy_from_slice(&s.start);
        } else {
            centre.fill(0.0);
        }
        s.x.copy_from_slice(&centre);
        s.activate_from_signs();
        let mut inner = s.active.clone();
        for k in 1..=outer {
            for i in 0..size {
                let weight = mu / (s.model.scale[i] * s.model.scale[i]);
                rhs[i] = s.f[i] + weight * centre[i];
            }
            s.active.copy_from_slice(&inner);
            let mut solved = pivoting::solve(s, level, &mut rhs, ROUNDS);
            if !solved {
                solved = if s.model.m <= LEMKE_LIMIT {
                    lemke::solve_level(s, level, &rhs)
                } else {
                    s.active.copy_from_slice(&inner);
                    pivoting::solve(s, level, &mut rhs, 10 * ROUNDS)
                };
            }
            if !s.x.iter().all(|v| v.is_finite()) {
                break;
            }
            inner.copy_from_slice(&s.active);
            let scaled = |x: &[f64], i: usize| x[i] / s.model.scale[i];
            let (mut step, mut reach) = (0.0f64, 0.0f64);
            for i in 0..size {
                step = step.max((scaled(&s.x, i) - scaled(&centre, i)).abs());
                reach = reach.max(scaled(&s.x, i).abs());
            }
            centre.copy_from_slice(&s.x);
            for (i, l) in centre[n..].iter_mut().enumerate() {
                if s.roles[i] == super::Role::Diode {
                    *l = l.max(0.0);
                }
            }
            let still = step <= OF_SOLUTION * reach;
            if POLISH_AT.contains(&k) || still {
                if let Some(found) = polish::polish(s, &centre) {
                    return Some(found);
                }
            }
            // next to larger unknowns rounding leaves nothing of what has the size of the scaled data
            if still || OF_SOLUTION * reach > 1.0 || (!solved && k > 3) {
                break;
            }
        }
    }
    None
}
