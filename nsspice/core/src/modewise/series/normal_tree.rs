//! Capacitors and inductors whose states follow from others, found from the graph.
//!
//! A capacitor that closes a loop of sources, of what is short against it and of larger capacitors follows those.  An
//! inductor without which some nodes are reached through other inductors alone carries the sum of their currents.  With
//! the loop or the cut-set goes a number `f` that is zero but for sources and for what flows through the shorts (lies
//! across what is open): the state itself and those of the others with factors 1 and -1.

use crate::structure::{Basis, Branch, Elements};
use crate::union_find::UnionFind;

/// A state that follows from others.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependent {
    /// its place among the states: capacitors, then inductors
    pub state: usize,
    /// other states, and the signs with which they are added to it to give `f`
    pub others: Vec<(usize, f64)>,
    /// what sources bring into `f`: number of the source (capacitor), or node at which current enters (inductor)
    pub sources: Vec<(usize, f64)>,
}

fn ends(list: &[Branch]) -> impl Iterator<Item = [usize; 2]> + '_ {
    list.iter().map(|b| b.ends)
}

/// Capacitors that close loops.
pub fn capacitors(elements: &Elements, shorts: &[[usize; 2]]) -> Vec<Dependent> {
    let list = &elements.capacitors;
    let (sources, first) = (elements.voltages.len(), elements.voltages.len() + shorts.len());
    let all: Vec<[usize; 2]> =
        ends(&elements.voltages).chain(shorts.iter().copied()).chain(ends(list)).collect();
    let mut order: Vec<usize> = (0..list.len()).collect();
    order.sort_by(|&i, &j| list[j].value.total_cmp(&list[i].value));
    let order = (0..first).chain(order.into_iter().map(|k| first + k));
    let basis = Basis::new(elements.nodes, &all, order);
    let mut in_tree = vec![false; all.len()];
    basis.tree.iter().for_each(|&edge| in_tree[edge] = true);
    let mut found = Vec::new();
    for (k, c) in list.iter().enumerate().filter(|(k, _)| !in_tree[first + k]) {
        let path = basis.path(c.ends[0], c.ends[1]).unwrap_or_default();
        let mut one = Dependent { state: k, others: Vec::new(), sources: Vec::new() };
        for (place, sign) in path {
            match basis.tree[place] {
                edge if edge < sources => one.sources.push((edge, sign)),
                edge if edge >= first => one.others.push((edge - first, -sign)),
                _ => {}
            }
        }
        found.push(one);
    }
    found
}

/// Inductors that carry what others bring, where the `joining` branches leave their nodes together.
pub fn inductors(
    elements: &Elements,
    joining: impl IntoIterator<Item = [usize; 2]>,
) -> Vec<Dependent> {
    let list = &elements.inductors;
    let mut sets = UnionFind::new(elements.nodes);
    let fixed = ends(&elements.voltages).chain(ends(&elements.capacitors)).chain(joining);
    fixed.for_each(|[a, b]| {
        sets.join(a, b);
    });
    let part: Vec<usize> = (0..elements.nodes).map(|node| sets.root(node)).collect();
    let all: Vec<[usize; 2]> = ends(list).map(|ends| ends.map(|node| part[node])).collect();
    let mut order: Vec<usize> = (0..list.len()).filter(|&k| all[k][0] != all[k][1]).collect();
    if order.is_empty() {
        return Vec::new();
    }
    order.sort_by(|&i, &j| list[i].value.total_cmp(&list[j].value));
    let basis = Basis::new(elements.nodes, &all, order.iter().copied());
    let first = elements.capacitors.len();
    let state = |k: usize| first + k;
    let mut found: Vec<Dependent> = (basis.tree.iter())
        .map(|&k| Dependent { state: state(k), others: Vec::new(), sources: Vec::new() })
        .collect();
    for &k in order.iter().filter(|k| !basis.tree.contains(k)) {
        for (place, sign) in basis.path(all[k][0], all[k][1]).unwrap_or_default() {
            found[place].others.push((state(k), sign));
        }
    }
    let ground = part[elements.nodes - 1];
    for (node, &own) in part.iter().enumerate().take(elements.nodes - 1) {
        for (place, sign) in basis.path(own, ground).unwrap_or_default() {
            found[place].sources.push((node, sign));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn branch(ends: [usize; 2], value: f64) -> Branch {
        Branch { ends, value, index: None }
    }

    #[test]
    fn a_capacitor_across_a_source_follows_it() {
        let elements = Elements {
            nodes: 3,
            voltages: vec![branch([0, 2], 0.0)],
            capacitors: vec![branch([0, 1], 1e-6), branch([1, 2], 1e-9)],
            ..Elements::default()
        };
        // v2 = v - v1
        let expected = Dependent { state: 1, others: vec![(0, 1.0)], sources: vec![(0, 1.0)] };
        assert_eq!(capacitors(&elements, &[]), [expected]);
        assert_eq!(capacitors(&elements, &[[1, 2]]).len(), 2);
    }

    #[test]
    fn three_inductors_at_a_star_are_two_states() {
        let elements = Elements {
            nodes: 4,
            inductors: vec![branch([0, 3], 2e-3), branch([3, 1], 2e-3), branch([2, 0], 1e-3)],
            ..Elements::default()
        };
        // node 3 is ground: the star is joined to nothing else
        let found = inductors(&elements, [[1, 3], [2, 3]]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].state, &found[0].others[..]), (2, &[(0, -1.0)][..]));
        // what enters the star leaves through the inductor against its direction
        assert_eq!(found[0].sources, [(0, -1.0)]);
        assert!(inductors(&elements, [[1, 3], [2, 3], [0, 3]]).is_empty());
    }
}
