//! The voltages of a spanning tree as unknowns: which node each one belongs to, and against which it is counted.

use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;
use std::collections::BTreeMap;

/// A two-terminal element between the nodes of two unknowns, -1 for ground, and its capacitance or conductance.
pub type Edge = (isize, isize, f64);

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

    /// The voltages of elements as sums of unknowns.
    pub fn rows(&self, edges: &[Edge]) -> Vec<Vec<(usize, f64)>> {
        edges.iter().map(|e| self.path(e.0, e.1)).collect()
    }

    /// Entries of a matrix minus those of the elements; what is left by rounding is dropped.
    ///
    /// Of `k` terms the sum in the matrix and this difference are each rounded less than `k` times, by the unit
    /// roundoff times the sum of their sizes at most.
    pub fn remainder(&self, matrix: &Csc, edges: &[Edge]) -> Csc {
        let mut left: BTreeMap<(usize, usize), [f64; 3]> = BTreeMap::new();
        let mut add = |at: (usize, usize), v: f64| {
            let [sum, size, terms] = left.entry(at).or_insert([0.0; 3]);
            (*sum, *size, *terms) = (*sum + v, *size + v.abs(), *terms + 1.0);
        };
        matrix.iter().for_each(|(r, c, v)| add((r, c), v));
        for edge in edges {
            let row = self.path(edge.0, edge.1);
            for &(r, one) in &row {
                row.iter().for_each(|&(c, two)| add((r, c), -one * two * edge.2));
            }
        }
        left.retain(|_, [sum, size, terms]| {
            let nothing = sum.abs() <= *terms * f64::EPSILON * *size;
            !nothing
        });
        let entries: Vec<_> = left.into_iter().map(|((r, c), [sum, ..])| (r, c, sum)).collect();
        Csc::from_triplets(matrix.nrows, matrix.ncols, &entries)
    }

    /// Whether all voltages are counted against ground.
    pub fn are_potentials(&self) -> bool {
        self.before.iter().all(|&k| k < 0)
    }

    /// A matrix of laws of cut-sets by voltages of the tree as one of laws of nodes by potentials; elements keep all
    /// their digits.
    fn matrix_at_nodes(&self, matrix: &Csc, edges: &[Edge]) -> Csc {
        let n = matrix.nrows;
        let rest = self.rows_at_nodes(&self.remainder(matrix, edges));
        let mut entries: Vec<_> =
            self.rows_at_nodes(&rest.transpose()).transpose().iter().collect();
        for &(a, b, v) in edges {
            for (r, c, v) in [(a, a, v), (b, b, v), (a, b, -v), (b, a, -v)] {
                if r >= 0 && c >= 0 {
                    entries.push((r as usize, c as usize, v));
                }
            }
        }
        Csc::from_triplets(n, n, &entries)
    }

    /// Laws of nodes from those of cut-sets.
    fn rows_at_nodes(&self, matrix: &Csc) -> Csc {
        let column = |c: usize| -> Vec<(usize, usize, f64)> {
            let (rows, values) = matrix.col(c);
            let list: Vec<_> = rows.iter().copied().zip(values.iter().copied()).collect();
            self.list_at_nodes(&list).into_iter().map(|(r, v)| (r, c, v)).collect()
        };
        let entries: Vec<_> = (0..matrix.ncols).flat_map(column).collect();
        Csc::from_triplets(matrix.nrows, matrix.ncols, &entries)
    }

    /// A system in potentials, with Kirchhoff's current law at nodes.
    pub fn at_nodes_of(&self, linear: &Linear, capacitors: &[Edge], conductors: &[Edge]) -> Linear {
        // a static form of the system has left its capacitors out
        let stored = if linear.e.values.is_empty() { &[][..] } else { capacitors };
        Linear {
            e: self.matrix_at_nodes(&linear.e, stored),
            g: self.matrix_at_nodes(&linear.g, conductors),
            a: self.rows_at_nodes(&linear.a),
            b: self.rows_at_nodes(&linear.b.transpose()).transpose(),
            s: self.rows_at_nodes(&linear.s),
            ..linear.clone()
        }
    }

    /// The same functions in laws of nodes.
    pub fn smooth_at_nodes(&self, smooth: &Smooth) -> Smooth {
        let [f, q] = [&smooth.f, &smooth.q].map(|matrix| self.rows_at_nodes(matrix));
        Smooth { tape: smooth.tape.clone(), f, q }
    }

    /// Averaging terms in potentials.
    pub fn averaging_at_nodes(&self, [h, hs]: [&Csc; 2]) -> (Csc, Csc) {
        (self.matrix_at_nodes(h, &[]), self.rows_at_nodes(hs))
    }

    /// `potentials` of several points in one list.
    pub fn all_potentials(&self, z: &[f64]) -> Vec<f64> {
        z.chunks(self.before.len().max(1)).flat_map(|z| self.potentials(z)).collect()
    }

    /// The node before an unknown's, -1 for ground.
    pub fn before(&self, unknown: usize) -> isize {
        self.before[unknown]
    }

    /// All unknowns, those of nodes closer to ground first.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Potentials in place of voltages along the tree; currents stay.
    pub fn potentials(&self, z: &[f64]) -> Vec<f64> {
        let mut out = z.to_vec();
        self.add_up(&mut out);
        out
    }

    /// The same in place: each node adds what the one before it has, those closer to ground first.
    pub fn add_up(&self, z: &mut [f64]) {
        for &k in &self.order {
            if self.before[k] >= 0 {
                z[k] += z[self.before[k] as usize];
            }
        }
    }

    /// Voltages along the tree from potentials; currents stay.
    pub fn voltages(&self, potentials: &[f64], out: &mut Vec<f64>) {
        let before = |k: isize| usize::try_from(k).map_or(0.0, |j| potentials[j]);
        out.clear();
        out.extend(potentials.iter().zip(&self.before).map(|(v, &k)| v - before(k)));
    }

    /// What enters each node, from what passes each cut-set.
    pub fn at_nodes(&self, cuts: &[f64]) -> Vec<f64> {
        let mut out = cuts.to_vec();
        self.take_apart(&mut out);
        out
    }

    /// The same in place: each node passes on to the one before it only what enters there, those closer to ground
    /// first, while the cut-sets beyond them are whole.
    pub fn take_apart(&self, cuts: &mut [f64]) {
        for &k in &self.order {
            if self.before[k] >= 0 {
                cuts[self.before[k] as usize] -= cuts[k];
            }
        }
    }

    /// The nodes with entries of terms `(cut-set, term, value)`: a term that passes the cut-set of a
    /// node and no other on the way to ground does not leave it.
    pub fn touched(&self, terms: impl Iterator<Item = (usize, usize, f64)>) -> Vec<bool> {
        let mut left: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (cut, term, value) in terms {
            *left.entry((term, cut)).or_insert(0.0) += value;
            if let Ok(before) = usize::try_from(self.before[cut]) {
                *left.entry((term, before)).or_insert(0.0) -= value;
            }
        }
        let mut out = vec![false; self.before.len()];
        left.iter().filter(|e| *e.1 != 0.0).for_each(|(&(_, node), _)| out[node] = true);
        out
    }

    /// `at_nodes` of a sparse list.
    pub fn list_at_nodes(&self, list: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let mut out = BTreeMap::new();
        for &(k, v) in list {
            *out.entry(k).or_insert(0.0) += v;
            if self.before[k] >= 0 {
                *out.entry(self.before[k] as usize).or_insert(0.0) -= v;
            }
        }
        out.into_iter().filter(|e| e.1 != 0.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes 0 - 1 - 2 on the way from ground, node 3 on ground, a current 4.
    fn chain() -> Coordinates {
        Coordinates::new(vec![-1, 0, 1, -1, -1]).unwrap()
    }

    #[test]
    fn voltages_add_up_along_the_tree() {
        let tree = chain();
        assert_eq!(tree.path(2, 0), [(2, 1.0), (1, 1.0)]);
        assert_eq!(tree.path(3, 1), [(1, -1.0), (3, 1.0), (0, -1.0)]);
        assert_eq!(tree.potentials(&[1.0, 10.0, 100.0, 7.0, 0.5]), [1.0, 11.0, 111.0, 7.0, 0.5]);
        let mut along = Vec::new();
        tree.voltages(&[1.0, 11.0, 111.0, 7.0, 0.5], &mut along);
        assert_eq!(along, [1.0, 10.0, 100.0, 7.0, 0.5]);
        assert_eq!(Coordinates::of_nodes(2).path(1, 0), [(1, 1.0), (0, -1.0)]);
    }

    #[test]
    fn a_ring_is_no_tree() {
        assert!(Coordinates::new(vec![1, 0]).is_none());
        assert!(Coordinates::new(vec![2]).is_none());
    }

    #[test]
    fn a_current_into_a_node_passes_all_cut_sets_before_it() {
        let tree = chain();
        // 1 A into node 2 passes the cut-sets of 2, 1 and 0
        assert_eq!(tree.at_nodes(&[1.0, 1.0, 1.0, 0.0, 0.0]), [0.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(tree.list_at_nodes(&[(0, 1.0), (1, 1.0), (2, 1.0)]), [(2, 1.0)]);
    }

    #[test]
    fn nothing_is_left_of_a_sum_of_elements() {
        let tree = chain();
        let edges = [(2, -1, 0.1), (1, 3, 0.7), (2, 1, 0.3)];
        let mut entries = vec![(4, 0, 1.0)];
        for (edge, row) in edges.iter().zip(tree.rows(&edges)) {
            for &(r, one) in &row {
                entries.extend(row.iter().map(|&(c, two)| (r, c, one * two * edge.2)));
            }
        }
        let matrix = Csc::from_triplets(5, 5, &entries);
        let left: Vec<_> = tree.remainder(&matrix, &edges).iter().collect();
        assert_eq!(left, [(4, 0, 1.0)]);
    }
}
