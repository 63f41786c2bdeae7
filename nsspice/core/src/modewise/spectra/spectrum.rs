//! The eigenvalues and eigenvectors of a mode, as real arrays.

use crate::dense::{complex, eigen, eigen_symmetric, Complex, Eigen, Lu, Matrix};
use crate::modewise::spectra::block::row_norm;
use crate::modewise::spectra::cluster::clustered;
use crate::modewise::spectra::scales::Scales;
use crate::modewise::spectra::sharpen::sharpened;
use crate::rounding::OF_SOLUTION;
use crate::tolerances::ACCEPT;
use crate::union_find::UnionFind;

/// Condition of the eigenvectors, or ratio of rates, above which the closed form loses too many digits: at two decades
/// more critically damped pairs lose theirs.
pub(in crate::modewise) const CONDITION: f64 = 1e6;

/// Number of states up to which the exponential of the whole matrix replaces missing eigenvectors.
const PLAIN: usize = 24;

/// Largest entry of `J V - V L` for vectors of unit size, `L` the eigenvalues, in units of that of J.
fn backward_error(j: &Matrix, found: &Eigen) -> f64 {
    let (v, image) = (&found.vectors, j.times(&found.vectors));
    let mut worst = 0.0f64;
    for (k, value) in found.values.iter().enumerate() {
        // of a pair, J a = re a - im b and J b = re b + im a
        let other = match value.im {
            im if im > 0.0 => k + 1,
            im if im < 0.0 => k - 1,
            _ => k,
        };
        let (mut rest, mut size) = (0.0f64, 0.0f64);
        for r in 0..j.rows {
            let turned = value.re * v[(r, k)] - value.im * v[(r, other)];
            rest = rest.max((image[(r, k)] - turned).abs());
            size = size.max(v[(r, k)].abs()).max(v[(r, other)].abs());
        }
        worst = worst.max(rest / size);
    }
    worst / j.max_abs()
}

/// Eigenvalues of J are exact to rounding of the largest one, those of its inverse to rounding of
/// the smallest: the fast half from the one, the slow half from the other. Returns the inverse and
/// the size that divides the halves, too; `None` if that gains nothing.
fn slow_half(j: &Matrix, fast: &Eigen) -> Option<(Eigen, Matrix, f64)> {
    let n = j.rows;
    let sizes = |values: &[Complex]| values.iter().map(|v| v.abs()).collect::<Vec<f64>>();
    let mut order = sizes(&fast.values);
    order.sort_by(f64::total_cmp);
    let (least, most) = (order[0], order[n - 1]);
    // beyond, as many digits of the slow ones are lost: they are taken from the inverse
    if most <= CONDITION * least {
        return None;
    }
    let factor = Lu::new(j);
    if factor.ratio == 0.0 {
        return None;
    }
    let inverse = factor.solve_refined(j, &Matrix::identity(n));
    let slow = eigen(&inverse)?;
    // the widest gap in the middle decides what is fast
    let middle = (least.max(1e-16 * most) * most).sqrt();
    let gap = order
        .windows(2)
        .filter(|w| w[1] > 1e-2 * middle && w[0] < 1e2 * middle)
        .max_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])))?;
    let split = (gap[0] * gap[1]).sqrt();
    let mut values = Vec::with_capacity(n);
    let mut columns = Vec::with_capacity(n);
    for (from, inverted) in [(fast, false), (&slow, true)] {
        let mut k = 0;
        while k < n {
            let pair = from.values[k].im != 0.0;
            let mut value = from.values[k];
            if inverted {
                // 1/mu has a negative imaginary part: its conjugate goes with the conjugate vector
                value = (complex(1.0, 0.0) / value).conj();
            }
            if (value.abs() < split) == inverted {
                values.push(value);
                columns.push(from.vectors.col(k));
                if pair {
                    values.push(value.conj());
                    let sign = if inverted { -1.0 } else { 1.0 };
                    columns.push(from.vectors.col(k + 1).iter().map(|v| sign * v).collect());
                }
            }
            k += if pair { 2 } else { 1 };
        }
    }
    if values.len() != n {
        return None;
    }
    let vectors = Matrix::from_fn(n, n, |r, c| columns[c][r]);
    let both = Eigen { values, vectors };
    // where J is singular but for rounding, its inverse may not have a single digit
    (backward_error(j, &both) <= ACCEPT).then_some((both, inverse, split))
}

/// Whether a matrix is symmetric but for the rounding of each entry and of the rates that it couples: what an
/// inductor and a capacitor lend to each other is skew, however small it is next to the fastest rate.
fn is_symmetric(j: &Matrix) -> bool {
    (0..j.rows).all(|r| {
        (0..r).all(|c| {
            let (one, other) = (j[(r, c)], j[(c, r)]);
            let rates = (j[(r, r)].abs() * j[(c, c)].abs()).sqrt();
            // what elimination has left of them may differ by its rounding
            (one - other).abs() <= OF_SOLUTION * one.abs().max(other.abs()).max(rates)
        })
    })
}

/// Groups of coordinates that do not act on those of other groups.
fn independent(j: &Matrix) -> Vec<Vec<usize>> {
    let n = j.rows;
    let mut together = UnionFind::new(n);
    for r in 0..n {
        for (c, v) in j.row(r).iter().enumerate() {
            if *v != 0.0 {
                together.join(r, c);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut place = vec![None; n];
    for k in 0..n {
        let root = together.root(k);
        let group = *place[root].get_or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(k);
    }
    groups
}

/// One eigenvalue, or a complex pair.
#[derive(Clone, Copy, Debug)]
pub struct Pole {
    /// place of its first modal coordinate
    pub at: usize,
    /// real part [1/s]
    pub alpha: f64,
    /// imaginary part, positive for a pair (which takes two coordinates), else 0 [1/s]
    pub omega: f64,
}

impl Pole {
    /// Absolute value.
    pub fn size(&self) -> f64 {
        self.alpha.hypot(self.omega)
    }

    /// Number of its modal coordinates.
    pub fn width(&self) -> usize {
        1 + usize::from(self.omega != 0.0)
    }
}

/// Modal coordinates `x = from_modal xi`; a pair has the real and the imaginary part of one complex
/// coordinate.
pub struct Spectrum {
    /// eigenvalues
    pub poles: Vec<Pole>,
    /// what has no eigenvectors: `xi' = B xi` from some coordinate on
    pub blocks: Vec<(usize, Matrix)>,
    /// x from xi
    pub from_modal: Matrix,
    /// xi from x
    pub to_modal: Matrix,
}

impl Spectrum {
    /// Decomposes `x' = J x`; `None` if J is (nearly) defective and too large for its exponential.
    /// `symmetric`: J is, but for rounding.
    pub fn new(j: &Matrix, symmetric: bool) -> Option<Spectrum> {
        let groups = independent(j);
        if groups.len() < 2 {
            return Spectrum::of_one(j, symmetric);
        }
        let part = |list: &Vec<usize>| j.select_rows(list).select_cols(list);
        let of_group = |list| Spectrum::of_one(&part(list), symmetric);
        let parts: Vec<Spectrum> = groups.iter().map(of_group).collect::<Option<_>>()?;
        let (poles, blocks, order) = Spectrum::beside(&parts);
        let (mut from_modal, mut to_modal) = [0; 2].map(|_| Matrix::zeros(j.rows, j.rows)).into();
        let mut first = 0;
        for (list, part) in groups.iter().zip(&parts) {
            for (i, &row) in list.iter().enumerate() {
                from_modal.row_mut(row)[first..first + list.len()]
                    .copy_from_slice(part.from_modal.row(i));
                for k in 0..list.len() {
                    to_modal[(first + k, row)] = part.to_modal[(k, i)];
                }
            }
            first += list.len();
        }
        let (from_modal, to_modal) = (from_modal.select_cols(&order), to_modal.select_rows(&order));
        Some(Spectrum { poles, blocks, from_modal, to_modal })
    }

    /// The same for coordinates that act on one another.
    fn of_one(j: &Matrix, symmetric: bool) -> Option<Spectrum> {
        let n = j.rows;
        if symmetric || is_symmetric(j) {
            let symmetric = Matrix::from_fn(n, n, |r, c| 0.5 * (j[(r, c)] + j[(c, r)]));
            let (values, vectors) = eigen_symmetric(&symmetric)?;
            let poles = values.iter().enumerate();
            let poles = poles.map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 }).collect();
            let to_modal = vectors.transpose();
            let from_modal = vectors;
            return Some(Spectrum { poles, blocks: Vec::new(), to_modal, from_modal });
        }
        if let Some(scales) = Scales::new(j) {
            let [slow, fast] = [0, 1].map(|k| Spectrum::new(&scales.parts[k], false));
            if let (Some(slow), Some(fast)) = (slow, fast) {
                return Some(Spectrum::of_scales(&scales, slow, fast));
            }
        }
        let whole = || {
            let unit = Matrix::identity(n);
            (n <= PLAIN).then(|| Spectrum {
                poles: Vec::new(),
                blocks: vec![(0, j.clone())],
                from_modal: unit.clone(),
                to_modal: unit,
            })
        };
        let Some(found) = eigen(j) else {
            return whole();
        };
        let (plain, condition) = Spectrum::from_eigen(&found, Vec::new());
        if condition < CONDITION {
            if let Some(sharp) = plain.and_then(|plain| sharpened(j, plain)) {
                return Some(sharp);
            }
        }
        if backward_error(j, &found) > ACCEPT {
            return whole();
        }
        let (found, slow) = match slow_half(j, &found) {
            Some((both, inverse, split)) => (both, Some((inverse, split))),
            None => (found, None),
        };
        let (plain, condition) = Spectrum::from_eigen(&found, Vec::new());
        if condition < CONDITION {
            return plain;
        }
        let parts = slow.as_ref().map(|(inverse, split)| (inverse, *split));
        let (found, blocks) = clustered(j, parts, found);
        match Spectrum::from_eigen(&found, blocks) {
            (grouped, better) if better < CONDITION => grouped,
            _ if n > PLAIN => plain,
            _ => whole(),
        }
    }

    /// From those of two motions.
    fn of_scales(scales: &Scales, slow: Spectrum, fast: Spectrum) -> Spectrum {
        let from_modal = scales.from(&slow.from_modal, &fast.from_modal);
        let to_modal = scales.to(&slow.to_modal, &fast.to_modal);
        let (poles, blocks, order) = Spectrum::beside(&[slow, fast]);
        let (from_modal, to_modal) = (from_modal.select_cols(&order), to_modal.select_rows(&order));
        Spectrum { poles, blocks, from_modal, to_modal }
    }

    /// Poles and blocks of several motions, and which of their coordinates becomes which: blocks come
    /// after all poles.
    fn beside(parts: &[Spectrum]) -> (Vec<Pole>, Vec<(usize, Matrix)>, Vec<usize>) {
        let (mut poles, mut blocks) = (Vec::new(), Vec::new());
        let (mut order, mut rest, mut first) = (Vec::new(), Vec::new(), 0);
        for part in parts {
            let n = part.from_modal.cols;
            let moving = part.blocks.first().map_or(n, |b| b.0);
            let at = order.len();
            poles.extend(part.poles.iter().map(|p| Pole { at: at + p.at, ..*p }));
            order.extend(first..first + moving);
            blocks.extend(part.blocks.iter().map(|(k, b)| (rest.len() + k - moving, b.clone())));
            rest.extend(first + moving..first + n);
            first += n;
        }
        blocks.iter_mut().for_each(|(k, _)| *k += order.len());
        order.extend(rest);
        (poles, blocks, order)
    }

    /// From eigenvectors, and invariant subspaces with their matrices; with the condition of all.
    pub(in crate::modewise) fn from_eigen(
        found: &Eigen,
        blocks: Vec<(Matrix, Matrix)>,
    ) -> (Option<Spectrum>, f64) {
        let mut from_modal = found.vectors.clone();
        let mut poles = Vec::with_capacity(found.values.len());
        let mut at = 0;
        while at < found.values.len() {
            let value = found.values[at];
            poles.push(Pole { at, alpha: value.re, omega: value.im });
            if value.im != 0.0 {
                // x = Re[(vr + i vi) xi] = vr Re xi - vi Im xi
                for r in 0..from_modal.rows {
                    from_modal[(r, at + 1)] = -from_modal[(r, at + 1)];
                }
                at += 1;
            }
            at += 1;
        }
        let mut placed = Vec::with_capacity(blocks.len());
        for (basis, matrix) in blocks {
            placed.push((from_modal.cols, matrix));
            from_modal = from_modal.beside(&basis);
        }
        let factor = Lu::new(&from_modal);
        if factor.ratio == 0.0 {
            return (None, f64::INFINITY);
        }
        let to_modal = factor.solve_refined(&from_modal, &Matrix::identity(from_modal.rows));
        let condition = row_norm(&from_modal) * row_norm(&to_modal);
        (Some(Spectrum { poles, blocks: placed, from_modal, to_modal }), condition)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_that_do_not_meet_share_no_vector() {
        // an oscillator and two stores of 1e12 times its rates, interlaced
        let j = Matrix::from_fn(4, 4, |r, c| match (r, c) {
            (0, 2) => 1.0,
            (2, 0) => -1.0,
            (1, 1) | (3, 3) => -1e12,
            (1, 3) => 4e11,
            (3, 1) => -3e11,
            _ => 0.0,
        });
        assert_eq!(independent(&j), [vec![0, 2], vec![1, 3]]);
        let spectrum = Spectrum::new(&j, false).unwrap();
        for pole in &spectrum.poles {
            let slow = pole.size() < 2.0;
            for r in 0..4 {
                let inside = (r % 2 == 0) == slow;
                let v = spectrum.from_modal[(r, pole.at)];
                assert!(inside || v == 0.0);
            }
            assert!(!slow || (pole.alpha == 0.0 && (pole.omega - 1.0).abs() < 1e-15));
        }
        let one = spectrum.to_modal.times(&spectrum.from_modal);
        assert!((0..4).all(|k| (one[(k, k)] - 1.0).abs() < 1e-14));
    }

    #[test]
    fn a_skew_pair_beside_a_faster_rate_keeps_its_coupling() {
        // an inductor behind a capacitor, of which rounding makes one group with the fastest rate
        let rows = [[0.0, 117.0, 0.0], [-117.0, -7e7, 5e-20], [0.0, 0.0, -2e17]];
        let j = Matrix::from_fn(3, 3, |r, c| rows[r][c]);
        let spectrum = Spectrum::new(&j, false).unwrap();
        let slow = spectrum.poles.iter().map(|p| p.alpha.abs()).fold(f64::INFINITY, f64::min);
        assert!((slow / (117.0 * 117.0 / 7e7) - 1.0).abs() < 1e-9, "{slow}");
    }

    #[test]
    fn a_matrix_is_symmetric_by_its_entries() {
        let of = |one: f64, other: f64| {
            let rows = [[-1.0, one, 0.0], [other, -4.0, 0.0], [0.0, 0.0, -1e20]];
            is_symmetric(&Matrix::from_fn(3, 3, |r, c| rows[r][c]))
        };
        assert!(of(1.0, 1.0) && of(1.0, 1.0 + 4e-15) && of(1e-15, 0.0));
        assert!(!of(1.0, -1.0) && !of(1e-3, 0.0));
    }
}
