//! Loops compiled twice: for every processor, and for those with registers of four numbers. Both do
//! the same operations in the same order, so that results do not depend on the machine.

use super::matrix::Matrix;
use super::rank_one;

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

#[inline(always)]
fn tiles<const W: usize>(a: &[f64], b: &[f64], inner: usize, cols: usize, out: &mut [f64]) {
    let rows = out.len() / cols;
    let mut panel = vec![[0.0f64; W]; inner];
    for left in (0..cols).step_by(W) {
        let width = W.min(cols - left);
        for (p, b) in panel.iter_mut().zip(b.chunks_exact(cols)) {
            p[..width].copy_from_slice(&b[left..left + width]);
        }
        for top in (0..rows).step_by(HIGH) {
            let height = HIGH.min(rows - top);
            // rows beyond the last are computed twice rather than treated apart
            let four = std::array::from_fn(|i| {
                let r = top + i.min(height - 1);
                &a[r * inner..(r + 1) * inner]
            });
            let sums = tile(four, &panel);
            for (i, values) in sums.iter().enumerate().take(height) {
                let start = (top + i) * cols + left;
                out[start..start + width].copy_from_slice(&values[..width]);
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn tiles_avx2(a: &[f64], b: &[f64], inner: usize, cols: usize, out: &mut [f64]) {
    tiles::<8>(a, b, inner, cols, out);
}

/// `out = a b` for matrices by rows, `b` having `inner` rows and `cols` columns.
pub(super) fn product(a: &[f64], b: &[f64], inner: usize, cols: usize, out: &mut [f64]) {
    if out.is_empty() {
        return;
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has just been asked
        return unsafe { tiles_avx2(a, b, inner, cols, out) };
    }
    tiles::<4>(a, b, inner, cols, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn secular_avx2(poles: &[f64], weights: &[f64], rho: f64) -> Option<(Vec<f64>, Matrix)> {
    rank_one::secular(poles, weights, rho)
}

/// Roots and vectors of `diag(poles) + rho weights weights'`.
pub(super) fn secular(poles: &[f64], weights: &[f64], rho: f64) -> Option<(Vec<f64>, Matrix)> {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has just been asked
        return unsafe { secular_avx2(poles, weights, rho) };
    }
    rank_one::secular(poles, weights, rho)
}

#[cfg(test)]
mod tests {
    use crate::dense::Matrix;

    #[test]
    fn tiles_agree_with_the_plain_product() {
        for (rows, inner, cols) in [(1, 1, 1), (3, 5, 7), (4, 8, 8), (9, 2, 17), (33, 20, 12)] {
            let a = Matrix::from_fn(rows, inner, |r, c| ((r * 7 + c * 3) % 11) as f64 - 4.0);
            let b = Matrix::from_fn(inner, cols, |r, c| ((r * 5 + c * 2) % 13) as f64 - 6.0);
            assert_eq!(a.product(&b), a.times(&b));
        }
        let empty = Matrix::zeros(3, 0).product(&Matrix::zeros(0, 2));
        assert_eq!(empty, Matrix::zeros(3, 2));
    }
}
