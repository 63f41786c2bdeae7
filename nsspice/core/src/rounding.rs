//! Bounds of rounding, from which allowances of the core are derived.
//!
//! With the unit roundoff `u` a sum of `n` numbers errs by at most `n u` of the sum of their sizes, in any order
//! it is formed, and a system of `n` equations that is solved by elimination is solved exactly for entries that are
//! off by `3 n u` of the factors' sizes, whose growth is below 8 as a rule (N. J. Higham, Accuracy and Stability of
//! Numerical Algorithms, 2nd ed., SIAM 2002, section 4.2, theorem 9.4 and section 9.4).

/// Unit roundoff.
pub const UNIT: f64 = 0.5 * f64::EPSILON;

/// Elements at most that an entry of an assembled matrix is the sum of, as a rule: beyond, digits are lost.
const ELEMENTS: usize = 16;

/// The part of the sizes of its terms by which an equation of a node, a winding or a control may be missed for rounding
/// alone: it has one term of each element, which is a product, and each of them is rounded when it is formed and when it
/// is added.
pub const OF_EQUATION: f64 = of_sum(2 * ELEMENTS);

/// What rounding leaves of numbers that a network has been solved for, as a part of their terms: of a current that
/// vanishes, of a column that depends on others.  That is [`of_elimination`] of some forty equations; larger networks are
/// sparse, and few of their unknowns meet more others than that on the way.
pub const OF_SOLUTION: f64 = 1e-13;

/// The part of the sizes of its terms that a sum of so many numbers may err by.
pub const fn of_sum(terms: usize) -> f64 {
    terms as f64 * UNIT
}

/// The part of the sizes of its terms that a sum of so many entries of an assembled matrix may err by.
pub fn of_entries(terms: usize) -> f64 {
    of_sum(ELEMENTS * terms)
}

/// The part of the sizes of its terms that an equation among so many may be missed by after elimination.
pub fn of_elimination(size: usize) -> f64 {
    of_sum(3 * 8 * size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_of_a_solution_is_that_of_the_elimination_of_an_ordinary_network() {
        assert!((OF_SOLUTION / of_elimination(38) - 1.0).abs() < 0.02);
    }
}
