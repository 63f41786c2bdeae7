//! Eigenvectors and eigenvalues to the rounding of each row of their equations.
//!
//! A decomposition is exact to rounding of the largest entries of a matrix.  Where its rows differ by
//! many orders, as with picofarads next to millifarads, small entries of slow vectors are then voltages
//! off by more than any tolerance, and slow vectors are mixed.  The residual `R = J V - V L` of each row
//! is known to rounding of that row, and to first order
//!
//! ```text
//! V <- V (1 + P),   L <- L + D,   V^-1 R = D + P L - L P      (D block diagonal, P without these blocks)
//! ```
//!
//! which squares the relative error (J. J. Dongarra, C. B. Moler, J. H. Wilkinson: *Improving the
//! accuracy of computed eigenvalues and eigenvectors*, SIAM J. Numer. Anal. 20, 1983, 23-45).  Vectors
//! that are mixed beyond that still span what they should: the eigenvectors in it are those of the small
//! matrix `L + V^-1 R` of their rows and columns.

use crate::dense::{complex, eigen, Complex, Lu, Matrix};
use crate::modewise::spectra::block::row_norm;
use crate::modewise::spectra::spectrum::{Pole, Spectrum, CONDITION};
use crate::tolerances::{ACCEPT, CLEARLY};
use crate::union_find::UnionFind;
use std::ops::Range;

/// Steps: most end after two, as the equations hold.
const STEPS: usize = 8;
/// Steps that may take vectors apart that are mixed: in those that are left, nothing is to be found.
const MIXED: usize = 3;

/// Rounding of a row, in units of its terms (Higham: Accuracy and Stability of Numerical Algorithms,
/// 2002, section 3.5).
fn rounding(j: &Matrix) -> f64 {
    j.rows as f64 * f64::EPSILON
}

/// `B X - X T = C` for a coordinate that another one drives: with `C w = c w + d conj(w)` the rates
/// of the parts are those of `w` and of its conjugate.
fn response(b: Complex, w: Complex, c: &Matrix) -> Matrix {
    let at = |r: usize, k: usize| if r < c.rows && k < c.cols { c[(r, k)] } else { 0.0 };
    let straight = complex(at(0, 0) + at(1, 1), at(1, 0) - at(0, 1)).scale(0.5);
    let turned = complex(at(0, 0) - at(1, 1), at(1, 0) + at(0, 1)).scale(0.5);
    let (x, y) = (straight / (b - w), turned / (b - w.conj()));
    let parts = [[(x + y).re, -(x - y).im], [(x + y).im, (x - y).re]];
    Matrix::from_fn(c.rows, c.cols, |r, k| parts[r][k])
}

/// Places of a pole.
fn places(pole: &Pole) -> Range<usize> {
    pole.at..pole.at + pole.width()
}

/// `V L`
fn turned(v: &Matrix, poles: &[Pole]) -> Matrix {
    let mut out = Matrix::zeros(v.rows, v.cols);
    for pole in poles {
        let k = pole.at;
        for r in 0..v.rows {
            if pole.omega == 0.0 {
                out[(r, k)] = pole.alpha * v[(r, k)];
            } else {
                out[(r, k)] = pole.alpha * v[(r, k)] + pole.omega * v[(r, k + 1)];
                out[(r, k + 1)] = pole.alpha * v[(r, k + 1)] - pole.omega * v[(r, k)];
            }
        }
    }
    out
}

/// `V^-1 R`, without what is rounding of its row, and the largest part of its terms that a row misses.
fn residual(j: &Matrix, sizes: &Matrix, spectrum: &Spectrum) -> (Matrix, f64) {
    let Spectrum { poles, from_modal, to_modal, .. } = spectrum;
    let mut rest = j.times(from_modal);
    rest.add_scaled(-1.0, &turned(from_modal, poles));
    let terms = sizes.times(&from_modal.abs());
    let (known, mut worst) = (rounding(j), 0.0f64);
    for (v, size) in rest.data.iter_mut().zip(&terms.data) {
        if v.abs() <= known * size {
            *v = 0.0;
        } else {
            worst = worst.max(v.abs() / size);
        }
    }
    (to_modal.times(&rest), worst)
}

/// The part of `P` between the two vectors of a pair: `D` takes the rest of theirs.
fn within(p: &mut Matrix, found: &Matrix, pair: &Pole) {
    let (k, n) = (pair.at, pair.at + 1);
    if pair.omega == 0.0 {
        return;
    }
    let along = 0.25 * (found[(k, k)] - found[(n, n)]) / pair.omega;
    let across = -0.25 * (found[(k, n)] + found[(n, k)]) / pair.omega;
    // squares of such corrections are a hundredth of what they are
    if along.abs().max(across.abs()) <= CLEARLY {
        (p[(k, k)], p[(n, n)]) = (across, -across);
        (p[(k, n)], p[(n, k)]) = (along, along);
    }
}

/// `P`, and labels of the poles: those with vectors that are mixed have the same.
fn corrections(found: &Matrix, poles: &[Pole]) -> (Matrix, Vec<usize>) {
    let mut p = Matrix::zeros(found.rows, found.cols);
    let mut mixed = UnionFind::new(poles.len());
    for (i, a) in poles.iter().enumerate() {
        for (k, b) in poles.iter().enumerate() {
            let (rows, cols) = (places(a), places(b));
            let part = Matrix::from_fn(rows.len(), cols.len(), |r, c| -found[(a.at + r, b.at + c)]);
            if part.max_abs() == 0.0 {
                continue;
            }
            if i == k {
                within(&mut p, found, a);
                continue;
            }
            let rate = |pole: &Pole| complex(pole.alpha, pole.omega);
            let part = response(rate(a), rate(b), &part);
            if part.max_abs() > CLEARLY || !part.finite() {
                mixed.join(i, k);
                continue;
            }
            for r in 0..part.rows {
                p.row_mut(a.at + r)[cols.clone()].copy_from_slice(part.row(r));
            }
        }
    }
    (p, (0..poles.len()).map(|k| mixed.root(k)).collect())
}

/// `V <- V (1 + P)`, `L <- L + D`
fn correct(spectrum: &mut Spectrum, found: &Matrix, p: &Matrix) {
    let mut poles = Vec::with_capacity(spectrum.poles.len());
    for pole in &spectrum.poles {
        let (k, mut pole) = (pole.at, *pole);
        if pole.omega == 0.0 {
            pole.alpha += found[(k, k)];
            poles.push(pole);
            continue;
        }
        pole.alpha += 0.5 * (found[(k, k)] + found[(k + 1, k + 1)]);
        pole.omega += 0.5 * (found[(k + 1, k)] - found[(k, k + 1)]);
        poles.push(pole);
        // a pair that was one by rounding alone: each of its vectors has a pole of its own
        if pole.omega == 0.0 {
            poles.push(Pole { at: k + 1, ..pole });
        }
    }
    spectrum.poles = poles;
    let more = spectrum.from_modal.times(p);
    spectrum.from_modal.add_scaled(1.0, &more);
}

/// Takes vectors of the same label apart.
fn take_apart(spectrum: &mut Spectrum, found: &Matrix, labels: &[usize]) -> Option<()> {
    let n = found.rows;
    let whole = turned(&Matrix::identity(n), &spectrum.poles);
    let (mut poles, mut vectors) = (Vec::new(), Matrix::zeros(n, 0));
    for label in 0..labels.len() {
        let group = || spectrum.poles.iter().zip(labels).filter(|(_, &l)| l == label);
        let list: Vec<usize> = group().flat_map(|(pole, _)| places(pole)).collect();
        let own = spectrum.from_modal.select_cols(&list);
        let at = vectors.cols;
        if group().count() < 2 {
            poles.extend(group().map(|(pole, _)| Pole { at, ..*pole }));
            vectors = vectors.beside(&own);
            continue;
        }
        let mut small = found.select_rows(&list).select_cols(&list);
        small.add_scaled(1.0, &whole.select_rows(&list).select_cols(&list));
        let (part, _) = Spectrum::from_eigen(&eigen(&small)?, Vec::new());
        let part = part?;
        poles.extend(part.poles.iter().map(|pole| Pole { at: at + pole.at, ..*pole }));
        vectors = vectors.beside(&own.times(&part.from_modal));
    }
    (spectrum.poles, spectrum.from_modal) = (poles, vectors);
    Some(())
}

/// Corrects a decomposition into eigenvectors; None if its equations do not hold then.
pub(in crate::modewise) fn sharpened(j: &Matrix, mut spectrum: Spectrum) -> Option<Spectrum> {
    let sizes = j.abs();
    let (mut last, mut apart) = (f64::INFINITY, 0);
    for _ in 0..STEPS {
        let (found, worst) = residual(j, &sizes, &spectrum);
        if worst == 0.0 || worst > 0.5 * last {
            break;
        }
        let (p, labels) = corrections(&found, &spectrum.poles);
        let mixed = labels.iter().enumerate().any(|(k, label)| k != *label);
        if mixed && apart < MIXED {
            apart += 1;
            take_apart(&mut spectrum, &found, &labels)?;
        } else {
            correct(&mut spectrum, &found, &p);
            (last, apart) = (worst, MIXED);
        }
        let from = &spectrum.from_modal;
        spectrum.to_modal = Lu::new(from).solve_refined(from, &Matrix::identity(j.rows));
    }
    let mut rest = j.times(&spectrum.from_modal);
    rest.add_scaled(-1.0, &turned(&spectrum.from_modal, &spectrum.poles));
    let condition = row_norm(&spectrum.from_modal) * row_norm(&spectrum.to_modal);
    (rest.max_abs() <= ACCEPT * j.max_abs() && condition < CONDITION).then_some(spectrum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::norm;

    /// Random rows of very different size.
    fn graded(seed: u64, n: usize) -> Matrix {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut chance = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 * 2f64.powi(-53)
        };
        let sizes: Vec<f64> = (0..n).map(|_| 10f64.powf(-2.0 + 7.0 * chance())).collect();
        let mut j = Matrix::zeros(n, n);
        for r in 0..n {
            for c in 0..r {
                // stores that lend energy to each other
                let v = (chance() - 0.5) * sizes[r] * sizes[c];
                (j[(r, c)], j[(c, r)]) = (v, -v);
            }
            j[(r, r)] = -chance() * sizes[r] * sizes[r];
        }
        j
    }

    #[test]
    fn each_row_holds_to_its_own_rounding() {
        for seed in 0..20 {
            let j = graded(seed, 12);
            let spectrum = Spectrum::new(&j, false).unwrap();
            let mut rest = j.times(&spectrum.from_modal);
            rest.add_scaled(-1.0, &turned(&spectrum.from_modal, &spectrum.poles));
            let size = j.abs().times(&spectrum.from_modal.abs());
            // rates lie 14 decades apart, so that a whole matrix is exact to 1 in the slowest row
            for (v, size) in rest.data.iter().zip(&size.data) {
                assert!(v.abs() <= 1e-11 * size, "{seed}: {v:e} of {size:e}");
            }
        }
    }

    #[test]
    fn mixed_vectors_are_taken_apart() {
        // the eigenvectors of two slow rates replaced by others of the same plane
        let j = Matrix::from_fn(3, 3, |r, c| {
            [[-2.0, 1.0, 0.0], [1.0, -2.0, 1e3], [0.0, -1e3, -1e9]][r][c]
        });
        let right = Spectrum::new(&j, false).unwrap();
        let mut poles = right.poles.clone();
        poles.sort_by(|a, b| a.alpha.total_cmp(&b.alpha));
        let mut mixed = Spectrum::new(&j, false).unwrap();
        let turn = Matrix::from_fn(3, 3, |r, c| {
            let of = |k: usize| mixed.poles.iter().position(|p| p.alpha == poles[k].alpha).unwrap();
            let (slow, slower) = (of(1), of(2));
            match (r, c) {
                _ if r == c => 0.8,
                _ if (r, c) == (slow, slower) => 0.6,
                _ if (r, c) == (slower, slow) => -0.6,
                _ => 0.0,
            }
        });
        mixed.from_modal = mixed.from_modal.times(&turn);
        mixed.to_modal = Lu::new(&mixed.from_modal).solve(&Matrix::identity(3));
        let found = sharpened(&j, mixed).unwrap();
        for pole in &found.poles {
            let near = poles.iter().map(|p| (p.alpha / pole.alpha - 1.0).abs()).fold(1.0, f64::min);
            assert!(near < 1e-14, "{pole:?}");
            let (v, u) = (found.from_modal.col(pole.at), |p: &Pole| right.from_modal.col(p.at));
            let same =
                right.poles.iter().find(|p| (p.alpha / pole.alpha - 1.0).abs() < 1e-9).unwrap();
            let w = u(same);
            let cosine = v.iter().zip(&w).map(|(a, b)| a * b).sum::<f64>() / norm(&v) / norm(&w);
            assert!((cosine.abs() - 1.0).abs() < 1e-14);
        }
    }

    /// Two inductors whose loops have no resistance, next to a fast rate: rounding makes a pair of them.
    #[test]
    fn a_pair_by_rounding_keeps_both_of_its_coordinates() {
        let j = Matrix::from_fn(3, 3, |r, c| if r == 2 && c == 2 { -1e9 } else { 0.0 });
        let pair = Pole { at: 0, alpha: 0.0, omega: 1e-30 };
        let unit = Matrix::identity(3);
        let poles = vec![pair, Pole { at: 2, alpha: -1e9, omega: 0.0 }];
        let mut spectrum =
            Spectrum { poles, blocks: Vec::new(), from_modal: unit.clone(), to_modal: unit };
        let mut found = j.clone();
        found.add_scaled(-1.0, &turned(&spectrum.from_modal, &spectrum.poles));
        correct(&mut spectrum, &found, &Matrix::zeros(3, 3));
        let places: Vec<usize> = spectrum.poles.iter().flat_map(places).collect();
        assert_eq!(places, [0, 1, 2]);
        assert!(spectrum.poles.iter().all(|pole| pole.omega == 0.0));
    }
}
