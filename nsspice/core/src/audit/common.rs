//! Parts of a network whose common potential a small conductance decides: it is a sum of currents over that
//! conductance, and has the rounding of each.

use crate::descriptor::Linear;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// Nodes that move together, and what conducts between them and the rest.
#[derive(Clone, Debug, PartialEq)]
struct Group {
    nodes: Vec<usize>,
    conductance: f64,
}

/// The parts of a network.
#[derive(Clone, Debug, Default)]
pub struct Common {
    groups: Vec<Group>,
    /// of each node; none if a source, a store or a pair leads from its part to ground
    of: Vec<Option<usize>>,
}

impl Common {
    /// Finds the parts that branches, pairs and stores join.
    pub fn new(linear: &Linear) -> Common {
        let (n, m, _) = linear.sizes();
        let node = |j: usize| linear.row_kind[j] == 0;
        let mut together = UnionFind::new(n);
        let mut grounded = vec![false; n];
        // nodes of a branch, a pair or a store: what does not cancel over them leads to ground
        let mut join = |members: &[(usize, f64)]| {
            for pair in members.windows(2) {
                together.join(pair[0].0, pair[1].0);
            }
            if members.iter().map(|e| e.1).sum::<f64>() != 0.0 {
                members.iter().for_each(|e| grounded[e.0] = true);
            }
        };
        let of_column = |matrix: &Csc, c: usize| -> Vec<(usize, f64)> {
            let (rows, values) = matrix.col(c);
            let all = rows.iter().copied().zip(values.iter().copied());
            all.filter(|e| node(e.0) && e.1 != 0.0).collect()
        };
        let laws = linear.g.transpose();
        for j in 0..n {
            if node(j) {
                join(&of_column(&linear.e, j));
            } else {
                join(&of_column(&linear.g, j));
                join(&of_column(&laws, j));
            }
        }
        (0..m).for_each(|pair| join(&of_column(&linear.a, pair)));
        let mut groups: Vec<Group> = Vec::new();
        let mut place = vec![None; n];
        let mut of = vec![None; n];
        for j in (0..n).filter(|&j| node(j)) {
            let root = together.root(j);
            let k = *place[root].get_or_insert_with(|| {
                groups.push(Group { nodes: Vec::new(), conductance: 0.0 });
                groups.len() - 1
            });
            groups[k].nodes.push(j);
            of[j] = Some(k);
        }
        let mut sizes = vec![0.0; groups.len()];
        for (row, column, v) in linear.g.iter().filter(|e| node(e.0) && node(e.1)) {
            if let (Some(k), true) = (of[row], of[row] == of[column]) {
                groups[k].conductance += v;
                sizes[k] += v.abs();
            }
        }
        let firm: Vec<bool> = groups
            .iter()
            .zip(&sizes)
            .map(|(group, size)| {
                // what is left of conductances inside by rounding is none to the rest
                let rounding = group.nodes.len() as f64 * f64::EPSILON * size;
                group.conductance <= rounding || group.nodes.iter().any(|&j| grounded[j])
            })
            .collect();
        of.iter_mut().for_each(|k| *k = k.filter(|&k| !firm[k]));
        Common { groups, of }
    }

    /// By how much the common potential of some nodes moves with rounding of `currents` (by row); zero unless
    /// they are all of one part that has one.
    pub fn moves(
        &self,
        nodes: impl Iterator<Item = usize>,
        currents: impl Fn(usize) -> f64,
    ) -> f64 {
        let mut parts = nodes.map(|j| self.of[j]);
        let Some(Some(k)) = parts.next() else { return 0.0 };
        if !parts.all(|other| other == Some(k)) {
            return 0.0;
        }
        let Group { nodes, conductance } = &self.groups[k];
        nodes.iter().map(|&row| currents(row)).sum::<f64>() / conductance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source between nodes 0 and 1, whose current is unknown 3, and 1 uS from node 1 to ground; node 2 is on
    /// 1 S alone, and `tied` to node 0 by a source to ground or not.
    fn moved(tied: bool) -> [f64; 2] {
        let mut g =
            vec![(0, 3, 1.0), (1, 3, -1.0), (3, 0, -1.0), (3, 1, 1.0), (1, 1, 1e-6), (2, 2, 1.0)];
        if tied {
            g.extend([(0, 4, 1.0), (4, 0, 1.0)]);
        }
        let size = if tied { 5 } else { 4 };
        let none = |rows, cols| Csc::from_triplets(rows, cols, &[]);
        let linear = Linear {
            e: none(size, size),
            g: Csc::from_triplets(size, size, &g),
            a: none(size, 0),
            b: none(0, size),
            d: none(0, 0),
            q: Vec::new(),
            s: none(size, 0),
            row_kind: (0..size).map(|j| u8::from(j > 2)).collect(),
        };
        let common = Common::new(&linear);
        let of = |nodes: [usize; 2]| common.moves(nodes.into_iter(), |_| 1e-15);
        [of([0, 1]), of([0, 2])]
    }

    #[test]
    fn a_star_point_moves_with_the_rounding_of_currents() {
        let [same, apart] = moved(false);
        assert!((same - 2e-9).abs() < 1e-20 && apart == 0.0, "{same} {apart}");
        assert_eq!(moved(true), [0.0; 2]);
    }
}
