//! The outputs inside a step as polynomials: a row is one scheme of Horner's for each of them.

use crate::integrate::implicit::outputs::Sum;
use crate::integrate::sdirk::step::Trial;
use crate::integrate::sdirk::tableau::{Tableau, DEGREE};

/// Coefficients of a polynomial: the largest degree is five.
pub const POWERS: usize = 6;
const _: () = assert!(DEGREE < POWERS); // continuous solutions are among them

/// A polynomial for each output.
pub struct Curve {
    /// from the constant on
    coefficients: Vec<[f64; POWERS]>,
}

impl Curve {
    /// As many as there are outputs.
    pub fn new(outputs: usize) -> Curve {
        Curve { coefficients: vec![[0.0; POWERS]; outputs] }
    }

    /// All outputs at a place.
    pub fn write(&self, place: f64, row: &mut [f64]) {
        for (out, coefficients) in row.iter_mut().zip(&self.coefficients) {
            *out = coefficients.iter().rev().fold(0.0, |sum, c| sum * place + c);
        }
    }

    /// Sums over rows of all outputs.
    pub fn write_sums(&self, moments: &Moments, row: &mut [f64]) {
        for (out, coefficients) in row.iter_mut().zip(&self.coefficients) {
            *out = coefficients.iter().zip(&moments.powers).map(|(c, p)| c * p).sum();
        }
    }

    /// Becomes the continuous solution of a step, of which the outputs are `sums`; places are parts of the
    /// step.
    pub fn follow(&mut self, sums: &[Sum], trial: &Trial, tableau: &Tableau) {
        for (coefficients, sum) in self.coefficients.iter_mut().zip(sums) {
            let of = |x: &[f64]| sum.iter().map(|&(j, factor)| factor * x[j]).sum::<f64>();
            coefficients[0] = of(&trial.first);
            coefficients[1..].fill(0.0);
            for (j, rates) in trial.stages.rates.iter().enumerate() {
                let change = trial.length * of(rates);
                for (c, weights) in coefficients[1..].iter_mut().zip(&tableau.dense) {
                    *c += weights[j] * change;
                }
            }
        }
    }

    /// Becomes the polynomials with these values, one row for each place of the `basis`.
    pub fn join(&mut self, basis: &Basis, values: &[Vec<f64>]) {
        self.coefficients.fill([0.0; POWERS]);
        for (lagrange, row) in basis.iter().zip(values) {
            for (coefficients, v) in self.coefficients.iter_mut().zip(row) {
                coefficients.iter_mut().zip(lagrange).for_each(|(c, l)| *c += v * l);
            }
        }
    }
}

/// Weighted sums over rows of the powers of their places, and of the sources there.
#[derive(Default)]
pub struct Moments {
    powers: [f64; POWERS],
    pub sources: Vec<f64>,
}

impl Moments {
    /// Takes a row.
    pub fn add(&mut self, weight: f64, place: f64, sources: &[f64]) {
        let mut power = weight;
        for sum in &mut self.powers {
            *sum += power;
            power *= place;
        }
        self.sources.resize(sources.len(), 0.0);
        crate::dense::add_scaled(&mut self.sources, weight, sources);
    }

    /// There have been no rows.
    pub fn is_empty(&self) -> bool {
        self.powers[0] == 0.0
    }
}

/// The polynomials that are one at a place and zero at all others, as coefficients.
pub type Basis = [[f64; POWERS]; POWERS];

/// See [`Basis`].
pub fn basis(places: &[f64; POWERS]) -> Basis {
    std::array::from_fn(|k| {
        let mut product = [0.0; POWERS];
        product[0] = 1.0;
        for (_, at) in places.iter().enumerate().filter(|e| e.0 != k) {
            // times `(x - at) / (x_k - at)`
            let scale = 1.0 / (places[k] - at);
            for p in (0..POWERS).rev() {
                let lower = if p > 0 { product[p - 1] } else { 0.0 };
                product[p] = (lower - at * product[p]) * scale;
            }
        }
        product
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_have_the_values_that_they_join() {
        let places = [-0.9, -0.5, -0.2, 0.3, 0.6, 1.0];
        let law = |x: f64| [2.0, (x - 0.3) * (1.0 + x).powi(POWERS as i32 - 2)];
        let mut curve = Curve::new(2);
        curve.join(&basis(&places), &places.map(|x| law(x).to_vec()));
        let mut row = [0.0; 2];
        for x in (-20..=20).map(|k| f64::from(k) / 20.0) {
            curve.write(x, &mut row);
            for (found, expected) in row.iter().zip(law(x)) {
                assert!((found - expected).abs() <= 1e-13, "{x}: {found} {expected}");
            }
        }
    }
}
