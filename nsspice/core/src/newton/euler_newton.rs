//! Euler-Newton steps along a path of solutions, one or more linearised problems per grid point.
//!
//! R. Cibulka, T. Roubal, *Solution stability and path-following for a class of generalized
//! equations* (2017), methods (21) and (22); T. Roubal, *Non-smooth analysis in engineering and
//! economics* (2015), methods (3.2) and (3.4).  Predictor and one corrector together have a grid error
//! of order four.

use super::convergence::Judgement;
use super::equations::Part;
use super::solve::Newton;
use crate::mlcp::{Residual, Role};
use crate::tape::Linearisation;

/// Correctors where the functions have kinks: there one linearisation may be that of the wrong side.
const WITH_KINKS: usize = 3;

/// How the path is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tracking {
    /// the predictor takes the rate of the data at the old point, (3.2); otherwise the data at the
    /// new point, (3.4)
    pub by_rate: bool,
    /// corrector steps
    pub correctors: usize,
}

/// The data of one point.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// right-hand side of the rows of z
    pub rhs: &'a [f64],
    /// sources and time that the functions see
    pub u: &'a [f64],
    /// see `u`
    pub t: f64,
    /// constant slacks
    pub q: &'a [f64],
    /// roles of the pairs
    pub roles: &'a [Role],
}

impl Newton {
    /// The number of correctors that the functions ask for.
    pub fn usual_correctors(&self) -> usize {
        if self.tape.program().has_kinks() {
            WITH_KINKS
        } else {
            1
        }
    }

    /// Number of functions.
    pub fn functions(&self) -> usize {
        self.tape.program().len()
    }

    /// One Josephy-Newton step: solves the problem linearised at `z`, exactly.  Returns how well that
    /// linear problem holds, or None if it has no solution.
    pub fn linearised_step(
        &mut self,
        data: &Data,
        z: &mut [f64],
        l: &mut [f64],
    ) -> Option<Residual> {
        let n = self.eq.n;
        self.load(data.rhs, data.u, data.t, data.q, data.roles);
        let s = &mut self.state;
        s.x[..n].copy_from_slice(z);
        s.x[n..].copy_from_slice(l);
        s.limits.bounded = false;
        s.limits.begin.copy_from_slice(&s.x);
        self.activate_from_signs();
        self.evaluate_at_x(Linearisation::Exact, None);
        if !self.advance(None) {
            return None;
        }
        let found = self.judge_linear();
        let s = &self.state;
        if !found.residual.rows.is_finite() {
            return None;
        }
        z.copy_from_slice(&s.x[..n]);
        l.copy_from_slice(&s.x[n..]);
        Some(found.residual)
    }

    /// Residual of the linearised problem after `advance`.
    fn judge_linear(&mut self) -> Judgement {
        let assembly = &mut self.assemblies[self.present];
        assembly.linearise(self.tape.slopes());
        let pattern = &self.eq.pattern;
        let s = &mut self.state;
        for (c, (x, begin)) in s.x.iter().zip(&s.limits.begin).enumerate() {
            let moved = x - begin;
            if moved != 0.0 {
                for at in pattern.colptr[c]..pattern.colptr[c + 1] {
                    let (row, change) = (pattern.rowidx[at], assembly.values[at] * moved);
                    s.balance.defect[row] -= change;
                    s.balance.terms[row] += change.abs();
                }
            }
        }
        s.balance.judge(&self.eq, assembly, &self.tape, &s.problem.roles, &s.x, 0.0)
    }

    /// Residual of the equations themselves at a point.  A law is measured by what its slopes make of the unknowns,
    /// too: of one that is a single function nothing else is left where it holds.  A voltage along the tree has there
    /// the size of the potentials at its ends: so far a point of the path misses it.
    pub fn residual_at(&mut self, data: &Data, z: &[f64], l: &[f64]) -> Residual {
        let n = self.eq.n;
        self.load(data.rhs, data.u, data.t, data.q, data.roles);
        self.state.x[..n].copy_from_slice(z);
        self.state.x[n..].copy_from_slice(l);
        self.evaluate_at_x(Linearisation::Exact, None);
        let assembly = &mut self.assemblies[self.present];
        assembly.linearise(self.tape.slopes());
        let (pattern, s) = (&self.eq.pattern, &mut self.state);
        let mut sizes = vec![0.0; s.x.len()];
        let mut ends = s.x.clone();
        if let Some(tree) = &self.eq.tree {
            let at_nodes = tree.potentials(z);
            let before = |k: usize| usize::try_from(tree.before(k)).map_or(0.0, |j| at_nodes[j]);
            (0..n).for_each(|k| ends[k] = at_nodes[k].abs().max(before(k).abs()));
        }
        for (c, x) in ends.iter().enumerate() {
            for at in pattern.colptr[c]..pattern.colptr[c + 1] {
                sizes[pattern.rowidx[at]] += (assembly.values[at] * x).abs();
            }
        }
        let terms = s.balance.terms.iter_mut().zip(sizes);
        terms.for_each(|(terms, size)| *terms = terms.max(size));
        self.judge().residual
    }

    /// Takes the largest voltage and current of a point into those of its path.
    pub fn widen(&self, z: &[f64], largest: &mut [f64; 2]) {
        for (i, z) in z.iter().enumerate() {
            let kind = usize::from(self.eq.kind(i) != 0);
            largest[kind] = largest[kind].max(z.abs());
        }
    }

    /// How far one more step would move a followed point, voltages and currents; infinite if there is none.
    ///
    /// Where all terms of a law pass zero, its residual alone says nothing.
    pub fn left_to_move(&mut self, data: &Data, z: &[f64], l: &[f64]) -> [f64; 2] {
        let (mut next, mut pairs) = (z.to_vec(), l.to_vec());
        if self.linearised_step(data, &mut next, &mut pairs).is_none() {
            return [f64::INFINITY; 2];
        }
        next.iter_mut().zip(z).for_each(|(next, z)| *next -= z);
        let mut moves = [0.0; 2];
        self.widen(&next, &mut moves);
        moves
    }

    /// `out += factor F (df/du u' + df/dt)` from the derivatives of the last evaluation.
    pub fn add_drift(&self, factor: f64, u_rate: &[f64], t_rate: f64, out: &mut [f64]) {
        let n = self.eq.n;
        let slopes = self.tape.slopes();
        for term in self.eq.terms.iter().filter(|t| t.f != 0.0 && t.part != Part::Sum) {
            for (variable, slot) in self.tape.derivatives(term.function as usize) {
                let Some(k) = variable.checked_sub(n) else { continue };
                let rate = u_rate.get(k).copied().unwrap_or(t_rate);
                out[term.row as usize] += factor * term.f * slopes[slot] * rate;
            }
        }
    }
}
