//! Orthonormal bases by Householder reflections.

use crate::dense::{norm, Matrix};

/// Orthogonal factor of a tall matrix, and its triangle: `A = Q[:, ..k] R`.
pub(in crate::modewise) fn full_qr(a: &Matrix) -> (Matrix, Matrix) {
    let mut w = a.clone();
    let mut q = Matrix::identity(a.rows);
    for k in 0..a.cols.min(a.rows) {
        reflect(&mut w, &mut q, k, k);
    }
    let r = Matrix::from_fn(a.cols, a.cols, |i, j| if i <= j { w[(i, j)] } else { 0.0 });
    (q, r)
}

/// The same for a matrix whose rows differ much in size: errors in each row are rounding of that row, and rows of
/// zeros have axes of their own.  `R` is a triangle but for the order of its columns.
///
/// Rows are sorted by size and columns chosen by size (A. J. Cox, N. J. Higham, *Stability of Householder QR
/// factorization for weighted least squares problems*, 1998).  Of a loop of capacitors with an inductor, states
/// that rest would otherwise turn towards those that decay within picoseconds, and move with their rounding.
pub(in crate::modewise) fn graded_qr(a: &Matrix) -> (Matrix, Matrix) {
    let (rows, cols) = (a.rows, a.cols);
    let sizes: Vec<f64> = (0..rows).map(|r| norm(a.row(r))).collect();
    let mut order: Vec<usize> = (0..rows).collect();
    order.sort_by(|&i, &j| sizes[j].total_cmp(&sizes[i]));
    let mut w = a.select_rows(&order);
    let mut q = Matrix::identity(rows);
    let mut left: Vec<usize> = (0..cols).collect();
    for k in 0..cols.min(rows) {
        let rest = |&c: &usize| norm(&column_from(&w, k, c));
        let most = left.iter().map(rest).enumerate().max_by(|i, j| i.1.total_cmp(&j.1));
        let Some(c) = most.map(|(at, _)| left.swap_remove(at)) else { break };
        reflect(&mut w, &mut q, k, c);
        (k + 1..rows).for_each(|r| w[(r, c)] = 0.0);
    }
    let mut places = vec![0; rows];
    order.iter().enumerate().for_each(|(k, &r)| places[r] = k);
    (q.select_rows(&places), Matrix::from_fn(cols, cols, |i, j| w[(i, j)]))
}

/// A column from row `k` on.
fn column_from(w: &Matrix, k: usize, column: usize) -> Vec<f64> {
    (k..w.rows).map(|r| w[(r, column)]).collect()
}

/// Turns what is left of a column to the axis `k`.
fn reflect(w: &mut Matrix, q: &mut Matrix, k: usize, column: usize) {
    let mut v = column_from(w, k, column);
    let size = norm(&v);
    if size == 0.0 {
        return;
    }
    v[0] += size.copysign(v[0]);
    let f = 2.0 / v.iter().map(|x| x * x).sum::<f64>();
    for c in 0..w.cols {
        let s: f64 = v.iter().enumerate().map(|(i, x)| x * w[(k + i, c)]).sum::<f64>() * f;
        v.iter().enumerate().for_each(|(i, x)| w[(k + i, c)] -= s * x);
    }
    for r in 0..q.rows {
        let row = &mut q.row_mut(r)[k..];
        let s: f64 = v.iter().zip(&*row).map(|(x, y)| x * y).sum::<f64>() * f;
        row.iter_mut().zip(&v).for_each(|(y, x)| *y -= s * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A state that no constraint touches keeps its axis; small entries keep their digits next to large ones.
    #[test]
    fn constraints_of_uneven_size() {
        let a = Matrix { rows: 4, cols: 2, data: vec![0.0, 0.0, 3e-8, 1e-8, 1.0, 0.0, -4.0, 1e-3] };
        let (q, r) = graded_qr(&a);
        let product = q.columns(0, 2).times(&r);
        for row in 0..4 {
            for c in 0..2 {
                let error = (product[(row, c)] - a[(row, c)]).abs();
                assert!(error <= 4e-15 * norm(a.row(row)), "{row} {c} {error}");
            }
        }
        assert!((1..4).all(|k| q[(0, k)] == 0.0 || q[(0, k)].abs() == 1.0));
        let still = (0..4).filter(|&c| q[(0, c)].abs() == 1.0).count();
        assert_eq!(still, 1);
        let kernel = q.columns(2, 2);
        let left = a.transpose_times(&kernel);
        let size = a.abs().transpose_times(&kernel.abs());
        for (v, s) in left.data.iter().zip(&size.data) {
            assert!(v.abs() <= 8e-16 * s, "{v} {s}");
        }
        let mut unit = q.transpose_times(&q);
        unit.add_scaled(-1.0, &Matrix::identity(4));
        assert!(unit.max_abs() < 1e-15);
    }
}
