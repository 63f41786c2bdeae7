//! Nodes that only capacitors tie: the sum of their laws.
//!
//! Beside `rate E z` the currents into a group of nodes that capacitors tie together, without a connection
//! to ground, drown in rounding: in a step of 10 ps the terms of 1 mF at 500 V are 5e10 A.  The sum of the
//! laws of such a group holds what comes in from elsewhere alone.  It takes the place of the first of them.

use crate::descriptor::stored_groups;
use crate::sparse::Csc;

/// Rows that belong together.
struct Ties(Vec<usize>);

impl Ties {
    fn new(rows: usize) -> Ties {
        Ties((0..rows).collect())
    }

    fn root(&mut self, mut row: usize) -> usize {
        while self.0[row] != row {
            self.0[row] = self.0[self.0[row]];
            row = self.0[row];
        }
        row
    }

    fn tie(&mut self, rows: &[usize]) {
        for pair in rows.windows(2) {
            let (a, b) = (self.root(pair[0]), self.root(pair[1]));
            self.0[a] = b;
        }
    }
}

/// The groups, of current rows, and how rows turn into sums.
#[derive(Clone, Debug)]
pub(super) struct Floating {
    groups: Vec<Vec<usize>>,
    /// the first row of the group of each row
    first: Vec<Option<usize>>,
}

impl Floating {
    /// Finds the groups of the storage matrix `e`.  The current of a source, a column of `g`, makes up for
    /// whatever the laws in which it stands sum to, unless it leaves their sum: then these are one group.
    pub fn new(e: &Csc, g: &Csc, row_kind: &[u8]) -> Floating {
        let n = e.nrows;
        let [floating, fixed] = stored_groups(e);
        let current = |group: &Vec<usize>| group.iter().all(|&row| row_kind[row] == 0);
        let mut ties = Ties::new(n);
        let mut free = vec![true; n];
        fixed.iter().flatten().for_each(|&row| free[row] = false);
        floating.iter().for_each(|group| ties.tie(group));
        let mut stored = vec![false; n];
        e.iter().for_each(|(_, column, _)| stored[column] = true);
        for c in (0..n).filter(|&c| row_kind[c] == 1 && !stored[c]) {
            let (rows, values) = g.col(c);
            let laws = || rows.iter().zip(values).filter(|(&r, v)| row_kind[r] == 0 && **v != 0.0);
            let rows: Vec<usize> = laws().map(|(&row, _)| row).collect();
            ties.tie(&rows);
            if laws().map(|(_, v)| v).sum::<f64>() != 0.0 {
                rows.iter().for_each(|&row| free[row] = false);
            }
        }
        let mut members = vec![Vec::new(); n];
        let mut fit = vec![true; n];
        for row in (0..n).filter(|&row| row_kind[row] == 0) {
            let root = ties.root(row);
            members[root].push(row);
            fit[root] &= free[row];
        }
        let mut first = vec![None; n];
        let mut groups = Vec::new();
        for group in floating.iter().filter(|group| group.len() > 1 && current(group)) {
            let root = ties.root(group[0]);
            let group = std::mem::take(&mut members[root]);
            if fit[root] && !group.is_empty() {
                group.iter().for_each(|&row| first[row] = Some(group[0]));
                groups.push(group);
            }
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

#[cfg(test)]
mod tests {
    use super::Floating;
    use crate::sparse::Csc;

    /// A capacitor between nodes 0 and 1; sources with the currents 4 and 5, from node 1 to node 2 and
    /// from there to `far` or to ground.
    fn example(far: Option<usize>) -> Floating {
        let e = [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
        let mut g = vec![(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (0, 0, 0.1), (0, 3, -0.1)];
        g.extend(far.map(|node| (node, 5, -1.0)));
        let matrix = |list: &[_]| Csc::from_triplets(6, 6, list);
        Floating::new(&matrix(&e), &matrix(&g), &[0, 0, 0, 0, 1, 1])
    }

    #[test]
    fn a_group_reaches_across_sources() {
        let floating = example(Some(3));
        let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        floating.sum_up(&mut rhs);
        assert_eq!(rhs, [15.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
        assert!(floating.is_sum(0) && !floating.is_sum(1));
        let sums = [(0, 4), (0, 5)].map(|place| {
            let g =
                Csc::from_triplets(6, 6, &[(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (3, 5, -1.0)]);
            let at = |e: &&(usize, usize, f64)| (e.0, e.1) == place;
            floating.with_sums(&g).iter().filter(at).map(|e| e.2).sum::<f64>()
        });
        assert_eq!(sums, [0.0; 2]);
    }

    #[test]
    fn a_source_to_ground_makes_up_for_the_sum() {
        assert!(!example(None).is_sum(0));
    }
}
