//! How far a point is from solving the equations, free of units and of scale.

use super::equations::{Equations, FOUR};
use super::linear::Assembly;
use crate::dense::{each, widest};
use crate::mlcp::{Residual, Role};
use crate::tape::Tape;

/// Rows are not judged against less than this part of what the largest voltage and the largest current
/// would make of them: so far unknowns are rounded.
const FLOOR: f64 = 1e-6;
/// What rounding of the unknowns by a few units may do to a row, through steep functions, is no
/// defect.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A defect of this part of its terms is rounding of one of them.
const NOTHING: f64 = 0.5 * f64::EPSILON;

widest! {
    fn balance(
        assembly: &Assembly,
        values: &[f64],
        right: &[f64],
        x: &[f64],
        out: &mut Balance,
    ) =
        out.compute_any(assembly, values, right, x)
}

widest! {
    fn judge_rows(
        balance: &mut Balance,
        eq: &Equations,
        assembly: &Assembly,
        tape: &Tape,
        x: &[f64],
    ) -> Rows =
        balance.rows(eq, assembly, tape, x)
}

/// What the rows of the unknowns say.
struct Rows {
    /// largest relative violation, and where
    worst: f64,
    row: usize,
    /// largest node voltage
    node: f64,
}

/// Defects of a point, and against what they are judged.
pub(super) struct Balance {
    /// `rhs - K z - F f - A l`; minus its second part is the slack
    pub defect: Vec<f64>,
    /// sum of the sizes of the terms
    pub terms: Vec<f64>,
    /// their quotients
    shares: Vec<f64>,
    /// sizes of the entries of multipliers that are not zero
    carried: Vec<f64>,
    /// laws of currents are judged against the largest: leakage is left open
    pub lenient: bool,
}

/// A verdict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judgement {
    pub residual: Residual,
    pub worst_row: usize,
}

impl Balance {
    /// Room for the rows of `eq`, a whole number of fours.
    pub fn new(eq: &Equations) -> Balance {
        let zeros = vec![0.0; eq.padded()];
        let [defect, terms, shares, carried] = [(); 4].map(|()| zeros.clone());
        Balance { defect, terms, shares, carried, lenient: false }
    }

    /// Computes both at `x = [z; l]` from the last evaluation of the tape.
    pub fn compute(&mut self, assembly: &Assembly, tape: &Tape, right: &[f64], x: &[f64]) {
        balance(assembly, tape.registers(), right, x, self);
    }

    #[inline(always)]
    fn compute_any(&mut self, assembly: &Assembly, values: &[f64], right: &[f64], x: &[f64]) {
        let (defects, sizes) = (self.defect.as_chunks_mut().0, self.terms.as_chunks_mut().0);
        let rows = right.as_chunks::<FOUR>().0.iter().zip(defects).zip(sizes);
        for (b, ((right, defect), size)) in rows.enumerate() {
            let (mut d, mut sum) = (*right, right.map(f64::abs));
            let mut subtract = |v: &[f64; FOUR], x: f64| {
                for i in 0..FOUR {
                    let term = v[i] * x;
                    d[i] -= term;
                    sum[i] += term.abs();
                }
            };
            for (c, v) in assembly.rows.row(b) {
                subtract(v, x[*c as usize]);
            }
            for (k, c) in assembly.terms.row(b) {
                subtract(c, values[*k as usize]);
            }
            (*defect, *size) = (d, sum);
        }
    }

    /// Size of what the functions make of the unknowns in a row: in steep functions, how far its
    /// defect may be rounding.
    fn steepness(assembly: &Assembly, tape: &Tape, x: &[f64], row: usize) -> f64 {
        let slopes = tape.slopes();
        let entries = assembly.entries.row(row).iter();
        entries.map(|e| (e.factor * slopes[e.slot as usize] * x[e.column as usize]).abs()).sum()
    }

    /// Relative violations of the rows of the unknowns.
    #[inline(always)]
    fn rows(&mut self, eq: &Equations, assembly: &Assembly, tape: &Tape, x: &[f64]) -> Rows {
        // comparisons, which pass over NaN as `max` does and cost less
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let (terms, defects) = (self.terms.as_chunks::<FOUR>().0, self.defect.as_chunks().0);
        let of = |list: &[u32]| list.iter().fold(0.0f64, |v, &i| larger(x[i as usize].abs(), v));
        let (node, branch) = (of(&eq.nodes), of(&eq.branches));
        let mut current = branch;
        if eq.m > 0 {
            // one that conducts takes part in all currents of its network: so far its own is rounded
            let mut largest = [0.0; FOUR];
            for (term, counts) in terms.iter().zip(&eq.currents) {
                largest = each(|i| larger(term[i] * counts[i], largest[i]));
            }
            current = largest.into_iter().fold(current, larger);
            for (carried, &kind) in self.carried.iter_mut().zip(&eq.row_kind) {
                *carried = f64::from(self.lenient && kind == 0);
            }
            for (c, _) in x[eq.n..].iter().enumerate().filter(|l| *l.1 != 0.0) {
                let (rows, values) = eq.a.col(c);
                rows.iter().zip(values).for_each(|(&row, v)| self.carried[row] += v.abs());
            }
        }
        let carried = &self.carried;
        let floor = |reach: &[[f64; FOUR]; 2], row: usize| {
            let i = row % FOUR;
            FLOOR * (reach[0][i] * node + reach[1][i] * branch + carried[row] * current)
        };
        let shares = self.shares.as_chunks_mut::<FOUR>().0;
        let mut top = [0.0f64; FOUR];
        for (b, ((((share, term), defect), reach), laws)) in
            shares.iter_mut().zip(terms).zip(defects).zip(&eq.reach).zip(&eq.laws).enumerate()
        {
            let defect: &[f64; FOUR] = defect;
            let size: [f64; FOUR] = each(|i| larger(term[i], floor(reach, FOUR * b + i)));
            let counted: [f64; FOUR] = each(|i| laws[i] * defect[i].abs());
            // nothing is no part of nothing, and NaN no number
            let ratio: [f64; FOUR] = each(|i| counted[i] / larger(size[i], f64::MIN_POSITIVE));
            let ratio = each(|i| if ratio[i] < f64::INFINITY { ratio[i] } else { f64::INFINITY });
            top = each(|i| larger(ratio[i], top[i]));
            *share = ratio;
        }
        let mut out = Rows { worst: 0.0, row: 0, node };
        let top = larger(larger(top[0], top[1]), larger(top[2], top[3]));
        if top <= NOTHING {
            return out;
        }
        // the largest first: most others need no look then
        let shares = &self.shares[..eq.n];
        let first = shares.iter().position(|s| *s == top).unwrap_or(0);
        let ratio = |i: usize| {
            let excess = self.defect[i].abs() - ROUNDING * Self::steepness(assembly, tape, x, i);
            if excess <= 0.0 {
                return 0.0;
            }
            let ratio = excess / larger(self.terms[i], floor(&eq.reach[i / FOUR], i));
            if ratio.is_finite() {
                ratio
            } else {
                f64::INFINITY
            }
        };
        (out.worst, out.row) = (ratio(first), first);
        let mut known = larger(out.worst, NOTHING);
        for (i, &share) in shares.iter().enumerate() {
            if share > known && i != first {
                let ratio = ratio(i);
                if ratio > out.worst {
                    (out.worst, out.row) = (ratio, i);
                    known = larger(ratio, NOTHING);
                }
            }
        }
        out
    }

    /// Relative violations of rows and pairs.
    pub fn judge(
        &mut self,
        eq: &Equations,
        assembly: &Assembly,
        tape: &Tape,
        roles: &[Role],
        x: &[f64],
    ) -> Judgement {
        let Rows { worst: rows, row: worst_row, node } = judge_rows(self, eq, assembly, tape, x);
        let (n, terms, defect) = (eq.n, &self.terms, &self.defect);
        if roles.is_empty() {
            let residual = Residual { rows, complementarity: 0.0 };
            return Judgement { residual, worst_row };
        }
        let mut current = 0.0f64;
        let mut voltage = node;
        for &r in &eq.touched {
            current = current.max(terms[r]);
        }
        for i in n..x.len() {
            current = current.max(x[i].abs());
            voltage = voltage.max(terms[i]);
        }
        let relative = |v: f64, scale: f64| if v == 0.0 { 0.0 } else { v / scale };
        let mut complementarity = 0.0f64;
        for (i, role) in roles.iter().enumerate() {
            let (l, w) = (relative(x[n + i], current), relative(-defect[n + i], voltage));
            let violation = match role {
                Role::Diode => l.min(w),
                Role::Closed => w,
                Role::Open => l,
            };
            let violation = if violation.is_nan() { f64::INFINITY } else { violation.abs() };
            complementarity = complementarity.max(violation);
        }
        let residual = Residual { rows, complementarity };
        Judgement { residual, worst_row }
    }
}
