//! The exponential of a small matrix; integrals of terms by divided differences ([`crate::dense::divided`]).
//!
//! With `E[z0, ..., zm]` the divided difference,
//!
//! ```text
//! integral over 0..d of e^(-s t) t^m E[z0 t, ..., zm t] dt = d^(m+1) E[(z0 - s) d, ..., (zm - s) d, 0],
//! ```
//!
//! so that every term of a segment has its weighted integrals in one function.

use super::linear::CMatrix;
use crate::dense::complex;

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
    use crate::dense::{divided, Complex};

    /// The divided difference is the breakpoint of the exponential of a bidiagonal matrix.
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
            let breakpoint = exponential(&m).row(0)[n - 1];
            // squaring a norm of 28 seven times costs some 2^7 roundings of the largest entry, 1
            assert!((divided(z) - breakpoint).abs() < 3e-14, "{z:?}");
        }
    }
}
