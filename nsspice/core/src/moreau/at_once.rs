//! Laws that hold at once: those in which nothing is stored, and sums of laws in which nothing is.

use std::mem::take;

use super::jumps::ROUNDING;
use super::stage::System;
use super::stepper::Stepper;
use crate::descriptor::{sums_that_store_nothing, ties_of_coils};
use crate::sparse::Csc;

/// Which laws of a network hold at once.
pub(super) struct AtOnce {
    /// groups of laws in whose sum nothing is stored; most are one law
    pub sums: Vec<Vec<usize>>,
    /// some of them tie currents of coils to each other: potentials that only their rates determine
    pub ties_rates: bool,
    /// whether something is stored in each law, apart from what functions store
    pub stores: Vec<bool>,
}

impl AtOnce {
    /// Finds them, also among functions.
    pub fn new(sys: &System) -> AtOnce {
        let none = Csc::zeros(sys.linear.g.nrows, 0);
        let (f, q) = sys.smooth.as_ref().map_or((&none, &none), |smooth| (&smooth.f, &smooth.q));
        let sums = sums_that_store_nothing(&sys.linear.e, q);
        let mut stores = vec![false; sys.linear.g.nrows];
        sys.linear.e.iter().for_each(|e| stores[e.0] = true);
        // pairs may be open
        let ties = ties_of_coils(&sys.linear, &sums, &[f]);
        AtOnce { ties_rates: ties.iter().any(|coils| !coils.is_empty()), sums, stores }
    }
}

impl Stepper {
    /// What is found at the present state.
    pub(super) fn at_present<T>(
        &mut self,
        find: impl FnOnce(&mut Stepper, &[f64], &[f64]) -> T,
    ) -> T {
        let (z, l) = (take(&mut self.z), take(&mut self.l));
        let found = find(self, &z, &l);
        (self.z, self.l) = (z, l);
        found
    }

    /// What acts in each law at a state, without what is stored, and the sizes of its terms.
    pub(super) fn acting_at(&mut self, z: &[f64], l: &[f64]) -> [Vec<f64>; 2] {
        let f = self.functions_at(z);
        let linear = &self.sys.linear;
        let [mut acting, mut sizes] = [(); 2].map(|()| vec![0.0; z.len()]);
        let terms = [(&linear.g, 1.0, z), (&linear.a, 1.0, l), (&linear.s, -1.0, &self.u0[..])];
        for (matrix, sign, x) in terms {
            matrix.mul_add(sign, x, &mut acting);
            matrix.abs_mul_add(x, &mut sizes);
        }
        if let Some(smooth) = &self.smooth {
            smooth.newton.add_flowing(&f, &mut acting, &mut sizes);
        }
        [acting, sizes]
    }

    /// How far a state is from obeying the laws, and sums of laws, in which nothing is stored, as a part of
    /// their terms.
    pub(super) fn missed_by(&mut self, z: &[f64], l: &[f64]) -> f64 {
        let [missed, sizes] = self.acting_at(z, l);
        let sum = |list: &[f64], rows: &[usize]| rows.iter().map(|&row| list[row]).sum::<f64>();
        // beside all laws of its kind, whose rounding a law of zeros may have
        let most = self.sys.largest(&[&sizes]).map(|size| ROUNDING * size);
        let kind = |rows: &[usize]| usize::from(self.sys.linear.row_kind[rows[0]]);
        let sums = self.facts.at_once.sums.iter();
        let sums = sums.map(|rows| (sum(&missed, rows), sum(&sizes, rows).max(most[kind(rows)])));
        sums.filter(|(_, size)| *size > 0.0)
            .fold(0.0, |worst, (missed, size)| f64::max(worst, missed.abs() / size))
    }
}
