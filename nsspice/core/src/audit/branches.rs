//! Inductors and sources, each relative to its own voltages so far.
//!
//! Elsewhere rounding is measured by the largest voltage and current and by the shortest time that rates represent
//! (see [`super::rounding`]): next to picoseconds any voltage across an inductor of amperes would be none.  The
//! constitutive equation of a branch is known better.  Its flux has the rounding of the currents that meet at its
//! ends, a quotient of increments that of the flux over the step, the rate of a closed form none relative to the
//! voltages that make it; and any rounding excuses no more than [`EXCUSED`] of the largest voltage that the
//! branch itself has had so far.

use super::judge::EXCUSED;
use super::matrix::Entries;
use super::rounding::Reach;
use super::TOLERANCE;

/// Constitutive equations of branches.
pub struct Branches {
    /// of each branch: the unknowns of the currents whose rates appear in its equation, and their inductances
    inductances: Vec<Vec<(usize, f64)>>,
    /// of each current: the nodes between which it flows
    ends: Vec<Vec<usize>>,
    /// equations that contain functions: known to what their slopes make of the rounding of what they read
    functional: Vec<bool>,
    /// largest sum of the sizes of the terms of each equation so far
    terms: Vec<f64>,
    /// largest value of each unknown so far
    values: Vec<f64>,
}

impl Branches {
    pub fn new(kinds: &[u8], e: &Entries, g: &Entries, functional: Vec<bool>) -> Branches {
        let n = kinds.len();
        let (mut inductances, mut ends) = (vec![Vec::new(); n], vec![Vec::new(); n]);
        for (row, current, value) in e.entries().filter(|e| kinds[e.0] == 1 && kinds[e.1] == 1) {
            inductances[row].push((current, value.abs()));
        }
        for (node, current, _) in g.entries().filter(|e| kinds[e.0] == 0 && kinds[e.1] == 1) {
            ends[current].push(node);
        }
        Branches { inductances, ends, functional, terms: vec![0.0; n], values: vec![0.0; n] }
    }

    /// Takes a point and the sizes of the terms of all equations there.
    pub fn see(&mut self, z: &[f64], sizes: &[f64]) {
        self.values.iter_mut().zip(z).for_each(|(most, v)| *most = most.max(v.abs()));
        self.terms.iter_mut().zip(sizes).for_each(|(most, size)| *most = most.max(*size));
    }

    /// The voltage that rounding may make of a branch, in units of the tolerance: `share` of what the `largest` values
    /// bring, and at a rate of the fluxes, next to terms of these `sizes` at the point.
    pub fn floor(
        &self,
        row: usize,
        [share, rate]: [f64; 2],
        reach: &Reach,
        largest: &[f64; 2],
        sizes: &[f64],
    ) -> f64 {
        if self.functional[row] {
            return f64::INFINITY;
        }
        let current = |j: usize| self.ends[j].iter().fold(self.values[j], |i, &k| i.max(sizes[k]));
        let flux: f64 = self.inductances[row].iter().map(|&(j, value)| value * current(j)).sum();
        let rounding = share * (reach.acting(row, largest) + rate * flux);
        rounding.max(EXCUSED / TOLERANCE * self.terms[row])
    }
}
