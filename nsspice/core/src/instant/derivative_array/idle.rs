//! Pairs whose guards are zero as long as a mode lasts: combinations of the equations that hold in it.
//!
//! A conducting diode that only blocking branches join to the rest carries nothing; a blocking one between nodes that
//! closed switches join has no voltage.  No rate decides about such a pair, of any order: it may stay as it is, as
//! ideal pairs side by side do of which the smallest currents (`shared`) leave one without.
//!
//! ```text
//! y' (G z + F f + A l - S u) + sum_j c_j w_j  =  the guard of the pair, for all z, f, l and u
//! ```

use super::DerivativeArray;
use crate::dense::{Complete, Matrix};
use crate::descriptor::Linear;
use crate::newton::Newton;
use crate::rounding::of_elimination;

/// The equations that hold in one mode, by the coefficients of all their terms.
pub(super) struct Equations {
    /// coefficients by equations, and factorised
    terms: Matrix,
    factor: Complete,
    /// equations of laws, which come first
    laws: usize,
}

impl DerivativeArray {
    /// The equations of the present mode that contain no rate.
    pub(super) fn equations(&mut self, linear: &Linear, newton: Option<&Newton>) -> Equations {
        let (n, conductors) = (self.n, self.conductors.len());
        let (sources, functions) = (linear.s.ncols, self.now.len());
        let rows: Vec<usize> = (0..n).filter(|&r| !self.stored[r]).collect();
        let constant = n + conductors;
        let (driven, from) = (constant + 1, constant + 1 + sources);
        let size = (from + 2 * functions).max(rows.len() + conductors);
        let mut terms = Matrix::zeros(size, size);
        // sources and functions, column by column
        let mut outside = vec![vec![0.0; n]; sources + 2 * functions];
        linear.s.iter().for_each(|(r, c, v)| outside[c][r] -= v);
        for (row, k, [f, q]) in newton.into_iter().flat_map(Newton::each_function) {
            outside[sources + k][row] += f;
            outside[sources + functions + k][row] += q;
        }
        for (c, list) in outside.into_iter().enumerate() {
            let list = self.in_basis(list);
            rows.iter().enumerate().for_each(|(at, &r)| terms[(driven + c, at)] = list[r]);
        }
        for (at, &r) in rows.iter().enumerate() {
            (0..n).for_each(|c| terms[(c, at)] = self.conducting[(r, c)]);
            for (c, &k) in self.conductors.iter().enumerate() {
                terms[(n + c, at)] = self.a[(r, k)];
            }
        }
        for (at, &k) in self.conductors.iter().enumerate() {
            let slack = self.slack_terms(linear, k, size);
            (0..size).for_each(|c| terms[(c, rows.len() + at)] = slack[c]);
        }
        let mut factor = Complete::default();
        factor.factor(&terms);
        Equations { terms, factor, laws: rows.len() }
    }

    /// The coefficients of a slack.
    fn slack_terms(&self, linear: &Linear, k: usize, size: usize) -> Vec<f64> {
        let mut terms = vec![0.0; size];
        (0..self.n).for_each(|c| terms[c] = -self.b[(k, c)]);
        for (c, &j) in self.conductors.iter().enumerate() {
            let own = linear.d.nonzeros(j).into_iter().find(|e| e.0 == k);
            terms[self.n + c] = own.map_or(0.0, |e| e.1);
        }
        terms[self.n + self.conductors.len()] = linear.q[k];
        terms
    }

    /// Whether a pair may stay as it is as long as the mode lasts.
    pub(super) fn is_idle(&self, linear: &Linear, equations: &mut Equations, k: usize) -> bool {
        let size = equations.terms.rows;
        if let Some(c) = self.conductors.iter().position(|&j| j == k) {
            let mut guard = vec![0.0; size];
            guard[self.n + c] = 1.0;
            return equations.combine_to(&guard).is_some();
        }
        let guard = self.slack_terms(linear, k, size);
        let Some(parts) = equations.combine_to(&guard) else { return false };
        if parts[..equations.laws].iter().any(|part| *part != 0.0) {
            return false;
        }
        // a current around the loop of conducting pairs that it closes would be no smaller
        let loops = || self.conductors.iter().zip(&parts[equations.laws..]);
        let closed = (0..self.n).all(|r| {
            let terms = || loops().map(|(&j, part)| part * self.a[(r, j)]);
            let most = terms().fold(self.a[(r, k)].abs(), |most, v| most.max(v.abs()));
            (self.a[(r, k)] - terms().sum::<f64>()).abs() <= of_elimination(size) * most
        });
        closed && loops().map(|(&j, part)| part * self.l[j]).sum::<f64>() <= 0.0
    }
}

impl Equations {
    /// The part of each equation in the combination that has these terms; nothing if there is none.
    fn combine_to(&mut self, guard: &[f64]) -> Option<Vec<f64>> {
        let mut parts = guard.to_vec();
        self.factor.solve(&mut parts);
        let rounding = of_elimination(guard.len());
        let holds = |(r, guard): (usize, &f64)| {
            let terms = || self.terms.row(r).iter().zip(&parts).map(|(term, part)| term * part);
            let most = terms().fold(guard.abs(), |most, v| most.max(v.abs()));
            (terms().sum::<f64>() - guard).abs() <= rounding * most
        };
        guard.iter().enumerate().all(holds).then_some(parts)
    }
}
