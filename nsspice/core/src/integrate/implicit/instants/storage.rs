//! Which unknowns the stored charges and fluxes determine, and which only up to a common potential.

use crate::dense::{eigen_symmetric, Matrix};
use crate::descriptor::stored_groups;
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;

/// Windings that are looked at together.
const MOST: usize = 64;

/// The unknowns that store something, in groups that store together.
#[derive(Clone, Debug, Default)]
pub struct Storage {
    /// groups whose potential no charge depends on: capacitors without a connection to ground
    floating: Vec<Vec<usize>>,
    /// the others
    fixed: Vec<usize>,
    /// perfectly coupled inductors
    tight: Vec<Tight>,
}

/// Currents that share one flux: what no flux depends on may carry impulses.
#[derive(Clone, Debug)]
struct Tight {
    currents: Vec<usize>,
    /// onto the currents that a flux depends on
    projector: Matrix,
}

impl Tight {
    /// Looks for such currents in a group of inductances.
    fn new(e: &Csc, row_kind: &[u8], group: &[usize]) -> Option<Tight> {
        if !(2..=MOST).contains(&group.len()) || group.iter().any(|&j| row_kind[j] == 0) {
            return None;
        }
        let place = |j: usize| group.iter().position(|&k| k == j);
        let mut own = Matrix::zeros(group.len(), group.len());
        for (b, &c) in group.iter().enumerate() {
            let (rows, values) = e.col(c);
            for (&r, &v) in rows.iter().zip(values) {
                own[(place(r)?, b)] += v;
            }
        }
        let scale: Vec<f64> = (0..group.len()).map(|k| own[(k, k)].sqrt()).collect();
        let size = group.len();
        let even = Matrix::from_fn(size, size, |a, b| own[(a, b)] / (scale[a] * scale[b]));
        let (values, vectors) = eigen_symmetric(&even)?;
        // eigenvalues that are none
        let lost: Vec<usize> = (0..size).filter(|&k| values[k] <= OF_SOLUTION).collect();
        if lost.is_empty() {
            return None;
        }
        // the kernel, orthogonal in the metric of the inductances' own energies
        let projector = Matrix::from_fn(size, size, |a, b| {
            let hidden: f64 = lost.iter().map(|&k| vectors[(a, k)] * vectors[(b, k)]).sum();
            f64::from(u8::from(a == b)) - hidden * scale[b] / scale[a]
        });
        Some(Tight { currents: group.to_vec(), projector })
    }

    fn seen(&self, z: &[f64]) -> Vec<f64> {
        let own: Vec<f64> = self.currents.iter().map(|&j| z[j]).collect();
        let mut out = vec![0.0; own.len()];
        self.projector.apply(&own, &mut out);
        out
    }
}

impl Storage {
    /// Finds the groups of a storage matrix.
    pub fn new(e: &Csc, row_kind: &[u8]) -> Storage {
        let [floating, fixed] = stored_groups(e);
        let tight = fixed.iter().filter_map(|group| Tight::new(e, row_kind, group)).collect();
        Storage { floating, fixed: fixed.into_iter().flatten().collect(), tight }
    }

    /// Whether there are perfectly coupled inductors.
    pub fn tight(&self) -> bool {
        !self.tight.is_empty()
    }

    /// Takes out of `z`, the state right after a jump, the currents of perfectly coupled inductors that
    /// no flux depends on: they carry impulses.
    pub fn project(&self, z: &mut [f64]) {
        for tight in &self.tight {
            let seen = tight.seen(z);
            tight.currents.iter().zip(seen).for_each(|(&j, v)| z[j] = v);
        }
    }

    /// Gives floating groups the potential of another state: an impulse may have lifted them to
    /// gigavolts, of which steps from there would have the rounding.
    pub fn lower(&self, to: &[f64], z: &mut [f64]) {
        for group in &self.floating {
            let shift = z[group[0]] - to[group[0]];
            group.iter().for_each(|&j| z[j] -= shift);
        }
    }

    /// Gives `z` the charges (fluxes) of `stored` where the two agree to `slack`; the potential of
    /// a floating group remains that of `z`.  An impulse may have lifted the group to gigavolts: what
    /// differs by no more than their rounding is left alone.
    pub fn restore(&self, stored: &[f64], z: &mut [f64], slack: impl Fn(usize) -> f64) {
        let put = |z: &mut [f64], j: usize, value: f64| {
            if (z[j] - value).abs() <= slack(j) {
                z[j] = value;
            }
        };
        let hidden: Vec<Vec<f64>> = self
            .tight
            .iter()
            .map(|t| t.currents.iter().zip(t.seen(z)).map(|(&j, v)| z[j] - v).collect())
            .collect();
        for (tight, hidden) in self.tight.iter().zip(&hidden) {
            tight.currents.iter().zip(hidden).for_each(|(&j, h)| z[j] -= h);
        }
        for &j in &self.fixed {
            put(z, j, stored[j]);
        }
        for (tight, hidden) in self.tight.iter().zip(&hidden) {
            tight.currents.iter().zip(hidden).for_each(|(&j, h)| z[j] += h);
        }
        for group in &self.floating {
            let highest = group.iter().fold(0.0f64, |a, &j| a.max(stored[j].abs()));
            let shift = z[group[0]] - stored[group[0]];
            for &j in group {
                if (z[j] - stored[j] - shift).abs() > 4.0 * f64::EPSILON * highest {
                    put(z, j, stored[j] + shift);
                }
            }
        }
    }

    /// Groups of capacitors without a connection to ground.
    pub fn floating(&self) -> &[Vec<usize>] {
        &self.floating
    }

    /// The unknowns that store something.
    pub fn unknowns(&self) -> impl Iterator<Item = usize> + '_ {
        self.fixed.iter().chain(self.floating.iter().flatten()).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// C1 between unknowns 0 and 1, C2 from 2 to ground, L as unknown 3, nothing stored in 4.
    fn example() -> Storage {
        let e = [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0), (2, 2, 5.0), (3, 3, 1e-3)];
        Storage::new(&Csc::from_triplets(5, 5, &e), &[0, 0, 0, 1, 0])
    }

    #[test]
    fn currents_that_no_flux_depends_on_are_taken_out() {
        let e = [(0, 0, 1e-3), (0, 1, 2e-3), (1, 0, 2e-3), (1, 1, 4e-3), (2, 2, 1.0)];
        let storage = Storage::new(&Csc::from_triplets(3, 3, &e), &[1, 1, 1]);
        assert!(storage.tight() && !example().tight());
        // 1e6 A in one winding are -5e5 A in the other: no flux
        let mut z = [1e6 + 3.0, -5e5, 7.0];
        storage.project(&mut z);
        assert!((z[0] + 2.0 * z[1] - 3.0).abs() < 1e-9, "{z:?}");
        assert!(z[0].abs() < 3.0 && z[1].abs() < 3.0 && z[2] == 7.0, "{z:?}");
        // and they stay what they are where charges and fluxes are put back
        let mut now = [1e3 + 1e-7, -5e2, 7.0 + 1e-7];
        storage.restore(&[0.0, 0.0, 7.0], &mut now, |_| 1e-6);
        assert!((now[0] + 2.0 * now[1]).abs() < 1e-10 && (now[0] - 1e3).abs() < 1e-6, "{now:?}");
        assert_eq!(now[2], 7.0);
    }

    #[test]
    fn a_floating_capacitor_keeps_its_voltage_not_its_potential() {
        let storage = example();
        assert_eq!(storage.unknowns().collect::<Vec<_>>(), vec![2, 3, 0, 1]);
        let mut z = [7.0, 6.0 + 1e-9, 1.0 + 1e-9, 2.0 + 1e-9, 9.0];
        storage.restore(&[1.0, 0.0, 1.0, 2.0, 0.0], &mut z, |_| 1e-6);
        assert_eq!(z, [7.0, 6.0, 1.0, 2.0, 9.0]);
        storage.lower(&[-1.0, 5.0, 0.0, 0.0, 0.0], &mut z);
        assert_eq!(z, [-1.0, -2.0, 1.0, 2.0, 9.0]);
        // a gigavolt knows no tenth of a microvolt
        let mut high = [7.0, 6.0 + 1e-7, 1.0, 2.0, 9.0];
        storage.restore(&[1e9, 1e9 - 1.0, 0.0, 2.0, 0.0], &mut high, |_| 1e-6);
        assert_eq!(high[1], 6.0 + 1e-7);
        let mut far = [7.0, 6.0, 1.5, 2.0, 9.0];
        storage.restore(&[1.0, 0.0, 1.0, 2.0, 0.0], &mut far, |_| 1e-6);
        assert_eq!(far[2], 1.5);
    }
}
