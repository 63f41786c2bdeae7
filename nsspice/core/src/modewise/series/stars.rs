//! Networks of conductances, solved for the potentials of their nodes without a subtraction.
//!
//! A node that others are joined to by `g_1, g_2, ...` is replaced by `g_i g_j / sum g` between each two of them, and
//! its current by shares of it (star and mesh).  That is Gaussian elimination, but no diagonal is formed as a difference:
//! every conductance keeps its digits however far apart they are (W. K. Grassmann, M. I. Taksar, D. P. Heyman,
//! Operations Research 33 (1985) 1107), and no pivots have to be chosen.

use std::collections::BTreeSet;

/// One node on its way out.
struct Step {
    node: usize,
    /// its arms: those of all steps are in one list
    arms: std::ops::Range<usize>,
    /// pairs of its arms
    meshes: std::ops::Range<usize>,
}

/// The order in which nodes are eliminated, and the conductances as they were when each was.
pub struct Stars {
    steps: Vec<Step>,
    /// node at the far end, place of the conductance
    arms: Vec<(usize, usize)>,
    /// places of two arms, and of what comes between their ends
    meshes: Vec<[usize; 3]>,
    /// ends of the arms, by their steps
    ends: Vec<usize>,
    /// where each edge is added
    of_edge: Vec<usize>,
    /// nodes that stand for a part that nothing joins to ground
    pub free: Vec<usize>,
    conductances: Vec<f64>,
    shares: Vec<f64>,
    resistances: Vec<f64>,
}

impl Stars {
    /// Of `nodes` nodes, and ground after them; edges with both ends at one node count for nothing.
    pub fn new(nodes: usize, edges: &[[usize; 2]]) -> Stars {
        let mut near = vec![BTreeSet::new(); nodes + 1];
        for &[a, b] in edges.iter().filter(|[a, b]| a != b) {
            near[a].insert(b);
            near[b].insert(a);
        }
        // what joins nodes to ground, then what joins them to each other
        let mut places = std::collections::HashMap::new();
        let mut place = |a: usize, b: usize| match a.max(b) == nodes {
            true => a.min(b),
            false => {
                let next = nodes + places.len();
                *places.entry([a.min(b), a.max(b)]).or_insert(next)
            }
        };
        let nowhere = usize::MAX;
        let of = |&[a, b]: &[usize; 2]| if a == b { nowhere } else { place(a, b) };
        let of_edge = edges.iter().map(of).collect();
        let (mut steps, mut arms, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
        let mut free = Vec::new();
        // of those with as many arms first what waits for fewer others: a processor takes independent steps together
        let mut after = vec![0usize; nodes + 1];
        let mut left: BTreeSet<(usize, usize, usize)> =
            (0..nodes).map(|node| (near[node].len(), 0, node)).collect();
        while let Some((_, rank, node)) = left.pop_first() {
            let ends: Vec<usize> = std::mem::take(&mut near[node]).into_iter().collect();
            if ends.is_empty() {
                free.push(node);
            }
            let first = (arms.len(), meshes.len());
            arms.extend(
                ends.iter().filter(|&&end| end < nodes).map(|&end| (end, place(node, end))),
            );
            for (k, &a) in ends.iter().enumerate() {
                for &b in &ends[k + 1..] {
                    meshes.push([place(node, a), place(node, b), place(a, b)]);
                }
            }
            for &a in &ends {
                let before = (near[a].len(), after[a], a);
                near[a].remove(&node);
                near[a].extend(ends.iter().filter(|&&b| b != a));
                after[a] = after[a].max(rank + 1);
                if left.remove(&before) {
                    left.insert((near[a].len(), after[a], a));
                }
            }
            let (arms, meshes) = (first.0..arms.len(), first.1..meshes.len());
            steps.push(Step { node, arms, meshes });
        }
        let count = nodes + places.len();
        Stars {
            conductances: vec![0.0; count],
            shares: vec![0.0; arms.len()],
            ends: arms.iter().map(|arm| arm.0).collect(),
            resistances: vec![0.0; nodes],
            steps,
            arms,
            meshes,
            of_edge,
            free,
        }
    }

    /// Operations of an elimination.
    pub fn work(&self) -> usize {
        self.meshes.len() + 2 * self.arms.len() + self.of_edge.len()
    }

    /// Eliminates all nodes with these conductances of the edges; false where a node is left that nothing joins to
    /// ground and that is not free.
    pub fn set(&mut self, edges: &[f64]) -> bool {
        self.conductances.fill(0.0);
        for (&place, g) in self.of_edge.iter().zip(edges) {
            if let Some(sum) = self.conductances.get_mut(place) {
                *sum += g;
            }
        }
        let mut regular = true;
        for step in &self.steps {
            let arms = &self.arms[step.arms.clone()];
            let all = arms.iter().fold(self.conductances[step.node], |sum, &(_, place)| {
                sum + self.conductances[place]
            });
            let inverse = if all > 0.0 { 1.0 / all } else { 0.0 };
            regular &= inverse.is_finite() && (all > 0.0 || self.free.contains(&step.node));
            self.resistances[step.node] = inverse;
            for (share, &(_, place)) in self.shares[step.arms.clone()].iter_mut().zip(arms) {
                *share = self.conductances[place] * inverse;
            }
            for &[one, two, between] in &self.meshes[step.meshes.clone()] {
                self.conductances[between] +=
                    self.conductances[one] * (self.conductances[two] * inverse);
            }
        }
        regular
    }

    /// Potentials from the currents that enter the nodes, free ones at zero.
    pub fn solve(&self, nodes: &mut [f64]) {
        let mut at = 0;
        for step in &self.steps {
            let current = nodes[step.node];
            let (ends, shares) = (&self.ends[at..step.arms.end], &self.shares[at..step.arms.end]);
            for (&end, share) in ends.iter().zip(shares) {
                nodes[end] += share * current;
            }
            nodes[step.node] = current * self.resistances[step.node];
            at = step.arms.end;
        }
        for step in self.steps.iter().rev() {
            let (first, last) = (step.arms.start, step.arms.end);
            let mut sum = nodes[step.node];
            for (&end, share) in self.ends[first..last].iter().zip(&self.shares[first..last]) {
                sum += share * nodes[end];
            }
            nodes[step.node] = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rounding::UNIT;

    #[test]
    fn a_bridge_keeps_all_digits_between_large_and_small_conductances() {
        // nodes 0, 1, 2 and ground 3: 1 kS between 0, 1 and 2, 1 nS from 2 to ground
        let edges = [[0, 1], [1, 2], [0, 2], [2, 3], [1, 1]];
        let mut stars = Stars::new(3, &edges);
        assert!(stars.set(&[1e3, 1e3, 1e3, 1e-9, 5.0]) && stars.free.is_empty());
        // 1 nA into node 0 leaves by way of 2: 1 V there, and 2/3 pV more at 0
        let mut v = [1e-9, 0.0, 0.0];
        stars.solve(&mut v);
        let error = [v[0] - 1.0 - 2e-12 / 3.0, v[1] - 1.0 - 1e-12 / 3.0, v[2] - 1.0];
        assert!(error.iter().all(|e| e.abs() <= 4.0 * UNIT), "{v:?}");
    }

    #[test]
    fn parts_without_ground_have_one_node_at_zero() {
        let mut stars = Stars::new(4, &[[0, 1], [1, 2], [3, 4]]);
        assert!(stars.set(&[1.0, 2.0, 4.0]) && stars.free.len() == 1);
        let mut v = [1.0, 0.0, -1.0, 2.0];
        stars.solve(&mut v);
        assert_eq!([v[0] - v[1], v[1] - v[2], v[3]], [1.0, 0.5, 0.5]);
        // an edge that is open may leave nothing
        assert!(!stars.set(&[1.0, 2.0, 0.0]));
    }
}
