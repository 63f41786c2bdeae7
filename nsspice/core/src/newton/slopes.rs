//! Functions at one point and their slopes, law by law: what a linearisation consists of.

use super::equations::Part;
use super::solve::Newton;
use crate::tape::Linearisation;

impl Newton {
    /// Linearises the functions at a point, for what follows.
    pub fn linearise(&mut self, z: &[f64], u: &[f64], t: f64, how: Linearisation) {
        self.tape.evaluate(z, u, t, how);
    }

    /// Goes through the functions: law, function, and the coefficients of it and of its rate.
    pub fn each_function(&self) -> impl Iterator<Item = (usize, usize, [f64; 2])> + '_ {
        let terms = self.eq.terms.iter().filter(|t| t.part != Part::Sum);
        terms.map(|t| (t.row as usize, t.function as usize, [t.f, t.q]))
    }

    /// Goes through the slopes: law, unknown, and what the functions and their rates count there.
    pub fn each_slope(&self) -> impl Iterator<Item = (usize, usize, [f64; 2])> + '_ {
        let slopes = self.tape.slopes();
        let entries = self.eq.entries.iter().filter(|e| e.part != Part::Sum);
        entries.map(|e| {
            let slope = slopes[e.slot as usize];
            (e.row as usize, e.column as usize, [e.f * slope, e.q * slope])
        })
    }

    /// Rates of the functions with those of the unknowns (nothing: none of them moves), of the sources and of time.
    pub fn rates_of_functions(&self, z: Option<&[f64]>, u: &[f64], t: f64, out: &mut [f64]) {
        let (n, slopes) = (self.eq.n, self.tape.slopes());
        let rate = |variable: usize| match variable.checked_sub(n) {
            None => z.map_or(0.0, |z| z[variable]),
            Some(k) => u.get(k).copied().unwrap_or(t),
        };
        for (k, out) in out.iter_mut().enumerate() {
            let list =
                self.tape.derivatives(k).map(|(variable, slot)| slopes[slot] * rate(variable));
            *out = list.sum();
        }
    }
}
