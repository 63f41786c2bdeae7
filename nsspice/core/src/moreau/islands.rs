//! Parts of a linear network that little ties to the rest: their potential.
//!
//! An isolated secondary that 1 TOhm ties to ground has 1e-12 S beside the hundreds of siemens inside it,
//! whose rounding drives what the tie carries.  The sum of the laws of all its nodes holds what enters from
//! outside alone, and moving all of them by one voltage changes nothing but the ties: so that sum, taken
//! after each solve, tells by how much the part has to move.

use super::sums::{dot, total, Row};
use crate::descriptor::Linear;
use crate::floating::Floating;

/// One part.
struct Island {
    nodes: Vec<usize>,
    /// what is left of the sum of its laws: of conductances and source currents, of sources
    g: Row,
    s: Row,
    /// the conductance of its ties [S]
    tie: f64,
}

/// All such parts of a network.
pub struct Islands(Vec<Island>);

impl Islands {
    /// Finds those that no capacitor and no pair ties to the rest.
    pub fn new(linear: &Linear) -> Islands {
        let floating = Floating::new(&linear.e, &linear.g, &linear.row_kind);
        let islands = floating.groups().iter().filter_map(|nodes| {
            let g = total(&linear.g, nodes);
            let mut inside = vec![false; linear.g.nrows];
            nodes.iter().for_each(|&node| inside[node] = true);
            let tie: f64 = g.iter().filter(|entry| inside[entry.0]).map(|entry| entry.1).sum();
            let alone = total(&linear.e, nodes).is_empty() && total(&linear.a, nodes).is_empty();
            let s = total(&linear.s, nodes);
            (alone && tie > 0.0).then(|| Island { nodes: nodes.clone(), g, s, tie })
        });
        Islands(islands.collect())
    }

    /// Whether there are any.
    pub fn any(&self) -> bool {
        !self.0.is_empty()
    }

    /// Moves each part to where the sum of its laws holds: unknowns `z`, sources `u`.
    pub fn move_by_ties(&self, z: &mut [f64], u: &[f64]) {
        for island in &self.0 {
            let shift = (dot(&island.s, u) - dot(&island.g, z)) / island.tie;
            island.nodes.iter().for_each(|&node| z[node] += shift);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Islands;
    use crate::descriptor::Linear;
    use crate::sparse::Csc;

    /// 100 S between two nodes, 1e-12 S from one of them to a third, which is at 2 V.
    #[test]
    fn a_part_moves_to_where_its_tie_carries_nothing() {
        let tie = 1e-12;
        let g = [(0, 0, 100.0), (0, 1, -100.0), (1, 0, -100.0), (1, 1, 100.0 + tie), (1, 2, -tie)];
        let g: Vec<_> = g.into_iter().chain([(2, 1, -tie), (2, 2, 1.0 + tie)]).collect();
        let none = |rows, columns| Csc::from_triplets(rows, columns, &[]);
        let linear = Linear {
            e: none(3, 3),
            g: Csc::from_triplets(3, 3, &g),
            a: none(3, 0),
            b: none(0, 3),
            d: none(0, 0),
            s: none(3, 1),
            q: vec![],
            row_kind: vec![0; 3],
        };
        let mut z = [30.0, 31.0, 2.0];
        Islands::new(&linear).move_by_ties(&mut z, &[0.0]);
        // the tie is known to the rounding of 100 S
        assert!((z[1] - 2.0).abs() < 29.0 * f64::EPSILON * 100.0 / tie);
        assert!((z[1] - z[0] - 1.0).abs() < 1e-12);
        assert_eq!(z[2], 2.0);
    }
}
