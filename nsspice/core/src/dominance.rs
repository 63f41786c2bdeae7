//! Passive networks that show it directly: pairs that meet the unknowns as these meet them, and diagonals
//! that outweigh their rows.

use crate::descriptor::Linear;
use crate::rounding::of_entries;
use crate::sparse::Csc;

impl Linear {
    /// Whether `B = A'`, and `D + D'` and what is left of `G + G'` without positive conductances are positive
    /// semidefinite because their diagonals dominate.  Many passive networks are not of this kind: eigenvalues
    /// have to decide then.
    pub fn dominant_beside(&self, rest: &Csc) -> bool {
        transposes(&self.a, &self.b) && dominates(&self.d) && dominates(rest)
    }
}

/// Whether one matrix is the transpose of the other one, entry by entry.
fn transposes(a: &Csc, b: &Csc) -> bool {
    let entry = |row: usize, column: usize| {
        let (rows, values) = b.col(column);
        rows.binary_search(&row).ok().map(|k| values[k])
    };
    a.values.len() == b.values.len() && a.iter().all(|(r, c, v)| entry(c, r) == Some(v))
}

/// Whether the diagonal of the symmetric part dominates.
pub(crate) fn dominates(matrix: &Csc) -> bool {
    let turned = matrix.transpose();
    let mut sums = vec![0.0; matrix.nrows];
    (0..matrix.ncols).all(|c| {
        let halves = [matrix.col(c), turned.col(c)];
        let entries = || halves.iter().flat_map(|(rows, values)| rows.iter().zip(*values));
        entries().for_each(|(&r, v)| sums[r] += v);
        let (mut size, diagonal) = (0.0f64, sums[c]);
        for (&r, _) in entries() {
            size += f64::abs(std::mem::take(&mut sums[r]));
        }
        // `|diagonal|` is in the sum as well
        diagonal + diagonal.abs() >= size * (1.0 - of_entries(entries().count()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(g: &[(usize, usize, f64)], b: f64) -> Linear {
        let one = |v| Csc::from_triplets(1, 2, &[(0, 0, v)]);
        Linear {
            e: Csc::zeros(2, 2),
            g: Csc::from_triplets(2, 2, g),
            a: one(1.0).transpose(),
            b: one(b),
            d: Csc::from_triplets(1, 1, &[(0, 0, 1e-3)]),
            q: vec![0.0],
            s: Csc::zeros(2, 0),
            row_kind: vec![0, 0],
        }
    }

    fn dominant(g: &[(usize, usize, f64)], b: f64) -> bool {
        let network = network(g, b);
        network.dominant_beside(&network.g)
    }

    #[test]
    fn resistors_and_sources_dominate_and_gains_do_not() {
        let bridge = [(0, 0, 0.3), (0, 1, -0.2), (1, 0, -0.2), (1, 1, 0.2)];
        assert!(dominant(&bridge, 1.0));
        assert!(!dominant(&bridge, -1.0));
        // a branch current takes no power, but a gain does
        assert!(dominant(&[(0, 1, 1.0), (1, 0, -1.0)], 1.0));
        assert!(!dominant(&[(0, 1, 1.0), (1, 0, -2.0)], 1.0));
        assert!(!dominant(&[(0, 0, -1.0)], 1.0));
    }
}
