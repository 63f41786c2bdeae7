//! Modes of short steps in which nodes that capacitors tie to each other alone float.
//!
//! Beside `E/h` what such nodes conduct drowns in rounding: the tie of 1 GOhm that gives an isolated
//! secondary its potential is nothing beside 100 uF in steps of a nanosecond.  In the sum of the laws
//! of all nodes of a group nothing is stored, so that it holds what conducts to its own digits.  It
//! takes the place of the law of the first node, see `floating.rs`.

use super::stage::{Ends, StepMatrices, OPEN};
use crate::dense::DenseLu;
use crate::descriptor::Linear;
use crate::floating::Floating;
use crate::sparse::Csc;

/// Entries of a sum below this part of their terms are rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Rounding below this part of the least conductance hides nothing.
const SEEN: f64 = 1e-4;

pub type Row = Vec<(usize, f64)>;

/// The sum of the laws of a group.
struct Sum {
    rows: Vec<usize>,
    g: Row,
    a: Row,
    s: Row,
}

/// The sums of all groups of a system.
pub struct Sums {
    sums: Vec<Sum>,
    /// the largest capacitance and the least conductance, to ground or between nodes [F, S]
    extremes: [f64; 2],
}

/// The factored equations of a mode with sums.
pub struct SummedMode {
    lu: DenseLu,
    /// factors of its rows and of its columns
    scales: [Vec<f64>; 2],
}

impl Sums {
    /// Those of a system, if it has any.
    pub fn new(linear: &Linear) -> Option<Sums> {
        let (n, m, _) = linear.sizes();
        if n + m > OPEN {
            return None; // sparse factors, which the sums would fill
        }
        let floating = Floating::new(&linear.e, &linear.g, &linear.row_kind);
        let sums = floating.groups().iter().map(|rows| Sum {
            g: total(&linear.g, rows),
            a: total(&linear.a, rows),
            s: total(&linear.s, rows),
            rows: rows.clone(),
        });
        let sums: Vec<Sum> = sums.collect();
        let extremes =
            [linear.e.values.iter().fold(0.0, |a: f64, v| a.max(v.abs())), least(linear)];
        (!sums.is_empty()).then_some(Sums { sums, extremes })
    }

    /// Whether in steps of this length [s] what is stored may hide what conducts.
    pub fn needed(&self, length: f64) -> bool {
        let [capacitance, conductance] = self.extremes;
        f64::EPSILON * capacitance / length > SEEN * conductance
    }

    /// Factorises a mode whose unknowns have these scales; nothing if it is singular.
    pub fn factor(
        &self,
        matrices: &StepMatrices,
        active: &[bool],
        scale: &[f64],
    ) -> Option<SummedMode> {
        let (n, size) = (matrices.n, scale.len());
        let mut entries: Vec<(usize, usize, f64)> = Vec::new();
        let summed = |row: usize| self.sums.iter().any(|sum| sum.rows[0] == row);
        for by_rows in [&matrices.carry_rows, &matrices.g_rows] {
            entries.extend(by_rows.iter().filter(|e| !summed(e.1)).map(|(c, r, v)| (r, c, v)));
        }
        let a = matrices.a_rows.iter().filter(|e| !summed(e.1));
        entries.extend(a.map(|(c, r, v)| (r, n + c, v)));
        for sum in &self.sums {
            entries.extend(sum.g.iter().map(|&(c, v)| (sum.rows[0], c, v)));
            entries.extend(sum.a.iter().map(|&(c, v)| (sum.rows[0], n + c, v)));
        }
        let on = |pair: &usize| active[*pair];
        entries.extend(matrices.b_rows.iter().filter(|e| on(&e.1)).map(|(c, r, v)| (n + r, c, -v)));
        entries
            .extend(matrices.d_rows.iter().filter(|e| on(&e.1)).map(|(c, r, v)| (n + r, n + c, v)));
        entries.extend((0..size - n).filter(|i| !on(i)).map(|i| (n + i, n + i, 1.0)));
        let mut largest = vec![0.0f64; size];
        entries.iter().for_each(|&(r, c, v)| largest[r] = largest[r].max((v * scale[c]).abs()));
        let rows: Vec<f64> = largest.iter().map(|v| if *v > 0.0 { 1.0 / v } else { 1.0 }).collect();
        let mut lu = DenseLu::default();
        lu.factor_by(size, |lu| {
            lu.fill(0.0);
            for (r, c, v) in entries {
                lu[c * size + r] += rows[r] * v * scale[c];
            }
        });
        lu.singular().is_none().then(|| SummedMode { lu, scales: [rows, scale.to_vec()] })
    }

    /// Puts the sums of the right-hand side for an increment in their places.
    pub fn increment(&self, Ends { z0, u1, .. }: Ends, rhs: &mut [f64]) {
        for sum in &self.sums {
            rhs[sum.rows[0]] = dot(&sum.s, u1) - dot(&sum.g, z0);
        }
    }

    /// Puts the residuals of sums in their places: `x = [z; l]` with a right-hand side of sums.
    pub fn residual(&self, rhs: &[f64], (z, l): (&[f64], &[f64]), out: &mut [f64]) {
        for sum in &self.sums {
            let row = sum.rows[0];
            out[row] = rhs[row] - dot(&sum.g, z) - dot(&sum.a, l);
        }
    }
}

impl SummedMode {
    /// Solves with a right-hand side in which sums stand: `x = [z; l]`.
    pub fn solve(&self, x: &mut [f64]) {
        let [rows, columns] = &self.scales;
        x.iter_mut().zip(rows).for_each(|(x, scale)| *x *= scale);
        if self.lu.solve(x).is_err() {
            x.fill(f64::NAN);
        }
        x.iter_mut().zip(columns).for_each(|(x, scale)| *x *= scale);
    }
}

/// The least conductance between two nodes or to ground [S].
fn least(linear: &Linear) -> f64 {
    let kinds = &linear.row_kind;
    let mut to_ground = vec![(0.0, 0.0); kinds.len()];
    let mut least = f64::INFINITY;
    for (r, c, v) in linear.g.iter().filter(|&(r, c, v)| kinds[r] + kinds[c] == 0 && v != 0.0) {
        let (sum, size) = &mut to_ground[r];
        (*sum, *size) = (*sum + v, *size + v.abs());
        least = if r == c { least } else { least.min(v.abs()) };
    }
    let left = to_ground.iter().filter(|(sum, size)| f64::abs(*sum) > ROUNDING * size);
    left.fold(least, |least, (sum, _)| least.min(sum.abs()))
}

pub fn dot(row: &Row, x: &[f64]) -> f64 {
    row.iter().map(|&(j, v)| v * x[j]).sum()
}

/// The sum of some rows.
pub fn total(matrix: &Csc, rows: &[usize]) -> Row {
    let mut wanted = vec![false; matrix.nrows];
    rows.iter().for_each(|&row| wanted[row] = true);
    let columns = (0..matrix.ncols).filter_map(|c| {
        let (indices, values) = matrix.col(c);
        let own = indices.iter().zip(values).filter(|(&r, _)| wanted[r]);
        let (sum, size) = own.fold((0.0, 0.0), |(sum, size), (_, v)| (sum + v, size + v.abs()));
        (f64::abs(sum) > ROUNDING * size).then_some((c, sum))
    });
    columns.collect()
}
