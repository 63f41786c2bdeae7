//! Sums and differences of the vectors of a step.

use crate::dense::add_scaled;

/// Adds the rates of stages, times a length and their weights.
pub fn add_rates(length: f64, weights: &[f64], rates: &[Vec<f64>], out: &mut [f64]) {
    for (&weight, rates) in weights.iter().zip(rates).filter(|(weight, _)| **weight != 0.0) {
        add_scaled(out, weight * length, rates);
    }
}

/// `factor (a - b)`
pub fn scaled_difference(factor: f64, a: &[f64], b: &[f64], out: &mut [f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = (a - b) * factor;
    }
}
