//! The full factorisation: left-looking, in time proportional to the arithmetic.
//!
//! Each column solves a triangular system with the columns before it; a depth-first search in the
//! graph of `L` finds the pattern and an order of elimination (Gilbert & Peierls 1988; Davis 2006,
//! chapter 6).  Entries that happen to be zero stay in the pattern, so that the factors of one mode
//! have room for the values of another as long as the pivots stay.

use super::lu::Entry;
use super::{Csc, SparseLu};
use crate::pivots::TRACE;
use crate::rounding::OF_EQUATION;
use crate::tolerances::ACCEPT;

/// The diagonal entry is the pivot if it reaches this part of the largest candidate in a row that
/// no mode change touches ...
const PREFER_DIAGONAL: f64 = 1e-2;
/// ... and this part of the largest candidate in the row of a pair.  The row of a conducting pair
/// under a node of small capacitance is large only until the pair blocks, so that taking it would
/// change the pivots with the mode.  What the growth costs in accuracy, one refinement regains.
pub(super) const PREFER_FIXED: f64 = 1e-6;

/// Marks a row that is no pivot yet, and a column whose row is found last.
const FREE: u32 = u32::MAX;

/// Storage for the depth-first search.
struct Search {
    /// last column in which each row was reached
    seen: Vec<u32>,
    /// position, and the next entry of its column of `L` to look at
    stack: Vec<(u32, u32)>,
    /// end of the part of each column of `L` that the search has to look at
    end: Vec<u32>,
    /// reached pivots, in reverse order of elimination
    pivots: Vec<u32>,
    /// reached rows that are no pivots yet
    rows: Vec<u32>,
}

impl SparseLu {
    /// Factorises a matrix with the pattern that was ordered, choosing new pivots.
    pub fn factor(&mut self, a: &Csc) {
        let n = self.size();
        assert_eq!((a.nrows, a.ncols), (n, n), "the matrix that was ordered");
        self.lower.clear();
        self.upper.clear();
        self.place.fill(FREE);
        self.singular = None;
        self.pivot_ratio = 0.0;
        self.measure_rows(a);
        let mut search = Search {
            seen: vec![FREE; n],
            stack: Vec::new(),
            end: Vec::new(),
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
            if self.late[k] {
                search.end.push(self.lower.start[k + 1]); // nothing lies beyond
            } else {
                self.prune(k, &mut search.end);
            }
        }
        self.place_late();
        for e in &mut self.lower.entries {
            e.row = self.place[e.row as usize];
        }
        self.transpose_upper();
        self.rate();
    }

    /// Finds the pattern of column `k` of `L` and `U`.
    fn reach(&self, a: &Csc, k: usize, search: &mut Search) {
        let Search { seen, stack, end, pivots, rows } = search;
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
                if *next == end[p] {
                    pivots.push(*position);
                    stack.pop();
                    continue;
                }
                let row = self.lower.entries[*next as usize].row;
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

    /// Gives the columns that depend on others the rows that are left: their own, if it is among these.
    fn place_late(&mut self) {
        let mut late: Vec<usize> = (0..self.size()).filter(|&k| self.late[k]).collect();
        late.retain(|&k| {
            let own = self.ordering.order[k] as usize;
            let free = self.place[own] == FREE;
            if free {
                (self.row[k], self.place[own]) = (own as u32, k as u32);
            }
            !free
        });
        let mut rows = 0..self.size();
        for k in late {
            let Some(r) = rows.find(|&r| self.place[r] == FREE) else { return };
            (self.row[k], self.place[r]) = (r as u32, k as u32);
        }
    }

    /// Eliminates column `k` and chooses its pivot; one that depends on those before it is late.  False if it is
    /// not finite, or depends on others where nothing is held.
    fn column(&mut self, a: &Csc, k: usize, search: &Search) -> bool {
        let c = self.ordering.order[k] as usize;
        let x = &mut self.x;
        let (rows, values) = a.col(c);
        let mut largest = 0.0f64;
        for (&r, &v) in rows.iter().zip(values) {
            x[r] = v;
            largest = largest.max(v.abs());
        }
        let mut finite = true;
        let mut scale = x[c].abs();
        for &j in search.pivots.iter().rev() {
            let u = std::mem::take(&mut x[self.row[j as usize] as usize]);
            self.upper.entries.push(Entry { row: j, column: k as u32, value: u });
            finite &= u.is_finite();
            if u != 0.0 {
                let before = x[c];
                for e in self.lower.col(j as usize) {
                    x[e.row as usize] -= e.value * u;
                }
                scale += (x[c] - before).abs();
            }
        }
        self.upper.close();
        let chosen = self.choose(c, &search.rows);
        finite &= chosen.is_some() || search.rows.iter().all(|&r| self.x[r as usize].is_finite());
        if !finite || chosen.is_none() && self.hold == 0.0 {
            return false;
        }
        let mut pivot = chosen.map_or(0.0, |p| self.x[p]);
        if let Some(p) = chosen.filter(|&p| p != c) {
            scale = self.terms(a, k, p);
        }
        let (terms, scale) = (scale, scale.max(largest).max(pivot.abs()));
        self.survival[k] = pivot.abs() / scale;
        let lost = |p: usize| self.is_lost(a, k, [pivot.abs(), terms, scale], |j| self.row[j], p);
        let chosen = chosen.filter(|&p| !lost(p));
        self.late[k] = chosen.is_none();
        match chosen {
            Some(p) => {
                self.row[k] = p as u32;
                self.place[p] = k as u32;
            }
            None => {
                pivot = self.hold * if scale > 0.0 { scale } else { 1.0 };
                self.row[k] = FREE;
                self.survival[k] = self.hold;
            }
        }
        self.inverse[k] = 1.0 / pivot;
        for p in self.upper.range(k) {
            self.upper.entries[p].value *= self.inverse[k];
        }
        for &r in &search.rows {
            let v = std::mem::take(&mut self.x[r as usize]);
            if chosen != Some(r as usize) {
                let value = if chosen.is_some() { v / pivot } else { 0.0 };
                self.lower.entries.push(Entry { row: r, column: k as u32, value });
            }
        }
        self.lower.close();
        true
    }

    /// Shortens the lists that later searches follow: once row and column of a pivot meet in both
    /// `L` and `U`, everything beyond is reached by way of that pivot (Eisenstat & Liu 1992).
    fn prune(&mut self, k: usize, end: &mut Vec<u32>) {
        let (p, place) = (self.row[k], &self.place);
        for e in self.upper.col(k) {
            let j = e.row as usize;
            let column = self.lower.range(j);
            if end[j] as usize != column.end {
                continue; // shortened before
            }
            let list = &mut self.lower.entries[column.clone()];
            if list.iter().any(|l| l.row == p) {
                let mut pivots = 0;
                for i in 0..list.len() {
                    if place[list[i].row as usize] != FREE {
                        list.swap(i, pivots);
                        pivots += 1;
                    }
                }
                end[j] = (column.start + pivots) as u32;
            }
        }
        end.push(self.lower.start[k + 1]);
    }

    /// The pivot row for column `c` among the candidates in `x`.
    fn choose(&self, c: usize, rows: &[u32]) -> Option<usize> {
        // largest among the rows that stay, and among those that change with the mode
        let (mut fixed, mut switching) = ((0.0, None), (0.0, None));
        for &r in rows {
            let (r, v) = (r as usize, self.part(r as usize));
            let best = if r < self.ordering.first_switching { &mut fixed } else { &mut switching };
            if v > best.0 {
                *best = (v, Some(r));
            } else if v.is_nan() {
                return None;
            }
        }
        // candidates of earlier columns are zero in `x`, so that a diagonal that is taken loses
        let diagonal = self.part(c);
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
        let candidates = rows.iter().map(|&r| (r as usize, self.x[r as usize]));
        let own = self.sizes.own_row(c, candidates);
        own.or(best.1).filter(|&p| self.x[p].is_finite() && (1.0 / self.x[p]).is_finite())
    }

    /// The part that a candidate in `x` has of its row.
    fn part(&self, row: usize) -> f64 {
        self.sizes.part(self.x[row], row)
    }

    /// The sum of the magnitudes of the terms of the entry of column `k` in row `p`.
    fn terms(&self, a: &Csc, k: usize, p: usize) -> f64 {
        let (rows, values) = a.col(self.ordering.order[k] as usize);
        let mut scale = rows.binary_search(&p).map_or(0.0, |at| values[at].abs());
        for e in self.upper.col(k).iter().filter(|e| e.value != 0.0) {
            let factor = self.lower.col(e.row as usize).iter().find(|l| l.row as usize == p);
            scale += factor.map_or(0.0, |l| (l.value * e.value).abs());
        }
        scale
    }

    /// Whether a pivot of this size, relative to the terms that it is the sum of and what its column has, is to be
    /// held: next to large entries that cancel nothing, a small pivot has all of its digits.
    pub(super) fn is_lost(
        &self,
        a: &Csc,
        k: usize,
        [pivot, terms, scale]: [f64; 3],
        row: impl Fn(usize) -> u32,
        p: usize,
    ) -> bool {
        // of the terms that a pivot is the sum of, and of the entries that were summed before; what is left of larger
        // parts of a column is known by more than is asked of solutions
        let rounding = |terms: f64| pivot <= (OF_EQUATION * terms).max(TRACE * scale);
        self.hold > 0.0
            && pivot <= ACCEPT * scale
            && (rounding(terms) || rounding(self.summed(a, k, row, p)))
    }

    /// As `terms`, with all that was summed before: the pivot is `y' A x` with the rows and columns that
    /// elimination has combined.  Rows of `L` are numbered as `row` numbers the pivots.
    fn summed(&self, a: &Csc, k: usize, row: impl Fn(usize) -> u32, p: usize) -> f64 {
        let mut y = vec![0.0f64; self.size()];
        y[p] = 1.0;
        for j in (0..k).rev().filter(|&j| !self.late[j]) {
            let below = self.lower.col(j).iter().map(|l| l.value * y[l.row as usize]);
            y[row(j) as usize] = -below.sum::<f64>();
        }
        let mut x = vec![0.0f64; k + 1];
        x[k] = 1.0;
        self.upper.col(k).iter().for_each(|e| x[e.row as usize] = e.value);
        for j in (0..k).rev() {
            let v = x[j];
            if v != 0.0 {
                self.upper.col(j).iter().for_each(|e| x[e.row as usize] -= e.value * v);
                x[j] = v * self.inverse[j];
            }
        }
        let number = |r: usize| match self.place[r] {
            FREE => r,
            place => row(place as usize) as usize,
        };
        let size = |j: usize| {
            let (rows, values) = a.col(self.ordering.order[j] as usize);
            rows.iter().zip(values).map(|(&r, v)| (v * y[number(r)]).abs()).sum::<f64>()
        };
        let combined = x.iter().enumerate().filter(|x| *x.1 != 0.0);
        combined.map(|(j, x)| x.abs() * size(j)).sum()
    }

    /// Lists the columns in which each row of `U` has entries.
    fn transpose_upper(&mut self) {
        let n = self.size();
        let (start, list) = &mut self.dependents;
        start.clear();
        start.resize(n + 2, 0);
        for e in &self.upper.entries {
            start[e.row as usize + 2] += 1;
        }
        for k in 0..n {
            start[k + 2] += start[k + 1];
        }
        list.clear();
        list.resize(self.upper.entries.len(), 0);
        for e in &self.upper.entries {
            let slot = &mut start[e.row as usize + 1];
            list[*slot as usize] = e.column;
            *slot += 1;
        }
        start.truncate(n + 1);
    }
}
