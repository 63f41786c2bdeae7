//! Eigenvalues and eigenvectors of a diagonal matrix plus a matrix of rank one.
//!
//! The eigenvalues are the roots of the secular equation `1 + sigma sum z_i^2 / (d_i - x) = 0`, one
//! between each two poles. They are found relative to the nearest pole, so that differences keep all
//! their digits, and the vectors belong to a `z` that has exactly these roots, so that they are
//! orthogonal (M. Gu, S. C. Eisenstat, SIAM J. Matrix Anal. Appl. 15 (1994) 1266). Components that do
//! not take part are left alone; the work is of the square of the others' number.

use super::matrix::{norm, Matrix};

/// Steps before a root is given up; five are usual.
const MAX_STEPS: usize = 120;

/// The decomposition `D + sigma z z' = U diag(values) U'`, with the work space that finding one takes.
#[derive(Default)]
pub struct RankOne {
    /// eigenvalues: first of the columns that take part, then of the others
    pub values: Vec<f64>,
    /// plane rotations that come first: two columns, cosine, sine
    rotations: Vec<(usize, usize, f64, f64)>,
    /// all columns in the order of the eigenvalues
    order: Vec<usize>,
    /// row by row the vectors of those that take part
    vectors: Matrix,
    work: Matrix,
    shifted: Vec<f64>,
}

#[inline(always)]
/// `sum z_i^2 / (d_i - x)` and its derivative.
fn sums(z: &[f64], d: &[f64], x: f64) -> (f64, f64) {
    let (mut value, mut slope) = ([0.0f64; 4], [0.0f64; 4]);
    let (z4, d4) = (z.chunks_exact(4), d.chunks_exact(4));
    let (mut a, mut b) = (0.0, 0.0);
    for (z, d) in z4.remainder().iter().zip(d4.remainder()) {
        let t = z / (d - x);
        a += z * t;
        b += t * t;
    }
    for (z, d) in z4.zip(d4) {
        for k in 0..4 {
            let t = z[k] / (d[k] - x);
            value[k] += z[k] * t;
            slope[k] += t * t;
        }
    }
    (value.iter().sum::<f64>() + a, slope.iter().sum::<f64>() + b)
}

/// The step from which `c + r / (p - step) + s / (q - step)` vanishes, `p <= 0 <= q` being the
/// distances of the poles.
#[inline(always)]
fn two_poles(c: f64, r: f64, s: f64, p: f64, q: f64) -> f64 {
    let a = c * (p + q) + r + s;
    let b = c * p * q + r * q + s * p;
    let root = (a * a - 4.0 * b * c).max(0.0).sqrt();
    if a <= 0.0 {
        (a - root) / (2.0 * c)
    } else {
        2.0 * b / (a + root)
    }
}

/// Root number `i` of `1 + rho sum z^2 / (d - x)`, `|z| = 1`, as a pole and a distance from it.
/// `shifted` is work space.
#[inline(always)]
fn root(i: usize, d: &[f64], z: &[f64], rho: f64, shifted: &mut [f64]) -> Option<(usize, f64)> {
    let k = d.len();
    let last = i + 1 == k;
    let width = if last { rho } else { d[i + 1] - d[i] };
    shifted.iter_mut().zip(d).for_each(|(s, v)| *s = v - d[i]);
    // the nearer pole becomes the origin
    let middle = 0.5 * width;
    let (sum, _) = sums(z, shifted, middle);
    let at_middle = 1.0 + rho * sum;
    let origin = if last || at_middle > 0.0 { i } else { i + 1 };
    let (mut low, mut high) = if origin == i { (0.0, width) } else { (-width, 0.0) };
    let guess = if last {
        middle
    } else {
        let (p, q) = (-middle, middle);
        let (r, s) = (rho * z[i] * z[i], rho * z[i + 1] * z[i + 1]);
        let rest = at_middle - r / p - s / q;
        middle + two_poles(rest, r, s, p, q)
    };
    let mut x = if origin == i { guess } else { guess - width };
    if origin != i {
        shifted.iter_mut().zip(d).for_each(|(s, v)| *s = v - d[origin]);
    }
    match (origin == i, at_middle > 0.0) {
        (true, true) => high = middle,
        (true, false) => low = middle,
        (false, _) => low = -middle,
    }
    if !(x > low && x < high) {
        x = 0.5 * (low + high);
    }
    for _ in 0..MAX_STEPS {
        let (below, below_slope) = sums(&z[..=i], &shifted[..=i], x);
        let (above, above_slope) = sums(&z[i + 1..], &shifted[i + 1..], x);
        let f = 1.0 + rho * (below + above);
        let rounding = 4.0 * f64::EPSILON * (1.0 + rho * (above - below));
        if f.abs() <= rounding {
            return Some((origin, x));
        }
        if f > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let p = shifted[i] - x;
        let step = if last {
            // one pole
            let c = 1.0 + rho * (below - below_slope * p);
            p + rho * below_slope * p * p / c
        } else {
            let q = shifted[i + 1] - x;
            let (r, s) = (rho * below_slope * p * p, rho * above_slope * q * q);
            two_poles(f - rho * (below_slope * p + above_slope * q), r, s, p, q)
        };
        let mut next = x + step;
        if !(next > low && next < high) {
            next = 0.5 * (low + high);
        }
        let change = (next - x).abs();
        if change <= f64::EPSILON * x.abs() {
            return Some((origin, x));
        }
        x = next;
    }
    None
}

/// Roots and, row by row, vectors of `diag(poles) + rho weights weights'`; `shifted` is work space.
#[inline(always)]
pub(super) fn secular(
    poles: &[f64],
    weights: &[f64],
    rho: f64,
    shifted: &mut Vec<f64>,
    vectors: &mut Matrix,
    roots: &mut Vec<f64>,
) -> Option<()> {
    let k = poles.len();
    // rows: distances of all poles from one root
    let apart = vectors;
    apart.reshape(k, k);
    shifted.resize(k, 0.0);
    roots.clear();
    for j in 0..k {
        let (origin, x) = root(j, poles, weights, rho, shifted)?;
        roots.push(poles[origin] + x);
        for (a, v) in apart.row_mut(j).iter_mut().zip(poles) {
            *a = (v - poles[origin]) - x;
        }
    }
    // weights that have exactly these roots
    let mut exact = vec![1.0f64; k];
    for j in 0..k {
        let (row, pole) = (apart.row(j), poles[j]);
        for ((e, a), p) in exact[..j].iter_mut().zip(row).zip(poles) {
            *e *= a / (p - pole);
        }
        exact[j] *= -row[j];
        for ((e, a), p) in exact[j + 1..].iter_mut().zip(&row[j + 1..]).zip(&poles[j + 1..]) {
            *e *= a / (p - pole);
        }
    }
    for (e, v) in exact.iter_mut().zip(weights) {
        *e = e.abs().sqrt().copysign(*v);
    }
    for j in 0..k {
        let row = apart.row_mut(j);
        row.iter_mut().zip(&exact).for_each(|(a, e)| *a = e / *a);
        let f = 1.0 / norm(row);
        row.iter_mut().for_each(|v| *v *= f);
    }
    Some(())
}

impl RankOne {
    /// Decomposes; `None` if some entry is not finite.
    pub fn decompose(&mut self, d: &[f64], sigma: f64, z: &[f64]) -> Option<()> {
        let n = d.len();
        let sign = if sigma < 0.0 { -1.0 } else { 1.0 };
        let size = norm(z);
        let mut values: Vec<f64> = d.iter().map(|v| sign * v).collect();
        let scale = values.iter().fold(sigma.abs() * size * size, |m, v| m.max(v.abs()));
        if !scale.is_finite() {
            return None;
        }
        let sigma = sigma.abs();
        let none = 8.0 * f64::EPSILON * scale;
        let mut order: Vec<usize> = (0..n).filter(|&i| sigma * z[i].abs() * size > none).collect();
        order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
        let mut w = z.to_vec();
        let rotations = &mut self.rotations;
        rotations.clear();
        let mut kept: Vec<usize> = Vec::with_capacity(order.len());
        for j in order {
            if let Some(&i) = kept.last() {
                // two poles that cannot be distinguished: one combination takes part, the other not
                let tau = w[i].hypot(w[j]);
                let (c, s) = (w[j] / tau, -w[i] / tau);
                let apart = values[j] - values[i];
                let close = 8.0 * f64::EPSILON * values[j].abs().max(values[i].abs());
                if (apart * c * s).abs() <= close {
                    let (x, y) = (values[i], values[j]);
                    values[i] = x * c * c + y * s * s;
                    values[j] = x * s * s + y * c * c;
                    (w[i], w[j]) = (0.0, tau);
                    rotations.push((i, j, c, s));
                    kept.pop();
                }
            }
            kept.push(j);
        }
        let poles: Vec<f64> = kept.iter().map(|&i| values[i]).collect();
        let mut weights: Vec<f64> = kept.iter().map(|&i| w[i]).collect();
        let length = norm(&weights);
        weights.iter_mut().for_each(|v| *v /= length);
        let rho = sigma * length * length;
        let found = &mut self.values;
        super::wide::secular(&poles, &weights, rho, &mut self.shifted, &mut self.vectors, found)?;
        let mut takes_part = vec![false; n];
        kept.iter().for_each(|&i| takes_part[i] = true);
        self.order = kept;
        for i in (0..n).filter(|&i| !takes_part[i]) {
            self.order.push(i);
            found.push(values[i]);
        }
        found.iter_mut().for_each(|v| *v *= sign);
        self.vectors.finite().then_some(())
    }

    /// `rows U`
    pub fn turned(&mut self, rows: &Matrix) -> Matrix {
        let (k, n) = (self.vectors.rows, rows.cols);
        self.work.reshape(rows.rows, n);
        let mut out = Matrix::zeros(rows.rows, n);
        if n == 0 {
            return out; // a mode without a state
        }
        let triples = self.work.data.chunks_exact_mut(n).zip(out.data.chunks_exact_mut(n));
        for ((to, out), from) in triples.zip(rows.data.chunks_exact(n)) {
            let mut from = from;
            if !self.rotations.is_empty() {
                // the rows of the result are free so far
                out.copy_from_slice(from);
                for &(i, j, c, s) in &self.rotations {
                    let (x, y) = (out[i], out[j]);
                    out[i] = c * x + s * y;
                    out[j] = c * y - s * x;
                }
                from = out;
            }
            to.iter_mut().zip(&self.order).for_each(|(t, &i)| *t = from[i]);
            out[k..].copy_from_slice(&to[k..]);
        }
        super::wide::product_transposed(&self.work, &self.vectors, &mut out);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `D + sigma z z'` times the vectors, orthogonality, and the trace.
    fn check(d: &[f64], sigma: f64, z: &[f64]) {
        let n = d.len();
        let mut found = RankOne::default();
        found.decompose(d, sigma, z).unwrap();
        let u = found.turned(&Matrix::identity(n));
        let a = Matrix::from_fn(n, n, |i, j| sigma * z[i] * z[j] + if i == j { d[i] } else { 0.0 });
        let size = a.max_abs();
        let (au, uu) = (a.times(&u), u.transpose_times(&u));
        for i in 0..n {
            for j in 0..n {
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((uu[(i, j)] - unit).abs() < 1e-14 * n as f64, "not orthogonal");
                let rest = au[(i, j)] - u[(i, j)] * found.values[j];
                assert!(rest.abs() < 1e-14 * n as f64 * size, "{rest} of {size}");
            }
        }
    }

    #[test]
    fn random_and_graded_and_multiple_poles() {
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        for n in [1, 2, 3, 5, 8, 33, 90] {
            for sigma in [1.0, -1.0, 1e-6, -1e6] {
                let d: Vec<f64> = (0..n).map(|_| next()).collect();
                let z: Vec<f64> = (0..n).map(|_| next()).collect();
                check(&d, sigma, &z);
                let graded: Vec<f64> = (0..n).map(|i| -(10f64.powi(-i % 14))).collect();
                check(&graded, sigma, &z);
                let double: Vec<f64> = (0..n).map(|i| (i / 3) as f64 * 0.1).collect();
                check(&double, sigma, &z);
                let sparse: Vec<f64> =
                    z.iter().enumerate().map(|(i, v)| if i % 2 == 0 { *v } else { 0.0 }).collect();
                check(&d, sigma, &sparse);
            }
        }
        check(&[1.0, 2.0], 1.0, &[0.0, 0.0]);
    }

    #[test]
    fn small_eigenvalues_of_a_stiff_sum_keep_their_digits() {
        // closed form: d1 + d2 + s = sum, d1 d2 + s (d1 z2^2 + d2 z1^2) = product
        let (d, z, s) = ([-1e-3, -2e-3], [0.6f64, 0.8f64], -1e9);
        let mut found = RankOne::default();
        found.decompose(&d, s, &z).unwrap();
        let product = d[0] * d[1] + s * (d[0] * z[1] * z[1] + d[1] * z[0] * z[0]);
        let slow = found.values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
        let fast = found.values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
        assert!((slow - product / fast).abs() < 1e-15 * slow.abs() * 4.0, "{slow}");
    }
}
