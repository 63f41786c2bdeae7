//! The full factorisation: left-looking, in time proportional to the arithmetic.
//!
//! Each column solves a triangular system with the columns before it; a depth-first search in the
//! graph of `L` finds the pattern and an order of elimination (Gilbert & Peierls 1988; Davis 2006,
//! chapter 6).  Entries that happen to be zero stay in the pattern, so that the factors of one mode
//! have room for the values of another as long as the pivots stay.

use super::{Csc, SparseLu};

/// The diagonal entry is the pivot if it reaches this part of the largest candidate in a row that
/// no mode change touches ...
const PREFER_DIAGONAL: f64 = 1e-2;
/// ... and this part of the largest candidate in the row of a pair.  The row of a conducting pair
/// under a node of small capacitance is large only until the pair blocks, so that taking it would
/// change the pivots with the mode.  What the growth costs in accuracy, one refinement regains.
const PREFER_FIXED: f64 = 1e-6;

/// Marks a row that is no pivot yet.
const FREE: u32 = u32::MAX;

/// Storage for the depth-first search.
struct Search {
    /// last column in which each row was reached
    seen: Vec<u32>,
    /// position, and the next entry of its column of `L` to look at
    stack: Vec<(u32, u32)>,
    /// reached pivots, in reverse order of elimination
    pivots: Vec<u32>,
    /// reached rows that are no pivots yet
    rows: Vec<u32>,
}

impl SparseLu {
    /// Factorises a matrix with the pattern that was ordered, choosing pivots anew.
    pub fn factor(&mut self, a: &Csc) {
        let n = self.size();
        assert_eq!((a.nrows, a.ncols), (n, n), "the matrix that was ordered");
        self.lower.clear();
        self.upper.clear();
        self.place.fill(FREE);
        self.singular = None;
        self.pivot_ratio = 0.0;
        let mut search = Search {
            seen: vec![FREE; n],
            stack: Vec::new(),
            pivots: Vec::new(),
            rows: Vec::new(),
        };
        for k in 0..n {
            self.reach(a, k, &mut search);
            if !self.column(a, k, &search) {
                self.singular = Some(self.ordering.order[k] as usize);
                self.x.fill(0.0); // a column that is not finite may have left something behind
                return;
            }
        }
        for i in &mut self.lower.index {
            *i = self.place[*i as usize];
        }
        self.transpose_upper();
        self.rate();
    }

    /// Finds the pattern of column `k` of `L` and `U`.
    fn reach(&self, a: &Csc, k: usize, search: &mut Search) {
        let Search { seen, stack, pivots, rows } = search;
        let column = k as u32;
        pivots.clear();
        rows.clear();
        for &start in a.col(self.ordering.order[k] as usize).0 {
            if seen[start] == column {
                continue;
            }
            seen[start] = column;
            if self.place[start] == FREE {
                rows.push(start as u32);
                continue;
            }
            stack.push((self.place[start], self.lower.start[self.place[start] as usize]));
            while let Some((position, next)) = stack.last_mut() {
                let p = *position as usize;
                if *next == self.lower.start[p + 1] {
                    pivots.push(*position);
                    stack.pop();
                    continue;
                }
                let row = self.lower.index[*next as usize];
                *next += 1;
                if seen[row as usize] != column {
                    seen[row as usize] = column;
                    match self.place[row as usize] {
                        FREE => rows.push(row),
                        child => stack.push((child, self.lower.start[child as usize])),
                    }
                }
            }
        }
    }

    /// Eliminates column `k` and chooses its pivot; false if there is none.
    fn column(&mut self, a: &Csc, k: usize, search: &Search) -> bool {
        let c = self.ordering.order[k] as usize;
        let x = &mut self.x;
        let (rows, values) = a.col(c);
        for (&r, &v) in rows.iter().zip(values) {
            x[r] = v;
        }
        let mut finite = true;
        for &j in search.pivots.iter().rev() {
            let at = &mut x[self.row[j as usize] as usize];
            let u = *at;
            *at = 0.0;
            self.upper.index.push(j);
            self.upper.value.push(u);
            finite &= u.is_finite();
            if u != 0.0 {
                for (r, l) in self.lower.col(j as usize) {
                    x[r] -= l * u;
                }
            }
        }
        self.upper.close();
        let Some(p) = self.choose(c, &search.rows).filter(|_| finite) else {
            return false;
        };
        let pivot = self.x[p];
        self.survival[k] = self.survived(a, k, p, pivot);
        self.row[k] = p as u32;
        self.place[p] = k as u32;
        self.inverse[k] = 1.0 / pivot;
        for &r in &search.rows {
            let v = std::mem::take(&mut self.x[r as usize]);
            if r as usize != p {
                self.lower.index.push(r);
                self.lower.value.push(v / pivot);
            }
        }
        self.lower.close();
        true
    }

    /// The pivot row for column `c` among the candidates in `x`.
    fn choose(&self, c: usize, rows: &[u32]) -> Option<usize> {
        // largest among the rows that stay, and among those that change with the mode
        let (mut fixed, mut switching) = ((0.0, None), (0.0, None));
        for &r in rows {
            let (r, v) = (r as usize, self.x[r as usize].abs());
            let best = if r < self.ordering.first_switching { &mut fixed } else { &mut switching };
            if v > best.0 {
                *best = (v, Some(r));
            } else if v.is_nan() {
                return None;
            }
        }
        // candidates of earlier columns are zero in `x`, so that a diagonal that is taken loses
        let diagonal = self.x[c].abs();
        let best = if diagonal > 0.0
            && diagonal >= PREFER_DIAGONAL * fixed.0
            && diagonal >= PREFER_FIXED * switching.0
        {
            (diagonal, Some(c))
        } else if fixed.0 > 0.0 && fixed.0 >= PREFER_FIXED * switching.0 {
            fixed
        } else {
            switching
        };
        best.1.filter(|_| best.0.is_finite() && (1.0 / best.0).is_finite())
    }

    /// The pivot in row `p` over the sum of the magnitudes of its terms.
    fn survived(&self, a: &Csc, k: usize, p: usize, pivot: f64) -> f64 {
        let (rows, values) = a.col(self.ordering.order[k] as usize);
        let mut scale = rows.binary_search(&p).map_or(0.0, |at| values[at].abs());
        for (j, u) in self.upper.col(k) {
            if u != 0.0 {
                let entry = self.lower.col(j).find(|&(r, _)| r == p);
                scale += entry.map_or(0.0, |(_, l)| (l * u).abs());
            }
        }
        pivot.abs() / scale.max(pivot.abs())
    }

    /// Lists the columns in which each row of `U` has entries.
    fn transpose_upper(&mut self) {
        let n = self.size();
        let (start, list) = &mut self.dependents;
        start.clear();
        start.resize(n + 2, 0);
        for &i in &self.upper.index {
            start[i as usize + 2] += 1;
        }
        for k in 0..n {
            start[k + 2] += start[k + 1];
        }
        list.clear();
        list.resize(self.upper.index.len(), 0);
        for c in 0..n {
            for p in self.upper.range(c) {
                let slot = &mut start[self.upper.index[p] as usize + 1];
                list[*slot as usize] = c as u32;
                *slot += 1;
            }
        }
        start.truncate(n + 1);
    }
}
