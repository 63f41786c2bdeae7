//! What functions store, whose rates count, and what they let flow.

use super::equations::{Equations, Part};
use super::solve::Newton;
use crate::tape::Linearisation;

impl Equations {
    /// `out += rate E z`, sums of laws included.
    pub(super) fn add_carried(&self, rate: f64, z: &[f64], out: &mut [f64]) {
        for &(r, c, _, v) in &self.stored {
            out[r as usize] += rate * v * z[c as usize];
        }
    }

    /// `out += rate Q f` with the functions `f`, sums of laws included.
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

    /// `out += F f` with the functions `f`, and the sizes of these terms.
    pub fn add_flowing(&self, f: &[f64], out: &mut [f64], sizes: &mut [f64]) {
        for t in self.eq.terms.iter().filter(|t| t.f != 0.0 && t.part != Part::Sum) {
            let term = t.f * f[t.function as usize];
            out[t.row as usize] += term;
            sizes[t.row as usize] += term.abs();
        }
    }

    /// Whether windings alone hold the potential of some nodes.
    pub fn has_cut_sets(&self) -> bool {
        self.eq.floating.has_cut_sets()
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
        s.right.copy_from_slice(right);
        eq.add_carried(rate, &x[..eq.n], &mut s.right);
        tape.evaluate(&x[..eq.n], &s.u, s.t, Linearisation::Exact);
        eq.add_carried_functions(rate, |k| tape.value(k), &mut s.right);
    }

    /// The rows in which functions stand.
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

    /// Unknowns that stored functions depend on.
    pub fn stored_unknowns(&self) -> Vec<usize> {
        let mut list: Vec<usize> =
            self.eq.entries.iter().filter(|e| e.q != 0.0).map(|e| e.column as usize).collect();
        list.sort_unstable();
        list.dedup();
        list
    }
}
