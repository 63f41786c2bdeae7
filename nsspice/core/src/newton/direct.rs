//! Jacobians of small systems, written where they are factorised, in the order of pivots found before.
//!
//! A search for pivots, with the exchanges that follow, takes most of the time of a small factorisation.
//! Derivatives change from one iteration to the next, the order of good pivots hardly ever.  An order that
//! does not serve any more shows by large quotients: then pivots are looked for again.

use super::equations::{Equations, FOUR};
use super::laws::SMALL;
use super::linear::Derivative;
use crate::dense::{each, widest, DenseLu};
use crate::linear::SURVIVES;

/// Unknowns and multipliers of a system for which this serves.
pub(super) const MOST: usize = SMALL * FOUR;

/// Entries below a pivot may be so much larger: what rounding makes of that slows the iteration down,
/// and no more.
const GROWTH: f64 = 1e4;

/// Four numbers side by side.
type Four = [f64; FOUR];

/// A call for each place in `B` blocks, which is known where it is compiled; `back` for the last one first.
macro_rules! each_place {
    ($B:ident, $call:ident $(, $rest:expr)*) => {
        each_place!(@ $B, $call, ($($rest),*), 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    (back $B:ident, $call:ident $(, $rest:expr)*) => {
        each_place!(@ $B, $call, ($($rest),*), 15 14 13 12 11 10 9 8 7 6 5 4 3 2 1 0)
    };
    (@ $B:ident, $call:ident, $rest:tt, $($k:literal)*) => {
        $( if $k < $B * FOUR { each_place!(# $B, $k, $call, $rest) } )*
    };
    (# $B:ident, $k:literal, $call:ident, ($($rest:expr),*)) => { $call::<$B, $k>($($rest),*) };
}

/// The scaled Jacobian of a mode as a function of the derivatives, and its factors.
pub(super) struct Direct {
    mode: Vec<bool>,
    /// the row in each place, and what it is multiplied by
    rows: Vec<(u32, f64)>,
    /// physical unknown = scale * scaled unknown
    scale: Vec<f64>,
    /// the linear part, column by column
    linear: Vec<Four>,
    /// where derivatives are added: place, slot, factor
    slopes: Vec<(u32, u32, f64)>,
    /// below the diagonal quotients, above it what is left
    lu: Vec<Four>,
    /// reciprocals of the pivots
    inverse: Vec<f64>,
}

impl Direct {
    /// For the `mode` of the factors, which tell the order of pivots, from the parts of the Jacobian and the
    /// weights of its entries, both in the pattern of `eq`, and the scales of rows and columns.
    pub fn new(
        eq: &Equations,
        (linear, entries): (&[f64], &[Derivative]),
        weight: &[f64],
        [row_scale, scale]: [&[f64]; 2],
        factor: &DenseLu,
        mode: &[bool],
    ) -> Direct {
        let (size, width) = (eq.size(), eq.padded());
        let rows = factor.rows();
        let mut places = vec![0; size];
        rows.iter().enumerate().for_each(|(place, &row)| places[row] = place);
        let blocks = |row: usize| row >= eq.n && !mode[row - eq.n];
        let mut all = vec![0.0; width * size];
        let mut place = vec![0; linear.len()];
        for c in 0..size {
            for at in eq.pattern.colptr[c]..eq.pattern.colptr[c + 1] {
                let row = eq.pattern.rowidx[at];
                place[at] = c * width + places[row];
                let own = f64::from(row == c);
                all[place[at]] = if blocks(row) { own } else { linear[at] * weight[at] };
            }
        }
        let slopes = entries.iter().map(|e| {
            let at = e.at as usize;
            (place[at] as u32, e.slot, e.factor * weight[at])
        });
        let of_row = |&row: &usize| {
            let scale = row_scale[row];
            (row as u32, if blocks(row) { scale.recip() } else { scale })
        };
        Direct {
            mode: mode.to_vec(),
            rows: rows.iter().map(of_row).collect(),
            scale: scale.to_vec(),
            slopes: slopes.collect(),
            lu: all.as_chunks().0.to_vec(),
            linear: all.as_chunks().0.to_vec(),
            inverse: vec![0.0; size],
        }
    }

    /// Which pairs are active.
    pub fn mode(&self) -> &[bool] {
        &self.mode
    }

    /// Factorises the Jacobian; false if it is singular, or asks for other pivots.
    pub fn factorise(&mut self, slopes: &[f64]) -> bool {
        match self.inverse.len().div_ceil(FOUR) {
            0 | 1 => factorise::<1>(self, slopes),
            2 => factorise::<2>(self, slopes),
            3 => factorise::<3>(self, slopes),
            _ => factorise::<SMALL>(self, slopes),
        }
    }

    /// `x := J^-1 x` in physical units.
    pub fn solve(&self, x: &mut [f64]) {
        match self.inverse.len().div_ceil(FOUR) {
            0 | 1 => solve::<1>(self, x),
            2 => solve::<2>(self, x),
            3 => solve::<3>(self, x),
            _ => solve::<SMALL>(self, x),
        }
    }

    #[inline(always)]
    fn factorise_blocks<const B: usize>(&mut self, slopes: &[f64]) -> bool {
        self.lu.copy_from_slice(&self.linear);
        let flat = self.lu.as_flattened_mut();
        for &(at, slot, f) in &self.slopes {
            flat[at as usize] += f * slopes[slot as usize];
        }
        let (columns, inverse) = (self.lu.as_chunks_mut::<B>().0, &mut self.inverse[..]);
        let mut seen = Seen { least: f64::INFINITY, greatest: 0.0, grown: [[0.0; FOUR]; B] };
        each_place!(B, eliminate, columns, inverse, &mut seen);
        let quotients = seen.grown.as_flattened().iter();
        let grown = quotients.fold(1.0, |most, &quotient| larger(most, quotient));
        // of a column that depends on those before it so much more is left by rounding
        let survives = SURVIVES * grown * seen.greatest;
        grown <= GROWTH && seen.greatest < f64::INFINITY && seen.least > survives
    }

    #[inline(always)]
    fn solve_blocks<const B: usize>(&self, x: &mut [f64]) {
        let mut y = [[0.0f64; FOUR]; B];
        for (y, &(row, scale)) in y.as_flattened_mut().iter_mut().zip(&self.rows) {
            *y = x[row as usize] * scale;
        }
        let (columns, inverse) = (self.lu.as_chunks::<B>().0, &self.inverse[..]);
        each_place!(B, forward, columns, &mut y);
        each_place!(back B, backward, columns, inverse, &mut y);
        for ((x, y), s) in x.iter_mut().zip(y.as_flattened()).zip(&self.scale) {
            *x = y * s;
        }
    }
}

/// The pivots of an elimination, and the largest quotients in each row.
struct Seen<const B: usize> {
    least: f64,
    greatest: f64,
    grown: [Four; B],
}

/// The larger of two numbers, or the second if one of them is none.
#[inline(always)]
fn larger(old: f64, new: f64) -> f64 {
    if new <= old {
        old
    } else {
        new
    }
}

/// Eliminates below the diagonal of column `K`.
#[inline(always)]
fn eliminate<const B: usize, const K: usize>(
    columns: &mut [[Four; B]],
    inverse: &mut [f64],
    seen: &mut Seen<B>,
) {
    if K >= columns.len() {
        return;
    }
    let (left, right) = columns.split_at_mut(K + 1);
    let column = &mut left[K];
    let pivot = column[K / FOUR][K % FOUR];
    let reciprocal = 1.0 / pivot;
    inverse[K] = reciprocal;
    seen.greatest = larger(seen.greatest, pivot.abs());
    seen.least = -larger(-seen.least, -pivot.abs());
    // zero where nothing changes, so that loops have a known length
    let mut below = [[0.0; FOUR]; B];
    for b in K / FOUR..B {
        for i in 0..FOUR {
            if b * FOUR + i > K {
                below[b][i] = column[b][i] * reciprocal;
                column[b][i] = below[b][i];
                seen.grown[b][i] = larger(seen.grown[b][i], below[b][i].abs());
            }
        }
    }
    for other in right {
        let u = other[K / FOUR][K % FOUR];
        if u != 0.0 {
            for b in K / FOUR..B {
                for i in 0..FOUR {
                    other[b][i] -= below[b][i] * u;
                }
            }
        }
    }
}

/// Substitutes unknown `K` in the rows below.
#[inline(always)]
fn forward<const B: usize, const K: usize>(columns: &[[Four; B]], y: &mut [Four; B]) {
    if K < columns.len() {
        let f = y[K / FOUR][K % FOUR];
        for b in K / FOUR..B {
            let changed: Four = each(|i| y[b][i] - columns[K][b][i] * f);
            y[b] = each(|i| if b * FOUR + i > K { changed[i] } else { y[b][i] });
        }
    }
}

/// Substitutes unknown `K` in the rows above.
#[inline(always)]
fn backward<const B: usize, const K: usize>(
    columns: &[[Four; B]],
    inverse: &[f64],
    y: &mut [Four; B],
) {
    if K < columns.len() {
        let f = y[K / FOUR][K % FOUR] * inverse[K];
        for b in 0..=K / FOUR {
            let changed: Four = each(|i| y[b][i] - columns[K][b][i] * f);
            y[b] = each(|i| if b * FOUR + i < K { changed[i] } else { y[b][i] });
        }
        y[K / FOUR][K % FOUR] = f;
    }
}

widest! {
    fn factorise<const B: usize>(direct: &mut Direct, slopes: &[f64]) -> bool =
        direct.factorise_blocks::<B>(slopes)
}

widest! {
    fn solve<const B: usize>(direct: &Direct, x: &mut [f64]) = direct.solve_blocks::<B>(x)
}

#[cfg(test)]
mod tests {
    use super::{Direct, FOUR, SMALL};
    use crate::dense::DenseLu;
    use crate::newton::equations::Equations;
    use crate::newton::{Newton, Smooth};
    use crate::sparse::Csc;
    use crate::tape::{Program, Tape};
    use std::sync::Arc;

    fn equations(matrix: &Csc) -> Arc<Equations> {
        let n = matrix.nrows;
        let none = |r, c| Csc::from_triplets(r, c, &[]);
        let program = Program::new(&[], &[], &[], &[], n, 0).unwrap();
        let smooth = Smooth { tape: Tape::new(Arc::new(program)), f: none(n, 0), q: none(n, 0) };
        let kinds = vec![0; n];
        let (a, b) = (none(n, 0), none(0, n));
        Newton::new(&none(n, n), matrix, &a, &b, &none(0, 0), &kinds, smooth).eq
    }

    /// Entries that no order of rows leaves on the diagonal alone.
    fn entry(r: usize, c: usize, shift: usize) -> f64 {
        let far = (r + shift) % 5 == c % 5;
        ((r * 7 + c * 3 + shift) % 11) as f64 - 5.0 + if far { 20.0 } else { 0.0 }
    }

    #[test]
    fn solutions_are_those_with_pivots_looked_for() {
        for n in 1..=SMALL * FOUR {
            let all: Vec<_> = (0..n * n).map(|k| (k / n, k % n, entry(k / n, k % n, 1))).collect();
            let matrix = Csc::from_triplets(n, n, &all);
            let (eq, factor) = (equations(&matrix), DenseLu::new(&matrix));
            if factor.pivot_ratio() < 1e-6 {
                continue;
            }
            let ones = vec![1.0; n];
            let mut direct = Direct::new(
                &eq,
                (&eq.pattern.values, &[]),
                &vec![1.0; eq.pattern.values.len()],
                [&ones, &ones],
                &factor,
                &[],
            );
            assert!(direct.factorise(&[]), "{n}");
            let expected: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let mut x = vec![0.0; n];
            matrix.mul_add(1.0, &expected, &mut x);
            direct.solve(&mut x);
            for (x, expected) in x.iter().zip(&expected) {
                assert!((x - expected).abs() < 1e-9, "{n}: {x} {expected}");
            }
        }
    }

    #[test]
    fn an_order_that_does_not_serve_is_refused() {
        let matrix = |v: f64| Csc::from_triplets(2, 2, &[(0, 0, v), (0, 1, 1.0), (1, 0, 1.0)]);
        let eq = equations(&matrix(1e-9));
        let refused = |order: f64| {
            let factor = DenseLu::new(&matrix(order));
            let (weight, ones) = (vec![1.0; eq.pattern.values.len()], [1.0; 2]);
            let parts = (&eq.pattern.values[..], &[][..]);
            !Direct::new(&eq, parts, &weight, [&ones, &ones], &factor, &[]).factorise(&[])
        };
        assert!(!refused(1e-9));
        assert!(refused(3.0), "1e-9 is no pivot beside 1");
    }
}
