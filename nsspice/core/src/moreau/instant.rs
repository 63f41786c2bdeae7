//! The laws that hold at an instant, whatever moves: right after a jump they fix the potentials of
//! capacitors without a connection to ground.
//!
//! In a short step the current of a capacitor is `C (v1 - v0) / h`, and one unit in the last place of
//! its voltages may be amperes.  What comes into one of its nodes and leaves by the other one is lost in
//! that.  The law of all nodes that capacitors tie together has no such current:
//!
//! ```text
//! sum over the group (G z + A l - S u) = 0,   v_j - v_i as they are,   all laws without storage
//! ```

use super::stepper::Stepper;
use super::storage::Storage;
use crate::descriptor::Linear;
use crate::mlcp::{Driver, Problem, Start};
use crate::sparse::Csc;

/// Parts of its terms by which the law of a group may be missed.
const HOLDS: f64 = 1e-12;
/// A correction that leaves more than this part of that is none.
const BETTER: f64 = 0.1;

/// The laws at an instant: where those of the unknowns go.
struct Instant<'a> {
    laws: &'a Linear,
    storage: &'a Storage,
    /// of each law without storage, and of those of a group, the row that takes it
    to: Vec<Option<usize>>,
}

impl Instant<'_> {
    fn new<'a>(laws: &'a Linear, storage: &'a Storage) -> Instant<'a> {
        let mut to: Vec<Option<usize>> = (0..laws.g.nrows).map(Some).collect();
        storage.unknowns().for_each(|j| to[j] = None);
        for group in storage.floating() {
            group.iter().for_each(|&j| to[j] = Some(group[0]));
        }
        Instant { laws, storage, to }
    }

    /// What the law of each group is missed by, and the size of its terms.
    fn missed(&self, z: &[f64], l: &[f64], u: &[f64]) -> Vec<[f64; 2]> {
        let laws = self.laws;
        let mut found = vec![[0.0; 2]; z.len()];
        for (matrix, factor, x) in [(&laws.g, -1.0, z), (&laws.a, -1.0, l), (&laws.s, 1.0, u)] {
            for (r, c, v) in matrix.iter() {
                if let Some(row) = self.to[r] {
                    found[row][0] += factor * v * x[c];
                    found[row][1] += (v * x[c]).abs();
                }
            }
        }
        self.storage.floating().iter().map(|group| found[group[0]]).collect()
    }

    /// The laws as a problem of their own, all that is stored being given.
    fn problem(&self) -> Problem {
        let (laws, n) = (self.laws, self.to.len());
        let taken = |matrix: &Csc| -> Vec<(usize, usize, f64)> {
            matrix.iter().filter_map(|(r, c, v)| Some((self.to[r]?, c, v))).collect()
        };
        let mut k = taken(&laws.g);
        for j in self.storage.unknowns().filter(|&j| self.to[j] != Some(j)) {
            k.push((j, j, 1.0));
            k.extend(self.to[j].map(|root| (j, root, -1.0)));
        }
        Problem {
            k: Csc::from_triplets(n, n, &k),
            a: Csc::from_triplets(n, laws.a.ncols, &taken(&laws.a)),
            b: laws.b.clone(),
            d: laws.d.clone(),
            row_kind: laws.row_kind.clone(),
        }
    }

    /// Its right-hand side at a state.
    fn right(&self, z: &[f64], u: &[f64]) -> Vec<f64> {
        let mut right = vec![0.0; z.len()];
        for (r, c, v) in self.laws.s.iter() {
            if let Some(row) = self.to[r] {
                right[row] += v * u[c];
            }
        }
        for j in self.storage.unknowns().filter(|&j| self.to[j] != Some(j)) {
            right[j] = z[j] - self.to[j].map_or(0.0, |root| z[root]);
        }
        right
    }
}

impl Stepper {
    /// Moves potentials, and what has no storage, so that the laws of groups of capacitors hold; what
    /// these leave open stays where it is.
    pub(super) fn tie_groups(&mut self) {
        if self.smooth.is_some() || self.storage.floating().is_empty() {
            return;
        }
        let instant = Instant::new(&self.sys.linear, &self.storage);
        let before = instant.missed(&self.z, &self.l, &self.u0);
        if before.iter().all(|[rest, size]| rest.abs() <= HOLDS * size) {
            return;
        }
        let right = instant.right(&self.z, &self.u0);
        let (mut z, mut l) = (self.z.clone(), self.l.clone());
        let mut driver = Driver::new(instant.problem());
        let q = &self.sys.linear.q;
        let found = driver.solve(&right, q, &self.roles, &mut z, &mut l, Start::Warm);
        let solved = found.is_ok_and(|found| !found.flawed && !found.needs_certificate);
        let after = instant.missed(&z, &l, &self.u0);
        let better = |(new, old): (&[f64; 2], &[f64; 2])| {
            new[0].abs() <= (BETTER * old[0].abs()).max(HOLDS * old[1])
        };
        if solved && after.iter().zip(&before).all(better) {
            (self.z, self.l) = (z, l);
        }
    }
}
