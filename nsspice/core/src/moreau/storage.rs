//! Which unknowns the stored charges and fluxes determine, and which only up to a common potential.

use crate::descriptor::Linear;

/// Rows of the storage matrix that sum to this part of their terms sum to zero.
const ROUNDING: f64 = 1e-12;

/// The unknowns that store something, in groups that store together.
#[derive(Clone, Debug, Default)]
pub struct Storage {
    /// groups whose potential no charge depends on: capacitors without a connection to ground
    floating: Vec<Vec<usize>>,
    /// the others
    fixed: Vec<usize>,
}

impl Storage {
    /// Finds the groups of a system.
    pub fn new(linear: &Linear) -> Storage {
        let n = linear.e.nrows;
        let (mut parent, mut sum, mut size) =
            ((0..n).collect::<Vec<_>>(), vec![0.0; n], vec![0.0f64; n]);
        fn root(parent: &mut [usize], mut i: usize) -> usize {
            while parent[i] != i {
                parent[i] = parent[parent[i]];
                i = parent[i];
            }
            i
        }
        for (r, c, v) in linear.e.iter() {
            let (a, b) = (root(&mut parent, r), root(&mut parent, c));
            parent[a] = b;
            sum[r] += v;
            size[r] += v.abs();
        }
        let mut groups: Vec<Vec<usize>> = vec![Vec::new(); n];
        for j in (0..n).filter(|&j| size[j] > 0.0) {
            groups[root(&mut parent, j)].push(j);
        }
        let free = |g: &Vec<usize>| g.iter().all(|&j| f64::abs(sum[j]) <= ROUNDING * size[j]);
        let stored = groups.into_iter().filter(|g| !g.is_empty());
        let (floating, fixed): (Vec<_>, Vec<_>) = stored.partition(free);
        Storage { floating, fixed: fixed.into_iter().flatten().collect() }
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
        for &j in &self.fixed {
            put(z, j, stored[j]);
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

    /// The unknowns that store something.
    pub fn unknowns(&self) -> impl Iterator<Item = usize> + '_ {
        self.fixed.iter().chain(self.floating.iter().flatten()).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Csc;

    /// C1 between unknowns 0 and 1, C2 from 2 to ground, L as unknown 3, nothing stored in 4.
    fn example() -> Storage {
        let e = [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0), (2, 2, 5.0), (3, 3, 1e-3)];
        let none = || Csc::from_triplets(5, 0, &[]);
        Storage::new(&Linear {
            e: Csc::from_triplets(5, 5, &e),
            g: Csc::from_triplets(5, 5, &[]),
            a: none(),
            b: Csc::from_triplets(0, 5, &[]),
            d: Csc::from_triplets(0, 0, &[]),
            q: Vec::new(),
            s: none(),
            row_kind: vec![0, 0, 0, 1, 0],
        })
    }

    #[test]
    fn a_floating_capacitor_keeps_its_voltage_not_its_potential() {
        let storage = example();
        assert_eq!(storage.unknowns().collect::<Vec<_>>(), vec![2, 3, 0, 1]);
        let mut z = [7.0, 6.0 + 1e-9, 1.0 + 1e-9, 2.0 + 1e-9, 9.0];
        storage.restore(&[1.0, 0.0, 1.0, 2.0, 0.0], &mut z, |_| 1e-6);
        assert_eq!(z, [7.0, 6.0, 1.0, 2.0, 9.0]);
        // a gigavolt knows no tenth of a microvolt
        let mut high = [7.0, 6.0 + 1e-7, 1.0, 2.0, 9.0];
        storage.restore(&[1e9, 1e9 - 1.0, 0.0, 2.0, 0.0], &mut high, |_| 1e-6);
        assert_eq!(high[1], 6.0 + 1e-7);
        let mut far = [7.0, 6.0, 1.5, 2.0, 9.0];
        storage.restore(&[1.0, 0.0, 1.0, 2.0, 0.0], &mut far, |_| 1e-6);
        assert_eq!(far[2], 1.5);
    }
}
