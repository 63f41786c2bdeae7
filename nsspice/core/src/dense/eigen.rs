//! Eigenvalues and eigenvectors of general real matrices: Householder reduction to Hessenberg form,
//! double-shift QR steps to the real Schur form, back substitution (Golub & Van Loan 2013, 7.4-7.6).

use super::complex::{complex, Complex};
use super::matrix::Matrix;

/// QR steps for one eigenvalue before giving up; three are usual.
const MAX_STEPS: usize = 120;

/// Eigenvalues, and eigenvectors in the columns of a real matrix: a complex pair
/// `a + ib, a - ib` (b > 0, the first two of its places) has its real and imaginary part in
/// neighbouring columns.
pub struct Eigen {
    /// eigenvalues; conjugate pairs come together, positive imaginary part first
    pub values: Vec<Complex>,
    /// eigenvectors
    pub vectors: Matrix,
}

/// Decomposes a matrix; `None` if the iteration does not end.
pub fn eigen(a: &Matrix) -> Option<Eigen> {
    let n = a.rows;
    if !a.finite() {
        return None;
    }
    let mut h = a.clone();
    let scale = balance(&mut h);
    let mut q = hessenberg(&mut h);
    let values = schur(&mut h, &mut q)?;
    let vectors = back_substitute(&h, &values);
    let mut vectors = q.times(&vectors);
    for (r, s) in scale.iter().enumerate() {
        vectors.row_mut(r).iter_mut().for_each(|v| *v *= s);
    }
    let mut k = 0;
    while k < n {
        let width = if values[k].im == 0.0 { 1 } else { 2 };
        let size = (0..n)
            .flat_map(|r| (k..k + width).map(move |c| (r, c)))
            .fold(0.0f64, |m, at| m.hypot(vectors[at]));
        for r in 0..n {
            for c in k..k + width {
                vectors[(r, c)] /= size;
            }
        }
        k += width;
    }
    vectors.finite().then_some(Eigen { values, vectors })
}

/// Scales rows and columns by powers of 2 to similar norms: `D^-1 A D`; returns D.
///
/// Entries that are rounding relative to the largest one do not count: they may be as small as they please,
/// and where a row has no others, scaling it up to its column would be scaling by chance, of which the
/// vectors keep the rounding.
pub fn balance(a: &mut Matrix) -> Vec<f64> {
    let n = a.rows;
    let rounding = f64::EPSILON * a.max_abs();
    let mut scale = vec![1.0; n];
    for _ in 0..20 {
        let mut changed = false;
        for i in 0..n {
            let off = |f: &dyn Fn(usize) -> f64| {
                let others = (0..n).filter(|&j| j != i).map(|j| f(j).abs());
                others.filter(|v| *v > rounding).sum::<f64>()
            };
            let (row, col) = (off(&|j| a[(i, j)]), off(&|j| a[(j, i)]));
            if row == 0.0 || col == 0.0 {
                continue;
            }
            let f = (row / col).log2().mul_add(0.5, 0.0).round().exp2();
            if f != 1.0 && col * f + row / f < 0.95 * (col + row) {
                changed = true;
                scale[i] *= f;
                for j in 0..n {
                    a[(i, j)] /= f;
                }
                for j in 0..n {
                    a[(j, i)] *= f;
                }
            }
        }
        if !changed {
            break;
        }
    }
    scale
}

/// Columns below this are zero to a reduction by reflections: of a matrix of low rank each one leaves
/// rounding of what the last one has left, down to numbers whose squares are zero.
pub(super) fn rounding_of_rounding(a: &Matrix) -> f64 {
    f64::EPSILON * f64::EPSILON * a.max_abs()
}

/// Reduces to Hessenberg form in place and returns the orthogonal transformation.
fn hessenberg(a: &mut Matrix) -> Matrix {
    let n = a.rows;
    let mut q = Matrix::identity(n);
    let mut w = vec![0.0; n];
    let least = rounding_of_rounding(a);
    for k in 0..n.saturating_sub(2) {
        let norm = (k + 1..n).fold(0.0f64, |m, i| m.hypot(a[(i, k)]));
        if norm <= least {
            (k + 1..n).for_each(|i| a[(i, k)] = 0.0);
            continue;
        }
        if (k + 2..n).all(|i| a[(i, k)] == 0.0) {
            continue;
        }
        let alpha = if a[(k + 1, k)] > 0.0 { -norm } else { norm };
        w.fill(0.0);
        for i in k + 1..n {
            w[i] = a[(i, k)];
        }
        w[k + 1] -= alpha;
        let f = 2.0 / w.iter().map(|x| x * x).sum::<f64>();
        for c in 0..n {
            let s: f64 = (k + 1..n).map(|i| w[i] * a[(i, c)]).sum::<f64>() * f;
            for i in k + 1..n {
                a[(i, c)] -= s * w[i];
            }
        }
        for matrix in [&mut *a, &mut q] {
            for r in 0..n {
                let row = matrix.row_mut(r);
                let s: f64 = (k + 1..n).map(|i| w[i] * row[i]).sum::<f64>() * f;
                for i in k + 1..n {
                    row[i] -= s * w[i];
                }
            }
        }
        a[(k + 1, k)] = alpha;
        for i in k + 2..n {
            a[(i, k)] = 0.0;
        }
    }
    q
}

/// Rotates columns (or rows) `p`, `q` of a matrix.
fn rotate_columns(a: &mut Matrix, rows: usize, p: usize, q: usize, c: f64, s: f64) {
    for r in 0..rows {
        let (x, y) = (a[(r, p)], a[(r, q)]);
        a[(r, p)] = c * x + s * y;
        a[(r, q)] = c * y - s * x;
    }
}

/// QR steps down to the real Schur form: 2x2 blocks on the diagonal hold complex pairs only.
fn schur(h: &mut Matrix, v: &mut Matrix) -> Option<Vec<Complex>> {
    let size = h.rows;
    let mut values = vec![complex(0.0, 0.0); size];
    let norm: f64 = h.data.iter().map(|x| x.abs()).sum();
    let mut end = size; // rows end.. are done
    let mut steps = 0;
    while end > 0 {
        let n = end - 1;
        let mut l = n;
        while l > 0 {
            let s = h[(l - 1, l - 1)].abs() + h[(l, l)].abs();
            let s = if s == 0.0 { norm } else { s };
            if h[(l, l - 1)].abs() <= f64::EPSILON * s {
                h[(l, l - 1)] = 0.0;
                break;
            }
            l -= 1;
        }
        if l == n {
            values[n] = complex(h[(n, n)], 0.0);
            end -= 1;
            steps = 0;
        } else if l + 1 == n {
            let half = 0.5 * (h[(n - 1, n - 1)] - h[(n, n)]);
            let w = h[(n, n - 1)] * h[(n - 1, n)];
            let disc = half * half + w;
            if disc >= 0.0 {
                // two real eigenvalues: rotate the block to triangular form
                let z = half + disc.sqrt().copysign(half);
                let first = h[(n, n)] + z;
                let second = if z == 0.0 { first } else { h[(n, n)] - w / z };
                let (x, y) = (h[(n, n - 1)], z);
                let r = x.hypot(y);
                let (s, c) = (x / r, y / r);
                for j in n - 1..size {
                    let (a, b) = (h[(n - 1, j)], h[(n, j)]);
                    h[(n - 1, j)] = c * a + s * b;
                    h[(n, j)] = c * b - s * a;
                }
                rotate_columns(h, n + 1, n - 1, n, c, s);
                rotate_columns(v, size, n - 1, n, c, s);
                h[(n, n - 1)] = 0.0;
                h[(n - 1, n - 1)] = first;
                h[(n, n)] = second;
                values[n - 1] = complex(first, 0.0);
                values[n] = complex(second, 0.0);
            } else {
                let re = h[(n, n)] + half;
                let im = (-disc).sqrt();
                values[n - 1] = complex(re, im);
                values[n] = complex(re, -im);
            }
            end -= 2;
            steps = 0;
        } else {
            steps += 1;
            if steps > MAX_STEPS {
                return None;
            }
            double_step(h, v, l, n, steps);
        }
    }
    Some(values)
}

/// One double-shift QR step on rows and columns `l..=n`.
fn double_step(h: &mut Matrix, v: &mut Matrix, l: usize, n: usize, steps: usize) {
    let size = h.rows;
    let (mut x, mut y) = (h[(n, n)], h[(n - 1, n - 1)]);
    let mut w = h[(n, n - 1)] * h[(n - 1, n)];
    if steps.is_multiple_of(10) {
        // exceptional shift against cycling
        let s = h[(n, n - 1)].abs() + h[(n - 1, n - 2)].abs();
        x = h[(n, n)] + 0.75 * s;
        y = x;
        w = -0.4375 * s * s;
    }
    let (mut p, mut q, mut r);
    let mut m = n - 2;
    loop {
        let z = h[(m, m)];
        let (a, b) = (x - z, y - z);
        p = (a * b - w) / h[(m + 1, m)] + h[(m, m + 1)];
        q = h[(m + 1, m + 1)] - z - a - b;
        r = h[(m + 2, m + 1)];
        let s = p.abs() + q.abs() + r.abs();
        if s > 0.0 {
            (p, q, r) = (p / s, q / s, r / s);
        }
        if m == l {
            break;
        }
        let near = p.abs() * (h[(m - 1, m - 1)].abs() + z.abs() + h[(m + 1, m + 1)].abs());
        if h[(m, m - 1)].abs() * (q.abs() + r.abs()) <= f64::EPSILON * near {
            break;
        }
        m -= 1;
    }
    for i in m + 2..=n {
        h[(i, i - 2)] = 0.0;
        if i > m + 2 {
            h[(i, i - 3)] = 0.0;
        }
    }
    for k in m..n {
        let three = k + 1 < n;
        let mut length = 1.0;
        if k > m {
            p = h[(k, k - 1)];
            q = h[(k + 1, k - 1)];
            r = if three { h[(k + 2, k - 1)] } else { 0.0 };
            length = p.abs() + q.abs() + r.abs();
            if length == 0.0 {
                continue;
            }
            (p, q, r) = (p / length, q / length, r / length);
        }
        if !three {
            r = 0.0;
        }
        let s = (p * p + q * q + r * r).sqrt().copysign(p);
        if s == 0.0 {
            continue;
        }
        if k > m {
            h[(k, k - 1)] = -s * length;
        } else if l != m {
            h[(k, k - 1)] = -h[(k, k - 1)];
        }
        p += s;
        let (fx, fy, fz) = (p / s, q / s, r / s);
        (q, r) = (q / p, r / p);
        for j in k..size {
            let mut sum = h[(k, j)] + q * h[(k + 1, j)];
            if three {
                sum += r * h[(k + 2, j)];
                h[(k + 2, j)] -= sum * fz;
            }
            h[(k, j)] -= sum * fx;
            h[(k + 1, j)] -= sum * fy;
        }
        let last = n.min(k + 3);
        for (matrix, rows) in [(&mut *h, last + 1), (&mut *v, size)] {
            for i in 0..rows {
                let mut sum = fx * matrix[(i, k)] + fy * matrix[(i, k + 1)];
                if three {
                    sum += fz * matrix[(i, k + 2)];
                    matrix[(i, k + 2)] -= sum * r;
                }
                matrix[(i, k)] -= sum;
                matrix[(i, k + 1)] -= sum * q;
            }
        }
    }
}

/// Eigenvectors of the real Schur form, by columns as described at [`Eigen`].
fn back_substitute(t: &Matrix, values: &[Complex]) -> Matrix {
    let n = t.rows;
    let norm = t.max_abs().max(f64::MIN_POSITIVE);
    let mut out = Matrix::zeros(n, n);
    let mut x = vec![complex(0.0, 0.0); n];
    let mut k = 0;
    while k < n {
        let lambda = values[k];
        x.fill(complex(0.0, 0.0));
        let top = if lambda.im == 0.0 {
            x[k] = complex(1.0, 0.0);
            k
        } else {
            // (t11 - lambda) x1 + t12 x2 = 0
            let (a, b) = (complex(t[(k, k)], 0.0) - lambda, t[(k, k + 1)]);
            let c = t[(k + 1, k)];
            if b.abs() >= c.abs() {
                x[k] = complex(1.0, 0.0);
                x[k + 1] = (-a).scale(1.0 / b);
            } else {
                x[k + 1] = complex(1.0, 0.0);
                let d = complex(t[(k + 1, k + 1)], 0.0) - lambda;
                x[k] = (-d).scale(1.0 / c);
            }
            k
        };
        let reach = top + if lambda.im == 0.0 { 1 } else { 2 };
        let mut i = top;
        while i > 0 {
            let pair = values[i - 1].im != 0.0;
            let first = if pair { i - 2 } else { i - 1 };
            let sum = |r: usize, x: &[Complex]| {
                (i..reach).fold(complex(0.0, 0.0), |s, c| s + x[c].scale(t[(r, c)]))
            };
            let small = f64::EPSILON * norm;
            if pair {
                let (s0, s1) = (sum(first, &x), sum(first + 1, &x));
                let a = complex(t[(first, first)], 0.0) - lambda;
                let d = complex(t[(first + 1, first + 1)], 0.0) - lambda;
                let (b, c) = (t[(first, first + 1)], t[(first + 1, first)]);
                let mut det = a * d - complex(b * c, 0.0);
                if det.abs() < small * norm * 1e-3 {
                    det = complex(small * norm * 1e-3, 0.0);
                }
                x[first] = (s1.scale(b) - d * s0) / det;
                x[first + 1] = (s0.scale(c) - a * s1) / det;
            } else {
                let mut d = complex(t[(first, first)], 0.0) - lambda;
                if d.abs() < small {
                    d = complex(small, 0.0); // defective: the result will be nearly parallel
                }
                x[first] = -sum(first, &x) / d;
            }
            // rescale before anything overflows
            let largest = x[first..reach].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            if largest > 1e100 {
                x[first..reach].iter_mut().for_each(|v| *v = v.scale(1.0 / largest));
            }
            i = first;
        }
        for (r, v) in x.iter().enumerate() {
            out[(r, k)] = v.re;
            if lambda.im != 0.0 {
                out[(r, k + 1)] = v.im;
            }
        }
        k = reach;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest defect of `A v = lambda v`.
    fn defect(a: &Matrix, e: &Eigen) -> f64 {
        let av = a.times(&e.vectors);
        let mut worst = 0.0f64;
        let mut k = 0;
        while k < a.rows {
            let l = e.values[k];
            for r in 0..a.rows {
                if l.im == 0.0 {
                    worst = worst.max((av[(r, k)] - l.re * e.vectors[(r, k)]).abs());
                } else {
                    let v = complex(e.vectors[(r, k)], e.vectors[(r, k + 1)]);
                    let d = complex(av[(r, k)], av[(r, k + 1)]) - l * v;
                    worst = worst.max(d.abs());
                }
            }
            k += if l.im == 0.0 { 1 } else { 2 };
        }
        worst
    }

    #[test]
    fn random_matrices() {
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        for n in [1usize, 2, 3, 4, 5, 8, 13, 24, 60] {
            for _ in 0..10 {
                let mut a = Matrix::zeros(n, n);
                a.data.iter_mut().for_each(|v| *v = next());
                let e = eigen(&a).unwrap();
                assert!(defect(&a, &e) < 1e-12 * n as f64, "n = {n}: {}", defect(&a, &e));
                let trace: f64 = (0..n).map(|i| a[(i, i)]).sum();
                let sum: f64 = e.values.iter().map(|l| l.re).sum();
                assert!((trace - sum).abs() < 1e-12 * n as f64);
            }
        }
    }

    #[test]
    fn states_that_do_not_move_have_no_rates() {
        for n in [5, 26, 48, 120] {
            let row = |by: usize| (0..n).map(move |i| ((by * i + 3) % 11) as f64 - 4.7);
            let lists: Vec<Vec<f64>> = [7, 5, 4, 3].map(|by| row(by).collect()).into();
            let [x, y, u, v] = &lists[..] else { unreachable!() };
            let a = Matrix::from_fn(n, n, |r, c| 1e5 * (x[r] * u[c] / 3.0 - y[r] * v[c] / 7.0));
            let e = eigen(&a).unwrap();
            assert!(defect(&a, &e) < 1e-15 * n as f64 * a.max_abs(), "n = {n}");
            let moving = e.values.iter().filter(|l| l.abs() > 1e-6 * a.max_abs()).count();
            assert_eq!(moving, 2, "n = {n}");
        }
    }

    #[test]
    fn an_undamped_oscillator_has_a_purely_imaginary_pair() {
        let a = Matrix::from_fn(2, 2, |r, c| [[0.0, 3.0], [-3.0, 0.0]][r][c]);
        let e = eigen(&a).unwrap();
        assert_eq!((e.values[0].re, e.values[0].im), (0.0, 3.0));
    }

    #[test]
    fn rounding_is_not_balanced() {
        // rows that are zero but for rounding, next to columns that are not
        let n = 8;
        let mut a = Matrix::from_fn(n, n, |r, c| {
            let noise = 1e-28 * (1.0 + (3 * r + 5 * c) as f64 % 7.0);
            let own = 1e6 * (((5 * r + 3 * c) % 11) as f64 - 4.0);
            if r < 3 {
                noise
            } else {
                own
            }
        });
        a[(2, 5)] = -3e5;
        let e = eigen(&a).unwrap();
        assert!(defect(&a, &e) < 1e-13 * a.max_abs(), "{:e}", defect(&a, &e));
    }

    #[test]
    fn permutations_need_the_exceptional_shift() {
        let a = Matrix::from_fn(4, 4, |r, c| f64::from((r + 1) % 4 == c));
        let e = eigen(&a).unwrap();
        assert!(defect(&a, &e) < 1e-14);
    }
}
