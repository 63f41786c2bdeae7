//! Coordinates without eigenvectors, followed once more: their ends and what they contribute to powers.
//!
//! They and the functions that drive them obey `Y' = M Y`, and a power is `Y' Q Y`.  Its integral is that
//! of `e^(M't) Q e^(Mt)` between the states at the begin, known in a short time by its series and doubled
//! with the exponential:
//!
//! ```text
//! G(2t) = G(t) + e^(M't) G(t) e^(Mt)
//! ```

use crate::dense::{complex, dot, Complex, Matrix};
use crate::modewise::checks::modal_energies::ModalEnergies;
use crate::modewise::spectra::block::row_norm;

/// Terms of a series of `1 / k!`: the next one is below rounding.
const TERMS: usize = 18;

/// The exponential of `m`, and the integral up to 1.
fn gramian(m: &Matrix, q: &Matrix) -> [Matrix; 2] {
    // Q becomes M'Q + QM
    let norm = row_norm(m) + row_norm(&m.transpose());
    let halvings = if norm > 1.0 { norm.log2().ceil() as i32 } else { 0 };
    let t = f64::from(-halvings).exp2();
    let (mut power, mut change) = (Matrix::identity(m.rows), q.clone());
    let (mut whole, mut integral) = (power.clone(), Matrix::zeros(m.rows, m.rows));
    let mut factor = 1.0;
    for k in 1..=TERMS {
        factor *= t / k as f64;
        integral.add_scaled(factor, &change);
        power = power.times(m);
        whole.add_scaled(factor, &power);
        let right = change.times(m);
        change = right.transpose();
        change.add_scaled(1.0, &right);
    }
    for _ in 0..halvings {
        integral.add_scaled(1.0, &whole.transpose_times(&integral).times(&whole));
        whole = whole.times(&whole);
    }
    [whole, integral]
}

/// Where the coordinates `X' = B X + forces` end, and the integral of `weights X`; forces and weights are
/// given by the functions of which the inputs are made.
pub fn followed(
    modal: &ModalEnergies,
    b: &Matrix,
    start: &[f64],
    forces: &[Vec<Complex>],
    weights: &[Vec<Complex>],
) -> (Vec<f64>, f64) {
    let h = modal.h;
    // real functions: cosine and sine of a pair, which begin as 1 and 0
    let own = modal.bases.iter().enumerate().filter(|(_, base)| !base.mirrored);
    let mut places: Vec<(usize, Complex)> = Vec::new();
    for (b, base) in own {
        if base.rate.im == 0.0 {
            places.push((b, complex(1.0, 0.0)));
        } else {
            places.extend([(b, complex(2.0, 0.0)), (b, complex(0.0, 2.0))]);
        }
    }
    let part = |list: &[Complex], p: usize| {
        let (b, side) = places[p];
        h * (list[b] * side).re
    };
    let (w, size) = (b.rows, b.rows + places.len());
    // what drives them in units by which it shows no larger rates than they have
    let pushed = forces.iter().flat_map(|list| (0..places.len()).map(|p| part(list, p).abs()));
    let largest = pushed.fold(0.0, f64::max) / (h * row_norm(b)).max(1.0);
    let unit = if largest > 0.0 { largest.log2().ceil().exp2() } else { 1.0 };
    let (mut m, mut q) = (Matrix::zeros(size, size), Matrix::zeros(size, size));
    let mut y = start.to_vec();
    for r in 0..w {
        m.row_mut(r)[..w].iter_mut().zip(b.row(r)).for_each(|(m, b)| *m = h * b);
        for p in 0..places.len() {
            m[(r, w + p)] = part(&forces[r], p) / unit;
            q[(r, w + p)] = 0.5 * part(&weights[r], p) / unit;
            q[(w + p, r)] = q[(r, w + p)];
        }
    }
    for (p, &(b, side)) in places.iter().enumerate() {
        let (base, at) = (&modal.bases[b], w + p);
        if base.line {
            m[(at, w)] = 1.0; // 1 is the first of all
        }
        m[(at, at)] += base.rate.re;
        if side.im != 0.0 {
            m[(at, at - 1)] = base.rate.im;
            m[(at - 1, at)] = -base.rate.im;
        }
        y.push(if base.line || side.im != 0.0 { 0.0 } else { unit });
    }
    let [whole, integral] = gramian(&m, &q);
    let (mut end, mut image) = (vec![0.0; size], vec![0.0; size]);
    whole.apply(&y, &mut end);
    integral.apply(&y, &mut image);
    end.truncate(w);
    (end, dot(&y, &image))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modewise::functions::inputs::{Decay, Segment, Tone};

    #[test]
    fn independent_coordinates_end_as_they_do_alone() {
        let segment = Segment {
            level: vec![1.0, 0.4, 0.0, 0.0, 0.0],
            slope: vec![0.0, 0.7, 0.0, 0.0, 0.0],
            sloped: true,
            tones: vec![Tone { index: 2, rate: complex(-0.1, 9.0), start: complex(0.8, -0.6) }],
            decays: vec![Decay { index: 4, rate: -1.5, start: 1.3 }],
            ..Segment::default()
        };
        let (start, rates) = ([1.0, -2.0], [-3.0, -40.0]);
        let drives = [[0.3, -1.0, 2.0, 0.5, -0.7], [30.0, 9.0, 0.2, -40.0, 7.0]];
        let weights = [[0.5, 0.1, -0.3, 0.2, 1.0], [-0.2, 0.6, 0.9, -1.1, 0.4]];
        let mut modal = ModalEnergies::default();
        for h in [1e-4, 0.03, 2.0] {
            modal.set(&segment, h);
            let sums = |lists: [[f64; 5]; 2]| {
                lists.map(|list| {
                    let mut out = vec![complex(0.0, 0.0); modal.bases.len()];
                    modal.real_forces(&list, &mut out);
                    out
                })
            };
            let (forces, factors) = (sums(drives), sums(weights));
            let mut expected = (Vec::new(), 0.0);
            for k in 0..2 {
                let mut steady = vec![complex(0.0, 0.0); modal.bases.len()];
                let (rate, begin) = (complex(rates[k], 0.0), complex(start[k], 0.0));
                let lists = [&forces[k][..], &factors[k]];
                let [end, rest] = modal.follow(rate, begin, lists, &mut steady);
                expected.0.push(end.re);
                expected.1 += rest.re + modal.between(&factors[k], &steady).re;
            }
            // mixed by a turn
            let (sin, cos) = 0.3f64.sin_cos();
            let turn = Matrix { rows: 2, cols: 2, data: vec![cos, -sin, sin, cos] };
            let alone = Matrix { rows: 2, cols: 2, data: vec![rates[0], 0.0, 0.0, rates[1]] };
            let both = turn.times(&alone).times(&turn.transpose());
            let mixed = |lists: &[Vec<Complex>; 2]| -> Vec<Vec<Complex>> {
                let row = |r: usize| {
                    let pairs = lists[0].iter().zip(&lists[1]);
                    pairs.map(|(a, b)| a.scale(turn[(r, 0)]) + b.scale(turn[(r, 1)])).collect()
                };
                (0..2).map(row).collect()
            };
            let turned = |x: &[f64]| {
                let mut out = vec![0.0; 2];
                turn.apply(x, &mut out);
                out
            };
            let lists = (mixed(&forces), mixed(&factors));
            let (end, given) = followed(&modal, &both, &turned(&start), &lists.0, &lists.1);
            let known = turned(&expected.0);
            assert!(
                end.iter().zip(&known).all(|(a, b)| (a - b).abs() < 1e-13),
                "{end:?} {known:?}"
            );
            assert!((given - expected.1).abs() < 1e-13 * (1.0 + h), "{given} {}", expected.1);
        }
    }
}
