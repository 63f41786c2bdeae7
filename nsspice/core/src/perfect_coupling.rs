//! Perfectly coupled inductors: ratios of voltages instead of some of their laws.
//!
//! The inductances of perfectly coupled windings are a singular matrix: their fluxes are those of fewer
//! currents.  So multiples of the laws of some windings, added to those of the others, leave nothing
//! stored there: `v2 - M/L1 v1 = 0`.  In a short step the difference of two fluxes, each rounded and
//! divided by the length, would be volts in its place, and no leakage limits the current that these
//! drive: 0.07 Vs in 1e-17 s have a rounding error of 0.8 V.

use crate::sparse::Csc;
use crate::structure::Coupled;

/// A law to which multiples of others are added, in which nothing is stored then.
#[derive(Clone, Debug, PartialEq)]
pub struct Multiples {
    pub row: usize,
    pub others: Vec<(usize, f64)>,
}

impl Multiples {
    /// By how much another law is multiplied, if it is added.
    pub fn factor(&self, other: usize) -> Option<f64> {
        self.others.iter().find(|term| term.0 == other).map(|term| term.1)
    }

    /// What is added to the right-hand side.
    pub fn added(&self, rhs: &[f64]) -> f64 {
        self.others.iter().map(|(other, factor)| factor * rhs[*other]).sum()
    }
}

/// The laws of windings that others make free of fluxes: those of the windings that determine no flux of a core.
pub fn laws_without_storage(e: &Csc, row_kind: &[u8]) -> Vec<Multiples> {
    let mut winding = vec![false; e.nrows];
    e.iter().filter(|e| e.0 == e.1 && e.2 != 0.0).for_each(|(r, ..)| winding[r] = row_kind[r] != 0);
    let entries: Vec<_> = e.iter().filter(|&(r, c, _)| winding[r] && winding[c]).collect();
    let groups = Coupled::of(&Csc::from_triplets(e.nrows, e.ncols, &entries)).unwrap_or_default();
    let law = |group: &Coupled, k: usize| {
        let row = |k: usize| group.windings[k].index;
        let others = group.without_flux(k).into_iter().enumerate().filter(|e| e.1 != 0.0);
        let others = others.filter_map(|(j, factor)| Some((row(j)?, factor))).collect();
        Some(Multiples { row: row(k)?, others })
    };
    let rest = |group: &Coupled| group.cores()..group.windings.len();
    groups.iter().flat_map(|group| rest(group).filter_map(|k| law(group, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inductances of windings 1 to 3 behind node 0, of so many turns on one core, with a leakage in addition.
    fn windings(turns: [f64; 3], leakage: f64) -> Csc {
        let pairs = (0..3).flat_map(|r| (0..3).map(move |c| (r, c)));
        let own = |r: usize, c: usize| if r == c { leakage } else { 0.0 };
        let all = pairs.map(|(r, c)| (r + 1, c + 1, turns[r] * turns[c] + own(r, c)));
        Csc::from_triplets(4, 4, &all.collect::<Vec<_>>())
    }

    #[test]
    fn without_leakage_voltages_are_as_turns() {
        let laws = laws_without_storage(&windings([0.1, 0.3, 0.2], 0.0), &[0, 1, 1, 1]);
        let mut voltages = [7.0, 1.0, 3.0, 2.0];
        assert_eq!(laws.len(), 2);
        for law in &laws {
            assert!(
                law.row != 2
                    && (law.factor(2).unwrap() + [0.1, 0.0, 0.2][law.row - 1] / 0.3).abs() < 1e-15
            );
            voltages[law.row] += law.added(&voltages);
            assert!(voltages[law.row].abs() < 1e-15);
        }
    }

    #[test]
    fn with_leakage_each_winding_has_a_flux() {
        assert_eq!(laws_without_storage(&windings([1.0, 3.0, 2.0], 1e-9), &[0, 1, 1, 1]), []);
        // capacitors between nodes are no windings
        let capacitor = [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
        assert_eq!(laws_without_storage(&Csc::from_triplets(2, 2, &capacitor), &[0, 0]), []);
    }
}
