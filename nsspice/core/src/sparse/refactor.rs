//! Partial refactorisation after a few rows have changed.

use super::factor::PREFER_FIXED;
use super::{Csc, SparseLu};
use crate::tolerances::CLEARLY;

/// How much of the factors was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// so many columns, with the old pivots
    Columns(usize),
    /// all, with new pivots
    Full,
}

impl SparseLu {
    /// Factorises a matrix that differs in the given rows only from the one factorised last.
    ///
    /// A column is computed again if one of its entries may have changed or if it depends on a
    /// column of `L` that did change; all others are kept.  With the order of `Ordering` few columns
    /// depend on one row.  If a pivot becomes too small, everything is factorised with new pivots.
    pub fn refactor_rows(&mut self, a: &Csc, rows: &[usize]) -> Extent {
        for &r in rows {
            for &(c, _) in self.ordering.row(r) {
                let k = self.ordering.position[c as usize] as usize;
                self.dirty[k / 64] |= 1 << (k % 64);
            }
        }
        self.sweep(a)
    }

    /// As `refactor_rows` with columns.
    pub fn refactor_columns(&mut self, a: &Csc, columns: &[usize]) -> Extent {
        for &c in columns {
            let k = self.ordering.position[c] as usize;
            self.dirty[k / 64] |= 1 << (k % 64);
        }
        self.sweep(a)
    }

    /// Factorises a matrix with the pattern that was ordered, with the old pivots if they serve.
    pub fn refactor(&mut self, a: &Csc) -> Extent {
        for k in 0..self.size() {
            self.dirty[k / 64] |= 1 << (k % 64);
        }
        self.sweep(a)
    }

    /// Computes the marked columns, and those that depend on them, from left to right.
    fn sweep(&mut self, a: &Csc) -> Extent {
        let n = self.size();
        assert_eq!((a.nrows, a.ncols), (n, n), "the matrix that was ordered");
        let mut usable = self.singular.is_none();
        let mut columns = 0;
        self.measure_rows(a);
        for word in 0..self.dirty.len() {
            // dependents lie behind, possibly in the same word
            while usable && self.dirty[word] != 0 {
                let bit = self.dirty[word].trailing_zeros() as usize;
                self.dirty[word] &= self.dirty[word] - 1;
                let k = 64 * word + bit;
                columns += 1;
                let changed = self.recompute(a, k);
                usable = changed.is_some();
                if changed == Some(true) {
                    let (start, list) = &self.dependents;
                    for &c in &list[start[k] as usize..start[k + 1] as usize] {
                        self.dirty[c as usize / 64] |= 1 << (c % 64);
                    }
                }
            }
        }
        if usable {
            self.rate();
            return Extent::Columns(columns);
        }
        self.dirty.fill(0);
        self.x.fill(0.0);
        self.factor(a);
        Extent::Full
    }

    /// Eliminates column `k` with its old pattern and pivot; returns whether its column of `L`
    /// changed, or `None` if the pivot is too small.
    fn recompute(&mut self, a: &Csc, k: usize) -> Option<bool> {
        let x = &mut self.x;
        let (rows, values) = a.col(self.ordering.order[k] as usize);
        let mut largest = 0.0f64;
        for (&r, &v) in rows.iter().zip(values) {
            x[self.place[r] as usize] = v;
            largest = largest.max(v.abs());
        }
        let mut scale = x[k].abs();
        let mut usable = true;
        let upper = self.upper.range(k);
        for e in &mut self.upper.entries[upper.clone()] {
            let j = e.row as usize;
            let u = std::mem::take(&mut x[j]);
            e.value = u;
            usable &= u.is_finite();
            if u != 0.0 {
                let before = x[k];
                for l in self.lower.col(j) {
                    x[l.row as usize] -= l.value * u;
                }
                scale += (x[k] - before).abs();
            }
        }
        let mut pivot = std::mem::take(&mut x[k]);
        let (terms, scale) = (scale, scale.max(largest).max(pivot.abs()));
        let mut survival = pivot.abs() / scale;
        let lost = self.is_lost(a, k, [pivot.abs(), terms, scale], |j| j as u32, k);
        // the row of a column that begins to depend on others, or ceases to, is another
        usable &= lost == self.late[k];
        if lost {
            usable &= self.lower.col(k).iter().all(|e| {
                let v = self.x[e.row as usize].abs();
                v == 0.0 || self.is_lost(a, k, [v, 0.0, scale], |j| j as u32, e.row as usize)
            });
            pivot = self.hold * scale;
            survival = self.hold;
        }
        let inverse = 1.0 / pivot;
        for e in &mut self.upper.entries[upper] {
            e.value *= inverse;
        }
        let mut changed = false;
        let row = self.row[k] as usize;
        let own = self.sizes.row(row);
        // nothing grows where nothing else is in the row of the pivot
        let alone = self.sizes.gives(row, self.ordering.order[k] as usize);
        let lower = self.lower.range(k);
        for e in &mut self.lower.entries[lower] {
            let v = std::mem::take(&mut self.x[e.row as usize]);
            let l = if lost { 0.0 } else { v / pivot };
            changed |= l != e.value;
            let size = self.sizes.row(self.row[e.row as usize] as usize);
            // clearly beyond the threshold at which pivots are chosen they are chosen again: at the threshold itself
            // they would flutter between two modes
            usable &= alone || CLEARLY * PREFER_FIXED * l.abs() * own <= size;
            e.value = l;
        }
        self.inverse[k] = inverse;
        self.survival[k] = survival;
        (usable && pivot.is_finite() && inverse.is_finite()).then_some(changed)
    }
}
