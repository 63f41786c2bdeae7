//! Eigenvalues and eigenvectors of symmetric matrices.
//!
//! Small ones by Jacobi rotations, which are simple and of the highest accuracy; larger ones by
//! reduction to tridiagonal form and implicit QL steps (Golub & Van Loan 2013, chapter 8).

use super::eigen::rounding_of_rounding;
use super::matrix::Matrix;

/// Up to this size by Jacobi rotations.
const JACOBI: usize = 12;
/// Sweeps or steps before giving up; a handful is usual.
const MAX_STEPS: usize = 60;

/// Eigenvalues and the orthogonal matrix whose columns are the eigenvectors; `None` if the
/// iteration does not end (entries that are not finite).
pub fn eigen_symmetric(a: &Matrix) -> Option<(Vec<f64>, Matrix)> {
    if !a.finite() {
        return None;
    }
    if a.rows <= JACOBI {
        jacobi(a.clone())
    } else {
        let mut v = a.clone();
        let (mut d, mut e) = tridiagonal(&mut v);
        ql(&mut d, &mut e, &mut v)?;
        Some((d, v.transpose()))
    }
}

/// Cyclic Jacobi rotations.
fn jacobi(mut a: Matrix) -> Option<(Vec<f64>, Matrix)> {
    let n = a.rows;
    let mut v = Matrix::identity(n);
    for _ in 0..MAX_STEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let off = a[(p, q)];
                // small against both diagonal entries: keeps the relative accuracy of graded ones
                let least = (a[(p, p)].abs() * a[(q, q)].abs()).sqrt();
                if off.abs() <= 1e-17 * least || off.abs() < f64::MIN_POSITIVE {
                    a[(p, q)] = 0.0;
                    a[(q, p)] = 0.0;
                    continue;
                }
                rotated = true;
                let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * off);
                let t = if theta.abs() > 1e150 {
                    0.5 / theta
                } else {
                    theta.signum() / (theta.abs() + theta.hypot(1.0))
                };
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                let (app, aqq) = (a[(p, p)] - t * off, a[(q, q)] + t * off);
                for k in 0..n {
                    let (x, y) = (a[(k, p)], a[(k, q)]);
                    a[(k, p)] = c * x - s * y;
                    a[(k, q)] = s * x + c * y;
                }
                for k in 0..n {
                    let (x, y) = (a[(p, k)], a[(q, k)]);
                    a[(p, k)] = c * x - s * y;
                    a[(q, k)] = s * x + c * y;
                }
                a[(p, p)] = app;
                a[(q, q)] = aqq;
                a[(p, q)] = 0.0;
                a[(q, p)] = 0.0;
                for k in 0..n {
                    let (x, y) = (v[(k, p)], v[(k, q)]);
                    v[(k, p)] = c * x - s * y;
                    v[(k, q)] = s * x + c * y;
                }
            }
        }
        if !rotated {
            return Some(((0..n).map(|i| a[(i, i)]).collect(), v));
        }
    }
    None
}

#[allow(clippy::needless_range_loop)] // indices as in the formulas
/// Householder reduction; on exit the rows of `v` are the accumulated transformation.
fn tridiagonal(v: &mut Matrix) -> (Vec<f64>, Vec<f64>) {
    let n = v.rows;
    let a = v;
    let mut q = Matrix::identity(n);
    let (mut w, mut p) = (vec![0.0; n], vec![0.0; n]);
    let mut e = vec![0.0; n];
    let least = rounding_of_rounding(a);
    for k in 0..n.saturating_sub(2) {
        // the reflector that takes column k below the subdiagonal to zero
        let norm = (k + 1..n).fold(0.0f64, |m, i| m.hypot(a[(i, k)]));
        if norm <= least {
            (k + 1..n).for_each(|i| a[(i, k)] = 0.0);
            continue;
        }
        let alpha = if a[(k + 1, k)] > 0.0 { -norm } else { norm };
        w[..=k].fill(0.0);
        for i in k + 1..n {
            w[i] = a[(i, k)];
        }
        w[k + 1] -= alpha;
        let length = w[k + 1..].iter().map(|x| x * x).sum::<f64>();
        if length == 0.0 {
            continue;
        }
        let f = 2.0 / length;
        for i in k..n {
            p[i] = f * super::matrix::dot(&a.row(i)[k + 1..], &w[k + 1..]);
        }
        let half = 0.5 * f * super::matrix::dot(&p[k + 1..], &w[k + 1..]);
        for i in k + 1..n {
            p[i] -= half * w[i];
        }
        for i in k + 1..n {
            let (wi, pi) = (w[i], p[i]);
            let row = &mut a.row_mut(i)[k + 1..];
            for ((x, &pj), &wj) in row.iter_mut().zip(&p[k + 1..]).zip(&w[k + 1..]) {
                *x -= wi * pj + pi * wj;
            }
        }
        for i in k + 1..n {
            let value = if i == k + 1 { alpha } else { 0.0 };
            a[(i, k)] = value;
            a[(k, i)] = value;
        }
        // q := H q (its rows are accumulated)
        let mut t = vec![0.0; n];
        for i in k + 1..n {
            super::matrix::add_scaled(&mut t, w[i], q.row(i));
        }
        for i in k + 1..n {
            super::matrix::add_scaled(q.row_mut(i), -f * w[i], &t);
        }
    }
    let d = (0..n).map(|i| a[(i, i)]).collect();
    for i in 1..n {
        e[i - 1] = a[(i, i - 1)];
    }
    *a = q;
    (d, e)
}

/// Implicit QL steps; `v` holds the eigenvectors in its rows, so that rotations run along rows.
fn ql(d: &mut [f64], e: &mut [f64], v: &mut Matrix) -> Option<()> {
    let n = d.len();
    let cols = v.cols;
    // the reduction has left rounding of the largest entry everywhere: less than that is zero
    let size = d.iter().chain(e.iter()).fold(0.0f64, |m, x| m.max(x.abs()));
    let floor = 0.25 * f64::EPSILON * size;
    for l in 0..n {
        let mut steps = 0;
        loop {
            let m = (l..n - 1)
                .find(|&m| e[m].abs() <= (f64::EPSILON * (d[m].abs() + d[m + 1].abs())).max(floor))
                .unwrap_or(n - 1);
            if m == l {
                break;
            }
            steps += 1;
            if steps > MAX_STEPS {
                return None;
            }
            let mut g = (d[l + 1] - d[l]) / (2.0 * e[l]);
            let mut r = g.hypot(1.0);
            g = d[m] - d[l] + e[l] / (g + r.copysign(g));
            let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
            let mut early = false;
            for i in (l..m).rev() {
                let mut f = s * e[i];
                let b = c * e[i];
                r = f.hypot(g);
                e[i + 1] = r;
                if r == 0.0 {
                    d[i + 1] -= p;
                    e[m] = 0.0;
                    early = true;
                    break;
                }
                s = f / r;
                c = g / r;
                g = d[i + 1] - p;
                r = (d[i] - g) * s + 2.0 * c * b;
                p = s * r;
                d[i + 1] = g + p;
                g = c * r - b;
                let (head, tail) = v.data.split_at_mut((i + 1) * cols);
                let (x, y) = (&mut head[i * cols..], &mut tail[..cols]);
                for (x, y) in x.iter_mut().zip(y) {
                    f = *y;
                    *y = s * *x + c * f;
                    *x = c * *x - s * f;
                }
            }
            if early {
                continue;
            }
            d[l] -= p;
            e[l] = g;
            e[m] = 0.0;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(n: usize) {
        let mut seed = 1u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let mut a = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let v = next();
                a[(i, j)] = v;
                a[(j, i)] = v;
            }
        }
        let (d, v) = eigen_symmetric(&a).unwrap();
        let av = a.times(&v);
        let vtv = v.transpose_times(&v);
        for i in 0..n {
            for j in 0..n {
                assert!((av[(i, j)] - v[(i, j)] * d[j]).abs() < 1e-13, "n={n}");
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((vtv[(i, j)] - unit).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn eigenvectors_of_random_matrices() {
        for n in [1, 2, 3, 7, 12, 13, 30, 70] {
            check(n);
        }
    }

    /// Many eigenvalues that are nothing but rounding relative to the largest.
    #[test]
    fn matrices_of_low_rank_come_to_an_end() {
        let n = 96;
        let w: Vec<f64> = (0..n).map(|i| f64::from((i * 37 % 11) as u32) - 5.0).collect();
        let a = Matrix::from_fn(n, n, |i, j| {
            let tiny = if i == j { 1e-3 } else { 1e-4 / (1.0 + (i + j) as f64) };
            -1e7 * w[i] * w[j] * (1.0 + ((i * j) % 3) as f64) - tiny
        });
        let (d, v) = eigen_symmetric(&a).unwrap();
        let av = a.times(&v);
        let size = a.max_abs() * n as f64;
        for i in 0..n {
            for j in 0..n {
                assert!((av[(i, j)] - v[(i, j)] * d[j]).abs() < 1e-14 * size);
            }
        }
    }

    /// Nothing but rounding of rounding behind the second reflection.
    #[test]
    fn states_that_do_not_move_have_no_rates() {
        for n in [13, 26, 48, 120] {
            // every other capacitor of a charge pump is in parallel with it
            let x = |i: usize| f64::from(u8::from(i.is_multiple_of(2)));
            let a = Matrix::from_fn(n, n, |r, c| {
                -1e5 * (x(r) * x(c) / 3.0 + 2.0 / 3.0 * (1.0 - x(r)) * (1.0 - x(c)))
            });
            let (mut d, v) = eigen_symmetric(&a).unwrap();
            let (size, av) = (a.max_abs() * n as f64, a.times(&v));
            for i in 0..n {
                for j in 0..n {
                    assert!((av[(i, j)] - v[(i, j)] * d[j]).abs() < 1e-14 * size, "n={n}");
                }
            }
            d.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            assert!(d[n - 3].abs() < 1e-14 * size, "n={n} {:e}", d[n - 3]);
            assert!(d[n - 2].abs() > 0.1 * size, "n={n} {:e}", d[n - 2]);
        }
    }

    #[test]
    fn graded_matrices_keep_their_small_eigenvalues() {
        let a = Matrix::from_fn(2, 2, |r, c| [[1e12, 1.0], [1.0, 3e-3]][r][c]);
        let (mut d, _) = eigen_symmetric(&a).unwrap();
        d.sort_by(f64::total_cmp);
        assert!((d[0] - 3e-3).abs() < 1e-11);
    }
}
