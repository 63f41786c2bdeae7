//! The rules of Gauss and Legendre on `[0, 1]`.

use std::f64::consts::PI;

/// Places and weights.
pub type Rule = (Vec<f64>, Vec<f64>);

/// Places and weights of the rule with so many points, which integrates polynomials of a degree below twice their
/// number exactly.
pub fn gauss_legendre(points: usize) -> Rule {
    let n = points as f64;
    let one = |k: usize| {
        let mut x = (PI * (k as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut p, mut before) = (1.0, 0.0);
            for j in 0..points {
                let j = j as f64;
                (p, before) = (((2.0 * j + 1.0) * x * p - j * before) / (j + 1.0), p);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..points).map(one).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_integrated_exactly() {
        for points in 1..16 {
            let (places, weights) = gauss_legendre(points);
            for power in 0..2 * points as i32 {
                let sum: f64 = places.iter().zip(&weights).map(|(x, w)| w * x.powi(power)).sum();
                assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-13, "{points} {power} {sum}");
            }
        }
    }
}
