//! Block principal pivoting for the strongly monotone problems of the proximal iteration.
//!
//! All pairs of the wrong sign change sides simultaneously (Kostreva 1978, Judice & Pires 1994); if their
//! number does not fall for a while, only the last one does, which is finite for P-matrices.  It
//! works on the factored mode equations, sparse or dense, and never forms the m x m matrix.

use super::scratch::{Scale, Scratch};

const PATIENCE: u32 = 8;

/// Solves the problem of the given level with right-hand side `s.rhs` = `[b + mu z_c; -q + mu l_c]`
/// from the active set in `s.active`; the solution is in `s.x`.  False if `limit` solves did not do.
pub(crate) fn solve(s: &mut Scratch, level: usize, rhs: &mut [f64], limit: usize) -> bool {
    let n = s.model.n;
    let mut fewest = usize::MAX;
    let mut patience = PATIENCE;
    for round in 0..limit {
        s.iterations += 1;
        s.x.copy_from_slice(rhs);
        for (x, _) in s.x[n..].iter_mut().zip(&s.active).filter(|(_, &a)| !a) {
            *x = 0.0;
        }
        let factor = s.factor(level);
        factor.solve(&mut s.x, &mut s.work);
        if !s.x.iter().all(|v| v.is_finite()) {
            return false;
        }
        // inactive multipliers are 0: the proximal term does not enter their slack
        s.model.defect(rhs, &s.x, &mut s.defect);
        let scale = if 2 * round < limit { Scale::Own } else { Scale::Network };
        let wrong = s.identify_from_defect(scale);
        if wrong == 0 {
            return true;
        }
        if wrong < fewest {
            fewest = wrong;
            patience = PATIENCE;
        } else {
            patience = patience.saturating_sub(1);
        }
        if patience > 0 {
            s.adopt();
        } else if let Some(last) = (0..s.model.m).rev().find(|&i| s.next[i] != s.active[i]) {
            s.active[last] = !s.active[last];
        }
    }
    false
}
