//! Coordinates of a mode in which large resistances act on as few as possible.
//!
//! Two inductors that meet in a node which hangs on 1 GOhm have one fast motion, the sum of their
//! currents, and in their own coordinates `J` is `R g g'` of that sum: all slow motions are lost to its
//! rounding.  Householder reflections that turn the rows of its symmetric part, largest first, into a
//! triangle give the fast motions coordinates of their own (rows are to be sorted by size: A. J. Cox,
//! N. J. Higham, *Stability of Householder QR factorization for weighted least squares problems*,
//! 1998); what resistances make of the others is then computed from rows without what cancels.

use crate::dense::{dot, norm, Matrix};
use crate::rounding::{of_elimination, UNIT};
use crate::tolerances::LOST_BEYOND;

/// An orthogonal matrix whose first columns are the directions of the motions that algebraic unknowns
/// damp fastest; None where rates are not far apart, or where the coordinates are already like that.
/// `indirect` is what the states do to each other by way of those unknowns, `direct` the rest.
pub(in crate::modewise) fn fastest_first(indirect: &Matrix, direct: &Matrix) -> Option<Matrix> {
    let n = indirect.cols;
    let mut rows = indirect.transpose();
    rows.add_scaled(1.0, indirect);
    let (mut turn, mut rates) = (Matrix::identity(n), Vec::new());
    let mut cuts = Vec::new();
    for k in 0..n {
        let rest = |r: usize| norm(&rows.row(r)[k..]);
        let fastest = (0..rows.rows).max_by(|&a, &b| rest(a).total_cmp(&rest(b)))?;
        let rate = rest(fastest);
        // digits of the slower group would be lost next to the faster one
        if let Some(last) = rates.last().filter(|last| rate * LOST_BEYOND <= **last) {
            cuts.push((k, *last, turn.clone()));
        }
        if rates.first().is_some_and(|first| rate <= of_elimination(n) * first) || rate == 0.0 {
            break;
        }
        rates.push(rate);
        // v = x + sign(x0) |x| e0 turns x to the first axis
        let mut mirror = rows.row(fastest)[k..].to_vec();
        mirror[0] += rate.copysign(mirror[0]);
        let factor = 2.0 / dot(&mirror, &mirror);
        for list in [&mut rows, &mut turn] {
            for r in 0..list.rows {
                let row = &mut list.row_mut(r)[k..];
                let share = factor * dot(row, &mirror);
                row.iter_mut().zip(&mirror).for_each(|(v, m)| *v -= share * m);
            }
        }
        rows.row_mut(fastest)[k + 1..].fill(0.0);
    }
    let apart = |(cut, rate, turn): &(usize, f64, Matrix)| {
        let others = turn.columns(*cut, n - cut);
        others.transpose_times(&direct.times(&others)).max_abs() * LOST_BEYOND <= *rate
    };
    let (cut, _, turn) = cuts.into_iter().rev().find(apart)?;
    // a direction that deviates so little from an axis leaves its square, rounding, on the others
    let axis = |c: usize| (0..n).filter(|&r| turn[(r, c)].abs() > UNIT.sqrt()).count() == 1;
    (!(0..cut).all(axis)).then_some(turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_currents_gets_a_coordinate_of_its_own() {
        let direct = |rate: f64| Matrix::from_fn(3, 3, |r, c| rate * (r as f64 - c as f64 - 1.0));
        let damped = |g: [f64; 3], rate: f64, other: f64| {
            let last = |r: usize, c: usize| if r == 2 && c == 2 { other } else { 0.0 };
            Matrix::from_fn(3, 3, |r, c| -rate * g[r] * g[c] - last(r, c))
        };
        // two currents into a node on a large resistance, a third on a small one, a swing in parallel
        let found = damped([0.6, 0.8, 0.0], 1e12, 1.0);
        let turn = fastest_first(&found, &direct(1e3)).unwrap();
        for (r, v) in [(0, 0.6), (1, 0.8), (2, 0.0)] {
            assert!((turn[(r, 0)].abs() - v).abs() < 1e-15);
        }
        let mut unit = turn.transpose_times(&turn);
        unit.add_scaled(-1.0, &Matrix::identity(3));
        assert!(unit.max_abs() < 1e-15);
        // nothing to gain: all is as fast, or the coordinates are those
        assert!(fastest_first(&damped([0.6, 0.8, 0.0], 1e4, 1.0), &direct(1e3)).is_none());
        assert!(fastest_first(&found, &direct(1e9)).is_none());
        assert!(fastest_first(&damped([0.0, 1.0, 0.0], 1e12, 1.0), &direct(1e3)).is_none());
        // what only turns round is no damping
        let turning = Matrix::from_fn(3, 3, |r, c| 1e12 * (r as f64 - c as f64));
        assert!(fastest_first(&turning, &direct(1e3)).is_none());
    }
}
