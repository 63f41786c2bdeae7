//! Symmetric scaling: the same factor for row i and column i keeps a problem monotone.

use crate::sparse::Csc;

const SWEEPS: usize = 12;

/// Steps of the conjugate gradient iteration; the exact minimum is not needed.
const GRADIENT_STEPS: usize = 25;

/// Row, column and size of an entry that is not zero.
type Entry = (u32, u32, f64);

/// Factors `d`, powers of two, equal for row i and column i, that bring the entries of
/// `diag(d) matrix diag(d)` near one: first all of them on average, then the largest of each row.
pub(crate) fn equilibrate(matrix: &Csc) -> Vec<f64> {
    let mut entries = Vec::with_capacity(matrix.values.len());
    let all = matrix.iter().filter(|e| e.2 != 0.0);
    entries.extend(all.map(|(r, c, v)| (r as u32, c as u32, v.abs())));
    let mut d = level(matrix.nrows, &entries);
    ruiz(&entries, &mut d);
    for f in &mut d {
        *f = f.log2().round().clamp(-250.0, 250.0).exp2();
    }
    d
}

/// Logarithmic least squares (Curtis & Reid 1972), made symmetric: minimises the sum of
/// `(log |a_ij| + u_i + u_j)^2` over all entries.
///
/// Equations like `i = C/h v` and `v1 - v2 = 0` leave free how large currents are against
/// voltages; this spreads the impedance level of one element over those joined by factors of one.
fn level(n: usize, entries: &[Entry]) -> Vec<f64> {
    let finite = entries.iter().filter(|e| e.2.is_finite());
    let mut entries = Vec::with_capacity(entries.len());
    entries.extend(finite.map(|&(r, c, size)| (r, c, size.ln())));
    let mut degree = vec![0.0f64; n];
    let mut residual = vec![0.0f64; n];
    for &(r, c, log) in &entries {
        let (r, c) = (r as usize, c as usize);
        degree[r] += if r == c { 2.0 } else { 1.0 };
        degree[c] += if r == c { 2.0 } else { 1.0 };
        residual[r] -= log;
        residual[c] -= log;
    }
    let mut u = vec![0.0f64; n];
    let mut direction = vec![0.0f64; n];
    let mut product = vec![0.0f64; n];
    let mut before = 0.0f64;
    for step in 0..GRADIENT_STEPS {
        let weighted = |(r, d): (&f64, &f64)| if *d > 0.0 { r * r / d } else { 0.0 };
        let now: f64 = residual.iter().zip(&degree).map(weighted).sum();
        if now <= 1e-4 * n as f64 {
            break;
        }
        let beta = if step == 0 { 0.0 } else { now / before };
        before = now;
        for ((p, r), d) in direction.iter_mut().zip(&residual).zip(&degree) {
            *p = beta * *p + if *d > 0.0 { r / d } else { 0.0 };
        }
        product.fill(0.0);
        for &(r, c, _) in &entries {
            let sum = direction[r as usize] + direction[c as usize];
            product[r as usize] += sum;
            product[c as usize] += sum;
        }
        let curvature: f64 = direction.iter().zip(&product).map(|(p, a)| p * a).sum();
        if curvature <= 0.0 {
            break;
        }
        let alpha = now / curvature;
        for (((u, r), p), a) in u.iter_mut().zip(&mut residual).zip(&direction).zip(&product) {
            *u += alpha * p;
            *r -= alpha * a;
        }
    }
    u.iter().map(|u| u.clamp(-170.0, 170.0).exp()).collect()
}

/// Ruiz' iteration: the largest entry of each row and column comes near one.  Rows and columns
/// without entries keep their factor.
fn ruiz(entries: &[Entry], d: &mut [f64]) {
    let mut largest = vec![0.0f64; d.len()];
    for _ in 0..SWEEPS {
        largest.fill(0.0);
        for &(r, c, size) in entries {
            let (r, c) = (r as usize, c as usize);
            let size = d[r] * size * d[c];
            largest[r] = largest[r].max(size);
            largest[c] = largest[c].max(size);
        }
        let mut settled = true;
        for (f, &big) in d.iter_mut().zip(&largest) {
            let root = big.sqrt();
            if big > 0.0 && big.is_finite() && root != 1.0 {
                *f /= root;
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_come_close_to_one() {
        let m = Csc::from_triplets(
            3,
            3,
            &[(0, 0, 1e-12), (0, 1, 1.0), (1, 0, -1.0), (1, 1, 1e9), (2, 2, 3e-7)],
        );
        let d = equilibrate(&m);
        let mut largest = [0.0f64; 3];
        for (r, c, v) in m.iter() {
            largest[r] = largest[r].max((d[r] * v * d[c]).abs());
        }
        assert!(largest.iter().all(|&x| x > 0.2 && x < 5.0), "{largest:?}");
    }

    #[test]
    fn one_impedance_level_spreads_along_unit_couplings() {
        // C/h = 1e10 at node 0, an ideal branch current 1, a node 2 behind it
        let one = [(0, 1, 1.0), (1, 0, -1.0), (2, 1, -1.0), (1, 2, 1.0), (0, 0, 1e10)];
        let d = equilibrate(&Csc::from_triplets(3, 3, &one));
        assert!((d[0] * 1e5).log2().abs() < 2.0, "{d:?}");
        assert!((d[1] / 1e5).log2().abs() < 2.0, "{d:?}");
        assert!((d[2] * 1e5).log2().abs() < 2.0, "{d:?}");
    }

    #[test]
    fn factors_are_powers_of_two_and_empty_rows_keep_one() {
        let m = Csc::from_triplets(2, 2, &[(0, 0, 7.3)]);
        let d = equilibrate(&m);
        assert_eq!(d[1], 1.0);
        assert_eq!(d[0].log2().fract(), 0.0);
    }
}
