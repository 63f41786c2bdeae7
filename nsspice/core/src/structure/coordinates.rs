//! The voltages of a spanning tree as unknowns: which node each one belongs to, and against which it is counted.

/// For each unknown the unknown of the node before it, on the way to ground.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coordinates {
    /// -1 for ground
    before: Vec<isize>,
    depth: Vec<usize>,
    /// nodes, those closer to ground first
    order: Vec<usize>,
}

impl Coordinates {
    /// From the node before each, -1 for ground; currents may have anything.
    pub fn new(before: Vec<isize>) -> Option<Coordinates> {
        let n = before.len();
        let mut depth = vec![0; n];
        for k in 0..n {
            let (mut steps, mut at) = (0, before[k]);
            while at >= 0 {
                steps += 1;
                if at as usize >= n || steps > n {
                    return None;
                }
                at = before[at as usize];
            }
            depth[k] = steps;
        }
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&k| depth[k]);
        Some(Coordinates { before, depth, order })
    }

    /// Unknowns that are potentials against ground.
    pub fn of_nodes(n: usize) -> Coordinates {
        Coordinates { before: vec![-1; n], depth: vec![0; n], order: (0..n).collect() }
    }

    /// The unknowns that add up to the voltage between two nodes, with their signs.
    pub fn path(&self, mut a: isize, mut b: isize) -> Vec<(usize, f64)> {
        let mut out = Vec::new();
        let depth = |k: isize| if k < 0 { 0 } else { self.depth[k as usize] + 1 };
        while a != b {
            if depth(a) >= depth(b) {
                out.push((a as usize, 1.0));
                a = self.before[a as usize];
            } else {
                out.push((b as usize, -1.0));
                b = self.before[b as usize];
            }
        }
        out
    }

    /// The node before an unknown's, -1 for ground.
    pub fn before(&self, unknown: usize) -> isize {
        self.before[unknown]
    }

    /// Potentials in place of voltages along the tree; currents stay.
    pub fn potentials(&self, z: &[f64]) -> Vec<f64> {
        let mut out = z.to_vec();
        for &k in &self.order {
            if self.before[k] >= 0 {
                out[k] += out[self.before[k] as usize];
            }
        }
        out
    }

    /// What enters each node, from what passes each cut-set.
    pub fn at_nodes(&self, cuts: &[f64]) -> Vec<f64> {
        let mut out = cuts.to_vec();
        for (k, &before) in self.before.iter().enumerate() {
            if before >= 0 {
                out[before as usize] -= cuts[k];
            }
        }
        out
    }

    /// `at_nodes` of a sparse list.
    pub fn list_at_nodes(&self, list: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let mut out = std::collections::BTreeMap::new();
        for &(k, v) in list {
            *out.entry(k).or_insert(0.0) += v;
            if self.before[k] >= 0 {
                *out.entry(self.before[k] as usize).or_insert(0.0) -= v;
            }
        }
        out.into_iter().filter(|e| e.1 != 0.0).collect()
    }
}
