//! A problem prepared for solving: one matrix, its scaling, and the Jacobian of any mode.

use super::equilibrate::equilibrate;
use super::problem::Problem;
use crate::dominance::dominates;
use crate::linear::{ordering, DENSE_LIMIT};
use crate::rounding::OF_SOLUTION;
use crate::sparse::{Csc, Ordering};
use std::sync::{Arc, OnceLock};

/// `H = [[K, A], [-B, D]]`, the scaling, and the fixed pattern of all mode Jacobians.
pub(crate) struct Model {
    pub n: usize,
    pub m: usize,
    /// physical units
    pub h: Csc,
    /// physical unknown = scale * scaled unknown; also multiplies the rows of `H`
    pub scale: Vec<f64>,
    /// current rows in which a multiplier appears
    pub touched: Vec<usize>,
    row_kind: Vec<u8>,
    /// `diag(scale) H diag(scale)` with a full diagonal
    pub scaled: Csc,
    /// order of elimination, the same for all modes
    pub ordering: Arc<Ordering>,
    /// memory of one factored mode [bytes], roughly
    pub factor_bytes: usize,
    monotone: OnceLock<bool>,
}

impl Model {
    pub fn new(problem: Problem) -> Model {
        let (n, m) = (problem.n(), problem.m());
        assert_eq!(problem.k.ncols, n, "K must be square");
        assert_eq!((problem.a.nrows, problem.a.ncols), (n, m), "A must be n x m");
        assert_eq!((problem.b.nrows, problem.b.ncols), (m, n), "B must be m x n");
        assert_eq!(problem.d.ncols, m, "D must be square");
        assert_eq!(problem.row_kind.len(), n, "one kind per row of K");
        let h = problem.matrix();
        let scale = equilibrate(&h);
        let mut entries: Vec<_> =
            h.iter().map(|(r, c, v)| (r, c, scale[r] * v * scale[c])).collect();
        entries.extend((0..n + m).map(|i| (i, i, 0.0)));
        let scaled = Csc::from_triplets(n + m, n + m, &entries);
        let ordering = Arc::new(ordering(&scaled, m));
        let mut touched: Vec<_> = problem.a.iter().map(|(r, _, _)| r).collect();
        touched.retain(|&r| problem.row_kind[r] == 0);
        touched.sort_unstable();
        touched.dedup();
        Model {
            n,
            m,
            h,
            scale,
            touched,
            row_kind: problem.row_kind,
            ordering,
            factor_bytes: factor_bytes(&scaled),
            scaled,
            monotone: OnceLock::new(),
        }
    }

    /// Number of unknowns `[z; l]`.
    pub fn size(&self) -> usize {
        self.n + self.m
    }

    /// 0 for a current row, 1 for a voltage row.
    pub fn kind(&self, row: usize) -> usize {
        usize::from(self.row_kind[row] != 0)
    }

    /// Sum of the sizes of the conductances (resistances) in a row: what multiplies unknowns of its kind.
    pub fn own_kind(&self, row: usize) -> f64 {
        let own = self.h.iter().filter(|&(r, c, _)| r == row && c < self.n);
        own.filter(|&(_, c, _)| self.kind(c) == self.kind(row)).map(|(.., v)| v.abs()).sum()
    }

    /// `out = f - H x`
    pub fn defect(&self, f: &[f64], x: &[f64], out: &mut [f64]) {
        out.copy_from_slice(f);
        self.h.mul_add(-1.0, x, out);
    }

    /// `out = |H| |x| + |f|`, the scale of rounding in the defect
    pub fn terms(&self, f: &[f64], x: &[f64], out: &mut [f64]) {
        for (o, v) in out.iter_mut().zip(f) {
            *o = v.abs();
        }
        self.h.abs_mul_add(x, out);
    }

    /// Both of the above in one pass.
    pub fn defect_and_terms(&self, f: &[f64], x: &[f64], defect: &mut [f64], terms: &mut [f64]) {
        defect.copy_from_slice(f);
        for (t, v) in terms.iter_mut().zip(f) {
            *t = v.abs();
        }
        for (c, &xc) in x.iter().enumerate() {
            if xc == 0.0 {
                continue;
            }
            let (rows, values) = self.h.col(c);
            for (&r, &v) in rows.iter().zip(values) {
                let term = v * xc;
                defect[r] -= term;
                terms[r] += term.abs();
            }
        }
    }

    /// Size of the terms that multiplier `i` balances, in its own unit.
    pub fn multiplier_terms(&self, i: usize, terms: &[f64]) -> f64 {
        let (rows, values) = self.h.col(self.n + i);
        let pairs = rows.iter().zip(values).take_while(|(&r, _)| r < self.n);
        pairs.fold(
            0.0f64,
            |size, (&r, &v)| if v == 0.0 { size } else { size.max(terms[r] / v.abs()) },
        )
    }

    /// Values (in the pattern of `scaled`) of the Jacobian in which the row of pair `i` is
    /// `weight[i]` times its slack equation plus `1 - weight[i]` times `l_i`, with `mu` added to
    /// the diagonal of the equations.  Weights 1 and 0 give an active and an inactive pair.
    pub fn jacobian(&self, weight: impl Fn(usize) -> f64, mu: f64, values: &mut Vec<f64>) {
        let n = self.n;
        values.clear();
        values.reserve(self.scaled.values.len());
        for c in 0..self.size() {
            let (rows, base) = self.scaled.col(c);
            for (&r, &v) in rows.iter().zip(base) {
                let shifted = if r == c { v + mu } else { v };
                values.push(if r < n {
                    shifted
                } else {
                    let t = weight(r - n);
                    let unit = if r == c { 1.0 - t } else { 0.0 };
                    if t == 0.0 {
                        unit
                    } else {
                        t * shifted + unit
                    }
                });
            }
        }
    }

    /// Jacobian of a mode, `mu` added to its equations.
    pub fn mode_jacobian(&self, active: &[bool], mu: f64) -> Csc {
        let mut jacobian = self.scaled.clone();
        self.jacobian(|i| f64::from(u8::from(active[i])), mu, &mut jacobian.values);
        jacobian
    }

    /// Rewrites the row of one pair in the Jacobian of a mode.
    pub fn rewrite_row(&self, pair: usize, active: bool, mu: f64, jacobian: &mut Csc) {
        let row = self.n + pair;
        for &(c, at) in self.ordering.row(row) {
            let (diagonal, at) = (c as usize == row, at as usize);
            jacobian.values[at] = match (active, diagonal) {
                (true, true) => self.scaled.values[at] + mu,
                (true, false) => self.scaled.values[at],
                (false, true) => 1.0,
                (false, false) => 0.0,
            };
        }
    }

    /// True if the symmetric part of `H` is known to be positive semidefinite: then a linear
    /// complementarity problem is solvable exactly if it is feasible.
    pub fn monotone(&self) -> bool {
        *self.monotone.get_or_init(|| positive_semidefinite(&self.scaled))
    }
}

/// Dense factors are square; sparse ones have, on circuits, a few times the entries of the matrix.
fn factor_bytes(matrix: &Csc) -> usize {
    let n = matrix.nrows;
    if n <= DENSE_LIMIT {
        8 * n * (n + 1)
    } else {
        16 * (6 * matrix.values.len() + 8 * n)
    }
}

/// Cholesky with diagonal pivoting on the symmetric part; beyond 600 unknowns only diagonal
/// dominance is tried.
fn positive_semidefinite(matrix: &Csc) -> bool {
    if dominates(matrix) {
        return true;
    }
    let n = matrix.nrows;
    if n > 600 {
        return false;
    }
    let symmetric: Vec<_> =
        matrix.iter().flat_map(|(r, c, v)| [(r, c, 0.5 * v), (c, r, 0.5 * v)]).collect();
    let symmetric = Csc::from_triplets(n, n, &symmetric);
    let mut s = vec![0.0; n * n];
    for (r, c, v) in symmetric.iter() {
        s[r * n + c] = v;
    }
    let mut left: Vec<usize> = (0..n).collect();
    while let Some((at, _)) =
        left.iter().enumerate().max_by(|x, y| s[x.1 * n + x.1].total_cmp(&s[y.1 * n + y.1]))
    {
        let p = left.swap_remove(at);
        let pivot = s[p * n + p];
        if pivot <= OF_SOLUTION {
            // all remaining diagonals are at most that: the rest must vanish altogether
            left.push(p);
            let root = OF_SOLUTION.sqrt();
            return left.iter().all(|&i| {
                s[i * n + i] >= -OF_SOLUTION && left.iter().all(|&j| s[i * n + j].abs() <= root)
            });
        }
        for &i in &left {
            let factor = s[i * n + p] / pivot;
            if factor != 0.0 {
                for &j in &left {
                    s[i * n + j] -= factor * s[p * n + j];
                }
            }
        }
    }
    true
}
