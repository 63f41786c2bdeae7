//! What signs of guards and of their rates say of a mode.

use super::{DerivativeArray, Moment};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::newton::Newton;
use crate::tolerances::ACCEPT;

/// What the signs say of a mode.
pub(super) enum Signs {
    Right,
    Wrong(usize),
    Undecided,
}

impl DerivativeArray {
    /// What the signs of guards, and of their rates where guards are at zero, say of the mode.
    pub(super) fn signs(&mut self, linear: &Linear, newton: Option<&Newton>, at: &Moment) -> Signs {
        let mut worst = (0.0, None);
        let counts = |k: &usize| at.roles[*k] == Role::Diode && !self.is_shorted(*k, at.roles);
        let diodes: Vec<usize> = (0..self.m).filter(counts).collect();
        let guard = |k: usize| if self.active[k] { self.l[k] } else { self.slack[k] };
        let zero = |k: usize| at.zero[k][usize::from(self.active[k])];
        for &k in diodes.iter().filter(|&&k| guard(k) < -zero(k)) {
            let part = -guard(k) / zero(k).max(f64::MIN_POSITIVE);
            if part > worst.0 {
                worst = (part, Some(k));
            }
        }
        if let Some(k) = worst.1 {
            return Signs::Wrong(k);
        }
        // multipliers that only rates determine are known to what solutions of these are accepted with
        let small = |k: &usize| {
            self.turning[*k].is_nan() && guard(*k) > zero(*k) && self.l[*k] <= ACCEPT * at.largest
        };
        if diodes.iter().any(small) {
            return Signs::Undecided;
        }
        let [rate, size] = &mut self.opening;
        [&mut *rate, &mut *size].into_iter().for_each(|list| list.fill(0.0));
        linear.b.mul_add(-1.0, &self.rates, rate);
        linear.b.abs_mul_add(&self.rates, size);
        linear.d.mul_add(1.0, &self.turning, rate);
        linear.d.abs_mul_add(&self.turning, size);
        linear.b.iter().filter(|e| self.open[e.1]).for_each(|e| rate[e.0] = f64::NAN);
        let largest = self.turning.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut neutral = Vec::new();
        for &k in diodes.iter().filter(|&&k| guard(k) <= zero(k)) {
            let (rate, size) = match self.active[k] {
                true => (self.turning[k], largest),
                false => (self.opening[0][k], self.opening[1][k]),
            };
            if rate.is_nan() || rate.abs() <= ACCEPT * size {
                neutral.push(k);
            } else if rate < 0.0 {
                return Signs::Wrong(k);
            }
        }
        if neutral.is_empty() {
            return Signs::Right;
        }
        let mut equations = self.equations(linear, newton);
        match neutral.into_iter().all(|k| self.is_idle(linear, &mut equations, k)) {
            true => Signs::Right,
            false => Signs::Undecided,
        }
    }
}
