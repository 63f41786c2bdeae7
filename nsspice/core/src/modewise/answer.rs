//! Unknowns that follow from states and inputs at once, and sums of them to the digits of the sums.
//!
//! The potentials of a part that only a large resistance ties to ground are known to the rounding of
//! what may flow, an ampere in a megohm, while differences between them are known to that of small
//! resistances.  A sum `f' A^-1 b` over the solution of `A x = b` is `(A^-T f)' b` as well, in which the
//! large resistance does not occur.

use super::mode::solved;
use super::tracked::Tracked;
use crate::dense::{Lu, Matrix};

/// Algebraic unknowns `[kernel part; active multipliers]` as rows.
pub(super) struct Answer {
    pub rows: Tracked,
    /// where terms cancel in the solution
    indirect: Option<Indirect>,
}

/// The equations, transposed; which unknowns they determine, and what is added to their solution.
struct Indirect {
    turned: Matrix,
    factor: Lu,
    right: Tracked,
    unknowns: Vec<usize>,
    rest: Tracked,
}

impl Answer {
    /// The solution of `block x = right` for some unknowns, zero for the other ones.
    pub fn new(
        [block, inverse]: [&Matrix; 2],
        factor: &Lu,
        right: Tracked,
        unknowns: &[usize],
        size: usize,
    ) -> Answer {
        let mut part = right.under(inverse);
        let cancels = part.cancels();
        if cancels {
            // what passes a node that a large resistance ties: not by the potential of that node
            part.value = factor.solve_refined(block, &right.value);
        }
        let mut rows = Tracked::zeros(size, right.value.cols);
        for (i, &unknown) in unknowns.iter().enumerate() {
            rows.value.row_mut(unknown).copy_from_slice(part.value.row(i));
            rows.bound.row_mut(unknown).copy_from_slice(part.bound.row(i));
        }
        let indirect = cancels.then(|| {
            let turned = block.transpose();
            Indirect {
                factor: Lu::new(&turned),
                turned,
                rest: Tracked::zeros(size, right.value.cols),
                unknowns: unknowns.to_vec(),
                right,
            }
        });
        Answer { rows, indirect }
    }

    /// Rows that no equations stand behind.
    pub fn plain(rows: Tracked) -> Answer {
        Answer { rows, indirect: None }
    }

    /// Adds something to the solution.
    pub fn add(&mut self, more: &Tracked) {
        self.rows.add(1.0, more);
        if let Some(indirect) = &mut self.indirect {
            indirect.rest.add(1.0, more);
        }
    }

    /// The product `factor * self`.
    pub fn under(&self, factor: &Matrix) -> Tracked {
        let Some(Indirect { turned, factor: lu, right, unknowns, rest }) = &self.indirect else {
            return self.rows.under(factor);
        };
        let wanted = factor.select_cols(unknowns).transpose();
        let mut out = right.under(&solved(turned, lu, &wanted).transpose());
        out.add(1.0, &rest.under(factor));
        out
    }
}
