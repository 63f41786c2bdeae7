//! Partial refactorisation after a few rows have changed.

use super::{Csc, SparseLu};

/// An old pivot stays unless an entry below it is larger by more than this factor: somewhat beyond
/// the threshold at which pivots are chosen, so that they do not flutter between two modes.
const LARGEST_FACTOR: f64 = 1e7;

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
        if self.singular.is_some() {
            self.factor(a);
            return Extent::Full;
        }
        let n = self.size();
        assert_eq!((a.nrows, a.ncols), (n, n), "the matrix that was ordered");
        let mut first = self.dirty.len();
        for &r in rows {
            for &(c, _) in self.ordering.row(r) {
                let k = self.ordering.position[c as usize] as usize;
                self.dirty[k / 64] |= 1 << (k % 64);
                first = first.min(k / 64);
            }
        }
        let mut columns = 0;
        for word in first..self.dirty.len() {
            // dependents lie behind, possibly in the same word
            while self.dirty[word] != 0 {
                let bit = self.dirty[word].trailing_zeros() as usize;
                self.dirty[word] &= self.dirty[word] - 1;
                let k = 64 * word + bit;
                columns += 1;
                match self.recompute(a, k) {
                    None => {
                        self.dirty.fill(0);
                        self.x.fill(0.0);
                        self.factor(a);
                        return Extent::Full;
                    }
                    Some(false) => {}
                    Some(true) => {
                        let (start, list) = &self.dependents;
                        for &c in &list[start[k] as usize..start[k + 1] as usize] {
                            self.dirty[c as usize / 64] |= 1 << (c % 64);
                        }
                    }
                }
            }
        }
        self.rate();
        Extent::Columns(columns)
    }

    /// Eliminates column `k` with its old pattern and pivot; tells whether its column of `L`
    /// changed, or `None` if the pivot is too small.
    fn recompute(&mut self, a: &Csc, k: usize) -> Option<bool> {
        let x = &mut self.x;
        let (rows, values) = a.col(self.ordering.order[k] as usize);
        for (&r, &v) in rows.iter().zip(values) {
            x[self.place[r] as usize] = v;
        }
        let mut scale = x[k].abs();
        let mut usable = true;
        for p in self.upper.range(k) {
            let j = self.upper.index[p] as usize;
            let u = std::mem::take(&mut x[j]);
            self.upper.value[p] = u;
            usable &= u.is_finite();
            if u != 0.0 {
                let before = x[k];
                for (i, l) in self.lower.col(j) {
                    x[i] -= l * u;
                }
                scale += (x[k] - before).abs();
            }
        }
        let pivot = std::mem::take(&mut x[k]);
        let inverse = 1.0 / pivot;
        let mut changed = false;
        for p in self.lower.range(k) {
            let l = std::mem::take(&mut x[self.lower.index[p] as usize]) / pivot;
            changed |= l != self.lower.value[p];
            usable &= l.abs() <= LARGEST_FACTOR;
            self.lower.value[p] = l;
        }
        self.inverse[k] = inverse;
        self.survival[k] = pivot.abs() / scale.max(pivot.abs());
        (usable && pivot.is_finite() && inverse.is_finite()).then_some(changed)
    }
}
