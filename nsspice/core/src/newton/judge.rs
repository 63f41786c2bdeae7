//! How far a point is from solving the equations, free of units and of scale.

use super::equations::Equations;
use super::linear::Assembly;
use crate::mlcp::{Residual, Role};
use crate::tape::Tape;

/// Rows are not judged against less than this part of the largest of their kind.
const FLOOR: f64 = 1e-6;
/// What rounding of the unknowns by a few units may do to a row, through steep functions, is no
/// defect.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A defect of this part of its terms is rounding of one of them.
const NOTHING: f64 = 0.5 * f64::EPSILON;

/// Defects of a point, and against what they are judged.
pub(super) struct Balance {
    /// `rhs - K z - F f - A l`; minus its second part is the slack
    pub defect: Vec<f64>,
    /// sum of the sizes of the terms
    pub terms: Vec<f64>,
}

/// A verdict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judgement {
    pub residual: Residual,
    pub worst_row: usize,
}

impl Balance {
    pub fn new(size: usize) -> Balance {
        Balance { defect: vec![0.0; size], terms: vec![0.0; size] }
    }

    /// Computes both at `x = [z; l]` from the last evaluation of the tape.
    pub fn compute(&mut self, assembly: &Assembly, tape: &Tape, right: &[f64], x: &[f64]) {
        for (r, (defect, size)) in self.defect.iter_mut().zip(&mut self.terms).enumerate() {
            let (mut d, mut sum) = (right[r], right[r].abs());
            for &(c, v) in assembly.rows.row(r) {
                let term = v * x[c as usize];
                d -= term;
                sum += term.abs();
            }
            for &(k, c) in assembly.terms.row(r) {
                let term = c * tape.value(k as usize);
                d -= term;
                sum += term.abs();
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

    /// Relative violations of rows and pairs.
    pub fn judge(
        &self,
        eq: &Equations,
        assembly: &Assembly,
        tape: &Tape,
        roles: &[Role],
        x: &[f64],
    ) -> Judgement {
        let (n, terms, defect) = (eq.n, &self.terms, &self.defect);
        let (mut largest, mut node) = ([0.0f64; 2], 0.0f64);
        for ((&kind, &term), x) in eq.row_kind.iter().zip(terms).zip(x) {
            // comparisons, which pass over NaN as `max` does and cost less
            if kind != 0 {
                largest[1] = if term > largest[1] { term } else { largest[1] };
            } else {
                largest[0] = if term > largest[0] { term } else { largest[0] };
                node = if x.abs() > node { x.abs() } else { node };
            }
        }
        let floor = [FLOOR * largest[0], FLOOR * largest[1].max(node)];
        let (mut rows, mut worst_row) = (0.0f64, 0);
        let quantities = eq.row_kind.iter().zip(terms).zip(defect);
        for (i, ((&kind, &term), defect)) in quantities.enumerate() {
            let floor = floor[usize::from(kind != 0)];
            let size = if term <= floor || term.is_nan() { floor } else { term };
            if defect.abs() <= rows.max(NOTHING) * size && size < f64::INFINITY {
                continue; // NaN goes on
            }
            let steep = Self::steepness(assembly, tape, x, i);
            let excess = defect.abs() - ROUNDING * steep;
            if excess <= 0.0 {
                continue;
            }
            let ratio = excess / size;
            let ratio = if ratio.is_finite() { ratio } else { f64::INFINITY }; // NaN is no number
            if ratio > rows {
                (rows, worst_row) = (ratio, i);
            }
        }
        if roles.is_empty() {
            return Judgement { residual: Residual { rows, complementarity: 0.0 }, worst_row };
        }
        let mut current = 0.0f64;
        let mut voltage = largest[1].max(node);
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
        Judgement { residual: Residual { rows, complementarity }, worst_row }
    }
}
