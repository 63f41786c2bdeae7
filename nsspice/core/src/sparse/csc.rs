//! Sparse matrices in compressed-column form.

/// A sparse matrix; row numbers ascend within each column and are unique.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Csc {
    /// number of rows
    pub nrows: usize,
    /// number of columns
    pub ncols: usize,
    /// start of each column, length `ncols + 1`
    pub colptr: Vec<usize>,
    /// row of each entry
    pub rowidx: Vec<usize>,
    /// value of each entry
    pub values: Vec<f64>,
}

impl Csc {
    /// The zero matrix.
    pub fn zeros(nrows: usize, ncols: usize) -> Self {
        Csc { nrows, ncols, colptr: vec![0; ncols + 1], rowidx: Vec::new(), values: Vec::new() }
    }

    /// Sums entries with equal position; entries that cancel to zero stay in the pattern, so that
    /// the pattern depends on the positions only.
    pub fn from_triplets(nrows: usize, ncols: usize, entries: &[(usize, usize, f64)]) -> Self {
        let mut count = vec![0usize; ncols + 1];
        for &(_, c, _) in entries {
            count[c + 1] += 1;
        }
        for c in 0..ncols {
            count[c + 1] += count[c];
        }
        let mut next = count.clone();
        let mut raw = vec![(0usize, 0.0f64); entries.len()];
        for &(r, c, v) in entries {
            raw[next[c]] = (r, v);
            next[c] += 1;
        }
        let mut out = Csc::zeros(nrows, ncols);
        for c in 0..ncols {
            let column = &mut raw[count[c]..count[c + 1]];
            column.sort_by_key(|e| e.0);
            for &(r, v) in column.iter() {
                if out.rowidx.len() > out.colptr[c] && *out.rowidx.last().unwrap() == r {
                    *out.values.last_mut().unwrap() += v;
                } else {
                    out.rowidx.push(r);
                    out.values.push(v);
                }
            }
            out.colptr[c + 1] = out.rowidx.len();
        }
        out
    }

    /// An entry; zero where none is kept.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        let (rows, values) = self.col(column);
        rows.iter().zip(values).filter(|e| *e.0 == row).map(|e| e.1).sum()
    }

    /// Row numbers and values of one column.
    pub fn col(&self, c: usize) -> (&[usize], &[f64]) {
        let range = self.colptr[c]..self.colptr[c + 1];
        (&self.rowidx[range.clone()], &self.values[range])
    }

    /// Row numbers and values of one column, without zeros.
    pub fn nonzeros(&self, c: usize) -> Vec<(usize, f64)> {
        let (rows, values) = self.col(c);
        rows.iter().copied().zip(values.iter().copied()).filter(|e| e.1 != 0.0).collect()
    }

    /// Row numbers and values of all columns.
    #[inline]
    fn columns(&self) -> impl Iterator<Item = (&[usize], &[f64])> {
        self.colptr.windows(2).map(|ends| {
            let range = ends[0]..ends[1];
            (&self.rowidx[range.clone()], &self.values[range])
        })
    }

    /// All entries as (row, column, value).
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, f64)> + Clone + '_ {
        (0..self.ncols).flat_map(move |c| {
            let (rows, values) = self.col(c);
            rows.iter().zip(values).map(move |(&r, &v)| (r, c, v))
        })
    }

    /// The transposed matrix.
    pub fn transpose(&self) -> Csc {
        let entries: Vec<_> = self.iter().map(|(r, c, v)| (c, r, v)).collect();
        Csc::from_triplets(self.ncols, self.nrows, &entries)
    }

    /// Scalar product of column `c` with `x`; on a transposed matrix a row of a product.
    #[inline]
    pub fn col_dot(&self, c: usize, x: &[f64]) -> f64 {
        let (rows, values) = self.col(c);
        rows.iter().zip(values).map(|(&r, &v)| v * x[r]).sum()
    }

    /// `y += factor * self * x`
    pub fn mul_add(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for ((rows, values), &xc) in self.columns().zip(x) {
            let f = factor * xc;
            if f != 0.0 {
                for (&r, &v) in rows.iter().zip(values) {
                    y[r] += f * v;
                }
            }
        }
    }

    /// `y += |self| * |x|`, the scale of rounding in `self * x`
    pub fn abs_mul_add(&self, x: &[f64], y: &mut [f64]) {
        for ((rows, values), &xc) in self.columns().zip(x) {
            for (&r, &v) in rows.iter().zip(values) {
                y[r] += v.abs() * xc.abs();
            }
        }
    }
}
