//! Ratios of the voltages of perfectly coupled inductors, which `L/h` of a short step may hide.
//!
//! Of `L/h` nothing is left in a ratio.  A mode that leaves something else open, the potential of a part without a
//! path to ground, is solved by the nearest point to a solution; next to such large terms the currents of the
//! inductors seem to be open, too, and what lets one diode carry those of two passes for a solution.  A longer step
//! decides.

use crate::descriptor::Linear;
use crate::integrate::implicit::stepper::Stepper;
use crate::perfect_coupling::{laws_without_storage, Multiples};
use crate::sparse::Csc;
use crate::tolerances::ACCEPT;

type Row = Vec<(usize, f64)>;

fn dot(row: &Row, x: &[f64]) -> f64 {
    row.iter().map(|&(j, v)| v * x[j]).sum()
}

/// A law of perfectly coupled inductors in which nothing is stored.
struct Ratio {
    g: Row,
    a: Row,
    s: Row,
    /// sizes of the fluxes that cancel
    e: Row,
}

impl Ratio {
    /// Whether a point misses it by more than a part of this voltage and the rounding of the fluxes over the
    /// length of a step [s].
    fn missed(&self, [z, l, u]: [&[f64]; 3], length: f64, voltage: f64) -> bool {
        let error = dot(&self.s, u) - dot(&self.g, z) - dot(&self.a, l);
        let fluxes: f64 = self.e.iter().map(|&(j, size)| size * z[j].abs()).sum();
        // as any equation of an accepted step, but for rounding of the fluxes at both of its ends
        error.abs() > ACCEPT * voltage + f64::EPSILON * fluxes / length
    }
}

/// Those of a system.
#[derive(Default)]
pub struct Ratios(Vec<Ratio>);

impl Ratios {
    /// Finds the inductors whose fluxes are determined by others.
    pub fn new(linear: &Linear) -> Ratios {
        let ratio = |law: &Multiples| {
            let combined = |matrix: &Csc| -> Row {
                let own = |r: usize| if r == law.row { Some(1.0) } else { law.factor(r) };
                let terms = matrix.iter().filter_map(|(r, c, v)| Some((c, own(r)? * v)));
                terms.collect()
            };
            let sizes = |(c, v): (usize, f64)| (c, v.abs());
            let e = combined(&linear.e).into_iter().map(sizes).collect();
            Ratio { g: combined(&linear.g), a: combined(&linear.a), s: combined(&linear.s), e }
        };
        Ratios(laws_without_storage(&linear.e, &linear.row_kind).iter().map(ratio).collect())
    }

    /// Whether a solution `x = [z; l]` of a step of this length [s] misses a ratio, or leaves a voltage across a pair
    /// that is active in its mode.
    pub fn lost(&self, s: &Stepper, length: f64, mode: &[bool], u: &[f64], x: &[f64]) -> bool {
        if self.0.is_empty() {
            return false;
        }
        let (z, l) = x.split_at(s.state.z.len());
        let [voltage, _] = s.solver.sys.largest(&[z, &s.state.z]);
        let slacks = s.solver.sys.linear.slacks_of(z, l);
        let mut across = mode.iter().zip(slacks).filter(|e| *e.0).map(|e| e.1.abs());
        self.0.iter().any(|ratio| ratio.missed([z, l, u], length, voltage))
            || across.any(|w| w > ACCEPT * voltage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes 0 and 1 with windings (unknowns 2 and 3) of 1 H and 4 H to ground, perfectly coupled.
    fn transformer(mutual: f64) -> Linear {
        let square = |entries: &[(usize, usize, f64)]| Csc::from_triplets(4, 4, entries);
        let none = |rows, columns| Csc::from_triplets(rows, columns, &[]);
        let windings = [(2, 2, 1.0), (2, 3, mutual), (3, 2, mutual), (3, 3, 4.0)];
        Linear {
            e: square(&windings),
            g: square(&[(0, 2, 1.0), (2, 0, -1.0), (1, 3, 1.0), (3, 1, -1.0)]),
            a: none(4, 0),
            b: none(0, 4),
            d: none(0, 0),
            q: Vec::new(),
            s: none(4, 0),
            row_kind: vec![0, 0, 1, 1],
        }
    }

    #[test]
    fn voltages_are_as_turns() {
        let Ratios(found) = Ratios::new(&transformer(2.0));
        assert_eq!(found.len(), 1);
        let missed = |z: [f64; 4], h: f64| found[0].missed([&z, &[], &[]], h, 10.0);
        assert!(!missed([5.0, 10.0, 0.0, 0.0], 1e-6));
        assert!(missed([5.0, 9.99, 0.0, 0.0], 1e-6));
        // the terms of the fluxes are 6 Vs: their rounding is 13 mV in a tenth of a picosecond
        assert!(!missed([5.0, 10.001, 1.0, 1.0], 1e-13));
    }

    #[test]
    fn leakage_leaves_voltages_free() {
        assert!(Ratios::new(&transformer(1.9)).0.is_empty());
    }
}
