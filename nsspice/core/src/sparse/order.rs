//! The elimination order of a mode Jacobian: short dependency paths, usable diagonal pivots.

use super::dissection::dissect;
use super::graph::Graph;
use super::placement::place;
use super::Csc;

/// The elimination order for one pattern, computed once and shared by all factorisations.
///
/// The matrix is `[[K, A], [R]]`; the last `pairs` rows belong to complementarity pairs and change
/// with the mode: the row of pair `i` holds `[-B_i, D_i]` if the pair conducts and the unit row
/// `l_i = 0` if it does not.  The pattern is the union of both, with a full diagonal.
///
/// The unknowns of `K` are ordered by nested dissection where small separators exist and by
/// approximate minimum degree elsewhere.  A row without a diagonal entry (a pair without
/// resistance, a voltage source) follows a neighbour whose elimination fills its diagonal, so that
/// the diagonal pivot serves in every mode and a mode change keeps the order of the pivots.
#[derive(Clone, Debug)]
pub struct Ordering {
    /// column (and preferred pivot row) eliminated at each position
    pub(super) order: Vec<u32>,
    /// position of each column
    pub(super) position: Vec<u32>,
    /// rows from here on change with the mode
    pub(super) first_switching: usize,
    row_start: Vec<u32>,
    row_entries: Vec<(u32, u32)>,
}

impl Ordering {
    /// Orders a square matrix, the last `pairs` rows of which change with the mode.  The values
    /// serve only to mark a diagonal entry that is always zero.
    pub fn new(matrix: &Csc, pairs: usize) -> Self {
        let mut out = Ordering::natural(matrix, pairs);
        let graph = Graph::contracted(matrix, &out);
        out.order = place(matrix, &out, &graph, &dissect(&graph, pairs > 0));
        for (k, &c) in out.order.iter().enumerate() {
            out.position[c as usize] = k as u32;
        }
        out
    }

    /// The columns as they are.
    pub fn natural(matrix: &Csc, pairs: usize) -> Self {
        assert_eq!(matrix.nrows, matrix.ncols, "only square matrices are ordered");
        assert!(pairs <= matrix.nrows, "more pairs than rows");
        let n = matrix.nrows;
        let (row_start, row_entries) = by_rows(matrix);
        let order: Vec<u32> = (0..n as u32).collect();
        let position = order.clone();
        Ordering { order, position, first_switching: n - pairs, row_start, row_entries }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// The entries of one row: column, and index into the values of the matrix.  Changing the mode
    /// of a pair means rewriting these.
    pub fn row(&self, row: usize) -> &[(u32, u32)] {
        &self.row_entries[self.row_start[row] as usize..self.row_start[row + 1] as usize]
    }

    /// Rows and columns that share an entry with `v`, `v` itself included; some appear twice.
    pub(super) fn neighbours<'a>(
        &'a self,
        matrix: &'a Csc,
        v: usize,
    ) -> impl Iterator<Item = usize> + 'a {
        let column = matrix.col(v).0.iter().copied();
        column.chain(self.row(v).iter().map(|e| e.0 as usize))
    }
}

/// The pattern by rows: start of each row, and (column, index into the values) of its entries.
fn by_rows(matrix: &Csc) -> (Vec<u32>, Vec<(u32, u32)>) {
    let entries = matrix.rowidx.len();
    assert!(entries < u32::MAX as usize && matrix.nrows < u32::MAX as usize, "matrix too large");
    let mut start = vec![0u32; matrix.nrows + 1];
    for &r in &matrix.rowidx {
        start[r + 1] += 1;
    }
    for r in 0..matrix.nrows {
        start[r + 1] += start[r];
    }
    let mut next = start.clone();
    let mut list = vec![(0u32, 0u32); entries];
    for c in 0..matrix.ncols {
        for p in matrix.colptr[c]..matrix.colptr[c + 1] {
            let slot = &mut next[matrix.rowidx[p]];
            list[*slot as usize] = (c as u32, p as u32);
            *slot += 1;
        }
    }
    (start, list)
}
