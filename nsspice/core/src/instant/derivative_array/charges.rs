//! Laws combined so that as few of them as possible contain charges of functions.
//!
//! The charge of a junction behind its series resistance belongs to the laws of both its ends, and stores one thing: in
//! their sum it cancels, and that sum holds without any rate.  Taken one by one the two laws would look as if the
//! voltage between them were an index of 2.  Elimination with row operations finds all such sums; since a charge
//! counts once in a law, with either sign, they have coefficients of one.

use super::{DerivativeArray, Moment};
use crate::dense::Matrix;
use crate::newton::Newton;
use crate::rounding::of_elimination;

/// One law is added to another, times a factor.
pub(super) struct Combination {
    to: usize,
    law: usize,
    factor: f64,
}

impl DerivativeArray {
    /// Finds the combinations, and in which laws something is stored then.
    pub(super) fn combine_laws(&mut self, newton: Option<&Newton>, at: &Moment) {
        self.combinations.clear();
        self.stored.clone_from(&self.stores);
        self.a.clone_from(&self.a_before);
        let Some(newton) = newton else { return };
        let charges =
            || newton.each_function().filter(|(row, _, [_, q])| *q != 0.0 && at.keeps[*row]);
        charges().for_each(|(row, ..)| self.stored[row] = true);
        let mut open: Vec<usize> =
            (0..self.n).filter(|&r| self.stored[r] && !self.stores[r]).collect();
        let mut all = Matrix::zeros(self.n, self.now.len());
        charges().for_each(|(row, k, [_, q])| all[(row, k)] += q);
        let rounding = of_elimination(open.len());
        for k in 0..self.now.len() {
            let largest =
                |a: &&usize, b: &&usize| all[(**a, k)].abs().total_cmp(&all[(**b, k)].abs());
            let Some(&law) = open.iter().max_by(largest).filter(|&&law| all[(law, k)] != 0.0)
            else {
                continue;
            };
            open.retain(|&row| row != law);
            for &to in open.iter().filter(|&&to| all[(to, k)] != 0.0).collect::<Vec<_>>() {
                let factor = -all[(to, k)] / all[(law, k)];
                for c in k..self.now.len() {
                    let (own, part) = (all[(to, c)], factor * all[(law, c)]);
                    let sum = own + part;
                    let nothing = sum.abs() <= rounding * own.abs().max(part.abs());
                    all[(to, c)] = if nothing { 0.0 } else { sum };
                }
                self.combinations.push(Combination { to, law, factor });
            }
        }
        open.iter().for_each(|&row| self.stored[row] = false);
        combine(&self.combinations, &mut self.a);
    }

    /// Sizes of laws, combined.
    pub(super) fn combine_sizes(&self, sizes: &mut [f64]) {
        self.combinations.iter().for_each(|c| sizes[c.to] += c.factor.abs() * sizes[c.law]);
    }

    /// A list of laws, combined.
    pub(super) fn combine_list(&self, list: &mut [f64]) {
        self.combinations.iter().for_each(|c| list[c.to] += c.factor * list[c.law]);
    }

    /// The columns of unknowns whose laws are the combined ones.
    pub(super) fn combine_columns(&self, matrix: &mut Matrix) {
        for c in &self.combinations {
            for r in 0..matrix.rows {
                matrix[(r, c.to)] += c.factor * matrix[(r, c.law)];
            }
        }
    }
}

/// Combines the rows of a matrix.
pub(super) fn combine(combinations: &[Combination], matrix: &mut Matrix) {
    for c in combinations {
        for k in 0..matrix.cols {
            let part = c.factor * matrix[(c.law, k)];
            matrix[(c.to, k)] += part;
        }
    }
}
