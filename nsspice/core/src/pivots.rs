//! What makes an entry a pivot, in dense and in sparse factors alike.

use crate::rounding::OF_SOLUTION;

/// Below this part of its column a pivot is none, even if nothing was lost on the way: rounding of right-hand
/// sides would move the unknown out of all bounds.
pub const TRACE: f64 = 1e-30;

/// What candidates for pivots are compared with where rows are not equilibrated: the largest entries of the
/// columns of a matrix and of its rows, but for unknowns that a row of their own gives.  In a law that contains
/// the slopes of blocking junctions next to these 1e-25 is no trace of anything larger.
#[derive(Clone, Debug, Default)]
pub struct Sizes {
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// rows of one entry that is no trace of its column, and the columns that rows of one entry give
    alone: Vec<bool>,
    given: Vec<bool>,
    /// scratch: entries of each row, its last column, and that entry
    last: Vec<(u32, u32, f64)>,
}

impl Sizes {
    /// Takes `n` rows for alike.
    pub fn forget(&mut self, n: usize) {
        self.rows.clear();
        self.rows.resize(n, 1.0);
        for list in [&mut self.alone, &mut self.given] {
            list.clear();
            list.resize(n, false);
        }
    }

    /// Measures a matrix.
    pub fn measure(
        &mut self,
        n: usize,
        entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
    ) {
        let entries = entries.filter(|e| e.2 != 0.0);
        let Sizes { rows, columns, alone, given, last } = self;
        last.clear();
        last.resize(n, (0, 0, 0.0));
        columns.clear();
        columns.resize(n, 0.0);
        for (r, c, v) in entries.clone() {
            last[r] = (last[r].0 + 1, c as u32, v.abs());
            columns[c] = columns[c].max(v.abs());
        }
        alone.clear();
        given.clear();
        given.resize(n, false);
        for &(count, c, v) in last.iter() {
            given[c as usize] |= count == 1;
            // less of a column does not survive elimination
            alone.push(count == 1 && v > OF_SOLUTION * columns[c as usize]);
        }
        rows.clear();
        rows.resize(n, 0.0);
        for (r, _, v) in entries.filter(|&(r, c, _)| !given[c] || last[r].0 == 1) {
            rows[r] = rows[r].max(v.abs());
        }
    }

    /// The part that an entry is of its row.
    #[inline]
    pub fn part(&self, v: f64, row: usize) -> f64 {
        if v == 0.0 {
            0.0
        } else {
            v.abs() / self.rows[row]
        }
    }

    /// The row that gives a column and contains nothing else, where the column would hide all else in another one
    /// of the candidates, as the current of an open switch does in a law of leakages.
    pub fn own_row(
        &self,
        column: usize,
        candidates: impl Iterator<Item = (usize, f64)> + Clone,
    ) -> Option<usize> {
        let hidden = |(row, v)| OF_SOLUTION * self.part(v, row) > 1.0;
        if !self.given[column] || !candidates.clone().any(hidden) {
            return None;
        }
        candidates.filter(|c| c.1 != 0.0).map(|c| c.0).find(|&row| self.alone[row])
    }

    /// Whether a row whose entry in a column does not vanish gives that column.
    #[inline]
    pub fn gives(&self, row: usize, column: usize) -> bool {
        self.given[column] && self.alone[row]
    }

    /// The largest entry of a row.
    #[inline]
    pub fn row(&self, row: usize) -> f64 {
        self.rows[row]
    }

    /// The largest entry of a column.
    #[inline]
    pub fn column(&self, column: usize) -> f64 {
        self.columns[column]
    }

    /// Exchanges two rows.
    pub fn swap_rows(&mut self, a: usize, b: usize) {
        self.rows.swap(a, b);
        self.alone.swap(a, b);
    }

    /// Exchanges two columns.
    pub fn swap_columns(&mut self, a: usize, b: usize) {
        self.columns.swap(a, b);
        self.given.swap(a, b);
    }
}

/// The matrix cannot be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular {
    /// the first column (of the matrix, not of its permutation) without a usable pivot
    pub column: usize,
}
