//! Bounds of rounding, from which allowances of the core are derived.
//!
//! With the unit roundoff `u` a sum of `n` numbers errs by at most `n u` of the sum of their sizes, in whatever order
//! it is formed, and a system of `n` equations that is solved by elimination is solved exactly for entries that are
//! off by `3 n u` of the factors' sizes, whose growth is below 8 as a rule (N. J. Higham, Accuracy and Stability of
//! Numerical Algorithms, 2nd ed., SIAM 2002, section 4.2, theorem 9.4 and section 9.4).

/// Unit roundoff.
pub const UNIT: f64 = 0.5 * f64::EPSILON;

/// Elements at most that an entry of an assembled matrix is the sum of, as a rule: beyond, digits are lost.
const ELEMENTS: usize = 16;

/// The part of the sizes of its terms that a sum of so many entries of an assembled matrix may err by.
pub fn of_entries(terms: usize) -> f64 {
    (ELEMENTS * terms) as f64 * UNIT
}

/// The part of the sizes of its terms that an equation among so many may be missed by after elimination.
pub fn of_elimination(size: usize) -> f64 {
    3.0 * 8.0 * size as f64 * UNIT
}
