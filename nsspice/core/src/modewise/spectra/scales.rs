//! Fast and slow coordinates of a mode, decoupled.
//!
//! In energy coordinates a picofarad next to a henry is a small number next to a large one, and yet its
//! voltage is what a node obeys.  An eigenvector of the whole matrix knows its small entries to
//! rounding of its length; here they are solutions of equations of their own size.  With the
//! coordinates split into slow and fast ones,
//!
//! ```text
//! J = [Jss Jsf; Jfs Jff],   T = [I 0; Y I] [I Z; 0 I],   J T = T diag(Jss + Jsf Y, Jff - Y Jsf)
//! ```
//!
//! where `Y` and `Z` are fixed points of maps that contract by the ratio of the rates (P. Kokotovic,
//! H. K. Khalil, J. O'Reilly, *Singular Perturbation Methods in Control*, 1986, ch. 2).

use crate::dense::{Lu, Matrix};
use crate::modewise::spectra::block::row_norm;
use crate::modewise::spectra::spectrum::CONDITION;
use crate::tolerances::CLEARLY;

/// Steps of the iterations, of which each leaves of the error what the ratio of the rates is.
const STEPS: usize = 4;

/// Slow and fast coordinates with what couples their motions.
pub(in crate::modewise) struct Scales {
    slow: Vec<usize>,
    fast: Vec<usize>,
    y: Matrix,
    z: Matrix,
    /// matrices of the two motions
    pub parts: [Matrix; 2],
}

fn sum(a: &Matrix, sign: f64, b: Matrix) -> Matrix {
    let mut out = a.clone();
    out.add_scaled(sign, &b);
    out
}

impl Scales {
    /// Decouples `J` at the widest gap between the sizes of its rows; `None` if no gap is wide enough.
    pub fn new(j: &Matrix) -> Option<Scales> {
        let size = |r: usize| j.row(r).iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let mut order: Vec<usize> = (0..j.rows).collect();
        order.sort_by(|&a, &b| size(a).total_cmp(&size(b)));
        let ratio = |k: usize| size(order[k - 1]) / size(order[k]);
        let cut = (1..j.rows).min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))?;
        let (mut slow, mut fast) = (order[..cut].to_vec(), order[cut..].to_vec());
        slow.sort_unstable();
        fast.sort_unstable();
        let part = |rows: &[usize], cols: &[usize]| j.select_rows(rows).select_cols(cols);
        let [ss, sf, fs, ff] = [(&slow, &slow), (&slow, &fast), (&fast, &slow), (&fast, &fast)]
            .map(|(r, c)| part(r, c));
        let factor = Lu::new(&ff);
        if factor.ratio == 0.0 {
            return None;
        }
        let shortest = row_norm(&factor.solve(&Matrix::identity(ff.rows)));
        let mut y = Matrix::zeros(ff.rows, ss.rows);
        let mut own = ss.clone();
        for step in 0..STEPS {
            let next = factor.solve_refined(&ff, &sum(&y.times(&own), -1.0, fs.clone()));
            let still = next == y;
            y = next;
            own = sum(&ss, 1.0, sf.times(&y));
            // the first step is off by the ratio of the rates
            let ratio = row_norm(&own) * shortest;
            if ratio.is_nan() || step == 0 && ratio * CONDITION.sqrt() > 1.0 {
                return None;
            }
            if still {
                break;
            }
        }
        let parts = [own, sum(&ff, -1.0, y.times(&sf))];
        // nearer ones lose so few digits to each other that eigenvectors of all serve
        if row_norm(&parts[0]) * shortest * CONDITION > 1.0 {
            return None;
        }
        // Z Jf = Jsf + Js Z, transposed
        let turned = parts[1].transpose();
        let factor = Lu::new(&turned);
        if factor.ratio == 0.0 {
            return None;
        }
        let mut z = Matrix::zeros(ss.rows, ff.rows);
        for _ in 0..STEPS {
            let right = sum(&sf, 1.0, parts[0].times(&z)).transpose();
            let next = factor.solve_refined(&turned, &right).transpose();
            let still = next == z;
            z = next;
            if still {
                break;
            }
        }
        // the vectors of the groups are far from parallel then
        (row_norm(&y) <= CLEARLY && row_norm(&z) <= CLEARLY).then_some(Scales {
            slow,
            fast,
            y,
            z,
            parts,
        })
    }

    /// `T diag(slow, fast)`
    pub fn from(&self, slow: &Matrix, fast: &Matrix) -> Matrix {
        let lower = self.y.times(slow);
        let upper = self.z.times(fast);
        let rest = sum(fast, 1.0, self.y.times(&upper));
        let mut out = Matrix::zeros(slow.rows + fast.rows, slow.cols + fast.cols);
        for (list, [left, right]) in [(&self.slow, [slow, &upper]), (&self.fast, [&lower, &rest])] {
            for (i, &r) in list.iter().enumerate() {
                out.row_mut(r)[..slow.cols].copy_from_slice(left.row(i));
                out.row_mut(r)[slow.cols..].copy_from_slice(right.row(i));
            }
        }
        out
    }

    /// `diag(slow, fast) T^-1`
    pub fn to(&self, slow: &Matrix, fast: &Matrix) -> Matrix {
        let of_fast = slow.times(&self.z);
        let of_slow = sum(slow, 1.0, of_fast.times(&self.y));
        let back = fast.times(&self.y);
        let mut out = Matrix::zeros(slow.rows + fast.rows, slow.cols + fast.cols);
        for r in 0..slow.rows {
            self.slow.iter().zip(of_slow.row(r)).for_each(|(&c, v)| out[(r, c)] = *v);
            self.fast.iter().zip(of_fast.row(r)).for_each(|(&c, v)| out[(r, c)] = -v);
        }
        for r in 0..fast.rows {
            self.slow.iter().zip(back.row(r)).for_each(|(&c, v)| out[(slow.rows + r, c)] = -v);
            self.fast.iter().zip(fast.row(r)).for_each(|(&c, v)| out[(slow.rows + r, c)] = *v);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 pF with 24 uOhm next to henries: what a slow motion leaves on it is known to its own digits.
    #[test]
    fn small_entries_have_their_digits() {
        let j = Matrix::from_fn(3, 3, |r, c| {
            [[-3e-4, 1e-2, 6e5], [-1e-2, -6.0, 3e8], [-6e5, -3e8, -2.8e16]][r][c]
        });
        let scales = Scales::new(&j).unwrap();
        let unit = [Matrix::identity(2), Matrix::identity(1)];
        let (from, to) = (scales.from(&unit[0], &unit[1]), scales.to(&unit[0], &unit[1]));
        // Jff y + Jfs = y (Jss + Jsf y), by hand to first order: 6e5 / 2.8e16 is 2e-11
        for (c, v) in [(0, -6e5 / 2.8e16), (1, -3e8 / 2.8e16)] {
            assert!((from[(2, c)] / v - 1.0).abs() < 1e-9, "{}", from[(2, c)]);
        }
        let mut one = to.times(&from);
        one.add_scaled(-1.0, &Matrix::identity(3));
        assert!(one.max_abs() < 1e-15);
        // T^-1 J T has nothing but rounding outside the two parts
        let apart = to.times(&j).times(&from);
        for (r, c) in [(0, 2), (1, 2), (2, 0), (2, 1)] {
            assert!(apart[(r, c)].abs() <= 1e-15 * j[(r, c)].abs().max(3e8), "{}", apart[(r, c)]);
        }
        for r in 0..2 {
            for c in 0..2 {
                let exact = j[(r, c)] - j[(r, 2)] * j[(2, c)] / j[(2, 2)];
                assert!((scales.parts[0][(r, c)] - exact).abs() < 1e-9 * exact.abs());
            }
        }
        assert!(Scales::new(&Matrix::identity(3)).is_none());
        assert!(Scales::new(&scales.parts[0]).is_none());
    }
}
