//! Parts of a network that nodes of fixed potential separate: currents of one are no measure of another.
//!
//! Where sources alone fix the potential of a node, Kirchhoff's current law there determines the current of a source
//! and nothing else.  What a junction across the source carries has no share in the currents of a clamp in parallel,
//! neither as numbers nor as their rounding.

use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// The part of each unknown and of each pair.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// none: a node of fixed potential, or the current of a source that fixes one
    unknowns: Vec<Option<usize>>,
    pairs: Vec<usize>,
    count: usize,
}

impl Parts {
    /// Finds the parts of a system.
    pub fn new(linear: &Linear, smooth: Option<&Smooth>) -> Parts {
        let (n, m, _) = linear.sizes();
        let fixed = fixed(linear, smooth).unwrap_or_else(|| vec![false; n]);
        let functions = smooth.map_or(0, |laws| laws.tape.program().len());
        let mut together = UnionFind::new(n + m + functions);
        let mut join = |a: usize, b: usize| {
            if [a, b].iter().all(|&k| k >= n || !fixed[k]) {
                together.join(a, b);
            }
        };
        let entries = [&linear.e, &linear.g].into_iter().flat_map(Csc::iter);
        entries.for_each(|(row, column, _)| join(row, column));
        linear.a.iter().for_each(|(row, pair, _)| join(row, n + pair));
        linear.b.iter().for_each(|(pair, column, _)| join(n + pair, column));
        linear.d.iter().for_each(|(pair, other, _)| join(n + pair, n + other));
        if let Some(laws) = smooth {
            let entries = [&laws.f, &laws.q].into_iter().flat_map(Csc::iter);
            entries.for_each(|(row, k, _)| join(row, n + m + k));
            for k in 0..functions {
                let unknowns = laws.tape.derivatives(k).map(|e| e.0).filter(|&j| j < n);
                unknowns.for_each(|j| join(n + m + k, j));
            }
        }
        let mut numbers = vec![None; n + m + functions];
        let mut count = 0;
        let mut number = |k: usize| {
            *numbers[together.root(k)].get_or_insert_with(|| {
                count += 1;
                count - 1
            })
        };
        let unknowns = (0..n).map(|j| (!fixed[j]).then(|| number(j))).collect();
        let pairs = (0..m).map(|pair| number(n + pair)).collect();
        Parts { unknowns, pairs, count }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// That of an unknown, or of its law; none if sources fix it, or if it is the current of such a source.
    pub fn of(&self, unknown: usize) -> Option<usize> {
        self.unknowns[unknown]
    }

    /// That of a pair.
    pub fn of_pair(&self, pair: usize) -> usize {
        self.pairs[pair]
    }
}

/// Which unknowns are potentials that sources alone fix, or currents of these sources; nothing where such a current
/// enters another law.
fn fixed(linear: &Linear, smooth: Option<&Smooth>) -> Option<Vec<bool>> {
    let (n, _, _) = linear.sizes();
    let kinds = &linear.row_kind;
    let mut plain: Vec<bool> = kinds.iter().map(|&kind| kind == 1).collect();
    for (row, column, _) in linear.e.iter() {
        (plain[row], plain[column]) = (false, false);
    }
    let mut nodes = vec![Vec::new(); n];
    for (row, column, v) in linear.g.iter().filter(|e| e.2 != 0.0) {
        plain[row] &= kinds[column] == 0 && v != 0.0;
        nodes[row].push(column);
    }
    let laws = smooth.iter().flat_map(|laws| laws.f.iter().chain(laws.q.iter()));
    linear.a.iter().chain(laws).for_each(|(row, ..)| plain[row] = false);
    let mut fixed = vec![false; n];
    while let Some((source, node)) = (0..n).find_map(|row| {
        let mut open = nodes[row].iter().filter(|&&j| !fixed[j]);
        match (plain[row] && !fixed[row], open.next(), open.next()) {
            (true, Some(&node), None) => Some((row, node)),
            _ => None,
        }
    }) {
        (fixed[source], fixed[node]) = (true, true);
    }
    let source = |column: usize| fixed[column] && kinds[column] == 1;
    let elsewhere = linear.g.iter().any(|(row, column, _)| source(column) && !fixed[row])
        || linear.b.iter().any(|(_, column, _)| source(column))
        || smooth.is_some_and(|laws| {
            let all = 0..laws.tape.program().len();
            all.flat_map(|k| laws.tape.derivatives(k)).any(|(j, _)| j < n && source(j))
        });
    (!elsewhere).then_some(fixed)
}
