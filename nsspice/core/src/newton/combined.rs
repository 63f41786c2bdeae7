//! Laws with multiples of others added to them, which contain less then.
//!
//! Two kinds: perfectly coupled windings, in which no flux is left (`windings.rs`), and Kirchhoff's current law where
//! voltages along a tree are the unknowns.  There a law sums all that passes a cut-set; where it gives the current
//! of a source or an inductor, the cut-sets of sources and inductors behind it are taken out, and their currents
//! replace everything that passes through those: `i(V) + i(L) = 0`, without the charges of junctions behind both,
//! whose rounding in a short step is amperes.

use crate::perfect_coupling::{laws_without_storage, Multiples};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;
use crate::structure::Coordinates;

/// All such laws of a system.
#[derive(Clone, Debug, Default)]
pub(super) struct Combined {
    laws: Vec<Multiples>,
    /// of each law those to which it is added, with its factor, and whether others are added to it
    with: Vec<Vec<(usize, f64)>>,
    changed: Vec<bool>,
    /// laws that do nothing but give the current of a source, and those of the cut-sets behind them, which come
    /// first
    sources: Vec<(usize, usize)>,
}

impl Combined {
    /// Finds them; functions appear in some laws of windings.
    pub fn new(
        [e, g]: [&Csc; 2],
        row_kind: &[u8],
        functional: &[bool],
        tree: Option<&Coordinates>,
    ) -> Combined {
        let mut laws = laws_without_storage(e, row_kind);
        laws.retain(|law| !functional[law.row]);
        let mut sources = Vec::new();
        if let Some(tree) = tree {
            let branch = branches(g, row_kind);
            let own: Vec<bool> = branch.iter().map(Option::is_some).collect();
            let mut stores = vec![false; e.nrows];
            e.iter().for_each(|(_, c, _)| stores[c] = true);
            let alone = |row: usize| branch[row].is_some_and(|current| !stores[current]);
            for &other in tree.order().iter().rev() {
                let before = usize::try_from(tree.before(other)).ok();
                sources.extend(before.filter(|&row| alone(row)).map(|row| (row, other)));
            }
            let mut behind = vec![Vec::new(); g.nrows];
            for (other, &own) in own.iter().enumerate() {
                if let Ok(row) = usize::try_from(tree.before(other)) {
                    behind[row].extend(own.then_some((other, -1.0)));
                }
            }
            let rows = behind
                .into_iter()
                .enumerate()
                .filter(|(row, others)| own[*row] && !others.is_empty());
            laws.extend(rows.map(|(row, others)| Multiples { row, others }));
        }
        let (mut with, mut changed) = (vec![Vec::new(); g.nrows], vec![false; g.nrows]);
        for law in &laws {
            changed[law.row] = true;
            law.others.iter().for_each(|&(other, factor)| with[other].push((law.row, factor)));
        }
        Combined { laws, with, changed, sources }
    }

    /// Adds the sizes of the terms at a node of a source that are no terms of its cut-set: its current is known
    /// relative to what flows there.
    pub fn add_sizes(&self, terms: &mut [f64]) {
        self.sources.iter().for_each(|&(row, other)| terms[row] += terms[other]);
    }

    /// The laws to which one is added, with its factor.
    pub fn with(&self, other: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.with[other].iter().copied()
    }

    /// Whether others are added to a law.
    pub fn changes(&self, row: usize) -> bool {
        self.changed[row]
    }

    /// A matrix with what is added; what cancels leaves nothing.
    pub fn matrix(&self, matrix: &Csc) -> Vec<(usize, usize, f64)> {
        if self.laws.is_empty() {
            return matrix.iter().collect();
        }
        let added =
            |(r, c, v): (usize, usize, f64)| self.with(r).map(move |(row, f)| (row, c, f * v));
        let terms: Vec<_> = matrix.iter().chain(matrix.iter().flat_map(added)).collect();
        let sizes: Vec<_> = terms.iter().map(|&(r, c, v)| (r, c, v.abs())).collect();
        let [sums, sizes] =
            [terms, sizes].map(|all| Csc::from_triplets(matrix.nrows, matrix.ncols, &all));
        let left = sums.iter().zip(sizes.iter());
        let left = left.filter(|(sum, size)| sum.2 == size.2 || sum.2.abs() > OF_SOLUTION * size.2);
        left.map(|(sum, _)| sum).collect()
    }

    /// Turns a right-hand side into one of these laws, instead of those that it was for.
    pub fn combine(&self, rhs: &mut [f64], sums: &mut [f64]) {
        // all from the laws themselves
        for (sum, law) in sums.iter_mut().zip(&self.laws) {
            *sum = law.added(rhs);
        }
        sums.iter().zip(&self.laws).for_each(|(sum, law)| rhs[law.row] += sum);
    }
}

/// Of each law the current of the branch that it gives: it passes no other cut-set.
fn branches(g: &Csc, row_kind: &[u8]) -> Vec<Option<usize>> {
    let mut own = vec![None; g.nrows];
    for column in (0..g.ncols).filter(|&c| row_kind[c] != 0) {
        let (rows, values) = g.col(column);
        let mut laws = rows.iter().zip(values).filter(|e| row_kind[*e.0] == 0 && *e.1 != 0.0);
        if let (Some((&row, &v)), None) = (laws.next(), laws.next()) {
            if v.abs() == 1.0 {
                own[row] = Some(column);
            }
        }
    }
    own
}
