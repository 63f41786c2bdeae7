//! Eigenvalues so close that their eigenvectors are (nearly) parallel: the space that they span
//! together is well determined, and so is the small matrix in it.

use crate::dense::{balance, complex, norm, Complex, Eigen, Lu, Matrix};
use crate::modewise::spectra::orthogonal::full_qr;
use crate::rounding::OF_SOLUTION;

/// Relative distance of eigenvalues that are taken together; no test distinguishes a decade more or less.
const CLOSE: f64 = 1e-2;
/// How far from the cluster the inverse iteration is shifted, in units of the same, and its steps.
const SHIFT: (f64, usize) = (0.1, 8);
/// Newton steps; three are usual.
const STEPS: usize = 12;

/// Eigenvalues `i` and `k` belong together: close, or conjugate to one that is, or both zero.
fn together(values: &[Complex], zero: f64, i: usize, k: usize) -> bool {
    let (a, b) = (values[i], values[k]);
    let size = a.abs().max(b.abs());
    size <= zero || (a - b).abs() <= CLOSE * size || (a - b.conj()).abs() <= CLOSE * size
}

/// Eigenvalues of a matrix below this size are the rounding of it.
fn rounding(x: &Matrix) -> f64 {
    x.rows as f64 * f64::EPSILON * x.max_abs()
}

/// Groups of places, each in growing order; conjugate ones are in the same group.
fn groups(values: &[Complex], zero: f64) -> Vec<Vec<usize>> {
    let mut label: Vec<usize> = (0..values.len()).collect();
    for k in 0..values.len() {
        for i in 0..k {
            if label[i] != label[k] && together(values, zero, i, k) {
                let (old, new) = (label[k], label[i]);
                label.iter_mut().filter(|l| **l == old).for_each(|l| *l = new);
            }
        }
    }
    let mut out: Vec<Vec<usize>> = Vec::new();
    for first in 0..values.len() {
        let members: Vec<usize> = (0..values.len()).filter(|&k| label[k] == first).collect();
        if !members.is_empty() {
            out.push(members);
        }
    }
    out
}

/// Orthonormal columns that span those of a matrix, those that complete them, and whether the
/// matrix has columns that depend on each other.
fn split(columns: &Matrix) -> (Matrix, Matrix, bool) {
    let (q, r) = full_qr(columns);
    let diagonal = |k: usize| r[(k, k)].abs();
    let most = (0..r.cols).map(diagonal).fold(0.0, f64::max);
    let poor = (0..r.cols).any(|k| diagonal(k) <= OF_SOLUTION * most);
    (q.columns(0, r.cols), q.columns(r.cols, q.cols - r.cols), poor)
}

/// Inverse iteration towards the eigenvalues around `center` and its conjugate.
fn iterated(x: &Matrix, center: Complex, start: Matrix) -> Option<Matrix> {
    let n = x.rows;
    let near = if center.abs() == 0.0 {
        // not the square, in which slow rates drown
        let zero = rounding(x);
        Matrix::from_fn(n, n, |r, c| x[(r, c)] - if r == c { zero } else { 0.0 })
    } else {
        let shift = center.scale(1.0 + SHIFT.0);
        let square = x.times(x);
        Matrix::from_fn(n, n, |r, c| {
            let unit = if r == c { shift.re * shift.re + shift.im * shift.im } else { 0.0 };
            square[(r, c)] - 2.0 * shift.re * x[(r, c)] + unit
        })
    };
    let factor = Lu::new(&near);
    let step = |basis: Matrix, _| split(&factor.solve(&basis)).0;
    (factor.ratio > 0.0).then(|| (0..SHIFT.1).fold(start, step))
}

/// The invariant subspace of `x` that belongs to eigenvalues around `center` and its conjugate, from
/// vectors near it, with the matrix in it. Newton's method for the part `y` of the complement that is
/// missing: `x22 y - y x11 = -x21`.
fn refined(x: &Matrix, center: Complex, start: &Matrix) -> Option<(Matrix, Matrix)> {
    let (n, w) = (x.rows, start.cols);
    let (mut basis, _, poor) = split(start);
    if poor {
        basis = iterated(x, center, basis)?;
    }
    let size = x.max_abs();
    let mut best: Option<(f64, Matrix, Matrix)> = None;
    for _ in 0..STEPS {
        let (now, others, _) = split(&basis);
        let image = x.times(&now);
        let x11 = now.transpose_times(&image);
        let x21 = others.transpose_times(&image);
        let rest = x21.max_abs();
        if best.as_ref().is_some_and(|b| rest >= 0.5 * b.0) {
            break;
        }
        let v = n - w;
        let x22 = others.transpose_times(&x.times(&others));
        // unknowns column by column
        let joint = Matrix::from_fn(v * w, v * w, |r, c| {
            let (i, k, j, l) = (r % v, r / v, c % v, c / v);
            let mut out = if k == l { x22[(i, j)] } else { 0.0 };
            if i == j {
                out -= x11[(l, k)];
            }
            out
        });
        let factor = Lu::new(&joint);
        best = Some((rest, now.clone(), x11));
        if factor.ratio == 0.0 || rest == 0.0 {
            break;
        }
        let right = Matrix::from_fn(v * w, 1, |r, _| -x21[(r % v, r / v)]);
        let found = factor.solve(&right);
        let y = Matrix::from_fn(v, w, |r, c| found[(c * v + r, 0)]);
        basis = others.times(&y);
        basis.add_scaled(1.0, &now);
    }
    let (rest, basis, matrix) = best?;
    let mean = (0..w).map(|k| matrix[(k, k)]).sum::<f64>() / w as f64;
    let same = (mean - center.re).abs() <= CLOSE * center.abs() + rounding(x);
    (same && rest <= OF_SOLUTION * n as f64 * size).then_some((basis, matrix))
}

/// The same in coordinates of similar size, for the digits of small parts of the vectors.
fn subspace(x: &Matrix, center: Complex, start: &Matrix) -> Option<(Matrix, Matrix)> {
    let mut even = x.clone();
    let scale = balance(&mut even);
    let start = Matrix::from_fn(start.rows, start.cols, |r, c| start[(r, c)] / scale[r]);
    let (basis, matrix) = refined(&even, center, &start)?;
    let basis = Matrix::from_fn(basis.rows, basis.cols, |r, c| basis[(r, c)] * scale[r]);
    let length: Vec<f64> = (0..basis.cols).map(|c| norm(&basis.col(c))).collect();
    let basis = Matrix::from_fn(basis.rows, basis.cols, |r, c| basis[(r, c)] / length[c]);
    let w = matrix.rows;
    Some((basis, Matrix::from_fn(w, w, |r, c| matrix[(r, c)] * length[r] / length[c])))
}

/// Takes clusters of eigenvalues out of a decomposition of `j`: what is left of it, and for each
/// cluster an invariant subspace with its matrix. `slow`: the inverse of `j`, and the size below which
/// eigenvalues are those of it.  What does not move at all stays, with orthonormal vectors.
pub(in crate::modewise) fn clustered(
    j: &Matrix,
    slow: Option<(&Matrix, f64)>,
    mut found: Eigen,
) -> (Eigen, Vec<(Matrix, Matrix)>) {
    let one = complex(1.0, 0.0);
    let mut blocks = Vec::new();
    let mut kept: Vec<usize> = Vec::new();
    let zero = rounding(j);
    for group in groups(&found.values, zero) {
        let single = match group[..] {
            [_] => true,
            [k, _] => found.values[k].im.abs() > CLOSE * found.values[k].abs(),
            _ => false,
        };
        let still = group.len() > 1 && group.iter().all(|&k| found.values[k].abs() <= zero);
        if single && !still {
            kept.extend(group);
            continue;
        }
        // the mean; of complex ones that of the upper half plane
        let mut center = complex(0.0, 0.0);
        for &k in group.iter().filter(|_| !still) {
            let value = found.values[k];
            center = center + complex(value.re, value.im.abs()).scale(1.0 / group.len() as f64);
        }
        let start = found.vectors.select_cols(&group);
        let block = match slow {
            _ if still => refined(j, center, &start),
            Some((inverse, split)) if center.abs() < split => {
                subspace(inverse, (one / center).conj(), &start).and_then(|(basis, matrix)| {
                    let factor = Lu::new(&matrix);
                    let unit = Matrix::identity(matrix.rows);
                    (factor.ratio > 0.0).then(|| (basis, factor.solve_refined(&matrix, &unit)))
                })
            }
            _ => subspace(j, center, &start),
        };
        match block {
            Some((basis, matrix)) if still && matrix.max_abs() <= zero => {
                for (i, &k) in group.iter().enumerate() {
                    found.values[k] = complex(0.0, 0.0);
                    (0..j.rows).for_each(|r| found.vectors[(r, k)] = basis[(r, i)]);
                }
                kept.extend(group);
            }
            Some(block) => blocks.push(block),
            None => kept.extend(group),
        }
    }
    kept.sort_unstable();
    let values = kept.iter().map(|&k| found.values[k]).collect();
    (Eigen { values, vectors: found.vectors.select_cols(&kept) }, blocks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::eigen;

    /// A double rate, a triple one and a double pair, each among others, in random coordinates.
    #[test]
    fn blocks_reproduce_the_matrix() {
        let mut seed = 5u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let jordan = |lambda: &[f64], ones: &[usize]| {
            Matrix::from_fn(lambda.len(), lambda.len(), |r, c| match (r == c, c == r + 1) {
                (true, _) => lambda[r],
                (_, true) if ones.contains(&r) => 1.0,
                _ => 0.0,
            })
        };
        let mut pair = Matrix::zeros(5, 5);
        for k in [0, 2] {
            (pair[(k, k)], pair[(k + 1, k + 1)]) = (-1.0, -1.0);
            (pair[(k, k + 1)], pair[(k + 1, k)]) = (3.0, -3.0);
        }
        (pair[(0, 2)], pair[(1, 3)], pair[(4, 4)]) = (1.0, 1.0, -7.0);
        let cases = [
            (jordan(&[-1.0, -1.0, -3.0, -0.2], &[0]), 1),
            (jordan(&[-2.0, -2.0, -2.0, -0.1, -0.1, -9.0], &[0, 1, 3]), 2),
            (pair, 1),
        ];
        for (form, count) in cases {
            let n = form.rows;
            let turn = Matrix::from_fn(n, n, |_, _| 0.0);
            let turn = Matrix { data: turn.data.iter().map(|_| next()).collect(), ..turn };
            let inverse = Lu::new(&turn).solve_refined(&turn, &Matrix::identity(n));
            let a = turn.times(&form).times(&inverse);
            let (rest, blocks) = clustered(&a, None, eigen(&a).unwrap());
            assert_eq!(blocks.len(), count, "{:?}", eigen(&a).unwrap().values);
            assert_eq!(rest.values.len() + blocks.iter().map(|b| b.1.rows).sum::<usize>(), n);
            for (basis, matrix) in blocks {
                let mut left = a.times(&basis);
                left.add_scaled(-1.0, &basis.times(&matrix));
                assert!(left.max_abs() < 1e-12 * a.max_abs(), "{}", left.max_abs());
            }
        }
    }

    /// What does not move (five rates that are zero but for rounding, next to fast and slow ones) has
    /// orthonormal vectors.
    #[test]
    fn zeros_keep_their_space() {
        let mut seed = 9u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let rates = [-1e8, -3e5, 0.0, -4e3, 0.0, 0.0, -7.0, 0.0, 0.0];
        let n = rates.len();
        let mut turn = Matrix::zeros(n, n);
        turn.data.iter_mut().for_each(|v| *v = next());
        let (turn, _) = full_qr(&turn);
        let form = Matrix::from_fn(n, n, |r, c| if r == c { rates[r] } else { 0.0 });
        let mut a = turn.times(&form).times(&turn.transpose());
        a.data.iter_mut().for_each(|v| *v += 1e-9 * next());
        let (rest, blocks) = clustered(&a, None, eigen(&a).unwrap());
        assert!(blocks.is_empty());
        let still: Vec<usize> = (0..n).filter(|&k| rest.values[k].abs() == 0.0).collect();
        assert_eq!(still.len(), 5);
        let basis = rest.vectors.select_cols(&still);
        assert!(a.times(&basis).max_abs() < 1e-14 * n as f64 * a.max_abs());
        let mut apart = basis.transpose_times(&basis);
        apart.add_scaled(-1.0, &Matrix::identity(5));
        assert!(apart.max_abs() < 1e-12);
    }
}
