//! The eigenvalues and eigenvectors of a mode, as real arrays.

use crate::dense::{eigen, eigen_symmetric, Lu, Matrix};

/// Condition of the eigenvectors above which the closed form loses too many digits.
const CONDITION: f64 = 1e6;
/// The same where nothing else is at hand.
const LAST_CONDITION: f64 = 1e10;

/// Number of states up to which the matrix exponential stands in for missing eigenvectors.
pub const PLAIN: usize = 24;

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
}

/// Modal coordinates `x = from_modal xi`; a pair has the real and the imaginary part of one complex
/// coordinate.
pub struct Spectrum {
    /// eigenvalues
    pub poles: Vec<Pole>,
    /// x from xi
    pub from_modal: Matrix,
    /// xi from x
    pub to_modal: Matrix,
}

impl Spectrum {
    /// Decomposes `x' = J x`; `None` if J is (nearly) defective. `symmetric`: J is, but for rounding.
    pub fn new(j: &Matrix, symmetric: bool) -> Option<Spectrum> {
        let n = j.rows;
        let size = j.max_abs();
        let mut skewness = 0.0f64;
        for r in 0..n {
            for c in 0..r {
                skewness = skewness.max((j[(r, c)] - j[(c, r)]).abs());
            }
        }
        if symmetric || skewness <= 1e-14 * size {
            let symmetric = Matrix::from_fn(n, n, |r, c| 0.5 * (j[(r, c)] + j[(c, r)]));
            let (values, vectors) = eigen_symmetric(&symmetric)?;
            let poles = values.iter().enumerate();
            let poles = poles.map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 }).collect();
            return Some(Spectrum { poles, to_modal: vectors.transpose(), from_modal: vectors });
        }
        let found = eigen(j)?;
        let mut from_modal = found.vectors;
        let mut poles = Vec::with_capacity(n);
        let mut at = 0;
        while at < n {
            let value = found.values[at];
            poles.push(Pole { at, alpha: value.re, omega: value.im });
            if value.im != 0.0 {
                // x = Re[(vr + i vi) xi] = vr Re xi - vi Im xi
                for r in 0..n {
                    from_modal[(r, at + 1)] = -from_modal[(r, at + 1)];
                }
                at += 1;
            }
            at += 1;
        }
        let factor = Lu::new(&from_modal);
        if factor.ratio == 0.0 {
            return None;
        }
        let to_modal = factor.solve_refined(&from_modal, &Matrix::identity(n));
        let norm = |m: &Matrix| {
            (0..n).map(|r| m.row(r).iter().map(|v| v.abs()).sum()).fold(0.0f64, f64::max)
        };
        let condition = norm(&from_modal) * norm(&to_modal);
        let limit = if n <= PLAIN { CONDITION } else { LAST_CONDITION };
        (condition < limit).then_some(Spectrum { poles, from_modal, to_modal })
    }
}
