//! Stage 5: problems without monotonicity (controlled sources, negative slopes).
//!
//! No method is sure to solve these.  Lemke's method is tried with several covering vectors, then,
//! for few pairs, every mode; of the solutions found by enumeration the one nearest to the previous
//! step is taken.

use super::lemke;
use super::polish;
use super::problem::Role;
use super::residual::Residual;
use super::scratch::Scratch;

/// Pairs up to which all modes are tried.
const ENUMERATION: usize = 14;
const LEMKE_LIMIT: usize = 300;
const COVERS: usize = 11;

/// True if `s.x` solves the problem.
pub(crate) fn solve(s: &mut Scratch) -> Option<Residual> {
    let diodes: Vec<usize> = (0..s.model.m).filter(|&i| s.roles[i] == Role::Diode).collect();
    if diodes.is_empty() {
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
