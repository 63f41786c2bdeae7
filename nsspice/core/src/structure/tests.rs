//! The equations compared with exact rational arithmetic, over values and steps of all sizes.

use super::{Law, Network};
use crate::sparse::examples::Rng;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

/// Random resistors, capacitors and inductors of 1 mOhm to 10 GOhm, 1 pF to 1 mF and 10 nH to 1 H as an implicit
/// step of 1e-18 to 1e-3 s sees them, some of which hold voltages of 0.1 to 300 V from before.
fn network(rng: &mut Rng) -> Network {
    let n = 3 + rng.below(5);
    let h = 1e-3 * rng.magnitude(15.0);
    let (mut ends, mut laws) = (Vec::new(), Vec::new());
    let mut add = |rng: &mut Rng, a: usize, b: usize| {
        let weight = match rng.below(3) {
            0 => 1e-3 * rng.magnitude(9.0) / h,
            1 => 1e3 * rng.magnitude(13.0),
            _ => h / rng.magnitude(8.0),
        };
        let held = if rng.below(10) < 3 { 300.0 * rng.magnitude(3.5) } else { 0.0 };
        let offset = if rng.below(2) == 0 { held } else { -held };
        ends.push([a, b]);
        laws.push(Law::Weighted { weight, offset });
    };
    for node in 0..n {
        let other = rng.below(node + 1);
        add(rng, node, if other == node { n } else { other });
    }
    for _ in 0..6 * n / 5 {
        let (a, b) = (rng.below(n + 1), rng.below(n + 1));
        if a != b {
            add(rng, a, b);
        }
    }
    Network { ends, laws, ..Network::new(n + 1) }
}

fn exact(v: f64) -> BigRational {
    BigRational::from_float(v).unwrap()
}

/// Branch voltages by Gaussian elimination in node voltages.
fn branch_voltages(network: &Network) -> Vec<BigRational> {
    let n = network.nodes - 1;
    let mut rows = vec![vec![BigRational::zero(); n + 1]; n];
    for (&[a, b], law) in network.ends.iter().zip(&network.laws) {
        let Law::Weighted { weight, offset } = *law else { continue };
        let (weight, offset) = (exact(weight), exact(offset));
        for (node, other, sign) in [(a, b, 1), (b, a, -1)] {
            if node == n {
                continue;
            }
            rows[node][node] += &weight;
            if other < n {
                rows[node][other] -= &weight;
            }
            let driven = &weight * &offset;
            rows[node][n] += if sign > 0 { driven } else { -driven };
        }
    }
    for k in 0..n {
        let pivot = rows[k].clone();
        for row in rows.iter_mut().skip(k + 1).filter(|row| !row[k].is_zero()) {
            let factor = &row[k] / &pivot[k];
            for (v, p) in row.iter_mut().zip(&pivot).skip(k) {
                *v -= &factor * p;
            }
        }
    }
    let mut z = vec![BigRational::zero(); n + 1];
    for k in (0..n).rev() {
        let mut v = rows[k][n].clone();
        for j in k + 1..n {
            v -= &rows[k][j] * &z[j];
        }
        z[k] = v / &rows[k][k];
    }
    network.ends.iter().map(|&[a, b]| &z[a] - &z[b]).collect()
}

#[test]
fn branch_voltages_are_right_whatever_the_values() {
    let mut rng = Rng(11);
    let (mut own, mut worst) = (Vec::new(), 0.0f64);
    for _ in 0..30 {
        let network = network(&mut rng);
        let right = branch_voltages(&network);
        let found = network.solve().unwrap();
        let largest = right.iter().map(|v| v.abs().to_f64().unwrap()).fold(0.0, f64::max);
        if largest == 0.0 {
            continue;
        }
        let mut most = 0.0f64;
        for (found, right) in found.voltage.iter().zip(&right) {
            let error = (exact(*found) - right).abs().to_f64().unwrap();
            worst = worst.max(error / largest);
            if !right.is_zero() {
                most = most.max(error / right.abs().to_f64().unwrap());
            }
        }
        own.push(most);
    }
    own.sort_by(f64::total_cmp);
    // a sum of up to seven voltages, each from a system whose condition is small
    assert!(worst < 1e-14, "{worst:e}");
    assert!(own[own.len() * 95 / 100] < 1e-13, "{own:?}");
}

/// Vavasis' bound of the condition after diagonal scaling: `1 + m n`.
#[test]
fn the_condition_is_bounded_by_the_size_alone() {
    let mut rng = Rng(3);
    for _ in 0..300 {
        let network = network(&mut rng);
        let hybrid = network.hybrid();
        let g = hybrid.coupling();
        assert!(g.iter().all(|v| v.abs() <= 1.0 + 4.0 * f64::EPSILON));
        let largest = g.singular_values().max();
        let bound = (network.ends.len() * (network.nodes - 1)) as f64;
        assert!(largest * largest <= bound, "{largest}");
    }
}
