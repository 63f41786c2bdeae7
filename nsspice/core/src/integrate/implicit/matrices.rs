//! The matrices of one step length, and the equations of a step in a mode.

use crate::mlcp::ModeFactor;
use crate::rounding::OF_EQUATION;
use crate::sparse::Csc;
use crate::tolerances::NO_JUMP;

/// Singular modes of up to so many unknowns and pairs are solved for increments too, and unsound ones
/// with sums.
pub(in crate::integrate) const OPEN: usize = 160;

/// The matrices of one step: `K z1 + A l = carry z0 + source_end u1 + source_start u0`.
///
/// In a short step `carry z0` and `K z1` are large and nearly equal, and where a node is connected by
/// little else (a floating part with 1 MOhm to ground) their rounding errors would be its potential.
/// There modes are solved for the increment, which contains nothing large:
/// `K (z1 - z0) + A l = -G z0 + source_end u1 + source_start u0`.
pub struct StepMatrices {
    /// number of unknowns
    pub n: usize,
    /// number of pairs
    pub m: usize,
    /// `E/h + H`
    pub carry: Csc,
    /// `S - Hs`
    pub source_end: Csc,
    /// `Hs`
    pub source_start: Csc,
    /// `carry`, `G = K - carry`, A, B and D by rows: gathering is faster than scattering
    pub(in crate::integrate) carry_rows: Csc,
    pub(in crate::integrate) g_rows: Csc,
    pub(in crate::integrate) a_rows: Csc,
    pub(in crate::integrate) b_rows: Csc,
    pub(in crate::integrate) d_rows: Csc,
    /// constant slack
    pub q: Vec<f64>,
}

impl StepMatrices {
    /// Turns a solution `[z; l]` into `[z; guards]`: l of active pairs, `w = q - B z + D l` of the
    /// others.  `w` is scratch.
    pub fn guards(&self, x: &mut [f64], active: &[bool], with_constant: bool, w: &mut [f64]) {
        let (z, l) = x.split_at_mut(self.n);
        for (i, (w, _)) in w.iter_mut().zip(active).enumerate().filter(|(_, (_, &a))| !a) {
            let constant = if with_constant { self.q[i] } else { 0.0 };
            *w = constant - self.b_rows.col_dot(i, z) + self.d_rows.col_dot(i, l);
        }
        for ((l, &w), _) in l.iter_mut().zip(&*w).zip(active).filter(|(_, &a)| !a) {
            *l = w;
        }
    }

    /// Right-hand sides for the increment `[z1 - z0; l]` in a mode.
    pub(in crate::integrate) fn increment(
        &self,
        Ends { z0, u0, u1 }: Ends,
        active: &[bool],
        out: &mut [f64],
    ) {
        let (rows, pairs) = out.split_at_mut(self.n);
        for (i, r) in rows.iter_mut().enumerate() {
            *r = -self.g_rows.col_dot(i, z0);
        }
        self.source_end.mul_add(1.0, u1, rows);
        self.source_start.mul_add(1.0, u0, rows);
        for (i, (x, &active)) in pairs.iter_mut().zip(active).enumerate() {
            *x = if active { self.b_rows.col_dot(i, z0) - self.q[i] } else { 0.0 };
        }
    }

    /// Solves a regular mode with the step equations: `x = [z; l]`.
    pub(in crate::integrate) fn solve(
        &self,
        factor: &ModeFactor,
        active: &[bool],
        ends: Ends,
        refined: bool,
        x: &mut [f64],
        work: &mut [f64],
    ) {
        let (rhs, pairs) = x.split_at_mut(self.n);
        self.right_hand_side(ends.z0, ends.u0, ends.u1, rhs);
        for ((x, &q), &active) in pairs.iter_mut().zip(&self.q).zip(active) {
            *x = if active { -q } else { 0.0 };
        }
        if !refined {
            return factor.solve(x, work);
        }
        let (rhs, work) = work.split_at_mut(x.len());
        rhs.copy_from_slice(x);
        factor.solve(x, work);
        factor.correct(x, rhs, work);
    }

    /// Solves a mode for the increment, given a solution `x = [z; l]` that has the rounding errors of
    /// `K z`; what the mode leaves open stays where it is.  False if it would take too long.
    pub fn sharpen(
        &self,
        factor: &ModeFactor,
        active: &[bool],
        ends: Ends,
        x: &mut [f64],
        work: &mut [f64],
    ) -> bool {
        if factor.regular() {
            self.increment(ends, active, x);
            factor.solve(x, work);
        } else if x.len() <= OPEN {
            let (rhs, work) = work.split_at_mut(x.len());
            self.increment(ends, active, rhs);
            for (x, z) in x.iter_mut().zip(ends.z0) {
                *x -= z;
            }
            factor.correct(x, rhs, work);
        } else {
            return false;
        }
        for (x, z) in x[..self.n].iter_mut().zip(ends.z0) {
            *x += z;
        }
        true
    }

    /// Whether in `x = [z; l]`, the end of a step, the charge (flux) that came into some store is not
    /// the one that flowed: where the sum of two large voltages is stored, each of which a map gives
    /// to its own digits, more may be lost than rounding of the two.
    pub fn loses_charge(&self, ends: Ends, active: &[bool], x: &[f64], work: &mut [f64]) -> bool {
        let (z, l) = x.split_at(self.n);
        self.increment(ends, active, work);
        (0..self.n).any(|i| {
            let (indices, values) = self.carry_rows.col(i);
            let (mut came, mut held) = (0.0, 0.0f64);
            for (&j, &v) in indices.iter().zip(values) {
                came += v * (z[j] - ends.z0[j]);
                held += (v * z[j]).abs();
            }
            if held == 0.0 {
                return false;
            }
            let (indices, values) = self.g_rows.col(i);
            let moved = indices.iter().zip(values).map(|(&j, v)| v * (z[j] - ends.z0[j]));
            let (indices, values) = self.a_rows.col(i);
            let carried = indices.iter().zip(values).filter(|(&j, _)| active[j]);
            let flow = work[i] - moved.sum::<f64>() - carried.map(|(&j, v)| v * l[j]).sum::<f64>();
            // what a map loses of what came into a store is to be no jump
            (flow - came).abs() > NO_JUMP * came.abs() + OF_EQUATION * held
        })
    }

    /// Right-hand side of the rows of z.
    pub fn right_hand_side(&self, z0: &[f64], u0: &[f64], u1: &[f64], rhs: &mut [f64]) {
        for (i, r) in rhs.iter_mut().enumerate() {
            *r = self.carry_rows.col_dot(i, z0);
        }
        self.add_sources(u0, u1, rhs);
    }

    /// Adds the part of the right-hand side that does not depend on the state.
    pub fn add_sources(&self, u0: &[f64], u1: &[f64], rhs: &mut [f64]) {
        self.source_end.mul_add(1.0, u1, rhs);
        self.source_start.mul_add(1.0, u0, rhs);
    }
}

/// What a step is given: the state at its begin, the sources at its begin and its end.
#[derive(Clone, Copy)]
pub struct Ends<'a> {
    pub z0: &'a [f64],
    pub u0: &'a [f64],
    pub u1: &'a [f64],
}
