//! What functions store, whose rates count, and what they let flow.

use super::equations::{Equations, Part};
use super::solve::Newton;
use crate::tape::Linearisation;

impl Equations {
    /// `out += rate E z`, cut-set equations included.
    pub(super) fn add_carried(&self, rate: f64, z: &[f64], out: &mut [f64]) {
        for &(r, c, _, v) in &self.stored {
            out[r as usize] += rate * v * z[c as usize];
        }
    }

    /// `out += rate Q f` with the functions `f`, cut-set equations included.
    pub(super) fn add_carried_functions(
        &self,
        rate: f64,
        f: impl Fn(usize) -> f64,
        out: &mut [f64],
    ) {
        for t in self.terms.iter().filter(|t| t.q != 0.0 && t.part != Part::Law) {
            out[t.row as usize] += rate * t.q * f(t.function as usize);
        }
    }
}

impl Newton {
    /// `out += factor Q f` with the functions `f`.
    pub fn add_stored(&self, factor: f64, f: &[f64], out: &mut [f64]) {
        for t in self.eq.terms.iter().filter(|t| t.q != 0.0 && t.part != Part::Sum) {
            out[t.row as usize] += factor * t.q * f[t.function as usize];
        }
    }

    /// The next solve is an implicit step from the unknowns `z`: adds the charges and fluxes that they
    /// carry, times the rate, to the laws, which its right-hand side then has to leave out.  In sums of
    /// laws they would leave nothing but their rounding.
    pub fn carry(&mut self, z: &[f64]) {
        self.carried.clear();
        self.carried.extend_from_slice(z);
    }

    /// The same for what the functions `f` store.
    pub fn carry_functions(&mut self, f: &[f64]) {
        self.carried_functions.clear();
        self.carried_functions.extend_from_slice(f);
    }

    /// Sets the right-hand side to `right + rate (E z + Q f(z))` for the point `x = [z; l]`.
    pub(super) fn hold_stored(&mut self, right: &[f64], x: &[f64], rate: f64) {
        let Newton { eq, tape, state: s, .. } = self;
        s.problem.right.copy_from_slice(right);
        eq.add_carried(rate, &x[..eq.n], &mut s.problem.right);
        tape.evaluate(&x[..eq.n], &s.problem.u, s.problem.t, Linearisation::Exact);
        eq.add_carried_functions(rate, |k| tape.value(k), &mut s.problem.right);
    }

    /// The rows that contain functions.
    pub fn rows_of_functions(&self) -> impl Iterator<Item = usize> + '_ {
        self.eq.terms.iter().filter(|t| t.part != Part::Sum).map(|t| t.row as usize)
    }

    /// Whether some function is stored: its rate counts.
    pub fn stores(&self) -> bool {
        self.eq.terms.iter().any(|t| t.q != 0.0)
    }

    /// What stored functions add to the storage matrix at a point.
    pub fn stored_slopes(&mut self, z: &[f64], u: &[f64], t: f64) -> Vec<(usize, usize, f64)> {
        self.tape.evaluate(z, u, t, Linearisation::Exact);
        let slopes = self.tape.slopes();
        let stored = self.eq.entries.iter().filter(|e| e.q != 0.0 && e.part != Part::Sum);
        stored.map(|e| (e.row as usize, e.column as usize, e.q * slopes[e.slot as usize])).collect()
    }

    /// The functions that are stored.
    pub fn stored_functions(&self) -> Vec<StoredFunction> {
        let mut found: Vec<StoredFunction> = Vec::new();
        let terms = self.eq.terms.iter().filter(|t| t.q != 0.0 && t.part != Part::Sum);
        for t in terms {
            let (function, row) = (t.function as usize, (t.row as usize, t.q));
            match found.iter_mut().find(|known| known.function == function) {
                Some(known) => {
                    known.rows.push(row);
                    known.size = known.size.max(t.q.abs());
                }
                None => found.push(StoredFunction {
                    function,
                    rows: vec![row],
                    slopes: self.tape.derivatives(function).filter(|e| e.0 < self.eq.n).collect(),
                    size: t.q.abs(),
                }),
            }
        }
        found
    }

    /// Of each function the rows that it enters, and the unknowns that it depends on.
    pub fn reads(&self) -> Vec<(Vec<usize>, Vec<usize>)> {
        let unknowns = |k| self.tape.derivatives(k).map(|e| e.0).filter(|&j| j < self.eq.n);
        let count = self.tape.program().len();
        let mut found: Vec<(Vec<usize>, Vec<usize>)> =
            (0..count).map(|k| (Vec::new(), unknowns(k).collect())).collect();
        for t in self.eq.terms.iter().filter(|t| t.part != Part::Sum) {
            found[t.function as usize].0.push(t.row as usize);
        }
        found
    }

    /// Slopes of the functions where they have been evaluated last.
    pub fn slopes(&self) -> &[f64] {
        self.tape.slopes()
    }

    /// Where stored functions are: laws, functions and coefficients.
    pub fn stored_rows(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let terms = self.eq.terms.iter().filter(|t| t.q != 0.0 && t.part != Part::Sum);
        terms.map(|t| (t.row as usize, t.function as usize, t.q))
    }

    /// Unknowns that stored functions depend on.
    pub fn stored_unknowns(&self) -> Vec<usize> {
        let mut list: Vec<usize> =
            self.eq.entries.iter().filter(|e| e.q != 0.0).map(|e| e.column as usize).collect();
        list.sort_unstable();
        list.dedup();
        list
    }
}

/// A function that is stored: a charge or a flux.
#[derive(Clone, Debug)]
pub struct StoredFunction {
    /// its number
    pub function: usize,
    /// where its rate enters: row and coefficient
    pub rows: Vec<(usize, f64)>,
    /// unknowns that it depends on, and the places of its slopes
    pub slopes: Vec<(usize, usize)>,
    /// the largest coefficient
    pub size: f64,
}

impl StoredFunction {
    /// The voltage (current) that does work on it: its power is that times its rate.
    pub fn voltage(&self, z: &[f64]) -> f64 {
        self.rows.iter().map(|&(row, q)| q * z[row]).sum()
    }
}
