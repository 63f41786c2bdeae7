//! The linearised problem: Jacobian of a mode, factored again when values or mode change.

use super::direct::{Direct, Parts};
use super::equations::{Equations, Part};
use super::residuals::Laws;
use crate::linear::Factor;
use crate::mlcp::equilibrate;
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;

/// Conductances below this part of the usual one do not count in the scaling.  With a decade more large networks that float
/// behind leakage cost more than others; no test distinguishes one less.
const NO_SLOPE: f64 = 1e-18;
/// Largest scaled entry with which open columns are distinguished from small ones; a column whose entries are below
/// its inverse looks open, too, if it was scaled while a junction conducted far more.  No test distinguishes a decade
/// more or less; without it rectifiers behind amplifiers of high gain find no solution.
const BADLY_SCALED: f64 = 1e6;

/// Lists, one after the other.
pub(super) struct Rows<T> {
    start: Vec<u32>,
    pub list: Vec<T>,
}

impl<T> Rows<T> {
    /// Gathers items by their rows, in the order in which they come.
    pub fn new(count: usize, items: impl Iterator<Item = (usize, T)>) -> Rows<T> {
        let mut items: Vec<(usize, T)> = items.collect();
        items.sort_by_key(|i| i.0);
        let start = (0..=count).map(|r| items.partition_point(|i| i.0 < r) as u32).collect();
        Rows { start, list: items.into_iter().map(|i| i.1).collect() }
    }

    /// The same with other items.
    pub fn map<U>(self, of: impl Fn(T) -> U) -> Rows<U> {
        Rows { start: self.start, list: self.list.into_iter().map(of).collect() }
    }

    #[inline]
    pub fn row(&self, r: usize) -> &[T] {
        &self.list[self.start[r] as usize..self.start[r + 1] as usize]
    }
}

/// A derivative `df/dz_j` in one entry of the Jacobian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivative {
    /// index into the values of the pattern
    pub at: u32,
    /// variable, and slot of the derivative
    pub column: u32,
    pub slot: u32,
    pub factor: f64,
}

/// How the Jacobian is scaled.
pub(super) struct Scaling {
    /// physical unknown = scale * scaled unknown
    pub columns: Vec<f64>,
    /// what multiplies the rows: the same, but for laws of leakage alone
    rows: Vec<f64>,
    /// product of the two scales of each entry
    weight: Vec<f64>,
    known: bool,
    /// how often it has been done
    pub count: u32,
}

impl Scaling {
    /// Multiplies rows by their scales; those of pairs that block are divided.
    fn scale_rows(&self, n: usize, active: &[bool], x: &mut [f64]) {
        let rows = &self.rows;
        for (v, s) in x[..n].iter_mut().zip(rows) {
            *v *= s;
        }
        for ((v, s), &on) in x[n..].iter_mut().zip(&rows[n..]).zip(active) {
            *v = if on { *v * s } else { *v / s };
        }
    }
}

/// All that depends on the rate: linear part, scaling, factors.
pub(super) struct Assembly {
    pub rate: f64,
    /// last use, for eviction
    pub stamp: u64,
    /// `[[rate E + G, A], [-B, D]]`
    pub linear: Csc,
    /// the same and the functions, as sums of terms
    pub laws: Laws,
    /// derivatives in each row
    pub entries: Rows<Derivative>,
    /// the Jacobian with all pairs active, unscaled
    pub values: Vec<f64>,
    pub scaling: Scaling,
    /// for the present values
    fresh: bool,
    /// the last Jacobian left something open, which was held
    open: bool,
    /// the last solution took one step: the next ones may, too, with the same factors
    pub steady: bool,
    /// so many of the next guesses need not be judged
    pub unjudged: u8,
    /// the largest terms of each law in solutions
    pub largest: Vec<f64>,
    jacobian: Csc,
    factor: Option<Factor>,
    /// the shorter way to dense factors, and whether it was taken last
    direct: Option<Direct>,
    directly: bool,
    /// columns in which the scaled Jacobian has changed
    dirty: Vec<usize>,
    /// what its factors hold
    hold: f64,
    /// the mode factored last
    active: Vec<bool>,
}

impl Assembly {
    pub fn new(eq: &Equations, rate: f64) -> Assembly {
        let mut linear = eq.pattern.clone();
        if rate != 0.0 {
            for &(_, _, at, v) in &eq.stored {
                linear.values[at as usize] += rate * v;
            }
        }
        // no division by an infinite step: charges that do not count may be infinite themselves
        let coefficient = |f: f64, q: f64| if rate == 0.0 || q == 0.0 { f } else { f + rate * q };
        Assembly {
            rate,
            stamp: 0,
            laws: Laws::new(eq, &linear, coefficient),
            entries: Rows::new(
                eq.n,
                eq.entries
                    .iter()
                    .filter(|e| e.part != Part::Law)
                    .map(|e| {
                        let (at, column, slot) = (e.at, e.column, e.slot);
                        let factor = coefficient(e.f, e.q);
                        (e.row as usize, Derivative { at, column, slot, factor })
                    })
                    .filter(|e| e.1.factor != 0.0),
            ),
            values: linear.values.clone(),
            scaling: Scaling {
                columns: vec![1.0; eq.size()],
                rows: vec![1.0; eq.size()],
                weight: vec![1.0; linear.values.len()],
                known: false,
                count: 0,
            },
            fresh: false,
            open: false,
            steady: false,
            unjudged: 0,
            largest: vec![0.0; eq.n],
            jacobian: linear.clone(),
            linear,
            factor: None,
            direct: None,
            directly: false,
            dirty: Vec::new(),
            hold: 0.0,
            active: vec![false; eq.m],
        }
    }

    /// Whether the Jacobian factored last left something open.
    pub fn open(&self) -> bool {
        self.open
    }

    /// The Jacobian has been no measure: the next one is scaled again.
    pub fn forget_scale(&mut self) {
        self.scaling.known = false;
        self.fresh = false;
        self.open = false;
    }

    /// Whether some Jacobian of this mode has been factored, none of another since, and nothing scaled again.
    pub fn factored(&self, active: &[bool]) -> bool {
        self.factor.is_some() && self.active == active
    }

    /// Adds the derivatives of the functions to the linear part.
    pub fn linearise(&mut self, slopes: &[f64]) {
        self.fresh = false;
        self.values.copy_from_slice(&self.linear.values);
        for e in &self.entries.list {
            self.values[e.at as usize] += e.factor * slopes[e.slot as usize];
        }
    }

    /// The unknowns and multipliers that the Jacobian factored last leaves open.
    pub fn held(&self) -> Vec<usize> {
        let factor = self.factor.as_ref().filter(|_| self.open);
        factor.map_or_else(Vec::new, Factor::held)
    }

    /// The combination of the rows that vanishes but for what holds column `c`, into `y`.
    pub fn contradiction(
        &self,
        n: usize,
        active: &[bool],
        c: usize,
        y: &mut [f64],
        work: &mut [f64],
    ) {
        y.fill(0.0);
        y[c] = 1.0;
        let solved = self.factor.as_ref().map(|f| f.solve_transposed(y, work));
        if !matches!(solved, Some(Ok(()))) {
            y.fill(f64::NAN);
        }
        self.scaling.scale_rows(n, active, y);
    }

    /// `out += factor J_c` with a column of the Jacobian of all pairs.
    pub fn add_column(&self, c: usize, factor: f64, out: &mut [f64]) {
        for at in self.jacobian.colptr[c]..self.jacobian.colptr[c + 1] {
            out[self.jacobian.rowidx[at]] += factor * self.values[at];
        }
    }

    /// Scales the present Jacobian so that its entries come near one; false if it already is.
    fn rescale(&mut self, eq: &Equations) -> bool {
        if std::mem::replace(&mut self.fresh, true) {
            return false;
        }
        let Assembly { jacobian, values, scaling, .. } = self;
        let Scaling { columns: scale, rows: row_scale, weight, known, count } = scaling;
        for c in 0..jacobian.ncols {
            let range = jacobian.colptr[c]..jacobian.colptr[c + 1];
            let entries = jacobian.rowidx[range.clone()].iter().zip(&values[range.clone()]);
            for (out, (&r, &v)) in jacobian.values[range].iter_mut().zip(entries) {
                // what a blocking junction leaves is no measure of a circuit
                let counts = v.abs() * eq.unit[r] * eq.unit[c] >= NO_SLOPE;
                *out = if counts { v } else { 0.0 };
            }
        }
        *scale = equilibrate(jacobian);
        row_scale.copy_from_slice(scale);
        let mut largest = vec![0.0f64; eq.n];
        for (c, scale) in scale.iter().enumerate() {
            let range = jacobian.colptr[c]..jacobian.colptr[c + 1];
            for (&row, v) in jacobian.rowidx[range.clone()].iter().zip(&values[range]) {
                if row < eq.n && eq.places.leaks.binary_search(&row).is_ok() {
                    largest[row] = largest[row].max((v * scale).abs());
                }
            }
        }
        for (row, largest) in row_scale.iter_mut().zip(largest).filter(|row| row.1 > 0.0) {
            *row = largest.log2().round().exp2().recip();
        }
        for (c, scale) in scale.iter().enumerate() {
            for at in jacobian.colptr[c]..jacobian.colptr[c + 1] {
                weight[at] = row_scale[jacobian.rowidx[at]] * scale;
            }
        }
        (*known, *count) = (true, *count + 1);
        self.steady = false;
        self.factor = None;
        self.direct = None;
        true
    }

    /// Whether `factorise_directly` may serve.
    pub fn is_direct(&self) -> bool {
        self.scaling.known && !self.open && matches!(self.factor, Some(Factor::Dense(_)))
    }

    /// Factors the Jacobian with these derivatives in a mode, without `linearise`; false if it is
    /// singular.
    pub fn factorise_directly(&mut self, eq: &Equations, slopes: &[f64], active: &[bool]) -> bool {
        let direct = self.direct.get_or_insert_with(|| {
            let parts = Parts {
                linear: &self.linear.values,
                weight: &self.scaling.weight,
                derivatives: &self.entries.list,
                scales: [&self.scaling.rows, &self.scaling.columns],
            };
            Direct::new(eq, &parts)
        });
        self.directly = true;
        self.active.copy_from_slice(active);
        direct.factorise(slopes, active)
    }

    /// Factors the present Jacobian in a mode; what it leaves open is held with the pivot `hold`.
    /// False if it is singular.
    pub fn factorise(&mut self, eq: &Equations, active: &[bool], hold: f64) -> bool {
        if !self.scaling.known {
            self.rescale(eq);
        }
        if hold > 0.0 {
            return self.try_factorise(eq, active, hold);
        }
        if self.open {
            return false; // probably still: the factors that hold it will show it
        }
        if self.try_factorise(eq, active, 0.0) {
            return true;
        }
        // values far from those that the scaling was made for look singular
        self.rescale(eq) && self.try_factorise(eq, active, 0.0)
    }

    /// Computes the scaled Jacobian of the mode, in which pairs that block have no current, the columns that have
    /// changed, the largest entry and the largest of that column in which it is least.
    fn fill(&mut self, n: usize) -> [f64; 2] {
        let [mut largest, mut least] = [0.0f64, f64::INFINITY];
        let Assembly { jacobian, values, scaling: Scaling { weight, .. }, dirty, active, .. } =
            self;
        dirty.clear();
        for c in 0..jacobian.ncols {
            let range = jacobian.colptr[c]..jacobian.colptr[c + 1];
            let rows = &jacobian.rowidx[range.clone()];
            let new = values[range.clone()].iter().zip(&weight[range.clone()]).zip(rows);
            let (mut changed, mut size) = (false, 0.0f64);
            for (j, ((v, w), &row)) in jacobian.values[range].iter_mut().zip(new) {
                let blocks = row >= n && !active[row - n];
                let value = match blocks {
                    true => f64::from(u8::from(row == c)),
                    false => v * w,
                };
                changed |= *j != value;
                *j = value;
                size = size.max((v * w).abs());
            }
            (largest, least) = (largest.max(size), least.min(size));
            if changed {
                dirty.push(c);
            }
        }
        [largest, least]
    }

    fn try_factorise(&mut self, eq: &Equations, active: &[bool], hold: f64) -> bool {
        self.active.copy_from_slice(active);
        let [largest, least] = self.fill(eq.n);
        let badly = largest > BADLY_SCALED || BADLY_SCALED * least < 1.0;
        if hold > 0.0 && badly && self.rescale(eq) {
            self.fill(eq.n);
        }
        match &mut self.factor {
            Some(factor) => {
                factor.set_hold(hold);
                if hold == self.hold && !self.directly {
                    factor.refactor_columns(&self.jacobian, &self.dirty);
                } else {
                    factor.refactor(&self.jacobian);
                }
                if factor.pivot_ratio() <= OF_SOLUTION {
                    factor.factor(&self.jacobian); // the old order of pivots may be to blame
                }
            }
            None => {
                let factor = self.factor.insert(Factor::new(&self.jacobian, &eq.ordering));
                if hold > 0.0 {
                    factor.set_hold(hold);
                    factor.factor(&self.jacobian);
                }
            }
        }
        self.hold = hold;
        self.directly = false;
        let ratio = self.factor.as_ref().map_or(0.0, Factor::pivot_ratio);
        self.open = ratio <= hold;
        if hold > 0.0 {
            ratio > 0.0
        } else {
            ratio > OF_SOLUTION
        }
    }

    /// `x := J^-1 x` in physical units, in the mode factored last.
    pub fn solve(&self, n: usize, active: &[bool], x: &mut [f64], work: &mut [f64]) {
        if let (Some(direct), true) = (&self.direct, self.directly) {
            return direct.solve(active, x, work);
        }
        self.scaling.scale_rows(n, active, x);
        let solved = self.factor.as_ref().map(|f| f.solve(x, work));
        if !matches!(solved, Some(Ok(()))) {
            x.fill(f64::NAN);
        }
        for (v, s) in x.iter_mut().zip(&self.scaling.columns) {
            *v *= s;
        }
    }
}
