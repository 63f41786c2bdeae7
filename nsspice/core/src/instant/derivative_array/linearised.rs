//! The equations at one point: residuals, sizes of their terms, matrices and right-hand sides.

use super::charges::combine;
use super::{DerivativeArray, Moment};
use crate::dense::Complete;
use crate::descriptor::Linear;
use crate::newton::Newton;
use crate::tape::Linearisation;
use crate::tolerances::{ACCEPT, FLOOR};

impl DerivativeArray {
    /// Linearises everything at the present point.
    pub(super) fn linearise(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
        how: Linearisation,
    ) {
        let DerivativeArray { flow, size, held, z, l, now, before, scratch, .. } = self;
        let u = at.sources[0];
        [&mut *flow, size, held].into_iter().for_each(|list| list.fill(0.0));
        linear.s.mul_add(1.0, u, flow);
        linear.s.abs_mul_add(u, size);
        linear.g.mul_add(-1.0, z, flow);
        linear.g.abs_mul_add(z, size);
        linear.a.mul_add(-1.0, l, flow);
        linear.a.abs_mul_add(l, size);
        for ((change, z), from) in scratch.iter_mut().zip(z.iter()).zip(from) {
            *change = z - from;
        }
        match at.charges {
            Some(charges) => {
                linear.e.mul_add(1.0, z, held);
                held.iter_mut().zip(charges).for_each(|(held, charge)| *held -= charge);
            }
            None => linear.e.mul_add(1.0, scratch, held),
        }
        linear.slacks(z, l, &mut self.slack);
        let Some(newton) = newton else { return };
        newton.linearise(z, u, at.time[0], how);
        newton.values(now);
        self.storing.clone_from(&self.e);
        self.conducting.clone_from(&self.g);
        for (row, k, [f, q]) in newton.each_function() {
            flow[row] -= f * now[k];
            size[row] += (f * now[k]).abs();
            let from = if at.charges.is_some() { 0.0 } else { before[k] };
            held[row] += q * (now[k] - from);
        }
        for (row, column, [f, q]) in newton.each_slope() {
            self.conducting[(row, column)] += f;
            self.storing[(row, column)] += if at.keeps[row] { q } else { 0.0 };
        }
        combine(&self.combinations, &mut self.conducting);
        combine(&self.combinations, &mut self.storing);
    }

    /// A list of laws in the coordinates of the matrices, combined as these are.
    pub(super) fn in_basis(&mut self, mut list: Vec<f64>) -> Vec<f64> {
        if let Some(basis) = &self.basis {
            self.scratch.fill(0.0);
            basis.apply_transposed(&list, &mut self.scratch);
            list.copy_from_slice(&self.scratch);
        }
        self.combine_list(&mut list);
        list
    }

    /// Fills the matrix of values and rates.
    pub(super) fn assemble(&mut self, linear: &Linear) {
        let n = self.n;
        self.conductors.clear();
        self.conductors.extend((0..self.m).filter(|&k| self.active[k]));
        let all = n + self.conductors.len();
        self.matrix.reshape(all, all);
        self.matrix.data.fill(0.0);
        for r in 0..n {
            let row = if self.stored[r] { self.storing.row(r) } else { self.conducting.row(r) };
            self.matrix.row_mut(r)[..n].copy_from_slice(row);
            if !self.stored[r] {
                for (c, &k) in self.conductors.iter().enumerate() {
                    self.matrix[(r, n + c)] = self.a[(r, k)];
                }
            }
        }
        for (r, &k) in self.conductors.iter().enumerate() {
            self.matrix.row_mut(n + r)[..n].copy_from_slice(self.b.row(k));
            for (c, &j) in self.conductors.iter().enumerate() {
                let (rows, values) = linear.d.col(j);
                let found = rows.iter().position(|&row| row == k);
                self.matrix[(n + r, n + c)] = found.map_or(0.0, |at| -values[at]);
            }
        }
    }

    /// Right-hand sides of the values.
    pub(super) fn right_of_values(&mut self) {
        let flow = self.in_basis(self.flow.clone());
        let held = self.in_basis(self.held.clone());
        self.x.clear();
        let laws = self.stored.iter().zip(flow.iter().zip(&held));
        self.x.extend(laws.map(|(&stored, (flow, held))| if stored { -held } else { *flow }));
        self.x.extend(self.conductors.iter().map(|&k| self.slack[k]));
    }

    /// Right-hand sides of the rates.
    pub(super) fn right_of_rates(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        at: &Moment,
    ) {
        let slopes = at.sources[1];
        let mut rising = vec![0.0; self.n];
        linear.s.mul_add(1.0, slopes, &mut rising);
        let mut flow = self.flow.clone();
        if let Some(newton) = newton {
            newton.rates_of_functions(None, slopes, at.time[1], &mut self.function_rates);
            for (row, k, [f, q]) in newton.each_function() {
                rising[row] -= f * self.function_rates[k];
                flow[row] -= q * self.function_rates[k];
            }
        }
        let (flow, rising) = (self.in_basis(flow), self.in_basis(rising));
        self.x.clear();
        let laws = self.stored.iter().zip(flow.iter().zip(&rising));
        self.x.extend(laws.map(|(&stored, (flow, rising))| if stored { *flow } else { *rising }));
        self.x.resize(self.matrix.rows, 0.0);
    }

    /// Whether the residuals of all equations without storage are below the tolerance, and conducting pairs have no slack.
    pub(super) fn holds(&mut self, linear: &Linear) -> bool {
        let flow = self.in_basis(self.flow.clone());
        let mut size: Vec<f64> = match &self.basis {
            Some(basis) => {
                let of = |c: usize| (0..self.n).map(|r| basis[(r, c)].abs() * self.size[r]).sum();
                (0..self.n).map(of).collect()
            }
            None => self.size.clone(),
        };
        self.combine_sizes(&mut size);
        let mut most = [0.0f64; 2];
        for (&kind, &size) in linear.row_kind.iter().zip(&size) {
            most[usize::from(kind)] = most[usize::from(kind)].max(size);
        }
        let laws = (0..self.n).filter(|&r| !self.stored[r]).all(|r| {
            let floor = FLOOR * most[usize::from(linear.row_kind[r])];
            // a junction that is far beyond its voltage has no current in the range of numbers
            flow[r].is_finite() && flow[r].abs() <= ACCEPT * size[r].max(floor)
        });
        let largest = |list: &[f64]| list.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let volts = largest(&linear.q).max(largest(&self.z)).max(largest(&self.slack));
        laws && self.conductors.iter().all(|&k| self.slack[k].abs() <= ACCEPT * volts)
    }

    /// Whether the rates fulfil their equations: but for the tolerance, or for what rounding leaves of them.
    pub(super) fn solved(&self, right: &[f64], factor: &Complete) -> bool {
        let x = &self.x;
        let mut rounding = Vec::new();
        x.iter().all(|x| x.is_finite())
            && right.iter().enumerate().all(|(r, &right)| {
                let terms = || self.matrix.row(r).iter().zip(x).map(|(a, x)| a * x);
                let size = terms().fold(right.abs(), |size, v| size + v.abs());
                let rest = (terms().sum::<f64>() - right).abs();
                if rest <= ACCEPT * size {
                    return true;
                }
                if rounding.is_empty() {
                    rounding = factor.residuals(x);
                }
                rest <= rounding[r]
            })
    }
}
