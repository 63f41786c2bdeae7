//! Lemke's complementary pivoting with lexicographic ratio test, on a dense tableau.
//!
//! It terminates for every matrix and solves the problem for P- and copositive-plus matrices; for
//! others a ray may end it although solutions exist, and another covering vector may find one.

use super::problem::Role;
use super::scratch::Scratch;
use crate::rounding::OF_SOLUTION;

/// Basic pairs of `w = M l + q >= 0`, `l >= 0`, `w' l = 0`: true where `l` is basic.  `matrix` is
/// stored by rows.  `None` at a secondary ray or after too many pivots.
pub(crate) fn lcp(matrix: &[f64], q: &[f64], cover: &[f64]) -> Option<Vec<bool>> {
    let m = q.len();
    if q.iter().all(|&v| v >= 0.0) {
        return Some(vec![false; m]);
    }
    // columns: q, w (m), l (m), artificial
    let width = 2 * m + 2;
    let artificial = 2 * m + 1;
    let mut t = vec![0.0; m * width];
    for i in 0..m {
        let row = &mut t[i * width..(i + 1) * width];
        row[0] = q[i];
        row[1 + i] = 1.0;
        for j in 0..m {
            row[1 + m + j] = -matrix[i * m + j];
        }
        row[artificial] = -cover[i];
    }
    let mut basis: Vec<usize> = (1..=m).collect();
    // the first pivot makes all q nonnegative: the row with the most negative q / cover leaves
    let mut row = (0..m).min_by(|&i, &j| (q[i] / cover[i]).total_cmp(&(q[j] / cover[j])))?;
    let mut entering = artificial;
    for _ in 0..(50 * m + 200) {
        let leaving = basis[row];
        pivot(&mut t, width, row, entering);
        basis[row] = entering;
        if leaving == artificial {
            let mut active = vec![false; m];
            for &b in basis.iter().filter(|&&b| b > m && b < artificial) {
                active[b - 1 - m] = true;
            }
            return Some(active);
        }
        entering = if leaving <= m { leaving + m } else { leaving - m };
        row = leaving_row(&t, width, entering, &basis, artificial)?;
    }
    None
}

/// Lexicographically smallest ratio; the artificial variable leaves as soon as it may.
fn leaving_row(
    t: &[f64],
    width: usize,
    entering: usize,
    basis: &[usize],
    artificial: usize,
) -> Option<usize> {
    let m = basis.len();
    let largest = (0..m).fold(0.0f64, |a, i| a.max(t[i * width + entering].abs()));
    let mut best: Option<usize> = None;
    // what pivots have left of smaller entries is rounding
    for i in (0..m).filter(|&i| t[i * width + entering] > OF_SOLUTION * largest) {
        let Some(b) = best else {
            best = Some(i);
            continue;
        };
        let (x, y) = (&t[i * width..(i + 1) * width], &t[b * width..(b + 1) * width]);
        let mut order = (x[0] / x[entering]).total_cmp(&(y[0] / y[entering]));
        if order.is_eq() && basis[i] == artificial {
            order = std::cmp::Ordering::Less;
        } else if order.is_eq() && basis[b] == artificial {
            order = std::cmp::Ordering::Greater;
        }
        for k in 1..=m {
            if !order.is_eq() {
                break;
            }
            order = (x[k] / x[entering]).total_cmp(&(y[k] / y[entering]));
        }
        if order.is_lt() {
            best = Some(i);
        }
    }
    best
}

fn pivot(t: &mut [f64], width: usize, row: usize, column: usize) {
    let factor = 1.0 / t[row * width + column];
    for v in &mut t[row * width..(row + 1) * width] {
        *v *= factor;
    }
    let (above, rest) = t.split_at_mut(row * width);
    let (pivot_row, below) = rest.split_at_mut(width);
    for other in above.chunks_exact_mut(width).chain(below.chunks_exact_mut(width)) {
        let f = other[column];
        if f != 0.0 {
            for (o, p) in other.iter_mut().zip(pivot_row.iter()) {
                *o -= f * p;
            }
            other[column] = 0.0;
        }
    }
}

/// The problem reduced to its diodes: closed switches and `z` eliminated.
pub(crate) struct Reduced {
    /// which pairs
    pub diodes: Vec<usize>,
    /// by rows, in the scaled system
    pub matrix: Vec<f64>,
    pub q: Vec<f64>,
}

/// Eliminates all unknowns but the diodes' multipliers, with the given right-hand side.  `None` if
/// the equations with all diodes blocking are singular.
pub(crate) fn reduce(s: &mut Scratch, level: usize, rhs: &[f64]) -> Option<Reduced> {
    let (n, size) = (s.model.n, s.model.size());
    let mu = super::modes::LEVELS[level];
    let diodes: Vec<usize> = (0..s.model.m).filter(|&i| s.roles[i] == Role::Diode).collect();
    for i in 0..s.model.m {
        s.active[i] = s.roles[i] == Role::Closed;
    }
    let factor = s.factor(level);
    if !factor.regular() {
        return None;
    }
    let count = diodes.len();
    let mut reduced = Reduced { matrix: vec![0.0; count * count], q: vec![0.0; count], diodes };
    let zeros = vec![0.0; size];
    let mut x = vec![0.0; size];
    let mut defect = vec![0.0; size];
    for column in 0..=count {
        // one column per multiplier, then the right-hand side
        let source = if column < count { &zeros } else { rhs };
        x.copy_from_slice(source);
        for (x, _) in x[n..].iter_mut().zip(&s.active).filter(|(_, &a)| !a) {
            *x = 0.0;
        }
        if column < count {
            let at = n + reduced.diodes[column];
            x[at] = s.model.scale[at];
        }
        s.iterations += 1;
        factor.respond(&mut x, &mut s.work);
        s.model.defect(source, &x, &mut defect);
        for (row, &i) in reduced.diodes.iter().enumerate() {
            let w = -defect[n + i] * s.model.scale[n + i];
            if !w.is_finite() {
                return None;
            }
            if column == count {
                reduced.q[row] = w;
            } else {
                reduced.matrix[row * count + column] = w;
            }
        }
        if column < count {
            reduced.matrix[column * count + column] += mu;
        }
    }
    Some(reduced)
}

/// Solves the problem of a proximal level; the solution is in `s.x`, its active set in `s.active`.
pub(crate) fn solve_level(s: &mut Scratch, level: usize, rhs: &[f64]) -> bool {
    let Some(reduced) = reduce(s, level, rhs) else {
        return false;
    };
    let cover = vec![1.0; reduced.q.len()];
    let Some(basic) = lcp(&reduced.matrix, &reduced.q, &cover) else {
        return false;
    };
    for (&i, &on) in reduced.diodes.iter().zip(&basic) {
        s.active[i] = on;
    }
    s.x.copy_from_slice(rhs);
    let n = s.model.n;
    for (x, _) in s.x[n..].iter_mut().zip(&s.active).filter(|(_, &a)| !a) {
        *x = 0.0;
    }
    let factor = s.factor(level);
    factor.solve(&mut s.x, &mut s.work);
    s.x.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_matrix_with_known_solution() {
        // M = [[2, 1], [1, 2]], q = (-5, -6): l = (4/3, 7/3)
        let basic = lcp(&[2.0, 1.0, 1.0, 2.0], &[-5.0, -6.0], &[1.0, 1.0]);
        assert_eq!(basic, Some(vec![true, true]));
    }

    #[test]
    fn degenerate_ties_end() {
        let m = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        let basic = lcp(&m, &[-1.0, -1.0, -1.0], &[1.0; 3]).unwrap();
        assert_eq!(basic.iter().filter(|&&b| b).count(), 1);
    }

    #[test]
    fn infeasible_ends_at_a_ray() {
        assert_eq!(lcp(&[0.0], &[-1.0], &[1.0]), None);
    }
}
