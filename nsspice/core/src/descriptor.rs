//! A complementarity descriptor system, linear part and smooth functions, which all engines and the checks share.

use crate::rounding::of_entries;
use crate::sparse::Csc;
use crate::tape::Tape;
use crate::union_find::UnionFind;
use std::collections::BTreeMap;

/// `E z' + G z + A l = S u`, `w = q - B z + D l`.
#[derive(Clone)]
pub struct Linear {
    /// storage matrix
    pub e: Csc,
    /// conductance-like matrix
    pub g: Csc,
    /// multiplier columns
    pub a: Csc,
    /// slack rows
    pub b: Csc,
    /// series resistance of the pairs
    pub d: Csc,
    /// constant slack
    pub q: Vec<f64>,
    /// source columns
    pub s: Csc,
    /// 0 for laws of currents, 1 for laws of voltages
    pub row_kind: Vec<u8>,
}

/// Smooth functions and where they enter.
#[derive(Clone)]
pub struct Smooth {
    /// the p functions
    pub tape: Tape,
    /// n x p: where they enter as they are
    pub f: Csc,
    /// n x p: where their rates enter
    pub q: Csc,
}

impl Linear {
    /// Numbers of unknowns, pairs and sources.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.g.nrows, self.a.ncols, self.s.ncols)
    }

    /// `E` in two parts: what is stored, which is symmetric, and what controls: a source that reads the
    /// current of a capacitor (the voltage of an inductor) has its rate in its law, and stores nothing.
    pub fn storage_and_controls(&self) -> [Csc; 2] {
        let entries: BTreeMap<(usize, usize), f64> =
            self.e.iter().map(|(r, c, v)| ((r, c), v)).collect();
        let (mut stored, mut controls) = (Vec::new(), Vec::new());
        for (&(r, c), &own) in &entries {
            let other = entries.get(&(c, r)).copied().unwrap_or(0.0);
            // what both have is stored; a sum of several elements is the same but for its rounding
            let both =
                if own * other > 0.0 { own.abs().min(other.abs()).copysign(own) } else { 0.0 };
            let rest = own - both;
            let alike = rest.abs() <= of_entries(1) * own.abs();
            stored.push((r, c, if alike { own } else { both }));
            controls.extend((!alike).then_some((r, c, rest)));
        }
        let n = self.e.nrows;
        [stored, controls].map(|list| Csc::from_triplets(n, n, &list))
    }

    /// What conducts where all pairs with a series resistance of their own do: `G + A D^-1 B`.
    pub fn conducting(&self) -> Csc {
        let m = self.a.ncols;
        let (mut own, mut alone) = (vec![0.0; m], vec![true; m]);
        for (r, c, v) in self.d.iter().filter(|e| e.2 != 0.0) {
            if r == c {
                own[r] = v;
            } else {
                alone[r] = false;
            }
        }
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); m];
        self.b.iter().for_each(|(pair, c, v)| rows[pair].push((c, v)));
        let mut entries: Vec<_> = self.g.iter().collect();
        for (row, pair, v) in self.a.iter().filter(|e| alone[e.1] && own[e.1] > 0.0) {
            entries.extend(rows[pair].iter().map(|(c, b)| (row, *c, v * b / own[pair])));
        }
        Csc::from_triplets(self.g.nrows, self.g.ncols, &entries)
    }

    /// `w = q - B z + D l`
    pub fn slacks(&self, z: &[f64], l: &[f64], w: &mut [f64]) {
        if w.is_empty() {
            return;
        }
        w.copy_from_slice(&self.q);
        self.b.mul_add(-1.0, z, w);
        self.d.mul_add(1.0, l, w);
    }

    /// `slacks` as a list of its own.
    pub fn slacks_of(&self, z: &[f64], l: &[f64]) -> Vec<f64> {
        let mut w = vec![0.0; l.len()];
        self.slacks(z, l, &mut w);
        w
    }
}

/// Groups of laws in whose sum nothing is stored, neither by `e` nor by functions (`q`): laws without
/// storage one by one, and those of nodes that capacitors alone connect.
pub fn sums_that_store_nothing(e: &Csc, q: &Csc) -> Vec<Vec<usize>> {
    let n = e.nrows;
    let mut together = UnionFind::new(n);
    let columns = || [e, q].into_iter().flat_map(|m| (0..m.ncols).map(move |c| m.col(c)));
    for (rows, _) in columns() {
        rows.windows(2).for_each(|pair| _ = together.join(pair[0], pair[1]));
    }
    let mut stores = vec![false; n];
    for (rows, values) in columns() {
        let (sum, size) =
            values.iter().fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
        if f64::abs(sum) > of_entries(values.len()) * size {
            stores[together.root(rows[0])] = true;
        }
    }
    let mut groups = together.groups(0..n);
    groups.retain(|group| !stores[together.root(group[0])]);
    groups
}

/// The columns in which something is stored.
pub fn stored_columns(e: &Csc) -> Vec<bool> {
    let mut stored = vec![false; e.ncols];
    e.iter().for_each(|(_, column, _)| stored[column] = true);
    stored
}

/// Unknowns that store together: groups on whose common value nothing that is stored depends (the
/// potential of capacitors without a connection to ground), and the others.
pub fn stored_groups(e: &Csc) -> [Vec<Vec<usize>>; 2] {
    let n = e.nrows;
    let (mut together, mut sum, mut size) = (UnionFind::new(n), vec![0.0; n], vec![0.0f64; n]);
    for (r, c, v) in e.iter() {
        together.join(r, c);
        sum[r] += v;
        size[r] += v.abs();
    }
    let groups = together.groups((0..n).filter(|&j| size[j] > 0.0));
    let free = |g: &Vec<usize>| g.iter().all(|&j| f64::abs(sum[j]) <= of_entries(n) * size[j]);
    let (floating, others) = groups.into_iter().partition(free);
    [floating, others]
}
