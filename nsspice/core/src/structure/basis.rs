//! A spanning forest of the heaviest branches, and every branch voltage as a sum of those of the forest.
//!
//! The voltages of a maximum-weight forest are the right coordinates of a network: with them
//! `v = T y`, `T` in {-1, 0, 1}, and each branch outside closes a loop through branches of at least its own
//! weight.  Scaled by the square roots of the weights the equations are `1 + G'G` with `|G| <= 1`, whose
//! condition is at most `1 + m n` for any values (S. A. Vavasis, SIAM J. Matrix Anal. Appl. 15,
//! 1994).

use crate::union_find::UnionFind;

/// A spanning forest; node `nodes - 1` is ground.
pub struct Basis {
    /// branches of the forest
    pub tree: Vec<usize>,
    /// nodes from the roots on, ground first
    order: Vec<usize>,
    /// the node before each, the place in the forest of the branch to it, and the sign with which the branch
    /// leads there from this node
    parent: Vec<Option<(usize, usize, f64)>>,
    depth: Vec<usize>,
}

impl Basis {
    /// Takes branches, by their two ends, in an order: those that close no loop (Kruskal).
    pub fn new(nodes: usize, ends: &[[usize; 2]], order: impl IntoIterator<Item = usize>) -> Basis {
        let mut sets = UnionFind::new(nodes);
        let mut tree = Vec::new();
        let mut adjacent: Vec<Vec<(usize, usize, f64)>> = vec![Vec::new(); nodes];
        for edge in order {
            let [plus, minus] = ends[edge];
            if sets.join(plus, minus) {
                adjacent[plus].push((minus, tree.len(), -1.0));
                adjacent[minus].push((plus, tree.len(), 1.0));
                tree.push(edge);
            }
        }
        let (mut parent, mut depth) = (vec![None; nodes], vec![0; nodes]);
        let mut seen = vec![false; nodes];
        let mut order = Vec::with_capacity(nodes);
        for root in (0..nodes).rev() {
            if std::mem::replace(&mut seen[root], true) {
                continue;
            }
            let mut next = order.len();
            order.push(root);
            while next < order.len() {
                let node = order[next];
                for &(other, place, sign) in &adjacent[node] {
                    if !std::mem::replace(&mut seen[other], true) {
                        parent[other] = Some((node, place, sign));
                        depth[other] = depth[node] + 1;
                        order.push(other);
                    }
                }
                next += 1;
            }
        }
        Basis { tree, order, parent, depth }
    }

    /// The branches of the forest between two nodes, with the signs with which they add up to `v_plus - v_minus`;
    /// nothing if the forest does not join them.
    pub fn path(&self, plus: usize, minus: usize) -> Option<Vec<(usize, f64)>> {
        let (mut a, mut b, mut path) = (plus, minus, Vec::new());
        while a != b {
            let up = self.depth[a] >= self.depth[b];
            let (node, sign) = if up { (&mut a, 1.0) } else { (&mut b, -1.0) };
            let (before, place, own) = self.parent[*node]?;
            path.push((place, sign * own));
            *node = before;
        }
        Some(path)
    }

    /// Whether two nodes are joined.
    pub fn joins(&self, plus: usize, minus: usize) -> bool {
        let root = |mut node: usize| {
            while let Some((before, ..)) = self.parent[node] {
                node = before;
            }
            node
        };
        root(plus) == root(minus)
    }

    /// One node of each part: ground and those that the forest does not join to it.
    pub fn roots(&self) -> impl Iterator<Item = usize> + '_ {
        self.order.iter().copied().filter(|&node| self.parent[node].is_none())
    }

    /// From the roots on: a node, the node before it, the place in the forest of the branch between them, and the sign
    /// with which its voltage leads there.
    pub fn reached(&self) -> impl Iterator<Item = (usize, usize, usize, f64)> + '_ {
        let step = |&node: &usize| {
            self.parent[node].map(|(before, place, sign)| (node, before, place, sign))
        };
        self.order.iter().filter_map(step)
    }

    /// Potentials from the voltages of the forest; each root has that of `roots`.
    pub fn potentials(&self, tree: &[f64], roots: &[f64]) -> Vec<f64> {
        let mut out = roots.to_vec();
        for &node in &self.order {
            if let Some((before, place, sign)) = self.parent[node] {
                out[node] = out[before] + sign * tree[place];
            }
        }
        out
    }

    /// What is injected into the nodes on the positive side of each branch of the forest: the current that has to
    /// pass its cut-set.
    pub fn through_cuts(&self, injected: &[f64]) -> Vec<f64> {
        let mut sums = injected.to_vec();
        let mut out = vec![0.0; self.tree.len()];
        for &node in self.order.iter().rev() {
            if let Some((before, place, sign)) = self.parent[node] {
                out[place] = sign * sums[node];
                sums[before] += sums[node];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ground is node 3; a ring of three nodes with a branch to ground.
    const ENDS: [[usize; 2]; 4] = [[0, 1], [1, 2], [2, 0], [2, 3]];

    #[test]
    fn the_heaviest_branches_span() {
        let basis = Basis::new(4, &ENDS, [2, 3, 1, 0]);
        assert_eq!(basis.tree, [2, 3, 1]);
        // v(0) - v(1) = -(v2 - v0) - (v1 - v2)
        let mut path = basis.path(0, 1).unwrap();
        path.sort_by_key(|e| e.0);
        assert_eq!(path, [(0, -1.0), (2, -1.0)]);
        let potentials = basis.potentials(&[10.0, 1.0, 5.0], &[0.0; 4]);
        assert_eq!(potentials, [-9.0, 6.0, 1.0, 0.0]);
    }

    #[test]
    fn currents_pass_cut_sets() {
        let basis = Basis::new(4, &ENDS, [2, 3, 1, 0]);
        // 1 A into node 0 leaves through branch 2, against its direction, and through branch 3
        assert_eq!(basis.through_cuts(&[1.0, 0.0, 0.0, 0.0]), [-1.0, 1.0, 0.0]);
        assert_eq!(basis.through_cuts(&[0.0, 1.0, 0.0, 0.0]), [0.0, 1.0, 1.0]);
    }

    #[test]
    fn parts_without_ground_have_roots_of_their_own() {
        let basis = Basis::new(4, &[[0, 1]], [0]);
        assert!(basis.joins(0, 1) && !basis.joins(1, 3));
        assert!(basis.path(0, 3).is_none());
        assert_eq!(basis.potentials(&[2.0], &[0.0, 7.0, 0.0, 0.0])[..2], [9.0, 7.0]);
    }
}
