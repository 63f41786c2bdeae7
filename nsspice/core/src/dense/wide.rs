//! Loops compiled twice: for every processor, and for those with registers of four numbers. Both do
//! the same operations in the same order, so that results do not depend on the machine.

use super::matrix::{self, dot, larger, Matrix};
use super::rank_one;

/// Defines a function by one or two of the same arguments: what it is where there are registers of
/// four numbers, compiled for them, and what it is elsewhere.
macro_rules! widest {
    ($(#[$doc:meta])* $visible:vis fn $name:ident $(<const $flag:ident: $of:ty>)?
     ($($arg:ident: $kind:ty),* $(,)?) $(-> $out:ty)? = $wide:expr, $narrow:expr) => {
        $(#[$doc])*
        $visible fn $name $(<const $flag: $of>)? ($($arg: $kind),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn wide $(<const $flag: $of>)? ($($arg: $kind),*) $(-> $out)? {
                $wide
            }
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2")
                && std::arch::is_x86_feature_detected!("fma")
            {
                // SAFETY: the processor has just been asked
                return unsafe { wide $(::<$flag>)? ($($arg),*) };
            }
            // out of line: callers would prepare for its loops each time
            #[cfg_attr(target_arch = "x86_64", cold)]
            #[inline(never)]
            fn narrow $(<const $flag: $of>)? ($($arg: $kind),*) $(-> $out)? {
                $narrow
            }
            narrow $(::<$flag>)? ($($arg),*)
        }
    };
    ($(#[$doc:meta])* $visible:vis fn $name:ident $(<const $flag:ident: $of:ty>)?
     ($($arg:ident: $kind:ty),* $(,)?) $(-> $out:ty)? = $both:expr) => {
        widest! {
            $(#[$doc])*
            $visible fn $name $(<const $flag: $of>)? ($($arg: $kind),*) $(-> $out)? = $both, $both
        }
    };
}

pub(crate) use widest;

/// Numbers side by side, each from its place.
#[inline(always)]
pub(crate) fn each<const W: usize>(f: impl Fn(usize) -> f64) -> [f64; W] {
    let mut out = [0.0; W];
    for (i, o) in out.iter_mut().enumerate() {
        *o = f(i);
    }
    out
}

/// Rows of a tile.
const HIGH: usize = 4;

/// Four rows times a panel of some columns.
#[inline(always)]
fn tile<const W: usize>(rows: [&[f64]; HIGH], panel: &[[f64; W]]) -> [[f64; W]; HIGH] {
    let mut sums = [[0.0f64; W]; HIGH];
    let [r0, r1, r2, r3] = rows.map(|r| &r[..panel.len()]);
    for ((((p, a), b), c), d) in panel.iter().zip(r0).zip(r1).zip(r2).zip(r3) {
        for j in 0..W {
            sums[0][j] += a * p[j];
            sums[1][j] += b * p[j];
            sums[2][j] += c * p[j];
            sums[3][j] += d * p[j];
        }
    }
    sums
}

/// The first rows and columns of `out` become `a b`, or `a b'` if `TURNED`; `b` may be smaller.
#[inline(always)]
fn tiles<const W: usize, const TURNED: bool>(a: &Matrix, b: &Matrix, out: &mut Matrix) {
    let (inner, cols) = if TURNED { (b.cols, b.rows) } else { (b.rows, b.cols) };
    let rows = out.rows;
    let mut panel = vec![[0.0f64; W]; inner];
    for left in (0..cols).step_by(W) {
        let width = W.min(cols - left);
        if TURNED {
            for j in 0..width {
                panel.iter_mut().zip(b.row(left + j)).for_each(|(p, v)| p[j] = *v);
            }
        } else {
            for (k, p) in panel.iter_mut().enumerate() {
                p[..width].copy_from_slice(&b.row(k)[left..left + width]);
            }
        }
        for top in (0..rows).step_by(HIGH) {
            let height = HIGH.min(rows - top);
            // rows beyond the last are computed twice rather than treated apart
            let four = std::array::from_fn(|i| &a.row(top + i.min(height - 1))[..inner]);
            let sums = tile(four, &panel);
            for (i, values) in sums.iter().enumerate().take(height) {
                out.row_mut(top + i)[left..left + width].copy_from_slice(&values[..width]);
            }
        }
    }
}

widest! {
    fn fastest_tiles<const TURNED: bool>(a: &Matrix, b: &Matrix, out: &mut Matrix) =
        tiles::<8, TURNED>(a, b, out), tiles::<4, TURNED>(a, b, out)
}

/// `out = a b`
pub(super) fn product(a: &Matrix, b: &Matrix, out: &mut Matrix) {
    fastest_tiles::<false>(a, b, out);
}

/// The first columns of `out` become `a b'`; `a` may have more columns than `b`.
pub(super) fn product_transposed(a: &Matrix, b: &Matrix, out: &mut Matrix) {
    fastest_tiles::<true>(a, b, out);
}

widest! {
    /// `B - A X`, see [`matrix::residual`].
    pub(super) fn residual(a: &Matrix, x: &Matrix, b: &Matrix) -> Matrix = matrix::residual(a, x, b)
}

widest! {
    /// Roots and, row by row, vectors of `diag(poles) + rho weights weights'`; `shifted` is work space.
    pub(super) fn secular(
        poles: &[f64],
        weights: &[f64],
        rho: f64,
        shifted: &mut Vec<f64>,
        vectors: &mut Matrix,
        roots: &mut Vec<f64>,
    ) -> Option<()> =
        rank_one::secular(poles, weights, rho, shifted, vectors, roots)
}

/// Scalar products of two rows with two vectors, and of their absolute values with a third.
#[inline(always)]
fn two_looks(rows: [&[f64]; 2], with: [&[f64]; 3]) -> [[f64; 3]; 2] {
    type Four = [f64; 4];
    let plus = |sum: Four, c: &Four, x: &Four| -> Four { each(|k| sum[k] + c[k] * x[k]) };
    let ([a4, b4], [a, b]) = split(rows);
    let ([v4, s4, w4], [v, s, w]) = split(with);
    let [mut va, mut sa, mut wa, mut vb, mut sb, mut wb] = [[0.0; 4]; 6];
    for ((((a, b), v), s), w) in a4.iter().zip(b4).zip(v4).zip(s4).zip(w4) {
        (va, sa, wa) = (plus(va, a, v), plus(sa, a, s), plus(wa, &a.map(f64::abs), w));
        (vb, sb, wb) = (plus(vb, b, v), plus(sb, b, s), plus(wb, &b.map(f64::abs), w));
    }
    let end = |four: Four, c: &[f64], x: &[f64]| total(&four) + dot(c, x);
    let size = |four: Four, c: &[f64]| {
        total(&four) + c.iter().zip(w).map(|(c, x)| c.abs() * x).sum::<f64>()
    };
    [[end(va, a, v), end(sa, a, s), size(wa, a)], [end(vb, b, v), end(sb, b, s), size(wb, b)]]
}

/// Sum of four numbers. Out of line: where compilers see that numbers side by side are added up in
/// the end, they keep them in an order that costs more in each turn of the loop than the sum.
#[inline(never)]
fn total(four: &[f64; 4]) -> f64 {
    four.iter().sum()
}

/// What of vectors comes in fours, and the rest.
#[inline(always)]
fn split<const N: usize>(vectors: [&[f64]; N]) -> ([&[[f64; 4]]; N], [&[f64]; N]) {
    let parts = vectors.map(|x| x.as_chunks::<4>());
    (parts.map(|p| p.0), parts.map(|p| p.1))
}

/// Scalar products of each row with two vectors, and of its absolute values with a third; two rows
/// at a time, since the sums of one would wait for each other.
#[inline(always)]
fn looks_any(factor: &[f64], with: [&[f64]; 3], out: [&mut [f64]; 3]) {
    let slots = with[2].len();
    if slots == 0 {
        return out.into_iter().for_each(|o| o.fill(0.0));
    }
    let with = with.map(|x| &x[..slots]);
    let count = (factor.len() / slots).min(out[0].len());
    let [values, slopes, bounds] = out.map(|o| &mut o[..count]);
    let row = |j: usize| &factor[j * slots..][..slots];
    for j in (0..count).step_by(2) {
        let last = (j + 1).min(count - 1); // of an odd number the last is taken twice
        let both = two_looks([row(j), row(last)], with);
        for (at, [value, slope, bound]) in [j, last].into_iter().zip(both) {
            (values[at], slopes[at], bounds[at]) = (value, slope, bound);
        }
    }
}

widest! {
    /// For each row of factors its scalar products with two vectors, and that of its absolute values
    /// with a third.
    pub fn looks(factor: &[f64], with: [&[f64]; 3], out: [&mut [f64]; 3]) =
        looks_any(factor, with, out)
}

/// Rows of this length are worth the question what the processor can.
pub(super) const LONG: usize = 16;

#[inline(always)]
fn apply_any(rows: &[f64], x: &[f64], out: &mut [f64]) {
    for (o, row) in out.iter_mut().zip(rows.chunks_exact(x.len().max(1))) {
        *o = dot(row, x);
    }
}

widest! {
    /// Scalar products of rows with a vector as long as they are.
    pub(super) fn apply(rows: &[f64], x: &[f64], out: &mut [f64]) = apply_any(rows, x, out)
}

#[inline(always)]
fn polynomials_any(coefficients: &[Vec<f64>], s: f64, out: &mut [f64]) {
    let (eights, rest) = out.as_chunks_mut::<8>();
    let inside = 8 * eights.len();
    for (k, out) in eights.iter_mut().enumerate() {
        let mut sums = [0.0; 8];
        for c in coefficients.iter().rev() {
            let c = &c[8 * k..][..8];
            sums = each(|j| sums[j] * s + c[j]);
        }
        *out = sums;
    }
    for (k, out) in rest.iter_mut().enumerate() {
        *out = coefficients.iter().rev().fold(0.0, |sum, c| sum * s + c[inside + k]);
    }
}

widest! {
    /// Values at `s` of polynomials, given by the coefficients of each power of all of them.
    pub fn polynomials(coefficients: &[Vec<f64>], s: f64, out: &mut [f64]) =
        polynomials_any(coefficients, s, out)
}

#[inline(always)]
fn largest_any(list: &[f64]) -> f64 {
    let (eights, rest) = list.as_chunks::<8>();
    let most: [f64; 8] = eights.iter().fold([0.0; 8], |m, x| each(|k| larger(x[k].abs(), m[k])));
    most.iter().chain(rest).fold(0.0, |m, x| larger(x.abs(), m))
}

widest! {
    /// The largest absolute value; NaN is skipped.
    pub fn largest(list: &[f64]) -> f64 = largest_any(list)
}

#[inline(always)]
fn largest_of_kinds_any(list: &[f64], kinds: &[u8]) -> [f64; 2] {
    let count = list.len().min(kinds.len());
    let ((eights, rest), (of_eights, of_rest)) =
        (list[..count].as_chunks::<8>(), kinds[..count].as_chunks::<8>());
    let mut most = [[0.0; 8]; 2];
    for (x, kinds) in eights.iter().zip(of_eights) {
        let only = |k: usize, kind: u8| if kinds[k] == kind { x[k].abs() } else { 0.0 };
        most[0] = each(|k| larger(only(k, 0), most[0][k]));
        most[1] = each(|k| larger(only(k, 1), most[1][k]));
    }
    let mut out = most.map(|eight| largest_any(&eight));
    for (x, &kind) in rest.iter().zip(of_rest) {
        let out = &mut out[usize::from(kind != 0)];
        *out = larger(x.abs(), *out);
    }
    out
}

widest! {
    /// The largest absolute values of those that are of the kind 0, and of the kind 1; NaN is skipped.
    pub fn largest_of_kinds(list: &[f64], kinds: &[u8]) -> [f64; 2] =
        largest_of_kinds_any(list, kinds)
}

#[inline(always)]
fn collapse_any(row: &[f64], common: &[f64], own: &[f64], out: &mut [f64]) {
    let n = row.len();
    let (shared, rest) = out.split_at_mut(out.len() - n);
    for (o, common) in shared.iter_mut().zip(common.chunks_exact(n.max(1))) {
        *o += dot(row, common);
    }
    for ((o, w), own) in rest.iter_mut().zip(row).zip(own) {
        *o = w * own;
    }
}

widest! {
    /// `out = [out + common row; own * row]`: the factors of shared terms (`common` by rows) and of
    /// those that each coordinate has to itself.
    pub fn collapse(row: &[f64], common: &[f64], own: &[f64], out: &mut [f64]) =
        collapse_any(row, common, own, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::Matrix;

    #[test]
    fn looks_are_scalar_products() {
        for (count, slots) in [(1, 1), (3, 4), (5, 7), (2, 33)] {
            let c = Matrix::from_fn(count, slots, |r, k| ((r * 7 + k * 3) % 11) as f64 - 4.0);
            let with = Matrix::from_fn(3, slots, |r, k| ((r * 5 + k * 2) % 13) as f64 - 6.0);
            let mut out = Matrix::zeros(3, count);
            let (a, rest) = out.data.split_at_mut(count);
            let (b, d) = rest.split_at_mut(count);
            looks(&c.data, [with.row(0), with.row(1), with.row(2)], [a, b, d]);
            for j in 0..count {
                assert_eq!(out[(0, j)], dot(c.row(j), with.row(0)));
                assert_eq!(out[(1, j)], dot(c.row(j), with.row(1)));
                assert_eq!(out[(2, j)], dot(&c.abs().data[j * slots..][..slots], with.row(2)));
            }
        }
    }

    #[test]
    fn polynomials_and_largest_values_are_those_of_one_at_a_time() {
        for count in [1, 7, 8, 19] {
            let row = |k: usize| (0..count).map(|j| ((j * 7 + k * 5) % 11) as f64 - 4.0).collect();
            let rows: Vec<Vec<f64>> = (0..4).map(row).collect();
            let mut out = vec![0.0; count];
            polynomials(&rows, 0.5, &mut out);
            // halves and eighths of small integers are not rounded
            for (j, value) in out.iter().enumerate() {
                let powers = [1.0, 0.5, 0.25, 0.125];
                assert_eq!(*value, rows.iter().zip(powers).map(|(c, p)| p * c[j]).sum::<f64>());
            }
            out[count / 2] = -1e3;
            assert_eq!(largest(&out), 1e3);
            let kinds: Vec<u8> = (0..count).map(|k| u8::from(k == count / 2)).collect();
            let others = out.iter().filter(|v| **v != -1e3).fold(0.0, |m, v| v.abs().max(m));
            assert_eq!(largest_of_kinds(&out, &kinds), [others, 1e3]);
        }
    }

    #[test]
    fn tiles_agree_with_the_plain_product() {
        for (rows, inner, cols) in [(1, 1, 1), (3, 5, 7), (4, 8, 8), (9, 2, 17), (33, 20, 12)] {
            let a = Matrix::from_fn(rows, inner, |r, c| ((r * 7 + c * 3) % 11) as f64 - 4.0);
            let b = Matrix::from_fn(inner, cols, |r, c| ((r * 5 + c * 2) % 13) as f64 - 6.0);
            assert_eq!(a.product(&b), a.times(&b));
            let mut out = Matrix::zeros(rows, cols + 1);
            product_transposed(&a.beside(&a), &b.transpose(), &mut out);
            assert_eq!(out, a.times(&b).beside(&Matrix::zeros(rows, 1)));
        }
        let empty = Matrix::zeros(3, 0).product(&Matrix::zeros(0, 2));
        assert_eq!(empty, Matrix::zeros(3, 2));
    }
}
