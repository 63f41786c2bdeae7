//! Rows at the instants that an engine chooses: one where all is continuous, two where something
//! jumps.

use crate::audit::TOLERANCE;

/// Where such rows go.
pub enum Home<'a> {
    /// into the table
    Table,
    /// besides the table, both sides of jumps alone
    Beside(&'a mut Vec<f64>),
}

/// The row before an instant until the one after it is known, and rows that wait for their place.
#[derive(Clone, Debug, Default)]
pub struct Sides {
    waiting: Vec<f64>,
    /// how many of the waiting numbers have been handed on
    taken: usize,
    left: Vec<f64>,
    open: bool,
    /// size of each column: the largest value so far, or of the terms it is summed from
    pub sizes: Vec<f64>,
}

impl Sides {
    /// Takes the row before an instant, unless there is one already: everything between is at the
    /// same instant.
    pub fn left(&mut self, row: &[f64]) {
        if !self.open {
            self.open = true;
            self.left.clear();
            self.left.extend_from_slice(row);
        }
    }

    /// Takes notice of a row.
    pub fn see(&mut self, row: &[f64]) {
        self.sizes.resize(row.len(), 0.0);
        for (size, value) in self.sizes.iter_mut().zip(row) {
            *size = size.max(value.abs());
        }
    }

    /// True if the row after the instant is missing.
    pub fn open(&self) -> bool {
        self.open
    }

    /// Takes the row after the instant, if there is one; `row` is the label of the table's own row
    /// at the instant, which is the one after a jump.
    pub fn right(&mut self, right: Option<&[f64]>, instant: f64, row: Option<f64>, home: Home) {
        self.open = false;
        let label = row.unwrap_or(instant);
        self.left[0] = label;
        if let Some(right) = right {
            self.see(right);
        }
        let right = right.filter(|right| {
            let pairs = self.left.iter().zip(*right).zip(&self.sizes).skip(1);
            pairs.into_iter().any(|((a, b), size)| (a - b).abs() > TOLERANCE * size.max(a.abs()))
        });
        let (out, both) = match home {
            Home::Beside(_) if right.is_none() => return,
            Home::Table if right.is_none() && row.is_some() => return,
            Home::Beside(out) => (out, true),
            Home::Table => (&mut self.waiting, row.is_none()),
        };
        out.extend_from_slice(&self.left);
        if let (true, Some(right)) = (both, right) {
            out.push(label);
            out.extend_from_slice(&right[1..]);
        }
    }

    /// A row of the table whose place comes before all that follows.
    pub fn wait(&mut self, row: &[f64]) {
        self.see(row);
        self.waiting.extend_from_slice(row);
    }

    /// True if no row waits for its place in the table.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Writes the next row that waits, if there is one.
    pub fn next(&mut self, row: &mut [f64]) -> bool {
        if self.waiting.is_empty() {
            return false;
        }
        row.copy_from_slice(&self.waiting[self.taken..self.taken + row.len()]);
        self.taken += row.len();
        if self.taken == self.waiting.len() {
            self.waiting.clear();
            self.taken = 0;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_no_jump() {
        let mut sides = Sides::default();
        let mut kept = Vec::new();
        for (left, right) in [([0.0, 1.0], [0.0, 2.0]), ([1.0, 1e-17], [1.0, 0.0])] {
            sides.left(&left);
            sides.right(Some(&right), left[0], None, Home::Beside(&mut kept));
        }
        assert_eq!(kept, [0.0, 1.0, 0.0, 2.0]);
    }

    fn rows(row: Option<f64>, right: &[f64]) -> Vec<Vec<f64>> {
        let mut sides = Sides::default();
        sides.left(&[9.0, 1.0]);
        sides.left(&[9.0, 5.0]);
        sides.right(Some(right), 3.0, row, Home::Table);
        let mut out = Vec::new();
        let mut next = [0.0; 2];
        while sides.next(&mut next) {
            out.push(next.to_vec());
        }
        assert!(sides.is_empty());
        out
    }

    #[test]
    fn an_instant_stands_twice_if_something_jumps() {
        assert_eq!(rows(None, &[3.0, 1.0]), [[3.0, 1.0]]);
        assert_eq!(rows(None, &[3.0, 2.0]), [[3.0, 1.0], [3.0, 2.0]]);
        // the table's own row is the second one
        assert_eq!(rows(Some(3.5), &[3.0, 2.0]), [[3.5, 1.0]]);
        assert!(rows(Some(3.5), &[3.0, 1.0]).is_empty());
    }
}
