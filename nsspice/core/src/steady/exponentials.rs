//! Divided differences of the exponential, and the exponential of a small matrix.
//!
//! With `E[z0, ..., zm]` the divided difference,
//!
//! ```text
//! integral over 0..d of e^(-s t) t^m E[z0 t, ..., zm t] dt = d^(m+1) E[(z0 - s) d, ..., (zm - s) d, 0],
//! ```
//!
//! so that every term of a segment has its weighted integrals in one function.

use super::linear::CMatrix;
use crate::dense::{complex, Complex};

/// Nodes at most.
pub const NODES: usize = 5;
/// Nodes nearer to their mean than this are summed by Taylor's series: 1^24 / 24! < 2e-24.
const NEAR: f64 = 1.0;
const TERMS: usize = 24;

/// `E[z0, ..., zm]`, at most [`NODES`] of them.
pub fn divided(z: &[Complex]) -> Complex {
    match *z {
        [] => complex(0.0, 0.0),
        [a] => a.exp(),
        [a, b] => {
            // from the node whose exponential is larger
            let (a, b) = if a.re >= b.re { (a, b) } else { (b, a) };
            let apart = b - a;
            let less = if apart.abs() == 0.0 { complex(1.0, 0.0) } else { apart.exp_m1() / apart };
            a.exp() * less
        }
        _ => several(z),
    }
}

fn several(z: &[Complex]) -> Complex {
    let count = z.len();
    let mean = z.iter().fold(complex(0.0, 0.0), |s, &v| s + v).scale(1.0 / count as f64);
    if z.iter().all(|&v| (v - mean).abs() <= NEAR) {
        return mean.exp() * series(z, mean);
    }
    let (mut far, mut most) = ((0, 1), -1.0);
    for i in 0..count {
        for j in 0..i {
            let apart = (z[i] - z[j]).abs();
            if apart > most {
                (far, most) = ((j, i), apart);
            }
        }
    }
    let without = |left_out: usize| {
        let mut rest = [complex(0.0, 0.0); NODES];
        let kept = (0..count).filter(|&k| k != left_out);
        kept.enumerate().for_each(|(to, k)| rest[to] = z[k]);
        divided(&rest[..count - 1])
    };
    (without(far.0) - without(far.1)) / (z[far.1] - z[far.0])
}

/// `sum over j of h_j(z - mean) / (j + m)!` with the complete homogeneous polynomials `h_j`.
fn series(z: &[Complex], mean: Complex) -> Complex {
    let mut h = [complex(0.0, 0.0); TERMS];
    h[0] = complex(1.0, 0.0);
    for &node in z {
        let w = node - mean;
        for j in 1..TERMS {
            h[j] = h[j] + w * h[j - 1];
        }
    }
    let mut factor = (1..z.len()).fold(1.0, |f, k| f / k as f64);
    let mut sum = complex(0.0, 0.0);
    for (j, term) in h.iter().enumerate() {
        sum = sum + term.scale(factor);
        factor /= (j + z.len()) as f64;
    }
    sum
}

/// `e^M` by scaling, Taylor's series and squaring; for blocks of a few coordinates.
pub fn exponential(m: &CMatrix) -> CMatrix {
    let size = (0..m.rows).map(|r| m.row(r).iter().map(|v| v.abs()).sum()).fold(0.0f64, f64::max);
    let halvings = if size > 0.25 { (4.0 * size).log2().ceil().max(0.0) as i32 } else { 0 };
    let scaled = m.scale(0.5f64.powi(halvings));
    let mut sum = CMatrix::identity(m.rows);
    // 0.25^14 / 14! < 5e-20
    for k in (1..=14).rev() {
        sum = scaled.times(&sum).scale(1.0 / f64::from(k));
        (0..m.rows).for_each(|i| sum.row_mut(i)[i] = sum.row(i)[i] + complex(1.0, 0.0));
    }
    for _ in 0..halvings {
        sum = sum.times(&sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The divided difference is the corner of the exponential of a bidiagonal matrix.
    #[test]
    fn they_are_the_corner_of_a_matrix_exponential() {
        let c = complex;
        let sets: [&[Complex]; 6] = [
            &[c(-3.0, 5.0), c(0.0, 0.0)],
            &[c(-0.1, 0.2), c(-0.1, 0.2), c(0.0, 0.0)],
            &[c(-20.0, 1.0), c(-20.0, 1.0), c(0.0, 0.0)],
            &[c(0.0, 6.0), c(0.0, -6.0), c(0.0, 0.0), c(0.0, 0.0)],
            &[c(-1.0, 1.1), c(-1.0, 0.0), c(0.3, 0.0), c(0.0, 0.0), c(0.0, 0.0)],
            &[c(-7.0, 0.0), c(-7.0 + 1e-9, 0.0), c(0.0, 1e-9), c(0.0, 0.0)],
        ];
        for z in sets {
            let n = z.len();
            let mut m = CMatrix::zeros(n, n);
            for (i, &v) in z.iter().enumerate() {
                m.row_mut(i)[i] = v;
                if i + 1 < n {
                    m.row_mut(i)[i + 1] = c(1.0, 0.0);
                }
            }
            let corner = exponential(&m).row(0)[n - 1];
            // squaring a norm of 28 seven times costs some 2^7 roundings of the largest entry, 1
            assert!((divided(z) - corner).abs() < 3e-14, "{z:?}");
        }
    }
}
