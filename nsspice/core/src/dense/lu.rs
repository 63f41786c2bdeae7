//! LU factorisation of a small dense matrix with partial pivoting.

use super::wide::widest;
use crate::pivots::{Singular, Sizes, TRACE};
use crate::rounding::{OF_EQUATION, OF_SOLUTION};
use crate::sparse::Csc;

/// Calls a function that is compiled for each size of a small matrix, or something else for a larger one.
macro_rules! of_known_size {
    ($size:expr, $name:ident($($arg:expr),*), $larger:expr) => {
        match $size {
            1 => $name::<1>($($arg),*),
            2 => $name::<2>($($arg),*),
            3 => $name::<3>($($arg),*),
            4 => $name::<4>($($arg),*),
            5 => $name::<5>($($arg),*),
            6 => $name::<6>($($arg),*),
            7 => $name::<7>($($arg),*),
            8 => $name::<8>($($arg),*),
            9 => $name::<9>($($arg),*),
            10 => $name::<10>($($arg),*),
            11 => $name::<11>($($arg),*),
            12 => $name::<12>($($arg),*),
            13 => $name::<13>($($arg),*),
            14 => $name::<14>($($arg),*),
            15 => $name::<15>($($arg),*),
            16 => $name::<16>($($arg),*),
            _ => $larger,
        }
    };
}

widest! {
    fn eliminate_small<const N: usize>(lu: &mut DenseLu) = lu.eliminate_columns::<N>()
}

widest! {
    fn substitute_small<const N: usize>(lu: &DenseLu, x: &mut [f64]) = lu.substitute::<N>(x)
}

/// `P A = L U`, stored over `A` column by column; refactoring reuses the storage.
#[derive(Clone, Debug, Default)]
pub struct DenseLu {
    n: usize,
    /// column-major; `L` (unit diagonal, not stored) below, `U` above and on the diagonal
    lu: Vec<f64>,
    /// reciprocals of the pivots
    inverse: Vec<f64>,
    /// row exchanged with row `k` at step `k`
    swap: Vec<usize>,
    pivot_ratio: f64,
    /// the least and the largest pivot
    extremes: [f64; 2],
    singular: Option<usize>,
    hold: f64,
    /// those of the matrix itself, where something is to be held
    sizes: Box<Sizes>,
    /// the matrix itself, its columns in order, where something is to be held
    given: Vec<f64>,
    /// columns that were exchanged because they depend on those before, in this order
    put_off: Vec<(usize, usize)>,
}

impl DenseLu {
    /// Factorises a square matrix.
    pub fn new(a: &Csc) -> Self {
        let mut out = DenseLu::default();
        out.factor(a);
        out
    }

    /// See `Factor::set_hold`.
    pub fn set_hold(&mut self, hold: f64) {
        self.hold = hold;
    }

    /// See `Factor::held`.
    pub fn held(&self) -> Vec<usize> {
        let mut columns: Vec<usize> = (0..self.n).collect();
        self.put_off.iter().for_each(|&(k, other)| columns.swap(k, other));
        columns.split_off(self.n - self.put_off.len())
    }

    /// Factorises a square matrix into the storage of this one.
    pub fn factor(&mut self, a: &Csc) {
        assert_eq!(a.nrows, a.ncols, "only square matrices have an LU factorisation here");
        let n = a.nrows;
        self.factor_by(n, |lu| {
            lu.fill(0.0);
            for c in 0..n {
                let (rows, values) = a.col(c);
                for (&r, &v) in rows.iter().zip(values) {
                    lu[c * n + r] = v;
                }
            }
        });
    }

    /// Factorises a matrix of `n` columns, which `fill` writes one after the other.
    #[inline]
    pub fn factor_by(&mut self, n: usize, fill: impl FnOnce(&mut [f64])) {
        if self.n != n || self.lu.is_empty() {
            self.n = n;
            self.lu.resize(n * n, 0.0);
            self.swap.resize(n, 0);
            self.inverse.resize(n, 0.0);
        }
        fill(&mut self.lu);
        if self.hold > 0.0 {
            self.eliminate();
        } else {
            of_known_size!(n, eliminate_small(self), self.eliminate());
        }
    }

    /// As `eliminate` where nothing is held, with loops of known length.
    #[inline(always)]
    fn eliminate_columns<const N: usize>(&mut self) {
        let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
        self.singular = None;
        self.put_off.clear();
        let columns = self.lu.as_chunks_mut::<N>().0;
        let (inverse, swap) = (&mut self.inverse[..N], &mut self.swap[..N]);
        for k in 0..N {
            let (left, right) = columns.split_at_mut(k + 1);
            let column = &mut left[k];
            let (mut p, mut best) = (k, column[k].abs());
            for (i, v) in column.iter().enumerate().skip(k + 1) {
                (p, best) = if v.abs() > best { (i, v.abs()) } else { (p, best) };
            }
            swap[k] = p;
            least = least.min(best);
            greatest = greatest.max(best);
            // NaN is never the largest
            let sound = column.iter().map(|v| 0.0 * v).sum::<f64>() == 0.0;
            // also if so small that its reciprocal overflows
            if !(sound && best.is_finite() && (1.0 / best).is_finite()) {
                self.singular = Some(k);
                break;
            }
            column.swap(k, p);
            let divisor = column[k];
            inverse[k] = 1.0 / divisor;
            // zero where nothing changes, so that loops have a known length
            let mut below = [0.0; N];
            for i in 0..N {
                let quotient = column[i] / divisor;
                below[i] = if i > k { quotient } else { 0.0 };
                column[i] = if i > k { quotient } else { column[i] };
            }
            for other in right {
                other.swap(k, p);
                let u = other[k];
                if u != 0.0 {
                    for i in 0..N {
                        other[i] -= below[i] * u;
                    }
                }
            }
        }
        self.rate(least, greatest);
    }

    /// The pivot ratio from the sizes of the pivots.
    fn rate(&mut self, least: f64, greatest: f64) {
        self.extremes = [least, greatest];
        self.pivot_ratio = match self.singular {
            Some(_) => 0.0,
            None if self.n == 0 => 1.0,
            None => least / greatest,
        };
    }

    /// Right-looking elimination by columns.
    fn eliminate(&mut self) {
        let n = self.n;
        let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
        self.singular = None;
        self.put_off.clear();
        if self.hold > 0.0 {
            self.given.clone_from(&self.lu);
            let entry = |at: usize| (at % n, at / n, self.lu[at]);
            self.sizes.measure(n, (0..n * n).map(entry));
        }
        let mut last = n;
        for k in 0..n {
            let (p, best) = loop {
                if k == last {
                    self.hold_rest(k);
                }
                let column = &self.lu[k * n..(k + 1) * n];
                let (p, best) = if self.hold > 0.0 {
                    pivot_of_rows(column, k, &self.sizes)
                } else {
                    pivot(column, k)
                };
                let small =
                    self.hold > 0.0 && k < last && best <= OF_SOLUTION * self.sizes.column(k);
                // next to large entries that cancel nothing, a small pivot has all of its digits
                if !small
                    || best > (OF_EQUATION * self.terms(k, p)).max(TRACE * self.sizes.column(k))
                {
                    break (p, best);
                }
                last -= 1;
                self.exchange_columns(k, last);
            };
            self.swap[k] = p;
            if self.hold > 0.0 {
                self.sizes.swap_rows(k, p);
            }
            least = least.min(best);
            greatest = greatest.max(best);
            // also if so small that its reciprocal overflows
            if !(best.is_finite() && (1.0 / best).is_finite()) {
                self.singular = Some(k);
                break;
            }
            let (left, right) = self.lu.split_at_mut((k + 1) * n);
            let column = &mut left[k * n..];
            column.swap(k, p);
            let pivot = column[k];
            self.inverse[k] = 1.0 / pivot;
            for v in &mut column[k + 1..] {
                *v /= pivot;
            }
            for other in right.chunks_exact_mut(n) {
                other.swap(k, p);
                let u = other[k];
                if u != 0.0 {
                    for (v, l) in other[k + 1..].iter_mut().zip(&column[k + 1..]) {
                        *v -= l * u;
                    }
                }
            }
        }
        self.rate(least, greatest);
    }

    /// The size of the terms that the pivot in row `p` of column `k` is the sum of: it is `y' A x` with the
    /// rows and columns that elimination has combined.
    fn terms(&self, k: usize, p: usize) -> f64 {
        let n = self.n;
        let mut y = vec![0.0; n];
        y[p] = 1.0;
        for j in (0..k).rev() {
            let below = self.lu[j * n + j + 1..(j + 1) * n].iter().zip(&y[j + 1..]);
            y[j] -= below.map(|(l, y)| l * y).sum::<f64>();
            y.swap(j, self.swap[j]);
        }
        let mut x = self.lu[k * n..k * n + k].to_vec();
        for j in (0..k).rev() {
            x[j] *= self.inverse[j];
            for i in 0..j {
                x[i] -= self.lu[j * n + i] * x[j];
            }
        }
        x.push(1.0);
        let column = |j: usize| self.given[j * n..(j + 1) * n].iter().zip(&y);
        let size = |j: usize| column(j).map(|(a, y)| (a * y).abs()).sum::<f64>();
        x.iter().enumerate().map(|(j, x)| x.abs() * size(j)).sum()
    }

    fn exchange_columns(&mut self, k: usize, other: usize) {
        if k != other {
            let (left, right) = self.lu.split_at_mut(other * self.n);
            left[k * self.n..(k + 1) * self.n].swap_with_slice(&mut right[..self.n]);
            let (left, right) = self.given.split_at_mut(other * self.n);
            left[k * self.n..(k + 1) * self.n].swap_with_slice(&mut right[..self.n]);
            self.sizes.swap_columns(k, other);
        }
        self.put_off.push((k, other));
    }

    /// Columns from `k` on depend on those before: they are left with the rows that do, too.
    fn hold_rest(&mut self, k: usize) {
        let n = self.n;
        for c in k..n {
            self.lu[c * n + k..(c + 1) * n].fill(0.0);
            let size = self.sizes.column(c);
            let size = if size > 0.0 { size } else { 1.0 };
            self.lu[c * n + c] = self.hold * size;
        }
    }

    /// `min |u_ii| / max |u_ii|`; 0 for a singular or non-finite matrix, 1 for the empty one.
    pub fn pivot_ratio(&self) -> f64 {
        self.pivot_ratio
    }

    /// Sizes of the least and the largest pivot; infinity and zero for the empty matrix.
    pub fn extremes(&self) -> [f64; 2] {
        self.extremes
    }

    /// The first column that depends on those before it (or is not finite).
    pub fn singular(&self) -> Option<Singular> {
        self.singular.map(|column| Singular { column })
    }

    /// `x := A^-1 x`; leaves `x` alone if the matrix is singular.
    pub fn solve(&self, x: &mut [f64]) -> Result<(), Singular> {
        self.singular().map_or(Ok(()), Err)?;
        let n = self.n;
        let x = &mut x[..n];
        of_known_size!(n, substitute_small(self, x), self.substitute_any(x));
        for &(k, other) in self.put_off.iter().rev() {
            x.swap(k, other);
        }
        Ok(())
    }

    /// `x := A^-T x`; leaves `x` alone if the matrix is singular.
    pub fn solve_transposed(&self, x: &mut [f64]) -> Result<(), Singular> {
        self.singular().map_or(Ok(()), Err)?;
        let n = self.n;
        for &(k, other) in &self.put_off {
            x.swap(k, other);
        }
        for k in 0..n {
            let above = self.lu[k * n..k * n + k].iter().zip(&*x);
            x[k] = self.inverse[k] * above.fold(x[k], |rest, (u, x)| rest - u * x);
        }
        for k in (0..n).rev() {
            let below = self.lu[k * n + k + 1..(k + 1) * n].iter().zip(&x[k + 1..]);
            x[k] = below.fold(x[k], |rest, (l, x)| rest - l * x);
            x.swap(k, self.swap[k]);
        }
        Ok(())
    }

    /// As `substitute_any`, with loops of known length.
    #[inline(always)]
    fn substitute<const N: usize>(&self, x: &mut [f64]) {
        let (columns, inverse) = (&self.lu.as_chunks::<N>().0[..N], &self.inverse[..N]);
        let Some(x) = x.first_chunk_mut::<N>() else { return };
        for (k, (column, &p)) in columns.iter().zip(&self.swap).enumerate() {
            x.swap(k, p);
            let f = x[k];
            // all rows, of which those that are done stay: registers are filled without remainders
            for i in 0..N {
                x[i] = if i > k { x[i] - column[i] * f } else { x[i] };
            }
        }
        for k in (0..N).rev() {
            let f = x[k] * inverse[k];
            for i in 0..N {
                x[i] = if i < k { x[i] - columns[k][i] * f } else { x[i] };
            }
            x[k] = f;
        }
    }

    fn substitute_any(&self, x: &mut [f64]) {
        let n = self.n;
        // the columns of `L` were left unpermuted by later exchanges (as in LINPACK), so that
        // exchange and elimination alternate
        for k in 0..n {
            x.swap(k, self.swap[k]);
            let f = x[k];
            if f != 0.0 {
                let l = &self.lu[k * n + k + 1..(k + 1) * n];
                for (v, l) in x[k + 1..].iter_mut().zip(l) {
                    *v -= l * f;
                }
            }
        }
        for k in (0..n).rev() {
            let column = &self.lu[k * n..(k + 1) * n];
            let f = x[k] * self.inverse[k];
            x[k] = f;
            if f != 0.0 {
                for (v, u) in x[..k].iter_mut().zip(column) {
                    *v -= u * f;
                }
            }
        }
    }
}

/// The largest candidate for the pivot of column `k` and its size.
#[inline]
fn pivot(column: &[f64], k: usize) -> (usize, f64) {
    let (mut p, mut best) = (k, column[k].abs());
    for (i, v) in column.iter().enumerate().skip(k + 1) {
        // a NaN never compares greater: it must be let through to be reported
        if v.abs() > best || v.is_nan() {
            (p, best) = (i, v.abs());
        }
    }
    (p, best)
}

/// As `pivot`, by the part that each candidate has of its row.
fn pivot_of_rows(column: &[f64], k: usize, sizes: &Sizes) -> (usize, f64) {
    let (mut p, mut part) = (k, -1.0);
    for (i, v) in column.iter().enumerate().skip(k) {
        let own = sizes.part(*v, i);
        if own > part || own.is_nan() {
            (p, part) = (i, own);
        }
    }
    p = sizes.own_row(k, column.iter().copied().enumerate().skip(k)).unwrap_or(p);
    (p, column[p].abs())
}
