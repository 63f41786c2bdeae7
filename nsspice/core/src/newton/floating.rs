//! Nodes that only capacitors tie: the sum of their laws.
//!
//! Beside `rate E z` the currents into a group of nodes that capacitors tie together, without a connection
//! to ground, drown in rounding: in a step of 10 ps the terms of 1 mF at 500 V are 5e10 A.  The sum of the
//! laws of such a group holds what comes in from elsewhere alone.  It takes the place of the first of them.

use crate::descriptor::stored_groups;
use crate::sparse::Csc;

/// The groups, of current rows, and how rows turn into sums.
#[derive(Clone, Debug)]
pub(super) struct Floating {
    groups: Vec<Vec<usize>>,
    /// the first row of the group of each row
    first: Vec<Option<usize>>,
}

impl Floating {
    /// Finds the groups of the storage matrix `e`.  Where the current of a source stands in a law of `g`, it
    /// makes up for whatever the others sum to.
    pub fn new(e: &Csc, g: &Csc, row_kind: &[u8]) -> Floating {
        let mut fit = vec![true; e.nrows];
        let mut stored = vec![false; e.ncols];
        e.iter().for_each(|(_, column, _)| stored[column] = true);
        let of_sources = g.iter().filter(|&(_, c, v)| v != 0.0 && row_kind[c] == 1 && !stored[c]);
        of_sources.for_each(|(row, ..)| fit[row] = false);
        let [mut groups, _] = stored_groups(e);
        groups.retain(|group| {
            group.len() > 1 && group.iter().all(|&row| row_kind[row] == 0 && fit[row])
        });
        let mut first = vec![None; e.nrows];
        for group in &groups {
            group.iter().for_each(|&row| first[row] = Some(group[0]));
        }
        Floating { groups, first }
    }

    /// Whether a sum stands in the place of this row.
    pub fn is_sum(&self, row: usize) -> bool {
        self.first[row] == Some(row)
    }

    /// The row of the sum that contains a row.
    pub fn first(&self, row: usize) -> Option<usize> {
        self.first[row]
    }

    /// The row of the sum to which another row is to be added.
    fn sum_of(&self, row: usize) -> Option<usize> {
        self.first[row].filter(|&first| first != row)
    }

    /// The entries of a matrix, those of sums included.
    pub fn with_sums(&self, matrix: &Csc) -> Vec<(usize, usize, f64)> {
        let copies = matrix.iter().filter_map(|(r, c, v)| Some((self.sum_of(r)?, c, v)));
        matrix.iter().chain(copies).collect()
    }

    /// Turns the right-hand side of laws into one with sums.
    pub fn sum_up(&self, rhs: &mut [f64]) {
        for group in &self.groups {
            rhs[group[0]] = group.iter().map(|&row| rhs[row]).sum();
        }
    }
}
