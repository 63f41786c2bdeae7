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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_weighted_by_their_length() {
        // a weight of zero skips a stage that has not been computed
        let rates = [vec![1.0, -2.0], vec![f64::NAN; 2], vec![0.5, 4.0]];
        let mut out = [10.0, 20.0];
        add_rates(2.0, &[3.0, 0.0, -1.0], &rates, &mut out);
        assert_eq!(out, [10.0 + 6.0 - 1.0, 20.0 - 12.0 - 8.0]);
    }

    #[test]
    fn differences_are_scaled() {
        let mut out = [0.0; 2];
        scaled_difference(4.0, &[1.0, 3.0], &[0.5, 5.0], &mut out);
        assert_eq!(out, [2.0, -8.0]);
    }
}
