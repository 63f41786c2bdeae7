//! The rates at t+ in one mode, and the values that only they determine.

use super::{DerivativeArray, Moment};
use crate::dense::{add_scaled, dot, Matrix};
use crate::descriptor::Linear;
use crate::newton::Newton;
use crate::rounding::of_elimination;
use crate::tape::Linearisation;
use crate::tolerances::NO_JUMP;

impl DerivativeArray {
    /// The rates, and the values that they determine; false if they do not, or the equations do not hold.
    pub(super) fn find_rates(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
    ) -> bool {
        let n = self.n;
        self.linearise(linear, newton, from, at, Linearisation::Exact);
        self.assemble(linear);
        self.system.factor(&self.matrix);
        let kernel = self.system.kernel();
        let free = self.system.free().to_vec();
        if !free.is_empty() {
            self.replace_columns(&kernel, &free);
            self.onward.factor(&self.matrix);
            if !self.determines(linear, &kernel, &free) {
                return false;
            }
            // the condition on what is stored, to its last digit
            self.right_of_values();
            self.onward.solve(&mut self.x);
            free.iter().for_each(|&column| self.x[column] = 0.0);
            let moved = self.advance(linear, at.largest);
            if moved.is_nan() || moved > NO_JUMP {
                return false;
            }
            self.linearise(linear, newton, from, at, Linearisation::Exact);
        }
        if !self.holds(linear) {
            return false;
        }
        self.right_of_rates(linear, newton, at);
        let right = self.x.clone();
        let factor = if free.is_empty() { &mut self.system } else { &mut self.onward };
        factor.solve(&mut self.x);
        // equations of little else than a large term's rounding get digits of their own
        let mut rest = right.clone();
        for (r, rest) in rest.iter_mut().enumerate() {
            *rest -= dot(self.matrix.row(r), &self.x);
        }
        factor.solve(&mut rest);
        add_scaled(&mut self.x, 1.0, &rest);
        let factor = if free.is_empty() { &self.system } else { &self.onward };
        if !self.solved(&right, factor) {
            return false;
        }
        let mut along = vec![0.0; self.x.len()];
        for (j, &column) in free.iter().enumerate() {
            let part = std::mem::take(&mut self.x[column]);
            (0..along.len()).for_each(|c| along[c] += part * kernel[(c, j)]);
        }
        self.take_rates(newton, &kernel, at);
        if free.is_empty() {
            return true;
        }
        // a pair whose multiplier the rates determine has no rate of it
        for (c, &k) in self.conductors.iter().enumerate() {
            self.turning[k] = if along[n + c] == 0.0 { self.turning[k] } else { f64::NAN };
        }
        self.x.copy_from_slice(&along);
        self.advance(linear, 0.0);
        self.linearise(linear, newton, from, at, Linearisation::Exact);
        self.holds(linear)
    }

    /// Puts `K X` into the columns of the free unknowns, where something is stored; what is left of rounding is zero.
    pub(super) fn replace_columns(&mut self, kernel: &Matrix, free: &[usize]) {
        let (n, size) = (self.n, self.matrix.rows);
        let rounding = of_elimination(size);
        for (j, &column) in free.iter().enumerate() {
            let along = |c: usize| kernel[(c, j)];
            for r in 0..size {
                self.matrix[(r, column)] = 0.0;
                if r >= n || !self.stored[r] {
                    continue;
                }
                let unknowns = (0..n).map(|c| self.conducting[(r, c)] * along(c));
                let pairs = self.conductors.iter().enumerate();
                let pairs = pairs.map(|(c, &k)| self.a[(r, k)] * along(n + c));
                let terms = unknowns.chain(pairs);
                let (sum, most) = terms.fold((0.0, 0.0), |(s, m), v| (s + v, m + f64::abs(v)));
                if f64::abs(sum) > rounding * most {
                    self.matrix[(r, column)] = sum;
                }
            }
        }
    }

    /// Whether the rates determine all values, but for potentials that no equation contains: those stay.  Currents that
    /// nothing determines are shared otherwise than here.
    pub(super) fn determines(&self, linear: &Linear, kernel: &Matrix, free: &[usize]) -> bool {
        self.onward.free().iter().all(|&column| {
            let stays = |at: usize| {
                (0..self.matrix.rows).all(|r| {
                    let voltage = linear.row_kind.get(r) == Some(&0);
                    self.matrix[(r, column)] == 0.0 && (voltage || kernel[(r, at)] == 0.0)
                })
            };
            free.iter().position(|&free| free == column).is_some_and(stays)
        })
    }

    /// Takes the rates of unknowns, multipliers and functions from the solution.
    pub(super) fn take_rates(
        &mut self,
        newton: &Option<&mut Newton>,
        kernel: &Matrix,
        at: &Moment,
    ) {
        let n = self.n;
        self.open.fill(false);
        for c in (0..n).filter(|&c| kernel.row(c).iter().any(|v| *v != 0.0)) {
            match &self.basis {
                Some(basis) => (0..n).for_each(|r| self.open[r] |= basis[(r, c)] != 0.0),
                None => self.open[c] = true,
            }
        }
        self.turning.fill(0.0);
        let rates = self.conductors.iter().zip(&self.x[n..]);
        rates.for_each(|(&k, rate)| self.turning[k] = *rate);
        match &self.basis {
            Some(basis) => basis.apply(&self.x[..n], &mut self.rates),
            None => self.rates.copy_from_slice(&self.x[..n]),
        }
        if let Some(newton) = newton {
            let (slopes, time) = (at.sources[1], at.time[1]);
            newton.rates_of_functions(Some(&self.rates), slopes, time, &mut self.function_rates);
        }
    }
}
