//! The rates in use: matrices and factors of each are kept as memory allows.

use super::equations::Equations;
use super::linear::Assembly;
use super::solve::Newton;

/// Memory for the matrices of all rates [numbers], and so many are kept at any size.  A run with error
/// control comes back to each of some ten lengths of steps, and to as many after events.
const BUDGET: usize = 8_000_000;
const FEWEST: usize = 12;
/// Beyond this number finding one takes longer than a small factorisation.
const MOST: usize = 256;
/// Copies of the Jacobian in an assembly: values, scales and patterns; its factors take as much, and fill in.
const COPIES: usize = 24;
/// How many rates a system keeps.
pub(super) fn rates_kept(eq: &Equations) -> usize {
    (BUDGET / (COPIES * eq.pattern.values.len().max(1))).clamp(FEWEST, MOST)
}

impl Newton {
    /// Chooses the rate: 0 for a static problem, `1/h` for an implicit step of length h.
    pub fn set_rate(&mut self, rate: f64) {
        self.stamp += 1;
        let same = |&known: &f64| known == rate || (known - rate).abs() <= 1e-9 * rate;
        let known = if same(&self.rates[self.present]) {
            Some(self.present)
        } else {
            self.rates.iter().position(same)
        };
        self.present = match known {
            Some(k) => k,
            None => {
                let count = self.assemblies.len();
                if count >= self.most {
                    let oldest = (0..count).min_by_key(|&k| self.assemblies[k].stamp).unwrap_or(0);
                    self.assemblies.swap_remove(oldest);
                    self.rates.swap_remove(oldest);
                }
                self.assemblies.push(Assembly::new(&self.eq, rate));
                self.rates.push(rate);
                self.assemblies.len() - 1
            }
        };
        self.assemblies[self.present].stamp = self.stamp;
    }
}
