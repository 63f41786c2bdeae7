//! Stage 5: problems without monotonicity (controlled sources, negative slopes).
//!
//! No method is sure to solve these.  Lemke's method is tried with several covering vectors, then,
//! for few pairs, every mode; of the solutions found by enumeration the one nearest to the previous
//! step is taken.

use super::lemke;
use super::polish;
use super::problem::Role;
use super::residual::Residual;
use super::scratch::{Scratch, ACCEPT_DATA};
use crate::dense::LeastNorm;
use crate::sparse::Csc;

/// Pairs up to which all modes are tried.
const ENUMERATION: usize = 14;
/// Unknowns up to which laws are looked at for a contradiction by their pseudo-inverse: once in a problem that
/// nothing has solved.
const PROVED: usize = 160;
const LEMKE_LIMIT: usize = 300;
const COVERS: usize = 11;

/// True if `s.x` solves the problem.
pub(crate) fn solve(s: &mut Scratch) -> Option<Residual> {
    let diodes: Vec<usize> = (0..s.model.m).filter(|&i| s.roles[i] == Role::Diode).collect();
    if diodes.is_empty() || s.model.size() <= PROVED && contradicts(s) {
        return None;
    }
    if diodes.len() <= ENUMERATION {
        return enumerate(s, &diodes);
    }
    if diodes.len() <= LEMKE_LIMIT {
        return cover(s);
    }
    None
}

/// Whether the laws contradict each other for any diode states: those of the network and of the pairs that are
/// open or closed have no solution, with any multipliers and slacks of the others.
fn contradicts(s: &Scratch) -> bool {
    let (n, size) = (s.model.n, s.model.size());
    let role = |row: usize| row.checked_sub(n).map_or(Role::Closed, |pair| s.roles[pair]);
    let closed = s.model.scaled.iter().filter(|e| role(e.0) == Role::Closed);
    let open = (0..size).filter(|&row| role(row) == Role::Open).map(|row| (row, row, 1.0));
    let laws = Csc::from_triplets(size, size, &closed.chain(open).collect::<Vec<_>>());
    let right: Vec<f64> = (0..size)
        .map(|row| if role(row) == Role::Closed { s.f[row] * s.model.scale[row] } else { 0.0 })
        .collect();
    let (mut x, mut work) = (vec![0.0; size], vec![0.0; size]);
    // they leave more of the data than any accepted solution
    LeastNorm::new(&laws).is_some_and(|laws| laws.correct(&right, &mut x, &mut work) > ACCEPT_DATA)
}

fn cover(s: &mut Scratch) -> Option<Residual> {
    let rhs = s.f.clone();
    let mut level = 0;
    let reduced = lemke::reduce(s, 0, &rhs).or_else(|| {
        level = 1;
        lemke::reduce(s, 1, &rhs)
    })?;
    let mut random = 0x2545_f491_4f6c_dd1du64;
    for k in 0..COVERS {
        let cover: Vec<f64> = (0..reduced.q.len())
            .map(|_| {
                // xorshift: reproducible, and no better randomness is needed
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                if k == 0 {
                    1.0
                } else {
                    0.01 + (random >> 11) as f64 / (1u64 << 53) as f64
                }
            })
            .collect();
        let Some(basic) = lemke::lcp(&reduced.matrix, &reduced.q, &cover) else { continue };
        for (&i, &on) in reduced.diodes.iter().zip(&basic) {
            s.active[i] = on;
        }
        for i in 0..s.model.m {
            if s.roles[i] != Role::Diode {
                s.active[i] = s.roles[i] == Role::Closed;
            }
        }
        s.x.copy_from_slice(&s.start);
        s.solve_mode();
        if let Some(found) = s.judge() {
            return Some(found);
        }
        let point = s.x.clone();
        if let Some(found) = polish::polish(s, &point) {
            return Some(found);
        }
    }
    None
}

fn enumerate(s: &mut Scratch, diodes: &[usize]) -> Option<Residual> {
    let mut nearest: Option<(f64, Vec<f64>, Vec<bool>, Residual)> = None;
    for mode in 0u32..1 << diodes.len() {
        for (k, &i) in diodes.iter().enumerate() {
            s.active[i] = mode >> k & 1 == 1;
        }
        for i in 0..s.model.m {
            if s.roles[i] != Role::Diode {
                s.active[i] = s.roles[i] == Role::Closed;
            }
        }
        s.x.copy_from_slice(&s.start);
        s.solve_mode();
        let Some(found) = s.judge() else { continue };
        let distance = s.x.iter().zip(&s.start).zip(&s.model.scale);
        let distance = distance.map(|((x, c), s)| ((x - c) / s).powi(2)).sum::<f64>();
        if nearest.as_ref().is_none_or(|(d, ..)| distance < *d) {
            nearest = Some((distance, s.x.clone(), s.active.clone(), found));
        }
    }
    let (_, x, active, found) = nearest?;
    s.x.copy_from_slice(&x);
    s.active.copy_from_slice(&active);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::super::model::Model;
    use super::super::problem::Problem;
    use super::*;
    use std::sync::Arc;

    /// A source of 10 V from node 0 to ground, its current 1, and pairs from node 0 to ground.
    fn source_across(pairs: &[Role]) -> Scratch {
        let m = pairs.len();
        let column =
            |v: f64| Csc::from_triplets(2, m, &(0..m).map(|i| (0, i, v)).collect::<Vec<_>>());
        let model = Model::new(Problem {
            k: Csc::from_triplets(2, 2, &[(0, 1, 1.0), (1, 0, -1.0), (0, 0, 1e-9)]),
            a: column(1.0),
            b: Csc::from_triplets(m, 2, &(0..m).map(|i| (i, 0, 1.0)).collect::<Vec<_>>()),
            d: Csc::zeros(m, m),
            row_kind: vec![0, 1],
        });
        let mut s = Scratch::new(Arc::new(model));
        s.f[..2].copy_from_slice(&[0.0, -10.0]);
        s.roles.copy_from_slice(pairs);
        s
    }

    #[test]
    fn closed_switches_alone_tell_that_a_source_is_shorted() {
        assert!(contradicts(&source_across(&[Role::Diode, Role::Closed])));
        // a diode may open; what it does is another question
        assert!(!contradicts(&source_across(&[Role::Diode, Role::Open])));
    }
}
