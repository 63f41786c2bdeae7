//! The laws that hold at an instant, regardless of motion: just after a jump they fix the potentials of
//! capacitors without a connection to ground.
//!
//! In a short step the current of a capacitor is `C (v1 - v0) / h`, and one unit in the last place of
//! its voltages may be amperes.  What comes into one of its nodes and leaves by the other one is lost in
//! that.  The law of all nodes that capacitors connect has no such current:
//!
//! ```text
//! sum over the group (G z + A l - S u) = 0,   v_j - v_i as they are,   all laws without storage
//! ```

use super::storage::Storage;
use crate::descriptor::Linear;
use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::mlcp::{Driver, Problem, Start};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;
use crate::tolerances::CLEARLY;

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

    /// What of an unknown is given: all of what is stored, in a group what lies above its first node.
    fn offset(&self, c: usize, z: &[f64]) -> f64 {
        self.to[c].map_or(z[c], |root| z[c] - z[root])
    }

    /// The laws as a problem of their own, all that is stored being given: rows and columns are joined alike, so
    /// that it is as monotone as the laws are.
    fn problem(&self) -> Problem {
        let (laws, n) = (self.laws, self.to.len());
        let rows = |matrix: &Csc| -> Vec<(usize, usize, f64)> {
            matrix.iter().filter_map(|(r, c, v)| Some((self.to[r]?, c, v))).collect()
        };
        let columns = |entries: Vec<(usize, usize, f64)>| {
            entries.into_iter().filter_map(|(r, c, v)| Some((r, self.to[c]?, v)))
        };
        let mut k: Vec<_> = columns(rows(&laws.g)).collect();
        k.extend(self.given().map(|j| (j, j, 1.0)));
        let b: Vec<_> = columns(laws.b.iter().collect()).collect();
        Problem {
            k: Csc::from_triplets(n, n, &k),
            a: Csc::from_triplets(n, laws.a.ncols, &rows(&laws.a)),
            b: Csc::from_triplets(laws.b.nrows, n, &b),
            d: laws.d.clone(),
            row_kind: laws.row_kind.clone(),
        }
    }

    /// Unknowns that what is stored gives.
    fn given(&self) -> impl Iterator<Item = usize> + '_ {
        self.storage.unknowns().filter(|&j| self.to[j] != Some(j))
    }

    /// Its right-hand sides at a state, of laws and of pairs; what is given there is 0.
    fn right(&self, z: &[f64], u: &[f64]) -> [Vec<f64>; 2] {
        let (mut right, mut q) = (vec![0.0; z.len()], self.laws.q.clone());
        for (r, c, v) in self.laws.s.iter() {
            if let Some(row) = self.to[r] {
                right[row] += v * u[c];
            }
        }
        for (r, c, v) in self.laws.g.iter() {
            if let Some(row) = self.to[r] {
                right[row] -= v * self.offset(c, z);
            }
        }
        self.laws.b.iter().for_each(|(pair, c, v)| q[pair] -= v * self.offset(c, z));
        [right, q]
    }

    /// The unknowns that belong to a solution.
    fn unknowns(&self, x: &[f64], z: &[f64]) -> Vec<f64> {
        let value = |c: usize| self.to[c].map_or(0.0, |root| x[root]) + self.offset(c, z);
        (0..z.len()).map(value).collect()
    }
}

impl StateJumps<'_> {
    /// Moves potentials, and what has no storage, so that the laws of groups of capacitors hold; what
    /// these leave open stays where it is.
    pub(in crate::integrate) fn tie_groups(&mut self) {
        if self.solver.smooth.is_some() || self.facts.storage.floating().is_empty() {
            return;
        }
        let instant = Instant::new(&self.solver.sys.linear, &self.facts.storage);
        let before = instant.missed(&self.state.z, &self.state.l, &self.state.u0);
        if before.iter().all(|[rest, size]| rest.abs() <= OF_SOLUTION * size) {
            return;
        }
        let [right, q] = instant.right(&self.state.z, &self.state.u0);
        let (mut x, mut l) = (self.state.z.clone(), self.state.l.clone());
        instant.given().for_each(|j| x[j] = 0.0);
        let mut driver = Driver::new(instant.problem());
        let found = driver.solve(&right, &q, &self.state.roles, &mut x, &mut l, Start::Warm);
        let solved = found.is_ok_and(|found| !found.flawed && !found.needs_certificate);
        let z = instant.unknowns(&x, &self.state.z);
        let after = instant.missed(&z, &l, &self.state.u0);
        let better = |(new, old): (&[f64; 2], &[f64; 2])| {
            // a correction that leaves more is none
            new[0].abs() <= (CLEARLY * old[0].abs()).max(OF_SOLUTION * old[1])
        };
        if solved && after.iter().zip(&before).all(better) {
            (self.state.z, self.state.l) = (z, l);
        }
    }
}
