//! The laws at one rate as sums of terms: what is left of them at a point, and how large their terms are.

use super::equations::{Equations, Part, FOUR};
use super::linear::Rows;
use crate::dense::widest;
use crate::sparse::Csc;
use std::collections::BTreeMap;

/// Systems of up to so many blocks of four rows are kept as full columns.
pub(super) const SMALL: usize = 4;

/// Four numbers side by side.
type Four = [f64; FOUR];

/// Coefficients of unknowns, multipliers and functions.
pub(super) enum Laws {
    /// of a small system: all rows of each column, first of the unknowns and multipliers, then of the
    /// functions, whose registers are next to them
    Columns { blocks: usize, linear: Vec<Four>, functions: Vec<Four>, registers: Vec<u32> },
    /// of a large one: what is not zero in each four rows, with its column or register
    Fours { linear: Rows<(u32, Four)>, functions: Rows<(u32, Four)> },
}

/// Gathers entries (row, place, value) that are not zero by four rows.
fn in_fours(size: usize, entries: &[(usize, u32, f64)]) -> Rows<(u32, Four)> {
    let mut blocks: BTreeMap<(usize, u32), Four> = BTreeMap::new();
    for &(r, c, v) in entries.iter().filter(|e| e.2 != 0.0) {
        blocks.entry((r / FOUR, c)).or_default()[r % FOUR] += v;
    }
    Rows::new(size.div_ceil(FOUR), blocks.into_iter().map(|((b, c), v)| (b, (c, v))))
}

/// Writes entries (row, column, value) into full columns.
fn in_columns(blocks: usize, count: usize, entries: &[(usize, usize, f64)]) -> Vec<Four> {
    let mut out = vec![[0.0; FOUR]; blocks * count];
    for &(r, c, v) in entries {
        out[c * blocks + r / FOUR][r % FOUR] += v;
    }
    out
}

impl Laws {
    /// The laws with this linear part; the coefficient of a function is made from its own and that of its
    /// rate.
    pub fn new(eq: &Equations, linear: &Csc, coefficient: impl Fn(f64, f64) -> f64) -> Laws {
        let terms = eq.terms.iter().filter(|t| t.part != Part::Law);
        let terms: Vec<_> = terms
            .map(|t| (t.row as usize, t.register, coefficient(t.f, t.q)))
            .filter(|t| t.2 != 0.0)
            .collect();
        let blocks = eq.size().div_ceil(FOUR);
        if blocks > SMALL {
            let entries: Vec<_> = linear.iter().map(|(r, c, v)| (r, c as u32, v)).collect();
            return Laws::Fours {
                linear: in_fours(eq.size(), &entries),
                functions: in_fours(eq.size(), &terms),
            };
        }
        let mut registers: Vec<u32> = terms.iter().map(|t| t.1).collect();
        registers.sort_unstable();
        registers.dedup();
        let place = |register: u32| registers.partition_point(|&r| r < register);
        let terms: Vec<_> = terms.iter().map(|&(row, k, v)| (row, place(k), v)).collect();
        Laws::Columns {
            blocks,
            linear: in_columns(blocks, eq.size(), &linear.iter().collect::<Vec<_>>()),
            functions: in_columns(blocks, registers.len(), &terms),
            registers,
        }
    }

    /// Writes `right - K x - F f` and the sums of the sizes of its terms, for functions whose values are
    /// in the given registers.
    pub fn balance(
        &self,
        values: &[f64],
        right: &[f64],
        x: &[f64],
        defect: &mut [f64],
        sizes: &mut [f64],
    ) {
        let all = [right, x, values];
        let out = [defect, sizes];
        match self {
            Laws::Fours { .. } => balance_fours(self, all, out),
            Laws::Columns { blocks: 0 | 1, .. } => balance_columns::<1>(self, all, out),
            Laws::Columns { blocks: 2, .. } => balance_columns::<2>(self, all, out),
            Laws::Columns { blocks: 3, .. } => balance_columns::<3>(self, all, out),
            Laws::Columns { .. } => balance_columns::<SMALL>(self, all, out),
        }
    }

    #[inline(always)]
    fn fours(&self, [right, x, values]: [&[f64]; 3], [defect, sizes]: [&mut [f64]; 2]) {
        let Laws::Fours { linear, functions } = self else { return };
        let (defects, sizes) = (defect.as_chunks_mut().0, sizes.as_chunks_mut().0);
        let rows = right.as_chunks::<FOUR>().0.iter().zip(defects).zip(sizes);
        for (b, ((right, defect), size)) in rows.enumerate() {
            let (mut d, mut sum) = (*right, right.map(f64::abs));
            for (c, v) in linear.row(b) {
                subtract(v, x[*c as usize], &mut d, &mut sum);
            }
            for (k, v) in functions.row(b) {
                subtract(v, values[*k as usize], &mut d, &mut sum);
            }
            (*defect, *size) = (d, sum);
        }
    }

    #[inline(always)]
    fn columns<const B: usize>(
        &self,
        [right, x, values]: [&[f64]; 3],
        [defect, sizes]: [&mut [f64]; 2],
    ) {
        let Laws::Columns { linear, functions, registers, .. } = self else { return };
        let Some(right) = right.as_chunks::<FOUR>().0.first_chunk::<B>() else { return };
        let (mut d, mut sums) = (*right, right.map(|four| four.map(f64::abs)));
        for (column, &x) in linear.as_chunks::<B>().0.iter().zip(x) {
            for b in 0..B {
                subtract(&column[b], x, &mut d[b], &mut sums[b]);
            }
        }
        for (column, &k) in functions.as_chunks::<B>().0.iter().zip(registers) {
            for b in 0..B {
                subtract(&column[b], values[k as usize], &mut d[b], &mut sums[b]);
            }
        }
        defect.as_chunks_mut().0[..B].copy_from_slice(&d);
        sizes.as_chunks_mut().0[..B].copy_from_slice(&sums);
    }
}

/// Subtracts `v x` from four defects and adds its size to four sums.
#[inline(always)]
fn subtract(v: &Four, x: f64, defect: &mut Four, sum: &mut Four) {
    for i in 0..FOUR {
        let term = v[i] * x;
        defect[i] -= term;
        sum[i] += term.abs();
    }
}

widest! {
    fn balance_fours(laws: &Laws, given: [&[f64]; 3], out: [&mut [f64]; 2]) = laws.fours(given, out)
}

widest! {
    fn balance_columns<const B: usize>(laws: &Laws, given: [&[f64]; 3], out: [&mut [f64]; 2]) =
        laws.columns::<B>(given, out)
}
