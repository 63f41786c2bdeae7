//! Modes of short steps in which nodes that capacitors tie to each other alone float.
//!
//! Beside `E/h` what such nodes conduct drowns in rounding: the tie of 1 GOhm that gives an isolated
//! secondary its potential is nothing beside 100 uF in steps of a nanosecond.  In the sum of the laws
//! of all nodes of a group nothing is stored, so that it holds what conducts to its own digits.  It
//! takes the place of the law of one node, see `floating`.

use super::matrices::{Ends, StepMatrices, OPEN};
use crate::dense::DenseLu;
use crate::descriptor::{stored_groups, Linear};
use crate::floating::Floating;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

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
    /// the largest capacitance and the least conductance, to ground or between nodes [F, S], and the largest
    /// inductance of which the current is in a sum [H]
    extremes: [f64; 3],
    /// modes may leave something open, which stays where it is
    open: bool,
}

/// The factored equations of a mode with sums.
pub struct SummedMode {
    lu: DenseLu,
    /// factors of its rows and of its columns
    scales: [Vec<f64>; 2],
    /// nodes of which nothing is told, that stay where they are
    pinned: Vec<usize>,
}

impl Sums {
    /// Those of a system for the groups of `floating`, if it has any: for modes that are regular but for
    /// rounding.
    pub fn floating(linear: &Linear) -> Option<Sums> {
        let floating = Floating::new(&linear.e, &linear.g, &linear.row_kind);
        Sums::new(linear, floating.groups().to_vec(), false)
    }

    /// The same for all groups that have one, and for all modes.
    pub fn tied(linear: &Linear) -> Option<Sums> {
        Sums::new(linear, groups(linear), true)
    }

    fn new(linear: &Linear, groups: Vec<Vec<usize>>, open: bool) -> Option<Sums> {
        let (n, m, _) = linear.sizes();
        if n + m > OPEN {
            return None; // sparse factors, which the sums would fill
        }
        // resistors tie nodes together, too, and of what these store something may be left
        let empty = |rows: &Vec<usize>| total(&linear.e, rows).is_empty();
        let sums = groups.into_iter().filter(empty).map(|rows| Sum {
            g: total(&linear.g, &rows),
            a: total(&linear.a, &rows),
            s: total(&linear.s, &rows),
            rows,
        });
        let sums: Vec<Sum> = sums.collect();
        let most = |list: &mut dyn Iterator<Item = f64>| list.fold(0.0f64, |a, v| a.max(v.abs()));
        let own = |c: usize| linear.e.iter().find(|e| e.0 == c && e.1 == c).map(|e| e.2);
        let coil = |&(c, _): &(usize, f64)| own(c).filter(|_| linear.row_kind[c] != 0);
        let currents = sums.iter().flat_map(|sum| &sum.g);
        let extremes = [
            most(&mut linear.e.values.iter().copied()),
            least(linear),
            most(&mut currents.filter_map(coil)),
        ];
        (!sums.is_empty()).then_some(Sums { sums, extremes, open })
    }

    /// Whether in steps of this length [s] what is stored may hide what conducts.
    pub fn needed(&self, length: f64) -> bool {
        self.hide(length, self.extremes[1])
    }

    /// The same beside coils, which conduct in a short step as large resistors do.
    pub fn hide_coils(&self, length: f64) -> bool {
        self.hide(length, length / self.extremes[2])
    }

    fn hide(&self, length: f64, conductance: f64) -> bool {
        f64::EPSILON * self.extremes[0] / length > SEEN * conductance
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
        let on = |pair: &usize| active[*pair];
        let pinned = if self.open { self.left_open(active) } else { Vec::new() };
        entries.extend(pinned.iter().map(|&row| (row, row, 1.0)));
        for sum in self.sums.iter().filter(|sum| !pinned.contains(&sum.rows[0])) {
            entries.extend(sum.g.iter().map(|&(c, v)| (sum.rows[0], c, v)));
            entries.extend(sum.a.iter().map(|&(c, v)| (sum.rows[0], n + c, v)));
        }
        entries.extend(matrices.b_rows.iter().filter(|e| on(&e.1)).map(|(c, r, v)| (n + r, c, -v)));
        entries
            .extend(matrices.d_rows.iter().filter(|e| on(&e.1)).map(|(c, r, v)| (n + r, n + c, v)));
        entries.extend((0..size - n).filter(|i| !on(i)).map(|i| (n + i, n + i, 1.0)));
        let mut largest = vec![0.0f64; size];
        entries.iter().for_each(|&(r, c, v)| largest[r] = largest[r].max((v * scale[c]).abs()));
        let rows: Vec<f64> = largest.iter().map(|v| if *v > 0.0 { 1.0 / v } else { 1.0 }).collect();
        let mut lu = DenseLu::default();
        lu.set_hold(if self.open { 1.0 } else { 0.0 });
        lu.factor_by(size, |lu| {
            lu.fill(0.0);
            for (r, c, v) in entries {
                lu[c * size + r] += rows[r] * v * scale[c];
            }
        });
        lu.singular().is_none().then(|| SummedMode { lu, scales: [rows, scale.to_vec()], pinned })
    }

    /// A node of each part that nothing but conducting pairs connects, and these only inside: the law of the
    /// whole part says nothing, and its potential is open.
    fn left_open(&self, active: &[bool]) -> Vec<usize> {
        let parts = || self.sums.iter().enumerate().filter(|(_, sum)| sum.g.is_empty());
        let mut together = UnionFind::new(self.sums.len());
        let mut tied: Vec<bool> = self.sums.iter().map(|sum| !sum.s.is_empty()).collect();
        for pair in (0..active.len()).filter(|&pair| active[pair]) {
            let at = |sum: &Sum| sum.a.iter().find(|e| e.0 == pair).map(|e| e.1);
            let ends: Vec<(usize, f64)> =
                parts().filter_map(|(k, sum)| Some((k, at(sum)?))).collect();
            match ends[..] {
                [(a, into), (b, out)] if into == -out => _ = together.join(a, b),
                _ => ends.iter().for_each(|&(k, _)| tied[k] = true),
            }
        }
        let tied: Vec<usize> =
            (0..tied.len()).filter(|&k| tied[k]).map(|k| together.root(k)).collect();
        let open = parts().filter(|&(k, _)| together.root(k) == k && !tied.contains(&k));
        open.map(|(_, sum)| sum.rows[0]).collect()
    }

    /// The largest current by which a point misses the sums.
    pub fn missed(&self, z: &[f64], l: &[f64], u: &[f64]) -> f64 {
        let of = |sum: &Sum| dot(&sum.s, u) - dot(&sum.g, z) - dot(&sum.a, l);
        self.sums.iter().map(|sum| of(sum).abs()).fold(0.0, f64::max)
    }

    /// Puts the sums of the right-hand side for an increment in their places.
    pub fn increment(&self, Ends { z0, u1, .. }: Ends, rhs: &mut [f64]) {
        for sum in &self.sums {
            rhs[sum.rows[0]] = dot(&sum.s, u1) - dot(&sum.g, z0);
        }
    }

    /// Puts the residuals of sums in their places: `x = [z; l]` with a right-hand side of sums.
    pub fn residual(
        &self,
        mode: &SummedMode,
        rhs: &[f64],
        (z, l): (&[f64], &[f64]),
        out: &mut [f64],
    ) {
        for sum in &self.sums {
            let row = sum.rows[0];
            let open = mode.pinned.contains(&row);
            out[row] = if open { 0.0 } else { rhs[row] - dot(&sum.g, z) - dot(&sum.a, l) };
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

/// Groups of nodes, each with the one first whose law gives way to the sum, so that all of them are
/// independent: those of `floating`, and in these all that only capacitors tie together.  A coil in
/// series with a capacitor ends at such nodes, and its current drowns like any other.
fn groups(linear: &Linear) -> Vec<Vec<usize>> {
    let floating = Floating::new(&linear.e, &linear.g, &linear.row_kind);
    let [mut tied, _] = stored_groups(&linear.e);
    tied.retain(|rows| rows.len() > 1 && rows.iter().all(|&row| linear.row_kind[row] == 0));
    let mut outer = floating.groups().to_vec();
    for rows in &mut outer {
        let inside = |row: usize| tied.iter().position(|group| group.contains(&row));
        match rows.iter().position(|&row| inside(row).is_none()) {
            Some(free) => rows.swap(0, free),
            // their sums make up that of the whole
            None => _ = inside(rows[0]).map(|group| tied.swap_remove(group)),
        }
    }
    outer.extend(tied);
    outer
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
